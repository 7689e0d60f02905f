"""Messages needed once, requested by MAV_CMD_REQUEST_MESSAGE until they arrive.

The message itself is the answer. The acknowledgement decides whether to ask again, so one request
is in progress at a time; an acknowledgement does not say which message it is about.

- FAILED (an ArduPilot, GCS_Common.cpp) and UNSUPPORTED mean that the autopilot does not have the
  message. It is not asked for again before a restart.
- DENIED (a PX4, mavlink_receiver.cpp) means that it does not have the message, or has nothing to
  put into it yet: home and origin need a position. Once there is a position, the next DENIED
  counts as a rejection, too.
- ACCEPTED without the message is "not yet" of an ArduPilot.

After a request without an answer a rejection is not believed for a while: it may be the late answer
to that one.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable

from mavlink_vehicle.codec import Message, mavlink, message_id
from mavlink_vehicle.protocols.operations.command import (
    ACCEPTED,
    Address,
    CommandRequest,
    ack_result,
)
from mavlink_vehicle.protocols.service import Conversation, VehicleService
from mavlink_vehicle.state.vehicle_state import VehicleState

_ANSWER_S = 1.0
_FIRST_RETRY_S = 1.0
_MAX_RETRY_S = 10.0
_LATE_S = 10.0
_NEVER = frozenset({mavlink.MAV_RESULT_FAILED, mavlink.MAV_RESULT_UNSUPPORTED})
_REQUEST = mavlink.MAV_CMD_REQUEST_MESSAGE
_COMMAND_ACK = mavlink.MAVLink_command_ack_message


class MessageRequests(VehicleService):
    """Asks for each missing message, more and more rarely, until it is there or rejected."""

    def __init__(
        self, names: Iterable[str], has_position: Callable[[], bool] = lambda: False
    ) -> None:
        """Set the messages to request.

        Args:
            names: of the messages, in the order in which they are asked for.
            has_position: whether the vehicle knows where it is.

        Raises:
            MessageError: there is no such message.
        """
        super().__init__()
        self._wanted = tuple(message_id(name) for name in names)
        self.handles = (*(mavlink.mavlink_map[number] for number in self._wanted), _COMMAND_ACK)
        self._has_position = has_position
        self._missing: list[int] = []
        self._refused: set[int] = set()
        self._address: Address | None = None
        self._round: list[int] = []
        self._asked: int | None = None
        self._retry_s = _FIRST_RETRY_S
        self._next_round_s = math.inf
        self._unsure_until_s = -math.inf

    @property
    def missing(self) -> frozenset[int]:
        """Ids of the messages that have neither come nor been rejected."""
        return frozenset(self._missing)

    def vehicle_came(self, conversation: Conversation, now: float) -> None:
        """Ask for everything again that was not rejected."""
        self.resume(conversation.address, now)

    def link_lost(self, state: VehicleState, now: float) -> None:
        """Stop asking."""
        self.pause()

    def vehicle_gone(self, reason: str, now: float) -> None:
        """Ask for what was rejected, too, from the next time on."""
        self.forget()

    def forget(self) -> None:
        """Ask for what was rejected, too, from the next `resume` on: the autopilot restarted."""
        self._refused.clear()

    def resume(self, address: Address, now: float) -> None:
        """Ask for everything again that was not rejected."""
        self._address = address
        self._missing = [number for number in self._wanted if number not in self._refused]
        self._retry_s = _FIRST_RETRY_S
        self._begin_round(now)

    def pause(self) -> None:
        """Stop asking."""
        self._asked = self.deadline_s = None
        self.outbox.clear()

    def receive(self, message: Message, now: float) -> None:
        """Tick off what came; look for the answer to the request in progress."""
        if not self._missing:
            return
        number = message._header.msgId
        if number in self._missing:
            self._missing.remove(number)
            if not self._missing:
                self._asked = self.deadline_s = None
            elif number == self._asked:
                self._ask_next(now)
        elif self._asked is not None and self._address is not None:
            self._take_answer(ack_result(message, _REQUEST, self._address), self._asked, now)

    def _take_answer(self, result: int | None, asked: int, now: float) -> None:
        denied = result == mavlink.MAV_RESULT_DENIED and self._has_position()
        if (result in _NEVER or denied) and now >= self._unsure_until_s:
            self._refused.add(asked)
            self._missing.remove(asked)
        if result is not None and result != ACCEPTED:
            self._ask_next(now)

    def _on_deadline(self, now: float) -> None:
        """Ask for the next one, or begin again."""
        if self._asked is None:
            self._begin_round(now)
        else:
            self._unsure_until_s = now + _LATE_S
            self._ask_next(now)

    def _begin_round(self, now: float) -> None:
        self._round = list(self._missing)
        self._next_round_s = now + self._retry_s
        self._retry_s = min(self._retry_s * 2.0, _MAX_RETRY_S)
        self._ask_next(now)

    def _ask_next(self, now: float) -> None:
        """Ask for what is left of this round; after the last, wait for the next round."""
        self._round = [number for number in self._round if number in self._missing]
        if self._round and self._address is not None:
            self._asked = self._round.pop(0)
            request = CommandRequest(_REQUEST, (self._asked,))
            self.outbox.append(request.message(self._address, 0))
            self.deadline_s = now + _ANSWER_S
        else:
            self._asked = None
            self.deadline_s = max(self._next_round_s, now) if self._missing else None
