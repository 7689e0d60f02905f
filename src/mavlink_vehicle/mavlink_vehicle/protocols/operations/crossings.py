"""Notices that a mode request of ours has overtaken a mode that somebody else chose.

A pilot's switch and our command cross on the link. The vehicle takes the pilot's mode, then our
command that was on its way, and is in our mode although the pilot chose last: a PX4 in OFFBOARD
without a stream, which runs into its failsafe (seen, 4 ms between the two). So:

- A command may take effect until it is acknowledged, or until the grace period is over. A PX4
  acknowledges DO_SET_MODE twice, and executes it before the second one.
- Another mode that shows, or that a ground station asks for, while a command of ours may take
  effect is a choice that may be overtaken. A HEARTBEAT is requested then: a PX4 sends none because
  of a mode change, and the next one may be a second away.
- If the mode of our command shows after that, the choice was overtaken.
"""

from __future__ import annotations

from dataclasses import dataclass

from mavlink_vehicle.codec import Message, mavlink
from mavlink_vehicle.protocols.operations.command import (
    ACCEPTED,
    IN_PROGRESS,
    Address,
    CommandRequest,
    ack_result,
)
from mavlink_vehicle.protocols.outbox import Outbox

SHOWN_S = 0.5
"""A mode shows within this time of its acknowledgement, as HEARTBEAT is requested every 0.3 s."""

_ASK_EVERY_S = 0.3
_HEARTBEAT = CommandRequest(mavlink.MAV_CMD_REQUEST_MESSAGE, (mavlink.MAVLINK_MSG_ID_HEARTBEAT,))


@dataclass
class _Sent:
    """A command that may still take effect.

    Attributes:
        command: its number.
        mode: the custom_mode that it asks for.
        until_s: until when it may.
        acks_left: how many acknowledgements are to come.
    """

    command: int
    mode: int
    until_s: float
    acks_left: int


class Crossings(Outbox):
    """The mode requests on their way, and the choice that they may overtake."""

    def __init__(self, grace_s: float) -> None:
        """A command without an acknowledgement may take effect for `grace_s`."""
        super().__init__()
        self._grace_s = grace_s
        self._sent: list[_Sent] = []
        self._address: Address | None = None
        self._chosen: int | None = None
        self._ask_s = 0.0

    @property
    def is_open(self) -> bool:
        """Whether a mode request of ours may still overtake another's choice."""
        return self._chosen is not None

    def forget(self) -> None:
        """Begin again: the vehicle restarted."""
        self._sent.clear()
        self._chosen = None

    def settle(self) -> None:
        """Drop earlier choices of a mode: the server now requests another mode on purpose."""
        self._chosen = None

    def sent(self, command: int, mode: int, acks: int, address: Address, now: float) -> None:
        """A command went out that asks for a mode; `acks` acknowledgements will come."""
        self._address = address
        self._sent.append(_Sent(command, mode, now + self._grace_s, acks))

    def receive(self, message: Message, now: float) -> None:
        """Look for the acknowledgements of what was sent."""
        if self._address is None:
            return
        for sent in self._sent:
            result = ack_result(message, sent.command, self._address)
            if result is None or result == IN_PROGRESS or sent.acks_left == 0:
                continue
            sent.acks_left = 0 if result != ACCEPTED else sent.acks_left - 1
            if sent.acks_left == 0:
                sent.until_s = min(sent.until_s, now + SHOWN_S)
            return

    def mode_changed(self, mode: int, requested: bool, now: float) -> int | None:
        """Record the mode that shows; return the mode that was overtaken by it, or None."""
        self._expire(now)
        own = [sent for sent in self._sent if sent.mode == mode]
        if self._chosen is not None and own:
            chosen, self._chosen = self._chosen, None
            self._sent.remove(own[0])
            return None if chosen == mode else chosen
        if requested and own:
            self._sent.remove(own[0])
        if not requested:
            self.chosen(mode, now)
        return None

    def chosen(self, mode: int, now: float) -> None:
        """Somebody else has chosen a mode."""
        self._expire(now)
        if any(sent.mode != mode for sent in self._sent):
            self._chosen, self._ask_s = mode, now

    def next_deadline(self) -> float | None:
        """Return when `handle_timer` wants to be called."""
        if self._chosen is None:
            return None
        return min(self._ask_s, max(sent.until_s for sent in self._sent))

    def handle_timer(self, now: float) -> None:
        """Ask for the mode while it is not clear."""
        self._expire(now)
        if self._chosen is not None and self._address is not None and now >= self._ask_s:
            self._ask_s = now + _ASK_EVERY_S
            self._outbox.append(_HEARTBEAT.message(self._address, 0))

    def _expire(self, now: float) -> None:
        self._sent = [sent for sent in self._sent if now < sent.until_s]
        if not self._sent:
            self._chosen = None
