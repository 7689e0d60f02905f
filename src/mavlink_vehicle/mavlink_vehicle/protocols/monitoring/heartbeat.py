"""HEARTBEAT in both directions: sends ours at 1 Hz and monitors the autopilot's.

https://mavlink.io/en/services/heartbeat.html. An ArduPilot with FS_GCS_ENABLE, and a PX4 with
COM_DL_LOSS_T, take the end of our HEARTBEATs as the loss of the ground station: setpoints
don't count as contact.

Theirs comes once a second. Where two of five packets are lost, three in a row are lost every
quarter of a minute; so while anything else of the autopilot comes, the watch is patient.
"""

from __future__ import annotations

import enum
from typing import ClassVar

from mavlink_vehicle.codec import Message, make, mavlink
from mavlink_vehicle.events import HeartbeatLost, HeartbeatRegained, VehicleEvent
from mavlink_vehicle.protocols.machine import Machine, Table
from mavlink_vehicle.protocols.service import Conversation, SendingRank, VehicleService

PATIENCE = 3.0
"""How many times longer HEARTBEAT may be missing while other messages of the autopilot come."""


class HeartbeatSender(VehicleService):
    """Sends our HEARTBEAT at a fixed rate, the first one at once."""

    rank = SendingRank.HEARTBEAT

    def __init__(self, interval_s: float, mav_type: int | None = None) -> None:
        """Send as `mav_type` (such as MAV_TYPE_ONBOARD_CONTROLLER) every `interval_s`.

        None takes what the vehicle's profile says. Until it is known who is there, that is a
        station: a PX4 that has seen an onboard computer would say that it is lost.
        """
        super().__init__()
        self._interval_s = interval_s
        self._takes_type = mav_type is None
        self.mav_type = mavlink.MAV_TYPE_GCS if mav_type is None else mav_type

    def start(self, now: float) -> None:
        """Send the first one."""
        self.deadline_s = now
        self.handle_timer(now)

    def vehicle_came(self, conversation: Conversation, now: float) -> None:
        """Send as what this kind of vehicle expects."""
        if self._takes_type:
            self.mav_type = conversation.profile.messages.heartbeat_type

    def _on_deadline(self, now: float) -> None:
        """Send one if it is due; after a pause only one, not all that were missed."""
        due_s = now if self.deadline_s is None else self.deadline_s
        self.deadline_s = max(due_s + self._interval_s, now + self._interval_s / 2)
        self.outbox.append(
            make(
                "HEARTBEAT",
                type=self.mav_type,
                autopilot=mavlink.MAV_AUTOPILOT_INVALID,
                system_status=mavlink.MAV_STATE_ACTIVE,
                mavlink_version=3,
            )
        )


class WatchState(enum.Enum):
    """The state of the watch."""

    UNSEEN = "never heard"
    ALIVE = "heard in time"
    LOST = "silent for too long"


class WatchInput(enum.Enum):
    """An input of the watch."""

    BEAT = "a HEARTBEAT of the autopilot"
    SILENCE = "timed out"


class HeartbeatWatch(Machine[VehicleEvent], VehicleService):
    """Watches the autopilot's HEARTBEAT; the caller passes in only those.

    Attributes:
        alive: whether the last one is recent enough.
        heard_s: when the autopilot was last heard; the caller sets it at any message.
    """

    def __init__(self, timeout_s: float) -> None:
        """Call it lost after `timeout_s` of silence, or `PATIENCE` times that without one."""
        super().__init__(WatchState.UNSEEN)
        self.alive = False
        self._timeout_s = timeout_s
        self._last_s = 0.0
        self.heard_s = 0.0
        self._boot_count = 0
        self._boot_count_at_loss = 0

    def receive(self, message: Message, now: float) -> None:
        """Process a HEARTBEAT of the autopilot."""
        self._fire(WatchInput.BEAT, now)

    def excuse(self, gap_s: float) -> None:
        """Do not count a time in which we did not run: nobody listened.

        Messages of that time are still in a buffer, or were not sent, as the whole machine hung.
        """
        self._last_s += gap_s
        self.heard_s += gap_s
        if self.deadline_s is not None:
            self.deadline_s += gap_s

    def observe_boots(self, boot_count: int) -> None:
        """Set how often the vehicle has restarted by now."""
        self._boot_count = boot_count

    def _on_deadline(self, now: float) -> None:
        """Report the loss when it times out."""
        longest_s = self._last_s + PATIENCE * self._timeout_s
        self.deadline_s = min(self.heard_s + self._timeout_s, longest_s)
        if now >= self.deadline_s:
            self._fire(WatchInput.SILENCE, now)

    def _beat(self, now: float) -> None:
        self.alive = True
        self._last_s = now
        self.deadline_s = now + self._timeout_s

    def _lose(self, now: float) -> None:
        self.alive, self.deadline_s = False, None
        self._boot_count_at_loss = self._boot_count
        self.events.append(HeartbeatLost(now - self._last_s))

    def _regain(self, now: float) -> None:
        self._beat(now)
        self.events.append(HeartbeatRegained(self._boot_count != self._boot_count_at_loss))

    table: ClassVar[Table] = {
        (WatchState.UNSEEN, WatchInput.BEAT): (WatchState.ALIVE, _beat),
        (WatchState.ALIVE, WatchInput.BEAT): (WatchState.ALIVE, _beat),
        (WatchState.ALIVE, WatchInput.SILENCE): (WatchState.LOST, _lose),
        (WatchState.LOST, WatchInput.BEAT): (WatchState.ALIVE, _regain),
    }
