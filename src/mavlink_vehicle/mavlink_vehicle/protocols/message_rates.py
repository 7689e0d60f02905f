"""Telemetry: requests each message at its rate and checks that it arrives.

MAV_CMD_SET_MESSAGE_INTERVAL is sent for one message after the other, since an acknowledgement
doesn't say which message it is about. Each message is asked for until the command is answered,
and then no more:

- A rejection holds until the autopilot restarts. A rejected message is never asked for again:
  each question makes an ArduPilot simulator say "No ap_message for mavlink id (330)" to every
  ground station.
- What comes in the first seconds after a grant is what the autopilot sends of the message. That may
  be less than the rate asked for: a PX4 sends CURRENT_MODE at 2 Hz at most, and an ArduPilot no
  LOCAL_POSITION_NED before its estimator is ready.
- Only a rate that falls much below what it was is asked for again, once. That covers a restart that
  nobody noticed, and a ground station that sets other rates on the same link.

On a link so slow that commands are repeated, an answer may be that to the command before. It is
then believed when the message comes, or when it was given several times.

Where the command is UNSUPPORTED (old ArduPilots), REQUEST_DATA_STREAM asks for the group that holds
the message; it has no acknowledgement, and is repeated a few times.
"""

from __future__ import annotations

import enum
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from mavlink_vehicle.codec import Message, make, mavlink, message_id
from mavlink_vehicle.events import VehicleEvent
from mavlink_vehicle.protocols.machine import Machine, Table
from mavlink_vehicle.protocols.operations.command import (
    ACCEPTED,
    Address,
    CommandExchange,
    CommandRequest,
    CommandTiming,
    result_name,
)
from mavlink_vehicle.protocols.service import Conversation, VehicleService
from mavlink_vehicle.state.vehicle_state import VehicleState

_CHECK_PERIOD_S = 2.0
_EXPECTED_IN_WINDOW = 4
_TOGETHER_S = 0.5
_RATE_SHARE_MIN = 0.4
"""A lossy link may swallow more than half; less than this means that the rate has fallen."""
_RETRY_S = 1.0
_MAX_RETRY_S = 10.0
_GROUP_ATTEMPTS = 3
_LATE_ANSWER_S = 5.0
"""Time after a repeated command in which an answer may still be to an earlier one"""
_UNSURE_ANSWERS = 3
_NO_ANSWER = frozenset({mavlink.MAV_RESULT_TEMPORARILY_REJECTED})

# MAV_DATA_STREAM groups, as ArduPilot fills them.
_GROUPS: dict[str, int] = {
    "SYS_STATUS": mavlink.MAV_DATA_STREAM_EXTENDED_STATUS,
    "GPS_RAW_INT": mavlink.MAV_DATA_STREAM_EXTENDED_STATUS,
    "GLOBAL_POSITION_INT": mavlink.MAV_DATA_STREAM_POSITION,
    "LOCAL_POSITION_NED": mavlink.MAV_DATA_STREAM_POSITION,
    "ATTITUDE": mavlink.MAV_DATA_STREAM_EXTRA1,
    "BATTERY_STATUS": mavlink.MAV_DATA_STREAM_EXTRA3,
    "EKF_STATUS_REPORT": mavlink.MAV_DATA_STREAM_EXTRA3,
    "SYSTEM_TIME": mavlink.MAV_DATA_STREAM_EXTRA3,
}


@dataclass
class _Wish:
    """One message that is wanted, and how it goes.

    Attributes:
        due_s: when it is to be asked for; None while it is watched.
        received: how many came since `window_start_s`.
        measured_hz: how often it came in the last window.
        usual_hz: how often it came when it came most; None before the first window after an
            answer is over.
        answers: how often the command was answered.
        settled: whether the answer is believed, or the message comes without one.
        refusal: the answer, unless it was ACCEPTED.
        attempts: commands, or requests for the group, that brought nothing.
    """

    name: str
    number: int
    rate_hz: float
    optional: bool
    due_s: float | None = None
    window_start_s: float = 0.0
    received: int = 0
    measured_hz: float = 0.0
    usual_hz: float | None = None
    answers: int = 0
    settled: bool = False
    refusal: int | None = None
    attempts: int = 0

    @property
    def window_s(self) -> float:
        """The time to count before judging."""
        rate_hz = self.rate_hz if not self.usual_hz else self.usual_hz
        return max(_CHECK_PERIOD_S, _EXPECTED_IN_WINDOW / rate_hz)

    @property
    def group(self) -> int | None:
        """The MAV_DATA_STREAM that it is asked for with instead of the command, or None."""
        unsupported = self.refusal == mavlink.MAV_RESULT_UNSUPPORTED
        return _GROUPS.get(self.name) if unsupported else None

    def watch(self, now: float) -> None:
        """Begin to count."""
        self.due_s = None
        self.window_start_s = now
        self.received = 0

    def _is_doubtful(self) -> bool:
        """Whether it was ACCEPTED, and nothing comes.

        An answer does not name its message: on a bad link it may be the copy of one to the request
        before. Some messages never come, so it is asked for only once more.
        """
        nothing_comes = self.refusal is None and self.measured_hz == 0.0
        return nothing_comes and self.answers == 1 and not self.optional

    def judge(self, now: float) -> bool:
        """End a window and begin the next; return whether the message must be asked for."""
        self.measured_hz = self.received / (now - self.window_start_s)
        self.watch(now)
        comes = self.measured_hz >= _RATE_SHARE_MIN * self.rate_hz
        if not self.settled:
            partly = self.refusal is not None or self.measured_hz > 0.0
            self.settled = comes or (partly and self.answers >= _UNSURE_ANSWERS)
            if not self.settled:
                return True
        if self.usual_hz is None:
            if self._is_doubtful():
                return True
            if self.group is not None and not comes and self.attempts < _GROUP_ATTEMPTS:
                return True
            self.usual_hz = self.measured_hz
        fell = self.measured_hz < _RATE_SHARE_MIN * self.usual_hz
        if fell:
            self.usual_hz, self.attempts, self.answers = None, 0, 0
        else:
            self.usual_hz = max(self.usual_hz, min(self.measured_hz, self.rate_hz))
        return fell and (self.refusal is None or self.group is not None)


class RatesState(enum.Enum):
    """The state of the service."""

    PAUSED = "no vehicle"
    ASKING = "a command is pending"
    WATCHING = "measuring the rates"


class RatesInput(enum.Enum):
    """An input of the state machine."""

    RESUME = "the vehicle is present (again)"
    ASK = "a message request is due"
    DONE = "the command ended"
    PAUSE = "the vehicle is absent"


class MessageRates(Machine[VehicleEvent], VehicleService):
    """Keeps the wanted messages coming."""

    def __init__(
        self,
        rates_hz: Mapping[str, float],
        timing: CommandTiming,
        optional_rates_hz: Mapping[str, float] | None = None,
    ) -> None:
        """Return what is wanted: Hz by message name.

        Optional messages come only from vehicles that are equipped for them: it is no rejection
        when they do not come.

        Raises:
            MessageError: there is no such message.
        """
        super().__init__(RatesState.PAUSED)
        self._rates_hz = {**rates_hz, **(optional_rates_hz or {})}
        self._optional = frozenset(optional_rates_hz or ())
        self._timing = timing
        self._address: Address | None = None
        self._wishes: dict[int, _Wish] = {}
        self._command: CommandExchange | None = None
        self._asked: _Wish | None = None
        self._unsure_until_s = -math.inf
        wanted = (mavlink.mavlink_map[message_id(name)] for name in self._rates_hz)
        self.handles = (*wanted, mavlink.MAVLink_command_ack_message)

    @property
    def refusals(self) -> dict[str, str]:
        """Messages that the autopilot won't send, with the result it gave.

        One that comes unasked is none of them: a PX4 sends MISSION_CURRENT once a second, and
        rejects every other rate.
        """
        return {
            wish.name: result_name(wish.refusal)
            for wish in self._wishes.values()
            if wish.refusal is not None and not wish.optional and not wish.measured_hz
        }

    def refusal(self, name: str) -> str | None:
        """Return why the autopilot won't send a message, optional or not; None if it will."""
        wish = self._wishes.get(message_id(name))
        if wish is None or wish.refusal is None or wish.measured_hz:
            return None
        return result_name(wish.refusal)

    def forget(self) -> None:
        """Ask for everything from the next `resume` on: the autopilot restarted."""
        self._wishes.clear()

    def vehicle_came(self, conversation: Conversation, now: float) -> None:
        """Ask for everything, but for what has been rejected."""
        profile = conversation.profile
        self.resume(conversation.address, profile.messages.unsupported, now)

    def link_lost(self, state: VehicleState, now: float) -> None:
        """Stop asking."""
        self.pause(now)

    def vehicle_gone(self, reason: str, now: float) -> None:
        """Ask for everything from the next time on."""
        self.forget()

    def resume(self, address: Address, skip: frozenset[str], now: float) -> None:
        """Ask for everything, but for what has been rejected since the last `forget`.

        Args:
            address: who asks whom.
            skip: messages that this firmware doesn't have.
            now: time in seconds.
        """
        self._address = address
        self._command = None
        self._asked = None
        before, self._wishes = self._wishes, {}
        for name, rate_hz in self._rates_hz.items():
            if rate_hz <= 0 or name in skip:
                continue
            number = message_id(name)
            wish = before.get(number)
            if wish is None or wish.refusal is None:
                wish = _Wish(name, number, rate_hz, name in self._optional, due_s=now)
            else:
                wish.watch(now)
            self._wishes[number] = wish
        self._fire(RatesInput.RESUME, now)

    def pause(self, now: float) -> None:
        """Stop asking: there is nobody who would hear it."""
        self._fire(RatesInput.PAUSE, now)

    def receive(self, message: Message, now: float) -> None:
        """Count telemetry; look for the answer to the command in progress."""
        number = message._header.msgId
        if self.count(number) or self._command is None:
            return
        if number == mavlink.MAVLINK_MSG_ID_COMMAND_ACK:
            self._command.receive(message, now)
            self._step_command(now)

    def count(self, number: int) -> bool:
        """Count a message if it is telemetry that is wanted; return whether it is."""
        wish = self._wishes.get(number)
        if wish is None:
            return False
        wish.received += 1
        return True

    def _on_deadline(self, now: float) -> None:
        """Repeat the command, judge what arrived, ask for the next one."""
        if self._command is not None:
            self._command.handle_timer(now)
            self._step_command(now)
        else:
            self._look(now)

    def _step_command(self, now: float) -> None:
        command, wish = self._command, self._asked
        if command is None or wish is None:
            return
        self.outbox += command.messages_to_send()
        self.deadline_s = command.deadline_s
        end = command.next_event()
        if end is None:
            return
        sure = end.attempts == 1 and now >= self._unsure_until_s
        if end.attempts > 1:
            self._unsure_until_s = now + _LATE_ANSWER_S
        wish.watch(now)
        wish.attempts += 1
        wish.settled = False
        if end.result is not None and end.result not in _NO_ANSWER:
            wish.answers += 1
            wish.settled = sure
            wish.usual_hz = None
            wish.refusal = None if end.result == ACCEPTED else end.result
            if wish.group is not None:
                wish.attempts = 0
                self._ask_for_group(wish)
        self._fire(RatesInput.DONE, now)

    def _ask_for_group(self, wish: _Wish) -> None:
        group, address = wish.group, self._address
        if group is None or address is None:
            return
        wish.attempts += 1
        self.outbox.append(
            make(
                "REQUEST_DATA_STREAM",
                target_system=address.target_system,
                target_component=address.target_component,
                req_stream_id=group,
                req_message_rate=max(1, round(wish.rate_hz)),
                start_stop=1,
            )
        )

    def _look(self, now: float) -> None:
        """Judge the windows that are over, then ask for what is due, else wait."""
        for wish in self._wishes.values():
            over = wish.due_s is None and now >= wish.window_start_s + wish.window_s
            if over and wish.judge(now):
                self._want(wish, now)
        due = [w for w in self._wishes.values() if w.due_s is not None and w.due_s <= now]
        if due:
            self._asked = due[0]
            self._fire(RatesInput.ASK, now)
        else:
            self.deadline_s = self._next_look_s()

    def _next_look_s(self) -> float | None:
        """Return when the next is due, or windows are over; None if nothing is wanted."""
        wishes = self._wishes.values()
        due_s = min((w.due_s for w in wishes if w.due_s is not None), default=None)
        ends_s = [w.window_start_s + w.window_s for w in wishes if w.due_s is None]
        if not ends_s:
            return due_s
        # Windows that end close together are judged together, and from then on end together.
        together_s = min(ends_s) + _TOGETHER_S
        look_s = max(end_s for end_s in ends_s if end_s <= together_s)
        return look_s if due_s is None else min(look_s, due_s)

    def _want(self, wish: _Wish, now: float) -> None:
        if wish.group is not None:
            self._ask_for_group(wish)
        else:
            wish.due_s = now + min(_RETRY_S * wish.attempts, _MAX_RETRY_S)

    def _ask(self, now: float) -> None:
        wish, address = self._asked, self._address
        if wish is None or address is None:
            return
        request = CommandRequest(
            mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, (wish.number, round(1e6 / wish.rate_hz))
        )
        self._command = CommandExchange(request, address, self._timing)
        self._command.start(now)
        self._step_command(now)

    def _next(self, now: float) -> None:
        self._command = None
        self._asked = None
        self._look(now)

    def _stop(self, now: float) -> None:
        self._command = None
        self._asked = None
        self.deadline_s = None
        self.outbox.clear()

    table: ClassVar[Table] = {
        (RatesState.PAUSED, RatesInput.RESUME): (RatesState.WATCHING, _next),
        (RatesState.WATCHING, RatesInput.RESUME): (RatesState.WATCHING, _next),
        (RatesState.ASKING, RatesInput.RESUME): (RatesState.WATCHING, _next),
        (RatesState.WATCHING, RatesInput.ASK): (RatesState.ASKING, _ask),
        (RatesState.ASKING, RatesInput.DONE): (RatesState.WATCHING, _next),
        (RatesState.PAUSED, RatesInput.PAUSE): (RatesState.PAUSED, None),
        (RatesState.WATCHING, RatesInput.PAUSE): (RatesState.PAUSED, _stop),
        (RatesState.ASKING, RatesInput.PAUSE): (RatesState.PAUSED, _stop),
    }
