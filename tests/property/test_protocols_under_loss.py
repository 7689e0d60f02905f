"""Every protocol ends once, under any schedule of loss, delay, duplication and reordering."""

from __future__ import annotations

import math
from collections.abc import Callable

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from mavlink_vehicle.codec import Codec, Message, mavlink
from mavlink_vehicle.events import (
    OperationFinished,
    OperationResult,
    VehicleEvent,
)
from mavlink_vehicle.protocols.message_rates import MessageRates
from mavlink_vehicle.protocols.message_requests import MessageRequests
from mavlink_vehicle.protocols.operations.command import (
    Address,
    CommandExchange,
    CommandRequest,
    CommandTiming,
)
from mavlink_vehicle.vehicle import Vehicle, VehicleConfig
from tests.support.links.lossy_channel import FATES, Fate, LossyChannel
from tests.support.models.model_autopilot import (
    ACCEPTED,
    ARM,
    FAILED,
    IN_PROGRESS,
    SET_MODE,
    TAKEOFF,
    TICK_S,
    ModelAutopilot,
)

ADDRESS = Address(1, 191, 1, 1)
TIMING = CommandTiming(timeout_s=0.5, retries=4, progress_timeout_s=2.0, limit_s=8.0)
GUIDED, BRAKE = 4, 17
PERFECT: list[Fate] = [(0.0,)]
RESULTS = st.lists(
    st.sampled_from([ACCEPTED, FAILED, IN_PROGRESS, mavlink.MAV_RESULT_TEMPORARILY_REJECTED]),
    max_size=3,
).map(tuple)


class Pair:
    """A vehicle and the model, joined by two lossy channels, tick by tick."""

    def __init__(self, model: ModelAutopilot, up: list[Fate], down: list[Fate]) -> None:
        self.now = 0.0
        self.model = model
        self.vehicle = Vehicle(VehicleConfig(message_rates_hz={}, heartbeat_timeout_s=5.0))
        self.events: list[VehicleEvent] = []
        self.climb_seen_s: float | None = None
        self.first_end_s = math.inf
        self._codec = Codec(1, 191)
        self._set_channels(PERFECT, PERFECT)
        self.vehicle.start(0.0)
        self.run(2.0)
        self._set_channels(up, down)

    def _set_channels(self, up: list[Fate], down: list[Fate]) -> None:
        self.up: LossyChannel[bytes] = LossyChannel(up)
        self.down: LossyChannel[bytes] = LossyChannel(down)

    def run(self, seconds: float, until: Callable[[], bool] = lambda: False) -> None:
        end_s = self.now + seconds
        self._flush()
        while self.now < end_s and not until():
            self.now += TICK_S
            for data in self.up.pop(self.now):
                self.model.receive(data)
            self.model.step(self.now)
            for data in self.model.outbox:
                self.down.push(data, self.now)
            self.model.outbox.clear()
            for data in self.down.pop(self.now):
                for message in self._codec.decode(data):
                    if _shows_climb(message) and self.climb_seen_s is None:
                        self.climb_seen_s = self.now
                    self.vehicle.receive(message, self.now)
            deadline = self.vehicle.next_deadline()
            if deadline is not None and deadline <= self.now:
                self.vehicle.handle_timer(self.now)
            self._flush()

    def _flush(self) -> None:
        for message in self.vehicle.messages_to_send():
            self.up.push(self._codec.encode(message), self.now)
        while (event := self.vehicle.next_event()) is not None:
            self.events.append(event)
            if isinstance(event, OperationFinished):
                self.first_end_s = min(self.first_end_s, self.now)

    def ends(self) -> list[OperationFinished]:
        return [event for event in self.events if isinstance(event, OperationFinished)]


def _shows_climb(message: Message) -> bool:
    if message.get_type() == "EXTENDED_SYS_STATE":
        return bool(message.landed_state == mavlink.MAV_LANDED_STATE_TAKEOFF)
    return message.get_type() == "GLOBAL_POSITION_INT" and bool(message.relative_alt > 500)


def the_one_end(pair: Pair, limit_s: float) -> OperationFinished:
    pair.run(limit_s, until=lambda: bool(pair.ends()))
    assert len(pair.ends()) == 1, "no end in bounded time"
    pair.run(6.0)
    assert len(pair.ends()) == 1, "a second end"
    assert pair.vehicle.operations.operation_id is None
    return pair.ends()[0]


@given(up=FATES, down=FATES, results=RESULTS)
def test_a_command_ends_once(up: list[Fate], down: list[Fate], results: tuple[int, ...]) -> None:
    model = ModelAutopilot(answers={SET_MODE: results})
    command = CommandExchange(CommandRequest(SET_MODE, (1.0, GUIDED)), ADDRESS, TIMING)
    _drive(command, lambda: command.start(0.0), model, up, down, 20.0)
    end = command.next_event()
    assert end is not None
    assert command.next_event() is None
    assert end.attempts <= TIMING.retries + 1 + TIMING.limit_s / TIMING.progress_timeout_s
    assert command.deadline_s is None
    final = [result for result in results if result != IN_PROGRESS]
    assert end.result is None or end.result in final
    confirmations = [m.confirmation for m in model.received]
    assert all(0 <= c <= end.attempts for c in confirmations)


@given(up=FATES, down=FATES, accepts=st.booleans())
@example(up=PERFECT, down=PERFECT, accepts=False)
@example(up=PERFECT, down=PERFECT, accepts=True)
@settings(max_examples=40)
def test_message_rates_are_asked_for_until_answered_and_no_more(
    up: list[Fate], down: list[Fate], accepts: bool
) -> None:
    """Nothing arrives but answers: a rejection is the last word, a grant is doubted once."""
    result = ACCEPTED if accepts else mavlink.MAV_RESULT_DENIED
    model = ModelAutopilot(answers={511: (result,)})
    rates = MessageRates({"ATTITUDE": 10.0, "SYS_STATUS": 1.0}, TIMING)
    now, sent = _drive(rates, lambda: rates.resume(ADDRESS, frozenset(), 0.0), model, up, down)
    assert {message.param1 for message in sent} == {30.0, 1.0}
    assert len(sent) <= 2 * (1 + TIMING.retries) * now / 2.0
    if all(fate == PERFECT[0] for fate in [*up, *down]):
        assert len(sent) == (4 if accepts else 2)
        assert not _timed(rates, now)


@given(up=FATES, down=FATES)
@settings(max_examples=40)
def test_message_rates_never_give_up_without_an_answer(up: list[Fate], down: list[Fate]) -> None:
    model = ModelAutopilot(answers={511: ()})
    rates = MessageRates({"ATTITUDE": 10.0, "SYS_STATUS": 1.0}, TIMING)
    now, sent = _drive(rates, lambda: rates.resume(ADDRESS, frozenset(), 0.0), model, up, down)
    assert len(sent) <= 2 * (1 + TIMING.retries) * now / 2.0
    late = [m for t, m in _timed(rates, now) if t > now + 20.0]
    assert late, "it gave up"


@given(up=FATES, down=FATES)
@settings(max_examples=40)
def test_message_requests_never_give_up_and_never_flood(up: list[Fate], down: list[Fate]) -> None:
    requests = MessageRequests(["HOME_POSITION", "AUTOPILOT_VERSION"])
    model = ModelAutopilot()
    now, sent = _drive(requests, lambda: requests.resume(ADDRESS, 0.0), model, up, down)
    assert 2 <= len(sent) <= 2 * (4 + now / 10.0 + 1)
    assert len(requests.missing) == 2
    assert requests.deadline_s is not None


Asking = MessageRates | MessageRequests


def _drive(
    asking: Asking | CommandExchange,
    begin: Callable[[], None],
    model: ModelAutopilot,
    up: list[Fate],
    down: list[Fate],
    seconds: float = 40.0,
) -> tuple[float, list[Message]]:
    to_model: LossyChannel[bytes] = LossyChannel(up)
    to_us: LossyChannel[bytes] = LossyChannel(down)
    codec, now = Codec(1, 191), 0.0
    sent: list[Message] = []
    begin()
    while now < seconds:
        for message in asking.messages_to_send():
            sent.append(message)
            to_model.push(codec.encode(message), now)
        for data in to_model.pop(now):
            model.receive(data)
        for data in model.outbox:
            to_us.push(data, now)
        model.outbox.clear()
        for data in to_us.pop(now):
            for message in codec.decode(data):
                asking.receive(message, now)
        asking.handle_timer(now)
        now += TICK_S
    return now, sent


def _timed(asking: Asking, start_s: float) -> list[tuple[float, Message]]:
    """Continue for a minute on a dead link."""
    now, sent = start_s, []
    while now < start_s + 60.0:
        asking.handle_timer(now)
        sent += [(now, message) for message in asking.messages_to_send()]
        now += TICK_S
    return sent


@pytest.mark.parametrize("command", [SET_MODE, ARM, TAKEOFF])
def test_on_a_perfect_link_everything_is_achieved(command: int) -> None:
    model = ModelAutopilot(mode=GUIDED if command == TAKEOFF else 0, armed=command == TAKEOFF)
    pair = Pair(model, PERFECT, PERFECT)
    if command == SET_MODE:
        pair.vehicle.change_mode("GUIDED", pair.now)
    elif command == ARM:
        pair.vehicle.arm(pair.now)
    else:
        pair.vehicle.take_off(6.0, pair.now)
    assert the_one_end(pair, 40.0).result is OperationResult.ACHIEVED
