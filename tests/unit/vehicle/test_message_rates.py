from __future__ import annotations

import pytest

from mavlink_vehicle.codec import Message, mavlink, message_id
from mavlink_vehicle.errors import MessageError
from mavlink_vehicle.protocols.message_rates import MessageRates
from mavlink_vehicle.protocols.message_requests import MessageRequests
from mavlink_vehicle.protocols.operations.command import Address, CommandTiming
from tests.support.messages.autopilot_messages import AutopilotMessages

SET_INTERVAL = mavlink.MAV_CMD_SET_MESSAGE_INTERVAL
ACCEPTED, DENIED = mavlink.MAV_RESULT_ACCEPTED, mavlink.MAV_RESULT_DENIED
UNSUPPORTED, FAILED = mavlink.MAV_RESULT_UNSUPPORTED, mavlink.MAV_RESULT_FAILED
BUSY = mavlink.MAV_RESULT_TEMPORARILY_REJECTED
LONG_S = 600.0
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
        self.frozen: set[int] = set()
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
        if result == ACCEPTED and number not in self.frozen:
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


@pytest.mark.parametrize("result", [DENIED, FAILED, UNSUPPORTED])
def test_a_rejected_message_is_asked_for_once_until_a_restart(result: int) -> None:
    """Every question makes an ArduPilot tell all ground stations that it has no such message."""
    rates = make_rates(ODOMETRY=5.0, SYS_STATUS=2.0)
    autopilot = Autopilot(rates, {"ODOMETRY": result})
    rates.resume(ADDRESS, frozenset(), 0.0)
    autopilot.run(LONG_S)
    assert list(rates.refusals) == ["ODOMETRY"]
    assert autopilot.asked_for("ODOMETRY") == 1
    rates.pause(autopilot.now)  # the link was lost: the autopilot is the same
    rates.resume(ADDRESS, frozenset(), autopilot.now)
    autopilot.run(60.0)
    assert list(rates.refusals) == ["ODOMETRY"]
    assert (autopilot.asked_for("ODOMETRY"), autopilot.asked_for("SYS_STATUS")) == (1, 2)
    rates.forget()  # it restarted, perhaps with another firmware
    rates.resume(ADDRESS, frozenset(), autopilot.now)
    autopilot.run(60.0)
    assert (autopilot.asked_for("ODOMETRY"), autopilot.asked_for("SYS_STATUS")) == (2, 3)


def test_a_vehicle_that_is_busy_is_asked_again() -> None:
    rates = make_rates(SYS_STATUS=2.0)
    autopilot = Autopilot(rates, {"SYS_STATUS": BUSY})
    rates.resume(ADDRESS, frozenset(), 0.0)
    autopilot.run(30.0)
    assert 3 <= autopilot.asked_for("SYS_STATUS") <= 10
    assert not rates.refusals


def test_what_was_granted_is_asked_for_once_and_once_more_if_nothing_comes() -> None:
    """A PX4 sends CURRENT_MODE at 2 Hz at most; a LOCAL_POSITION_NED waits for the estimator."""
    rates = make_rates(CURRENT_MODE=10.0, LOCAL_POSITION_NED=20.0)
    autopilot = Autopilot(rates)
    autopilot.frozen |= {message_id("CURRENT_MODE"), message_id("LOCAL_POSITION_NED")}
    autopilot.intervals_s[436], autopilot.next_s[436] = 0.5, 0.0
    rates.resume(ADDRESS, frozenset(), 0.0)
    autopilot.run(LONG_S)
    assert autopilot.asked_for("CURRENT_MODE") == 1
    assert autopilot.asked_for("LOCAL_POSITION_NED") == 2
    assert not rates.refusals


def test_an_answer_that_was_meant_for_another_request_loses_no_message() -> None:
    """An ACK does not name its message: on a bad link it may be a copy of the one before."""
    rates = make_rates(LOCAL_POSITION_NED=20.0)
    autopilot = Autopilot(rates)
    autopilot.frozen.add(32)
    rates.resume(ADDRESS, frozenset(), 0.0)
    autopilot.run(1.0)
    autopilot.frozen.clear()
    autopilot.run(20.0)
    assert autopilot.asked_for("LOCAL_POSITION_NED") == 2
    assert autopilot.intervals_s[32] == pytest.approx(0.05)


def test_a_rate_that_has_fallen_is_asked_for_again_once() -> None:
    """A ground station may set other rates on the same link."""
    rates = make_rates(GLOBAL_POSITION_INT=20.0)
    autopilot = Autopilot(rates)
    rates.resume(ADDRESS, frozenset(), 0.0)
    autopilot.run(10.0)
    autopilot.intervals_s[33] = 1.0
    autopilot.run(10.0)
    assert autopilot.asked_for("GLOBAL_POSITION_INT") == 2
    autopilot.frozen.add(33)  # from now on it grants the rate and keeps its own
    autopilot.intervals_s[33] = 1.0
    autopilot.run(60.0)
    assert autopilot.asked_for("GLOBAL_POSITION_INT") == 3


def test_the_answer_to_a_repetition_is_not_the_next_messages() -> None:
    """On a link with a round trip of 0.7 s every command is sent twice, and answered twice."""
    rates = make_rates(ODOMETRY=5.0, SYS_STATUS=2.0, ATTITUDE=2.0)
    messages, now = AutopilotMessages(), 0.0
    answers: list[tuple[float, int]] = []
    asked: list[int] = []
    rates.resume(ADDRESS, frozenset(), now)
    while now < LONG_S:
        for message in rates.messages_to_send():
            asked.append(int(message.param1))
            denied = asked[-1] == message_id("ODOMETRY")
            answers.append((now + 0.7, DENIED if denied else ACCEPTED))
        while answers and answers[0][0] <= now:
            rates.receive(messages.ack(SET_INTERVAL, answers.pop(0)[1]), now)
        if round(100.0 * now) % 50 == 0:
            for name in ("SYS_STATUS", "ATTITUDE"):
                if message_id(name) in asked:
                    rates.receive(messages(name), now)
        rates.handle_timer(now)
        now += 0.01
    assert list(rates.refusals) == ["ODOMETRY"]
    assert all(asked.count(number) <= 6 for number in asked)


def test_an_old_firmware_is_asked_for_the_group() -> None:
    rates = make_rates(GLOBAL_POSITION_INT=4.0, MEMINFO=1.0)
    names = ("GLOBAL_POSITION_INT", "MEMINFO")
    autopilot = Autopilot(rates, dict.fromkeys(names, UNSUPPORTED))
    rates.resume(ADDRESS, frozenset(), 0.0)
    autopilot.run(2.0)
    assert autopilot.groups == [mavlink.MAV_DATA_STREAM_POSITION]
    assert set(rates.refusals) == set(names)
    autopilot.run(60.0)  # neither comes; the question for the group may have been lost
    assert autopilot.groups == 3 * [mavlink.MAV_DATA_STREAM_POSITION]
    assert len(autopilot.asked) == 2


def test_what_is_rejected_and_comes_unasked_is_not_called_rejected() -> None:
    rates = make_rates(MISSION_CURRENT=2.0)
    autopilot = Autopilot(rates, {"MISSION_CURRENT": FAILED})
    autopilot.intervals_s[42], autopilot.next_s[42] = 1.0, 0.0
    rates.resume(ADDRESS, frozenset(), 0.0)
    autopilot.run(60.0)
    assert not rates.refusals
    assert len(autopilot.asked) == 1


def test_what_comes_after_all_is_no_longer_called_rejected() -> None:
    rates = make_rates(GLOBAL_POSITION_INT=4.0)
    autopilot = Autopilot(rates, {"GLOBAL_POSITION_INT": UNSUPPORTED})
    rates.resume(ADDRESS, frozenset(), 0.0)
    autopilot.run(0.1)
    autopilot.intervals_s[33], autopilot.next_s[33] = 0.25, autopilot.now  # the group works
    autopilot.run(5.0)
    assert not rates.refusals


def test_paused_it_is_silent_and_resumed_it_restarts() -> None:
    rates = make_rates(GLOBAL_POSITION_INT=20.0)
    autopilot = Autopilot(rates)
    rates.resume(ADDRESS, frozenset(), 0.0)
    autopilot.run(3.0)
    rates.pause(autopilot.now)
    rates.pause(autopilot.now)
    autopilot.restart()
    autopilot.run(30.0)
    assert len(autopilot.asked) == 1
    assert rates.deadline_s is None
    rates.resume(ADDRESS, frozenset(), autopilot.now)
    rates.resume(ADDRESS, frozenset(), autopilot.now)
    autopilot.run(1.0)
    assert autopilot.next_s


def test_names_are_checked_when_it_is_made() -> None:
    with pytest.raises(MessageError, match="no MAVLink message 'POSITION'"):
        make_rates(POSITION=1.0)
    with pytest.raises(MessageError):
        MessageRequests(["POSITION"])


def drive_requests(
    requests: MessageRequests, answers: dict[int, int], seconds: float, start_s: float = 0.0
) -> list[tuple[float, int]]:
    """Answer every request by message id, without the message; return what was asked and when."""
    messages, now = AutopilotMessages(), start_s
    asked = []
    while now < start_s + seconds:
        for message in requests.messages_to_send():
            assert message.command == 512
            number = int(message.param1)
            asked.append((round(now, 3), number))
            if number in answers:
                requests.receive(messages.ack(512, answers[number]), now)
        requests.handle_timer(now)
        now += 0.01
    return asked


HOME, VERSION, ORIGIN = 242, 148, 49


def test_what_is_wanted_once_is_asked_for_until_it_came() -> None:
    requests = MessageRequests(["AUTOPILOT_VERSION", "HOME_POSITION"])
    requests.start(0.0)
    assert not requests.messages_to_send()
    requests.resume(ADDRESS, 0.0)
    assert [(m.command, m.param1) for m in requests.messages_to_send()] == [(512, 148.0)]
    autopilot = AutopilotMessages()
    requests.receive(autopilot("AUTOPILOT_VERSION"), 0.5)  # then the other one
    assert [m.param1 for m in requests.messages_to_send()] == [242.0]
    asked = drive_requests(requests, {}, 40.0, 0.5)
    assert {number for _, number in asked} == {HOME}
    times = [time_s for time_s, _ in asked]
    assert times == sorted(times)
    assert len(times) in (5, 6)  # ever more rarely, and for ever
    requests.receive(autopilot("HOME_POSITION"), 40.5)
    assert requests.deadline_s is None
    assert not requests.missing
    requests.resume(ADDRESS, 50.0)  # after a restart
    assert len(requests.messages_to_send()) == 1
    requests.pause()
    assert requests.deadline_s is None


@pytest.mark.parametrize("result", [FAILED, UNSUPPORTED])
def test_what_the_autopilot_does_not_have_is_requested_once_until_a_restart(result: int) -> None:
    requests = MessageRequests(["AUTOPILOT_VERSION", "HOME_POSITION", "GPS_GLOBAL_ORIGIN"])
    answers = dict.fromkeys((VERSION, HOME, ORIGIN), result)
    requests.resume(ADDRESS, 0.0)
    asked = drive_requests(requests, answers, LONG_S)
    assert [number for _, number in asked] == [VERSION, HOME, ORIGIN]
    requests.pause()
    requests.resume(ADDRESS, LONG_S)  # the link was lost: the autopilot is the same
    assert not drive_requests(requests, answers, 60.0, LONG_S)
    requests.forget()
    requests.resume(ADDRESS, LONG_S)
    assert len(drive_requests(requests, answers, 60.0, LONG_S)) == 3


def test_denied_is_not_yet_until_there_is_a_position() -> None:
    """A PX4 denies what it does not have, and what it has nothing to put into."""
    position = False
    requests = MessageRequests(["GPS_GLOBAL_ORIGIN"], lambda: position)
    requests.resume(ADDRESS, 0.0)
    assert 5 <= len(drive_requests(requests, {ORIGIN: DENIED}, 60.0)) <= 9
    position = True
    assert len(drive_requests(requests, {ORIGIN: DENIED}, LONG_S, 60.0)) == 1
    assert not requests.missing


def test_a_late_rejection_is_not_taken_for_the_next_messages() -> None:
    requests = MessageRequests(["AUTOPILOT_VERSION", "HOME_POSITION"])
    requests.resume(ADDRESS, 0.0)
    requests.handle_timer(1.0)  # no answer in time
    requests.receive(AutopilotMessages().ack(512, FAILED), 1.1)
    assert requests.missing == {VERSION, HOME}


class TestOptional:
    @pytest.mark.parametrize("result", [DENIED, ACCEPTED])
    def test_what_is_optional_is_no_rejection_and_is_asked_for_once(self, result: int) -> None:
        rates = MessageRates({}, TIMING, {"OBSTACLE_DISTANCE": 10.0})
        autopilot = Autopilot(rates, {"OBSTACLE_DISTANCE": result})
        autopilot.has_sensors = False
        rates.resume(ADDRESS, frozenset(), 0.0)
        autopilot.run(LONG_S)
        assert len(autopilot.asked) == 1
        assert rates.refusals == {}
