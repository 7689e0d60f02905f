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

import math
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

SETTLE_S = 1.5
"""A mode that was asked for shows within this time, if at all."""
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


@dataclass
class _Request:
    """The operation in progress, if it asks for a mode.

    Attributes:
        command: the number of its command.
        mode: the custom_mode that it asks for.
        acks: how many acknowledgements each command gets.
        address: who talks to whom.
        restores: whether it asks again for the mode that somebody else chose.
        counted: how many of its commands have been recorded.
    """

    command: int
    mode: int
    acks: int
    address: Address
    restores: bool
    counted: int = 0


class Crossings(Outbox):
    """The mode requests on their way, and the choice that they may overtake."""

    def __init__(self, grace_s: float) -> None:
        """A command without an acknowledgement may take effect for `grace_s`."""
        super().__init__()
        self._grace_s = grace_s
        self._sent: list[_Sent] = []
        self._request: _Request | None = None
        self._foreign: tuple[int, float] | None = None
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

    def begin(
        self, command: int, mode: int, acks: int, address: Address, *, restores: bool
    ) -> None:
        """Begin an operation that asks for a mode on purpose: earlier choices are dropped.

        Args:
            command: the number of its command.
            mode: the custom_mode that it asks for.
            acks: how many acknowledgements each command gets.
            address: who talks to whom.
            restores: whether it asks again for the mode that somebody else chose; such a command
                overtakes nothing.
        """
        self._chosen = None
        self._request = _Request(command, mode, acks, address, restores)

    def end(self) -> None:
        """The operation has ended; its commands may still take effect."""
        self._request = None

    def attempted(self, attempts: int, now: float) -> None:
        """Record how often the command of the operation has been sent in all."""
        request = self._request
        if request is None or request.restores:
            return
        for _ in range(attempts - request.counted):
            until_s = now + self._grace_s
            self._sent.append(_Sent(request.command, request.mode, until_s, request.acks))
            self._address = request.address
        request.counted = attempts

    def mode_asked(self, mode: int, now: float) -> None:
        """Somebody else has asked the vehicle for a mode; it need not obey."""
        self.chosen(mode, now)
        self._foreign = (mode, now + SETTLE_S)

    @property
    def silent_until_s(self) -> float:
        """Until when the operation must wait for a mode that somebody else has asked for."""
        foreign, request = self._foreign, self._request
        if foreign is None or request is None or request.restores or request.mode == foreign[0]:
            return -math.inf
        return foreign[1]

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
        self._foreign = None
        overtaken = self._overtaken(mode, requested, now)
        if requested and self._request is not None and self._request.restores:
            self.chosen(mode, now)
        return overtaken

    def _overtaken(self, mode: int, requested: bool, now: float) -> int | None:
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

    @property
    def deadline_s(self) -> float | None:
        """When `handle_timer` wants to be called."""
        if self._chosen is None:
            return None
        return min(self._ask_s, max(sent.until_s for sent in self._sent))

    def handle_timer(self, now: float) -> None:
        """Ask for the mode while it is not clear."""
        self._expire(now)
        if self._chosen is not None and self._address is not None and now >= self._ask_s:
            self._ask_s = now + _ASK_EVERY_S
            self.outbox.append(_HEARTBEAT.message(self._address, 0))

    def _expire(self, now: float) -> None:
        self._sent = [sent for sent in self._sent if now < sent.until_s]
        if not self._sent:
            self._chosen = None
