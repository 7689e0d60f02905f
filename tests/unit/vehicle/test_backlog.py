"""Packets that have waited: the newest counts, and what must be kept is kept in order."""

from __future__ import annotations

import random
import threading
import time

import pytest

from mavlink_vehicle.codec import Codec, Message, make
from mavlink_vehicle.io.backlog import without_stale
from mavlink_vehicle.io.clock import MonotonicClock
from mavlink_vehicle.io.driver import Driver
from mavlink_vehicle.io.links import open_link
from mavlink_vehicle.io.links.udp import UdpLink
from mavlink_vehicle.io.router import Router
from mavlink_vehicle.protocols.known_vehicle import ModeOrder
from mavlink_vehicle.state.vehicle_state import DataAge
from tests.support.processes import patient_s

LIMIT_S = patient_s(20.0)
KEPT = ("HEARTBEAT", "COMMAND_ACK", "STATUSTEXT", "MISSION_REQUEST_INT", "PARAM_VALUE", "LOG_DATA")


def backlog(seconds: float, codec: Codec | None = None, rate_hz: int = 50) -> list[bytes]:
    """Return the frames that a vehicle sends in a time; every tenth is not telemetry."""
    codec = codec or Codec(1, 1)
    frames = []
    for index in range(round(seconds * rate_hz)):
        boot_ms = 60_000 + 1000 * index // rate_hz
        frames.append(codec.encode(make("GLOBAL_POSITION_INT", time_boot_ms=boot_ms, lat=1, lon=1)))
        frames.append(codec.encode(make("ATTITUDE", time_boot_ms=boot_ms)))
        if index % 5 == 0:
            kind = KEPT[index // 5 % len(KEPT)]
            frames.append(codec.encode(make(kind)))
    return frames


def decoded(frames: list[bytes]) -> list[Message]:
    codec = Codec(1, 191)
    return [message for frame in frames for message in codec.decode(frame)]


def test_of_what_waited_the_newest_telemetry_is_left_and_all_else_in_order() -> None:
    messages = decoded(backlog(6.0))
    kept = without_stale(messages)
    others = [m for m in messages if m.get_type() in KEPT]
    assert [m for m in kept if m.get_type() in KEPT] == others
    assert kept == sorted(kept, key=messages.index)
    for kind in ("GLOBAL_POSITION_INT", "ATTITUDE"):
        last = [m for m in messages if m.get_type() == kind][-1]
        assert kept[-1] is last or last in kept
    assert len(kept) < len(messages) / 4


def test_what_is_not_behind_is_kept_whole() -> None:
    messages = decoded(backlog(0.4))
    assert without_stale(messages) == messages


def test_a_sender_that_is_not_behind_loses_nothing_beside_one_that_is() -> None:
    behind, fresh = backlog(6.0), backlog(0.4, Codec(2, 1))
    kept = without_stale(decoded([*behind, *fresh]))
    assert len([m for m in kept if m.get_srcSystem() == 2]) == len(fresh)


def test_the_sequence_of_what_is_left_still_tells_the_order() -> None:
    """More than half the circle of numbers missing would make the next look old."""
    order = ModeOrder()
    messages = decoded(backlog(9.0))
    for message in without_stale(messages):
        before = order.last
        assert order.place(message._header.seq, 50.0) > before or before == -1
    assert order.last == messages[0]._header.seq + len(messages) - 1


class Listener:
    """Keeps what it receives."""

    def __init__(self) -> None:
        self.received: list[Message] = []

    def start(self, now: float) -> None:
        """Nothing to do."""

    def receive(self, message: Message, now: float) -> None:
        self.received.append(message)

    def overhear(self, message: Message, now: float) -> None:
        """Nothing to do."""

    def handle_timer(self, now: float) -> None:
        """Nothing to do."""

    def next_deadline(self) -> float | None:
        return None

    def messages_to_send(self) -> list[Message]:
        return []


def test_a_driver_that_did_not_run_begins_with_the_newest() -> None:
    link = open_link("udpin://127.0.0.1:0")
    assert isinstance(link, UdpLink)
    peer = open_link(f"udpout://127.0.0.1:{link.port}")
    frames = backlog(3.0)
    for frame in frames:
        assert peer.send(frame)
    end = Codec(1, 1).encode(make("SYSTEM_TIME", time_boot_ms=70_000))
    assert peer.send(end)
    listener = Listener()
    driver = Driver(listener, Router([link], lambda: Codec(1, 191)), MonotonicClock())
    driver.start()
    try:
        limit_s = time.monotonic() + LIMIT_S
        while not any(m.get_type() == "SYSTEM_TIME" for m in list(listener.received)):
            assert time.monotonic() < limit_s
            threading.Event().wait(0.002)
    finally:
        driver.stop()
        peer.close()
    positions = [m for m in listener.received if m.get_type() == "GLOBAL_POSITION_INT"]
    assert positions[-1].time_boot_ms == 62_980
    assert len(positions) < 10, "stale positions were processed one after the other"
    sent = [m.get_type() for m in decoded(frames) if m.get_type() in KEPT]
    assert [m.get_type() for m in listener.received if m.get_type() in KEPT] == sent


class Clocks:
    """A vehicle's clock against ours, and answers to TIMESYNC every two seconds."""

    def __init__(self, rate: float = 1.0, boot_ms: int = 10_000, link_s: float = 0.01) -> None:
        self.age = DataAge()
        self.rate, self.link_s = rate, link_s
        self._boot_ms, self.now = boot_ms, 100.0
        self.boot_count = 0

    def boot_ms(self, at_s: float) -> int:
        return round(self._boot_ms + 1e3 * self.rate * (at_s - 100.0)) % (1 << 32)

    def answer(self, waited_s: float = 0.0) -> None:
        """An answer is read that has waited in a buffer; telemetry at 20 Hz came before it."""
        sent_s = self.now - self.link_s - waited_s
        told = self.boot_ms(sent_s - 0.02)
        ns = self.boot_ms(sent_s) * 1_000_000
        trip_s = 2.0 * self.link_s + waited_s
        self.age.answered(trip_s, ns, told, self.boot_count, self.now)

    def run(self, seconds: float) -> None:
        for _ in range(round(seconds / 2.0)):
            self.now += 2.0
            self.answer()

    def read(self, waited_s: float) -> float:
        """Return the report about a sample that has waited for some time; 0 while unknown."""
        sample_ms = self.boot_ms(self.now - self.link_s - waited_s)
        return self.age.age_s(sample_ms, self.boot_count, self.now) or 0.0


@pytest.mark.parametrize("link_s", [0.005, 0.5])
@pytest.mark.parametrize("rate", [0.1, 0.5, 0.993, 1.0, 1.007, 4.0, 20.0])
def test_the_age_is_told_whatever_the_clocks_rate(rate: float, link_s: float) -> None:
    clocks = Clocks(rate, link_s=link_s)
    clocks.run(20.0)
    for waited_s in (0.0, 0.3, 2.0, 8.0):
        assert clocks.read(waited_s) == pytest.approx(waited_s, abs=0.1)
    clocks.now += 1.9
    assert clocks.read(0.0) < 0.1


def test_a_starved_server_knows_for_as_long_as_it_is_starved() -> None:
    clocks = Clocks(0.993)
    clocks.run(10.0)
    for second in range(60):
        clocks.now += 1.0
        if second % 2:
            clocks.answer(waited_s=5.0)
        assert clocks.read(5.0) == pytest.approx(5.0, abs=0.6)


def test_an_end_of_the_counter_and_a_restart_are_no_age() -> None:
    clocks = Clocks(boot_ms=(1 << 32) - 5_000)
    clocks.run(20.0)
    assert clocks.read(0.0) < 0.05
    assert clocks.read(3.0) == pytest.approx(3.0, abs=0.1)
    restarted = Clocks()
    restarted.run(20.0)
    restarted.boot_count = 1
    assert restarted.age.age_s(500, 1, restarted.now) is None
    assert restarted.age.age_s(None, 0, restarted.now) is None


def test_a_clock_from_elsewhere_and_a_jittery_link_do_no_harm() -> None:
    random_ = random.Random(1)
    clocks = Clocks(link_s=0.1)
    for _ in range(100):
        clocks.now += 2.0
        clocks.answer(waited_s=random_.uniform(0.0, 0.4))
        assert clocks.read(random_.uniform(0.0, 0.05)) < 0.25
    elsewhere = DataAge()
    for step in range(10):
        now = 100.0 + 2.0 * step
        elsewhere.answered(0.01, 1_700_000_000_000_000_000 + step, 2000 * step, 0, now)
    assert elsewhere.age_s(2000 * 9 - 3000, 0, 118.0) == pytest.approx(3.0, abs=0.05)
    assert elsewhere.age_s(0, 0, 118.0) == pytest.approx(18.0, abs=0.1)


def test_a_clock_that_is_set_makes_no_old_data() -> None:
    """The age is unknown until the new clock was compared with ours."""
    clocks = Clocks()
    clocks.run(20.0)
    clocks.age.answered(0.02, 900_000_000_000, 900_000, 1, clocks.now)
    assert clocks.age.age_s(clocks.boot_ms(clocks.now), 1, clocks.now) is None


def test_a_clock_that_stands_says_nothing_of_an_age() -> None:
    clocks = Clocks(rate=0.0)
    clocks.run(20.0)
    assert clocks.age.age_s(10_000, 0, clocks.now) is None
    assert not clocks.age.keeps_our_time
    assert DataAge().keeps_our_time


@pytest.mark.parametrize(
    ("rate", "keeps"), [(0.1, False), (0.993, True), (1.05, True), (20, False)]
)
def test_a_simulator_that_does_not_keep_our_time_is_known(rate: float, keeps: bool) -> None:
    clocks = Clocks(rate)
    clocks.run(20.0)
    assert clocks.age.keeps_our_time is keeps


def test_without_answers_nothing_is_said() -> None:
    assert DataAge().age_s(5_000, 0, 1_000.0) is None
