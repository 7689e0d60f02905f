from __future__ import annotations

import pytest

from mavlink_vehicle.codec import Message, mavlink, message_id
from mavlink_vehicle.errors import MessageError
from mavlink_vehicle.protocols.command import Address, CommandTiming
from mavlink_vehicle.protocols.message_rates import MessageRates
from mavlink_vehicle.protocols.message_requests import MessageRequests
from tests.support.autopilot_messages import AutopilotMessages

SET_INTERVAL = mavlink.MAV_CMD_SET_MESSAGE_INTERVAL
ACCEPTED, DENIED = mavlink.MAV_RESULT_ACCEPTED, mavlink.MAV_RESULT_DENIED
UNSUPPORTED = mavlink.MAV_RESULT_UNSUPPORTED
ADDRESS = Address(1, 191, 1, 1)
TIMING = CommandTiming(timeout_s=0.5, retries=2)


class Autopilot:
    """Answers SET_MESSAGE_INTERVAL and sends what it was asked for, or not."""

    def __init__(self, rates: MessageRates, results: dict[str, int] | None = None) -> None:
        self.rates = rates
        self.results = {message_id(n): result for n, result in (results or {}).items()}
        self.messages = AutopilotMessages()
        self.now = 0.0
        self.intervals_s: dict[int, float] = {}
        self.next_s: dict[int, float] = {}
        self.asked: list[tuple[float, int]] = []
        self.groups: list[int] = []
        self.deaf = False
        self.has_sensors = True

    def run(self, seconds: float) -> None:
        end_s = self.now + seconds
        while self.now < end_s:
            for message in self.rates.messages_to_send():
                self._take(message)
            for number, due_s in list(self.next_s.items()):
                if self.now >= due_s and self.has_sensors:
                    self.next_s[number] = due_s + self.intervals_s[number]
                    name = mavlink.mavlink_map[number].msgname
                    self.rates.receive(self.messages(name), self.now)
            self.rates.handle_timer(self.now)
            self.now = round(self.now + 0.01, 6)

    def restart(self) -> None:
        self.next_s.clear()

    def _take(self, message: Message) -> None:
        if message.get_type() == "REQUEST_DATA_STREAM":
            self.groups.append(message.req_stream_id)
            return
        assert message.command == SET_INTERVAL
        number = int(message.param1)
        self.asked.append((self.now, number))
        if self.deaf:
            return
        result = self.results.get(number, ACCEPTED)
        if result == ACCEPTED:
            self.intervals_s[number] = message.param2 * 1e-6
            self.next_s[number] = self.now
        self.rates.receive(self.messages.ack(SET_INTERVAL, result), self.now)

    def asked_for(self, name: str) -> int:
        return [number for _, number in self.asked].count(message_id(name))


def make_rates(**rates_hz: float) -> MessageRates:
    rates = MessageRates(rates_hz, TIMING)
    rates.start(0.0)
    return rates


def test_each_is_asked_for_once_in_order_with_its_interval() -> None:
    rates = make_rates(GLOBAL_POSITION_INT=20.0, SYS_STATUS=2.0, HOME_POSITION=0.5)
    autopilot = Autopilot(rates)
    autopilot.run(1.0)
    assert not autopilot.asked  # nobody is there yet
    rates.resume(ADDRESS, frozenset(), autopilot.now)
    autopilot.run(60.0)
    assert [number for _, number in autopilot.asked] == [33, 1, 242]
    assert autopilot.intervals_s == pytest.approx({33: 0.05, 1: 0.5, 242: 2.0})
    assert not rates.refusals


def test_off_and_unknown_to_the_firmware_are_not_asked_for() -> None:
    rates = make_rates(ATTITUDE=0.0, ESTIMATOR_STATUS=1.0, SYS_STATUS=1.0)
    autopilot = Autopilot(rates)
    rates.resume(ADDRESS, frozenset({"ESTIMATOR_STATUS"}), 0.0)
    autopilot.run(10.0)
    assert autopilot.asked_for("SYS_STATUS") == 1
    assert len(autopilot.asked) == 1


def test_a_silent_restart_is_noticed_by_what_does_not_come() -> None:
    rates = make_rates(GLOBAL_POSITION_INT=20.0, SYS_STATUS=2.0)
    autopilot = Autopilot(rates)
    rates.resume(ADDRESS, frozenset(), 0.0)
    autopilot.run(10.0)
    autopilot.restart()
    autopilot.run(5.0)
    assert autopilot.asked_for("GLOBAL_POSITION_INT") == 2
    assert autopilot.asked_for("SYS_STATUS") == 2
    assert len(autopilot.next_s) == 2


def test_a_lost_command_is_repeated() -> None:
    rates = make_rates(ATTITUDE=10.0)
    autopilot = Autopilot(rates)
    autopilot.deaf = True
    rates.resume(ADDRESS, frozenset(), 0.0)
    autopilot.run(0.9)
    assert autopilot.asked_for("ATTITUDE") == 2
    autopilot.deaf = False
    autopilot.run(2.0)
    assert autopilot.next_s


def test_a_refused_message_is_remembered_and_asked_for_rarely() -> None:
    rates = make_rates(ODOMETRY=5.0, SYS_STATUS=2.0)
    autopilot = Autopilot(rates, {"ODOMETRY": DENIED})
    rates.resume(ADDRESS, frozenset(), 0.0)
    autopilot.run(25.0)
    assert rates.refusals == {"ODOMETRY": "DENIED"}
    assert autopilot.asked_for("ODOMETRY") == 1
    autopilot.run(40.0)
    assert 2 <= autopilot.asked_for("ODOMETRY") <= 3


def test_an_old_firmware_is_asked_for_the_group() -> None:
    rates = make_rates(GLOBAL_POSITION_INT=4.0, MEMINFO=1.0)
    names = ("GLOBAL_POSITION_INT", "MEMINFO")
    autopilot = Autopilot(rates, dict.fromkeys(names, UNSUPPORTED))
    rates.resume(ADDRESS, frozenset(), 0.0)
    autopilot.run(2.0)
    assert autopilot.groups == [mavlink.MAV_DATA_STREAM_POSITION]
    assert set(rates.refusals) == set(names)


def test_what_comes_after_all_is_no_longer_called_refused() -> None:
    rates = make_rates(GLOBAL_POSITION_INT=4.0)
    autopilot = Autopilot(rates, {"GLOBAL_POSITION_INT": UNSUPPORTED})
    rates.resume(ADDRESS, frozenset(), 0.0)
    autopilot.run(0.1)
    autopilot.intervals_s[33], autopilot.next_s[33] = 0.25, autopilot.now  # the group works
    autopilot.run(5.0)
    assert not rates.refusals


def test_paused_it_is_silent_and_resumed_it_begins_anew() -> None:
    rates = make_rates(GLOBAL_POSITION_INT=20.0)
    autopilot = Autopilot(rates)
    rates.resume(ADDRESS, frozenset(), 0.0)
    autopilot.run(3.0)
    rates.pause(autopilot.now)
    rates.pause(autopilot.now)
    autopilot.restart()
    autopilot.run(30.0)
    assert len(autopilot.asked) == 1
    assert rates.next_deadline() is None
    rates.resume(ADDRESS, frozenset(), autopilot.now)
    rates.resume(ADDRESS, frozenset(), autopilot.now)
    autopilot.run(1.0)
    assert autopilot.next_s


def test_names_are_checked_when_it_is_made() -> None:
    with pytest.raises(MessageError, match="no MAVLink message 'POSITION'"):
        make_rates(POSITION=1.0)
    with pytest.raises(MessageError):
        MessageRequests(["POSITION"])


def test_what_is_wanted_once_is_asked_for_until_it_came() -> None:
    requests = MessageRequests(["HOME_POSITION", "AUTOPILOT_VERSION"])
    requests.start(0.0)
    assert not requests.messages_to_send()
    requests.resume(ADDRESS, 0.0)
    asked = [(m.command, m.param1) for m in requests.messages_to_send()]
    assert asked == [(512, 148.0), (512, 242.0)]
    autopilot = AutopilotMessages()
    requests.receive(autopilot("AUTOPILOT_VERSION"), 0.5)
    times, now = [], 0.0
    while now < 100.0:
        deadline = requests.next_deadline()
        assert deadline is not None
        now = deadline
        requests.handle_timer(now)
        times.append(now)
        assert [m.param1 for m in requests.messages_to_send()] == [242.0]
    assert times[:5] == [1.0, 3.0, 7.0, 15.0, 25.0]
    requests.receive(autopilot("HOME_POSITION"), now)
    assert requests.next_deadline() is None
    assert not requests.missing
    requests.resume(ADDRESS, now)  # after a restart
    assert len(requests.messages_to_send()) == 2
    requests.pause()
    assert requests.next_deadline() is None


class TestOptional:
    def test_what_is_optional_is_no_refusal_and_is_asked_for_again_seldom(self) -> None:
        rates = MessageRates({}, TIMING, {"OBSTACLE_DISTANCE": 10.0})
        autopilot = Autopilot(rates, {"OBSTACLE_DISTANCE": DENIED})
        rates.resume(ADDRESS, frozenset(), 0.0)
        autopilot.run(25.0)
        assert len(autopilot.asked) == 1
        assert rates.refusals == {}
        autopilot.run(15.0)
        assert len(autopilot.asked) == 2

    def test_what_was_granted_and_does_not_come_is_asked_for_as_seldom(self) -> None:
        rates = MessageRates({}, TIMING, {"OBSTACLE_DISTANCE": 10.0})
        autopilot = Autopilot(rates)
        rates.resume(ADDRESS, frozenset(), 0.0)
        autopilot.has_sensors = False
        autopilot.run(25.0)
        assert len(autopilot.asked) == 1
