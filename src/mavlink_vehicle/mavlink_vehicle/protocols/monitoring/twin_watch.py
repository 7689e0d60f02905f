"""Notices a second autopilot with the ids of the vehicle: the telemetry of both is mixed.

Each system on a network has an id of its own (https://mavlink.io/en/guide/routing.html). Two that
share one get each other's commands, and what is reported is of the one or of the other. Two signs
show it:

- HEARTBEATs of two kinds of vehicle in turn. Those of the other kind are not taken for the
  vehicle's. A vehicle that restarts as another kind does not send the old kind again;
- the same message by two clocks in turn, both of which run on (`state.restarts`). One vehicle may
  have a clock of its own for one kind of message, but not two for one kind.

Two of one kind that were switched on within seconds of each other show neither.
"""

from __future__ import annotations

import math

from mavlink_vehicle.codec import Message, mavlink
from mavlink_vehicle.events import TwinHeard
from mavlink_vehicle.protocols.service import VehicleService
from mavlink_vehicle.state.identity import sender_name
from mavlink_vehicle.state.vehicle_state import VehicleState

_HEARTBEAT = mavlink.MAVLink_heartbeat_message
# HEARTBEAT comes once a second; two may be lost.
_IN_TURN_S = 3.5
_SILENT_S = 10.0
_IN_TURN_LEAST = 4


class TwinWatch(VehicleService):
    """Watches who sends with the vehicle's ids.

    Attributes:
        reason: a sentence about the two; empty while one is known.
        deadline_s: when the other one counts as gone; None without one.
    """

    handles = (_HEARTBEAT,)

    def __init__(self) -> None:
        """Begin with one."""
        super().__init__()
        self.reason = ""
        self._other_s = -math.inf
        self._other = ""
        self._in_turn = 0

    def hear_other(self, message: mavlink.MAVLink_heartbeat_message, now: float) -> None:
        """Process a HEARTBEAT with the vehicle's ids that is of another kind of vehicle."""
        self._other_s = now
        self._other = sender_name(message.autopilot, message.type)

    def receive(self, message: Message, now: float) -> None:
        """Process a HEARTBEAT of the vehicle's own kind."""
        if isinstance(message, _HEARTBEAT) and now - self._other_s <= _IN_TURN_S:
            own = sender_name(message.autopilot, message.type)
            self._notice(f"{own}, and {self._other}", now)

    def vehicle_gone(self, reason: str, now: float) -> None:
        """Forget the other kind: it may be the vehicle's from now on."""
        self._other_s = -math.inf

    def state_changed(self, before: VehicleState, state: VehicleState, now: float) -> None:
        """Look at how often one message came by two clocks in turn."""
        in_turn = state.restart_signs.in_turn
        if in_turn > self._in_turn and in_turn >= _IN_TURN_LEAST:
            self._notice("their times since boot differ", now)
        self._in_turn = in_turn

    def _notice(self, reason: str, now: float) -> None:
        """Report the two, if they are not known yet, by the sign that shows them."""
        self.deadline_s = now + _SILENT_S
        if not self.reason:
            self.reason = (
                f"Two autopilots with one MAVLink system id are heard ({reason}), and each gets "
                "the other's commands; give each an id of its own."
            )
            self.events.append(TwinHeard(self.reason))

    def _on_deadline(self, now: float) -> None:
        """Forget the other one, which is no longer heard."""
        self.reason, self.deadline_s = "", None
