"""Several vehicles on one thread: whose message, whose turn, whose trouble."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import pytest

from mavlink_vehicle.codec import Message, make, with_source
from mavlink_vehicle.errors import DriverError
from mavlink_vehicle.io.clock import ManualClock
from mavlink_vehicle.io.driver import GIVE_UP_S
from navigation_bridge.fleet import VEHICLE_BURST, FleetApplication, Member


class Recorder:
    """An application that notes what is done with it, and can be made to fail."""

    def __init__(self) -> None:
        self.done: list[str] = []
        self.deadline_s: float | None = None
        self.outbox: list[Message] = []
        self.broken = ""
        self.given_up: list[str] = []
        self.asked = 0

    def start(self, now: float) -> None:
        self.do("start")

    def receive(self, message: Message, now: float) -> None:
        self.do(message.get_type())

    def overhear(self, message: Message, now: float) -> None:
        self.do(f"overheard {message.get_type()}")

    def handle_timer(self, now: float) -> None:
        self.do("timer")

    def next_deadline(self) -> float | None:
        self.asked += 1
        return self.deadline_s

    def messages_to_send(self) -> list[Message]:
        self.do("send")
        taken, self.outbox = self.outbox, []
        return taken

    def fail(self, error: Exception, now: float) -> None:
        self.done.append(f"failed: {error}")

    def give_up(self, error: Exception) -> None:
        self.given_up.append(str(error))

    def do(self, what: str) -> None:
        self.done.append(what)
        if what == self.broken:
            raise RuntimeError(f"{what} is broken")


class Now:
    """A driver's thread that does work at once."""

    def post(self, work: Callable[[], object]) -> None:
        work()

    def call(self, work: Callable[[], Any], timeout_s: float = 5.0) -> Any:
        return work()


class Three:
    """A fleet of three with the systems 1, 2 and 3."""

    def __init__(self) -> None:
        self.clock = ManualClock()
        self.applications = [Recorder() for _ in range(3)]
        self.members = [
            Member("abc"[number], number + 1, application)
            for number, application in enumerate(self.applications)
        ]
        self.fleet = FleetApplication(self.members, self.clock)
        self.fleet.attach(Now())
        self.fleet.start(self.clock.now())
        self.turn()
        self.turn()
        self.forget()

    def turn(self) -> list[Message]:
        """Do what a driver does in a turn, but for receiving."""
        deadline_s = self.fleet.next_deadline()
        if deadline_s is not None and deadline_s <= self.clock.now():
            self.fleet.handle_timer(self.clock.now())
        return self.fleet.messages_to_send()

    def advance(self, seconds: float) -> None:
        self.clock.advance_to(self.clock.now() + seconds)

    def forget(self) -> None:
        for application in self.applications:
            application.done.clear()
            application.asked = 0

    @property
    def done(self) -> list[list[str]]:
        return [application.done for application in self.applications]


@pytest.fixture
def three() -> Three:
    return Three()


def message(name: str, system: int, **fields: Any) -> Message:
    return with_source(make(name, **fields), system, 1)


def test_a_message_is_passed_to_its_own_vehicle(three: Three) -> None:
    three.fleet.receive(message("ATTITUDE", 2), 0.0)
    assert three.done == [[], ["ATTITUDE"], []]


def test_a_message_of_an_unknown_sender_reaches_its_target_only(three: Three) -> None:
    three.fleet.receive(message("COMMAND_ACK", 77, target_system=3), 0.0)
    three.fleet.receive(message("HEARTBEAT", 77), 0.0)
    assert three.done == [[], [], ["COMMAND_ACK"]]


def test_a_station_command_is_overheard_by_its_target_or_by_all(three: Three) -> None:
    three.fleet.overhear(message("COMMAND_LONG", 255, target_system=1), 0.0)
    three.fleet.overhear(message("COMMAND_LONG", 255, target_system=9), 0.0)
    assert three.done == [["overheard COMMAND_LONG"], [], []]
    three.fleet.overhear(message("COMMAND_LONG", 255, target_system=0), 0.0)
    assert [len(done) for done in three.done] == [2, 1, 1]


def test_a_flooding_vehicle_is_throttled_and_counted(three: Three) -> None:
    for number in range(3 * int(VEHICLE_BURST)):
        three.fleet.receive(message("ATTITUDE", 1), 0.0)
        if number % 100 == 0:
            three.fleet.receive(message("ATTITUDE", 2), 0.0)
    assert [len(done) for done in three.done] == [VEHICLE_BURST, 60, 0]
    assert [member.throttled for member in three.members] == [2 * VEHICLE_BURST, 0, 0]
    three.fleet.receive(message("ATTITUDE", 1), 1.0)
    assert three.members[0].throttled == 2 * VEHICLE_BURST


def test_a_single_vehicle_receives_all_messages() -> None:
    application = Recorder()
    fleet = FleetApplication([Member("", 0, application)], ManualClock())
    fleet.receive(message("HEARTBEAT", 7), 0.0)
    fleet.receive(message("RADIO_STATUS", 51), 0.0)
    fleet.overhear(message("COMMAND_LONG", 255, target_system=9), 0.0)
    assert application.done == ["HEARTBEAT", "RADIO_STATUS", "overheard COMMAND_LONG"]


def test_only_vehicles_with_events_are_polled(three: Three) -> None:
    three.applications[2].outbox.append(message("HEARTBEAT", 3))
    assert three.turn() == []
    assert [application.asked for application in three.applications] == [0, 0, 0]
    three.members[2].post(lambda: None)
    assert [sent.get_type() for sent in three.turn()] == ["HEARTBEAT"]
    assert three.done == [[], [], ["send"]]
    three.fleet.next_deadline()
    assert [application.asked for application in three.applications][:2] == [0, 0]


def test_the_first_deadline_is_the_fleets_and_only_its_owner_is_called(three: Three) -> None:
    assert three.fleet.next_deadline() is None
    for number, deadline_s in enumerate((3.0, 1.0, None)):
        three.applications[number].deadline_s = deadline_s
        three.members[number].post(lambda: None)
    assert three.fleet.next_deadline() == 1.0
    three.fleet.messages_to_send()
    three.forget()
    three.advance(2.0)
    three.turn()
    assert three.done == [[], ["timer", "send"], []]


def test_the_longest_overdue_timer_runs_first(three: Three) -> None:
    for number, application in enumerate(three.applications):
        application.deadline_s = 3.0 - number
        three.members[number].post(lambda: None)
    three.turn()
    for number, application in enumerate(three.applications):
        application.outbox = [message("HEARTBEAT", number + 1)]
    three.advance(5.0)
    sent = three.turn()
    assert [heartbeat.get_srcSystem() for heartbeat in sent] == [3, 2, 1]


def test_a_deadline_that_stays_where_it_is_does_not_spin_nor_hold_up_the_others(
    three: Three,
) -> None:
    stuck, other = three.applications[0], three.applications[1]
    stuck.deadline_s, other.deadline_s = 0.0, 0.02
    for member in three.members:
        member.post(lambda: None)
    three.turn()
    assert stuck.done.count("timer") == 1
    assert three.fleet.next_deadline() == 0.02
    three.advance(0.02)
    three.turn()
    assert (stuck.done.count("timer"), other.done.count("timer")) == (1, 1)
    three.advance(1.0)
    three.turn()
    assert stuck.done.count("timer") == 2


@pytest.mark.parametrize("where", ["ATTITUDE", "overheard COMMAND_LONG", "post"])
def test_an_exception_affects_its_own_vehicle_only(three: Three, where: str) -> None:
    three.applications[1].broken = where
    for system in (1, 2, 3):
        three.fleet.receive(message("ATTITUDE", system), 0.0)
        three.fleet.overhear(message("COMMAND_LONG", 255, target_system=system), 0.0)
        application = three.applications[system - 1]
        three.members[system - 1].post(partial(application.do, "post"))
    told = [[line for line in done if line.startswith("failed")] for done in three.done]
    assert told == [[], [f"failed: {where} is broken"], []]
    assert [line for line in three.done[2] if line == where] == [where]


@pytest.mark.parametrize("where", ["timer", "send"])
def test_a_vehicle_that_fails_again_and_again_is_given_up_and_the_others_fly_on(
    three: Three, where: str
) -> None:
    sick = three.applications[0]
    sick.broken = where
    while three.clock.now() < GIVE_UP_S + 1.0:
        for member, application in zip(three.members, three.applications, strict=True):
            application.deadline_s = three.clock.now()
            if application is not sick or not sick.given_up:
                member.post(lambda: None)
        three.turn()
        three.advance(0.02)
    assert len(sick.given_up) == 1
    assert "Vehicle a has been failing" in sick.given_up[0]
    assert sick.done.count("failed: " + f"{where} is broken") < 200
    assert not three.applications[1].given_up
    assert three.applications[1].done.count("timer") > 100
    assert not three.fleet.lost
    three.forget()
    three.fleet.receive(message("ATTITUDE", 1), three.clock.now())
    three.members[0].post(lambda: sick.done.append("post"))
    three.turn()
    assert sick.done == []
    with pytest.raises(DriverError, match="abandoned"):
        three.members[0].call(lambda: None)
    assert three.members[1].call(lambda: 5) == 5


def test_a_timer_that_works_again_is_forgiven(three: Three) -> None:
    weak = three.applications[0]
    for step in range(int(4.0 * GIVE_UP_S / 0.1)):
        weak.broken = "" if step % 10 == 9 else "timer"
        weak.deadline_s = three.clock.now()
        three.members[0].post(lambda: None)
        three.turn()
        three.advance(0.1)
    assert weak.done.count("failed: timer is broken") > 20
    assert not weak.given_up


def test_a_fleet_that_was_given_up_is_lost(three: Three) -> None:
    for member, application in zip(three.members, three.applications, strict=True):
        application.broken, application.deadline_s = "timer", 0.0
        member.post(lambda: None)
    while three.clock.now() < GIVE_UP_S + 1.0:
        three.turn()
        three.advance(0.1)
    assert three.fleet.lost
    assert three.fleet.next_deadline() is None
