"""Telemetry: asks for each message at its rate, and sees to it that it really comes.

MAV_CMD_SET_MESSAGE_INTERVAL is sent for one message after the other, since an acknowledgement
doesn't say which message it is about. What counts is what arrives: a message that comes much
too rarely, or not at all, is asked for again. That covers lost commands and autopilots that
restarted without anybody noticing; an ArduPilot forgets its rates then. Where the command is
UNSUPPORTED (old ArduPilots), REQUEST_DATA_STREAM asks for the group that holds the message.
"""

from __future__ import annotations

import enum
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from mavlink_vehicle.codec import Message, make, mavlink, message_id
from mavlink_vehicle.protocols.command import (
    ACCEPTED,
    Address,
    Command,
    CommandRequest,
    CommandTiming,
    result_name,
)
from mavlink_vehicle.protocols.machine import Machine, Table

_CHECK_PERIOD_S = 2.0
_EXPECTED_IN_WINDOW = 4
_ENOUGH = 0.4
"""A lossy link may swallow more than half; less than this means the rate isn't set."""
_RETRY_S = 1.0
_MAX_RETRY_S = 10.0
_REFUSED_RETRY_S = 30.0

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
    """One message that is wanted, and how it goes."""

    name: str
    number: int
    rate_hz: float
    optional: bool
    due_s: float | None = None  # when it is to be asked for, None while it is watched
    window_start_s: float = 0.0
    received: int = 0
    attempts: int = 0
    refusal: str | None = None

    @property
    def window_s(self) -> float:
        """How long to count before judging."""
        return max(_CHECK_PERIOD_S, _EXPECTED_IN_WINDOW / self.rate_hz)

    def watch(self, now: float) -> None:
        """Begin to count."""
        self.due_s = None
        self.window_start_s = now
        self.received = 0


class RatesState(enum.Enum):
    """What the service is doing."""

    PAUSED = "no vehicle to ask"
    ASKING = "a command is under way"
    WATCHING = "counting what arrives"


class RatesInput(enum.Enum):
    """What moves it on."""

    RESUME = "the vehicle is there (again)"
    ASK = "a message is due to be asked for"
    DONE = "the command ended"
    PAUSE = "the vehicle is gone"


class MessageRates(Machine[None]):
    """Keeps the wanted messages coming."""

    def __init__(
        self,
        rates_hz: Mapping[str, float],
        timing: CommandTiming,
        optional_rates_hz: Mapping[str, float] | None = None,
    ) -> None:
        """Say what is wanted: Hz by message name.

        What is optional comes only from vehicles that are equipped for it: it is no refusal when
        it does not come, and it is asked for again less often.

        Raises:
            MessageError: there is no such message.
        """
        super().__init__(RatesState.PAUSED)
        self._rates_hz = {**rates_hz, **(optional_rates_hz or {})}
        self._optional = frozenset(optional_rates_hz or ())
        self._timing = timing
        self._address: Address | None = None
        self._wishes: dict[int, _Wish] = {}
        self._command: Command | None = None
        self._asked: _Wish | None = None
        for name in self._rates_hz:
            message_id(name)

    @property
    def refusals(self) -> dict[str, str]:
        """Messages that the autopilot won't send, with the result it gave."""
        return {
            wish.name: wish.refusal
            for wish in self._wishes.values()
            if wish.refusal is not None and not wish.optional
        }

    def start(self, now: float) -> None:
        """Nothing to ask before `resume`."""

    def resume(self, address: Address, skip: frozenset[str], now: float) -> None:
        """Ask for everything, from the beginning.

        Args:
            address: who asks whom.
            skip: messages that this firmware doesn't have.
            now: time in seconds.
        """
        self._address = address
        self._command = None
        self._asked = None
        self._wishes = {
            number: _Wish(name, number, rate_hz, name in self._optional, due_s=now)
            for name, rate_hz in self._rates_hz.items()
            if rate_hz > 0 and name not in skip
            for number in (message_id(name),)
        }
        self._fire(RatesInput.RESUME, now)

    def pause(self, now: float) -> None:
        """Stop asking: there is nobody who would hear it."""
        self._fire(RatesInput.PAUSE, now)

    def receive(self, message: Message, now: float) -> None:
        """Count telemetry; look for the answer to the command under way."""
        number = message._header.msgId
        wish = self._wishes.get(number)
        if wish is not None:
            wish.received += 1
        elif self._command is not None and number == mavlink.MAVLINK_MSG_ID_COMMAND_ACK:
            self._command.receive(message, now)
            self._step_command(now)

    def handle_timer(self, now: float) -> None:
        """Repeat the command, judge what arrived, ask for the next one."""
        if self._deadline is None or now < self._deadline:
            return
        if self._command is not None:
            self._command.handle_timer(now)
            self._step_command(now)
        else:
            self._look(now)

    def _step_command(self, now: float) -> None:
        command, wish = self._command, self._asked
        if command is None or wish is None:
            return
        self._outbox += command.messages_to_send()
        self._deadline = command.next_deadline()
        end = command.next_event()
        if end is None:
            return
        wish.watch(now)
        wish.attempts += 1
        wish.refusal = None
        if end.result is not None and end.result != ACCEPTED:
            wish.refusal = result_name(end.result)
            if end.result == mavlink.MAV_RESULT_UNSUPPORTED:
                self._ask_for_group(wish)
        elif end.result is None:
            wish.due_s = now + min(_RETRY_S * wish.attempts, _MAX_RETRY_S)
        self._fire(RatesInput.DONE, now)

    def _ask_for_group(self, wish: _Wish) -> None:
        group = _GROUPS.get(wish.name)
        address = self._address
        if group is None or address is None:
            return
        self._outbox.append(
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
            if wish.due_s is None and now >= wish.window_start_s + wish.window_s:
                self._judge(wish, now)
        due = [w for w in self._wishes.values() if w.due_s is not None and w.due_s <= now]
        if due:
            self._asked = due[0]
            self._fire(RatesInput.ASK, now)
        else:
            self._deadline = min(
                (
                    w.due_s if w.due_s is not None else w.window_start_s + w.window_s
                    for w in self._wishes.values()
                ),
                default=None,
            )

    def _judge(self, wish: _Wish, now: float) -> None:
        expected = wish.rate_hz * (now - wish.window_start_s)
        if wish.received >= _ENOUGH * expected:
            wish.attempts = 0
            wish.refusal = None
            wish.watch(now)
        elif wish.refusal is not None or (wish.optional and not wish.received):
            wish.due_s = now + _REFUSED_RETRY_S
        else:
            # Some messages come only once there is a position; don't nag.
            wish.due_s = now + (min(_RETRY_S * (wish.attempts - 1), _MAX_RETRY_S))

    def _ask(self, now: float) -> None:
        wish, address = self._asked, self._address
        if wish is None or address is None:
            return
        request = CommandRequest(
            mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, (wish.number, round(1e6 / wish.rate_hz))
        )
        self._command = Command(request, address, self._timing)
        self._command.start(now)
        self._step_command(now)

    def _next(self, now: float) -> None:
        self._command = None
        self._asked = None
        self._look(now)

    def _stop(self, now: float) -> None:
        self._command = None
        self._asked = None
        self._deadline = None
        self._outbox.clear()

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
