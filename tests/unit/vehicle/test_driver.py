"""The driver on real sockets, in its real thread; every wait has a limit."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from mavlink_vehicle.codec import Codec, Message, make
from mavlink_vehicle.errors import DriverError
from mavlink_vehicle.io import driver as driver_module
from mavlink_vehicle.io.clock import ManualClock, MonotonicClock
from mavlink_vehicle.io.driver import Application, Driver
from mavlink_vehicle.io.links import open_link
from mavlink_vehicle.io.links.udp import UdpLink
from mavlink_vehicle.io.router import Router
from mavlink_vehicle.io.tlog import TlogReader, TlogWriter
from mavlink_vehicle.vehicle import Vehicle
from tests.support.processes import patient_s

LIMIT_S = patient_s(20.0)


class Echo:
    """Answers each COMMAND_LONG, beats every 20 ms, and fails where it is told to."""

    def __init__(self) -> None:
        self.received: list[str] = []
        self.overheard: list[str] = []
        self.beats = 0
        self.turns = 0
        self.threads: set[int] = set()
        self.fail_on: set[str] = set()
        self.stuck = False
        self._due_s = 0.0
        self._outbox: list[Message] = []

    def start(self, now: float) -> None:
        self._due_s = now
        self._maybe_fail("start")

    def receive(self, message: Message, now: float) -> None:
        self.threads.add(threading.get_ident())
        self._maybe_fail(message.get_type())
        self.received.append(message.get_type())
        if message.get_type() == "COMMAND_LONG":
            self._outbox.append(make("COMMAND_ACK", command=message.command))

    def overhear(self, message: Message, now: float) -> None:
        self._maybe_fail("overhear")
        self.overheard.append(message.get_type())

    def next_deadline(self) -> float | None:
        self.turns += 1
        self._maybe_fail("next_deadline")
        return self._due_s

    def handle_timer(self, now: float) -> None:
        self.threads.add(threading.get_ident())
        self._maybe_fail("timer")
        if self.stuck:
            return
        self._due_s = now + 0.02
        self.beats += 1
        self._outbox.append(make("HEARTBEAT"))

    def messages_to_send(self) -> list[Message]:
        self._maybe_fail("send")
        messages, self._outbox = self._outbox, []
        return messages

    def _maybe_fail(self, what: str) -> None:
        if what in self.fail_on:
            raise ZeroDivisionError(f"the application fails in {what}")


class Bench:
    """A driver with an echo, and somebody who talks to it."""

    def __init__(self, recorder: TlogWriter | None = None) -> None:
        self.echo = Echo()
        self.errors: list[Exception] = []
        link = open_link("udpin://127.0.0.1:0")
        assert isinstance(link, UdpLink)
        self.peer = open_link(f"udpout://127.0.0.1:{link.port}")
        self.codec = Codec(1, 1)
        router = Router([link], lambda: Codec(1, 191), recorder=recorder)
        self.driver = Driver(self.echo, router, MonotonicClock(), self.errors.append)

    def say(self, name: str, **fields: object) -> None:
        self.peer.send(self.codec.encode(make(name, **fields)))

    def hear(self) -> list[Message]:
        return [m for data, _ in self.peer.receive() for m in self.codec.decode(data)]


@pytest.fixture
def bench() -> Iterator[Bench]:
    bench = Bench()
    yield bench
    bench.driver.stop()
    bench.peer.close()
    assert not bench.driver.running


def until(condition: Callable[[], bool]) -> None:
    limit_s = time.monotonic() + LIMIT_S
    while not condition():
        assert time.monotonic() < limit_s, "it did not come about in time"
        threading.Event().wait(0.002)


def test_messages_come_in_and_answers_go_out_on_one_thread(bench: Bench) -> None:
    bench.driver.start()
    heard: list[Message] = []
    bench.say("COMMAND_LONG", command=400)

    def answered() -> bool:
        heard.extend(bench.hear())
        return any(m.get_type() == "COMMAND_ACK" and m.command == 400 for m in heard)

    until(answered)
    until(lambda: bench.echo.beats > 3)
    assert bench.driver.running
    assert len(bench.echo.threads) == 1
    assert threading.get_ident() not in bench.echo.threads
    assert not bench.errors


def test_work_is_posted_to_its_thread(bench: Bench) -> None:
    ran: list[int] = []
    bench.driver.post(lambda: ran.append(threading.get_ident()))  # kept until it starts
    bench.driver.start()
    until(lambda: len(ran) == 1)
    for number in range(500):
        bench.driver.post(lambda number=number: ran.append(number))  # type: ignore[misc]
    until(lambda: len(ran) == 501)
    assert ran[1:] == list(range(500))
    assert ran[0] in bench.echo.threads | {ran[0]}
    bench.driver.post(lambda: 1 / 0)
    until(lambda: bool(bench.errors))
    assert isinstance(bench.errors[0], ZeroDivisionError)
    assert bench.errors[0].__traceback__ is not None


def test_calls_return_and_raise_in_the_caller(bench: Bench) -> None:
    with pytest.raises(DriverError, match="not running; start it first"):
        bench.driver.call(lambda: 1)
    bench.driver.start()
    assert bench.driver.call(lambda: 42) == 42
    with pytest.raises(ZeroDivisionError):
        bench.driver.call(lambda: 1 / 0)
    assert bench.driver.call(lambda: bench.driver.call(lambda: "from inside")) == "from inside"
    assert not bench.errors
    with pytest.raises(DriverError, match="already been started"):
        bench.driver.start()


def test_a_call_that_takes_too_long_is_given_up(bench: Bench) -> None:
    release = threading.Event()
    bench.driver.start()
    bench.driver.post(lambda: release.wait(LIMIT_S))
    with pytest.raises(DriverError, match=r"did not answer within 0\.05 s"):
        bench.driver.call(lambda: bench.echo.received.append("too late"), timeout_s=0.05)
    release.set()
    assert bench.driver.call(lambda: 1) == 1
    assert "too late" not in bench.echo.received  # it was taken back


def test_calls_from_many_threads_all_return(bench: Bench) -> None:
    bench.driver.start()
    results: list[int] = []
    threads = [
        threading.Thread(target=lambda n=n: results.append(bench.driver.call(lambda: n, LIMIT_S)))
        for n in range(30)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(LIMIT_S)
    assert sorted(results) == list(range(30))


def test_a_message_that_breaks_the_application_is_reported_and_passed_over(
    bench: Bench,
) -> None:
    bench.echo.fail_on = {"start", "PING"}
    bench.driver.start()
    for name in ("PING", "SYS_STATUS", "PING", "ATTITUDE"):
        bench.say(name)
    until(lambda: bench.echo.received == ["SYS_STATUS", "ATTITUDE"])
    assert [str(error) for error in bench.errors] == [
        "the application fails in start",
        "the application fails in PING",
        "the application fails in PING",
    ]
    beats = bench.echo.beats
    until(lambda: bench.echo.beats > beats + 2)


@pytest.mark.parametrize("where", ["timer", "next_deadline", "send"])
def test_a_passing_failure_is_survived(bench: Bench, where: str) -> None:
    bench.driver.start()
    until(lambda: bench.echo.beats > 0)
    bench.driver.call(lambda: bench.echo.fail_on.add(where))
    until(lambda: len(bench.errors) >= 2)
    bench.driver.call(bench.echo.fail_on.clear)
    beats = bench.echo.beats
    until(lambda: bench.echo.beats > beats + 2)
    assert bench.driver.running


@pytest.mark.parametrize("where", ["timer", "next_deadline"])
def test_when_nobody_steers_any_more_it_falls_silent(
    bench: Bench, where: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(driver_module, "GIVE_UP_S", 0.3)
    bench.echo.fail_on = {where}
    bench.driver.start()
    until(lambda: not bench.driver.running)
    assert isinstance(bench.errors[-1], DriverError)
    assert "autopilot's own failsafe" in str(bench.errors[-1])
    assert bench.echo.turns < 100  # it didn't spin meanwhile
    with pytest.raises(DriverError, match="not running"):
        bench.driver.call(lambda: 1)


def test_an_error_handler_that_fails_does_not_end_the_thread(bench: Bench) -> None:
    def fail(error: Exception) -> None:
        raise ZeroDivisionError from error

    bench.driver._on_error = fail
    bench.echo.fail_on = {"PING"}
    bench.driver.start()
    bench.say("PING")
    bench.say("ATTITUDE")
    until(lambda: bench.echo.received == ["ATTITUDE"])


def test_a_deadline_that_stays_in_the_past_does_not_spin(bench: Bench) -> None:
    bench.echo.stuck = True
    bench.driver.start()
    until(lambda: bench.echo.turns > 3)
    turns = bench.echo.turns
    threading.Event().wait(0.5)
    assert bench.echo.turns - turns < 50  # spinning would be tens of thousands


def test_timers_are_kept_in_a_flood(bench: Bench) -> None:
    bench.driver.start()
    until(lambda: bench.echo.beats > 0)
    stop = threading.Event()
    flood = b"".join(bench.codec.encode(make("ATTITUDE", roll=1.0, yaw=1.0)) for _ in range(200))

    def send() -> None:
        while not stop.is_set():
            bench.peer.send(flood)

    sender = threading.Thread(target=send)
    sender.start()
    try:
        beats, received = bench.echo.beats, len(bench.echo.received)
        until(lambda: bench.echo.beats > beats + 10)
        assert len(bench.echo.received) > received
    finally:
        stop.set()
        sender.join(LIMIT_S)


def test_both_directions_are_recorded(tmp_path: Path) -> None:
    path = tmp_path / "flight.tlog"
    bench = Bench(TlogWriter(path))
    bench.driver.start()
    unknown = bytes([0xFD, 2, 0, 0, 9, 1, 1, 0x31, 0xD4, 0, 1, 2, 0, 0])  # message 54321
    bench.say("COMMAND_LONG", command=400)
    bench.peer.send(unknown)
    until(lambda: "COMMAND_LONG" in bench.echo.received and bench.echo.beats > 2)
    bench.driver.stop()
    bench.peer.close()
    packets = [packet for _, packet in TlogReader(path)]
    assert unknown in packets
    reader = Codec(255, 190)
    recorded = [message for packet in packets for message in reader.decode(packet)]
    both = {(message.get_type(), message.get_srcComponent()) for message in recorded}
    assert both >= {("COMMAND_LONG", 1), ("COMMAND_ACK", 191), ("HEARTBEAT", 191)}


def test_a_disk_that_fails_does_not_end_the_flight() -> None:
    bench = Bench(TlogWriter("/dev/full"))
    bench.say("ATTITUDE")
    bench.driver.start()
    until(lambda: bench.echo.beats > 3)
    bench.driver.stop()
    bench.peer.close()
    assert [str(error) for error in bench.errors] == [
        "Recording to /dev/full has ended: No space left on device."
    ]


def test_it_can_be_stopped_from_anywhere_and_twice(bench: Bench) -> None:
    bench.driver.start()
    bench.driver.call(bench.driver.stop)
    until(lambda: not bench.driver.running)
    bench.driver.stop()
    bench.driver.post(lambda: bench.errors.append(ValueError()))  # dropped, without a word
    assert not bench.errors


def test_stopped_before_it_was_started(bench: Bench) -> None:
    bench.driver.stop()
    bench.driver.stop()


def test_those_who_wait_learn_that_it_has_stopped(bench: Bench) -> None:
    bench.driver.start()
    told: list[Exception] = []
    hold = threading.Event()

    def call() -> None:
        try:
            bench.driver.call(lambda: 1, LIMIT_S)
        except DriverError as error:
            told.append(error)

    bench.driver.post(lambda: hold.wait(LIMIT_S))
    bench.driver.post(bench.driver.stop)
    caller = threading.Thread(target=call)
    # After the stop in the mailbox: this turn's work still includes it or it is told the end.
    caller.start()
    until(lambda: len(bench.driver.works) >= 1)
    hold.set()
    caller.join(LIMIT_S)
    assert not caller.is_alive()


def test_an_application_that_hangs_is_named_when_stopping(bench: Bench) -> None:
    hold, hangs = threading.Event(), threading.Event()

    def hang() -> None:
        hangs.set()
        hold.wait(LIMIT_S)

    bench.driver.start()
    bench.driver.post(hang)
    assert hangs.wait(LIMIT_S)  # A driver that is stopped first drops what it was asked to do.
    with pytest.raises(DriverError, match=r"did not end within 0\.05 s"):
        bench.driver.stop(timeout_s=0.05)
    hold.set()


def test_a_tcp_link_that_comes_back_is_heard_again() -> None:
    """It comes back under the same file descriptor, which must not go unnoticed."""
    echo = Echo()
    listener = open_link("tcpin://127.0.0.1:0")
    port = listener.port
    link = open_link(f"tcpout://127.0.0.1:{port}")
    driver = Driver(echo, Router([link], lambda: Codec(1, 191)), MonotonicClock())
    codec = Codec(1, 1)
    driver.start()
    try:
        for turn in range(1, 4):
            until(lambda at=listener: bool(at.receive()))  # type: ignore[misc] # a beat came: it is connected
            listener.send(codec.encode(make("ATTITUDE")))
            until(lambda turn=turn: len(echo.received) == turn)  # type: ignore[misc]
            listener.close()
            listener = open_link(f"tcpin://127.0.0.1:{port}")
    finally:
        driver.stop()
        listener.close()


def test_a_vehicle_alone_is_an_application() -> None:
    application: Application = Vehicle()
    application.start(0.0)
    assert [message.get_type() for message in application.messages_to_send()] == ["HEARTBEAT"]


def test_what_a_station_link_brings_is_overheard_and_not_received() -> None:
    echo, errors = Echo(), list[Exception]()
    vehicles, stations = (open_link("udpin://127.0.0.1:0") for _ in range(2))
    driver = Driver(
        echo,
        Router([vehicles], lambda: Codec(1, 191), [stations]),
        MonotonicClock(),
        errors.append,
    )
    craft = open_link(f"udpout://127.0.0.1:{vehicles.port}")
    ground = open_link(f"udpout://127.0.0.1:{stations.port}")
    echo.fail_on.add("overhear")
    driver.start()
    try:
        ground.send(Codec(255, 190).encode(make("SET_MODE", target_system=1)))
        until(lambda: bool(errors))
        driver.call(echo.fail_on.clear)
        ground.send(Codec(255, 190).encode(make("SET_MODE", target_system=1)))
        craft.send(Codec(1, 1).encode(make("ATTITUDE")))
        until(lambda: echo.overheard == ["SET_MODE"] and echo.received == ["ATTITUDE"])
    finally:
        driver.stop()
        craft.close()
        ground.close()


class Hanging:
    """Works on a message for 2.6 s of its clock, and notes what the driver does then."""

    def __init__(self, clock: ManualClock) -> None:
        self.clock = clock
        self.calls: list[tuple[str, float]] = []
        self._due_s = 0.0

    def start(self, now: float) -> None:
        self._due_s = now

    def receive(self, message: Message, now: float) -> None:
        self.calls.append(("receive", now))
        self.clock.advance_to(now + 2.6)

    def overhear(self, message: Message, now: float) -> None:
        """Nothing comes."""

    def next_deadline(self) -> float | None:
        return self._due_s

    def handle_timer(self, now: float) -> None:
        self._due_s = now + 1.0
        self.calls.append(("timer", now))

    def messages_to_send(self) -> list[Message]:
        self.calls.append(("send", self.clock.now()))
        return []


def test_after_a_hang_in_its_own_turn_the_application_is_informed_before_anything_leaves() -> None:
    clock = ManualClock(10.0)
    hanging = Hanging(clock)
    link = open_link("udpin://127.0.0.1:0")
    assert isinstance(link, UdpLink)
    peer = open_link(f"udpout://127.0.0.1:{link.port}")
    driver = Driver(hanging, Router([link], lambda: Codec(1, 191)), clock)
    try:
        driver.start()
        peer.send(Codec(1, 1).encode(make("HEARTBEAT")))
        until(lambda: ("receive", 10.0) in hanging.calls)
        until(lambda: ("send", 12.6) in hanging.calls)
    finally:
        driver.stop()
        peer.close()
    at = hanging.calls.index(("receive", 10.0))
    after = hanging.calls[at + 1 : hanging.calls.index(("send", 12.6))]
    assert ("timer", 12.6) in after
