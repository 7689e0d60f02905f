"""The trace of the driver's turns: what long ones are put down to."""

from __future__ import annotations

import gc
import threading
import time
from dataclasses import replace

from drone_navigation.server.lateness.lateness_trace import LONG_MS, PARTS, LatenessTrace, LongTurn
from mavlink_vehicle.codec import Codec, Message
from mavlink_vehicle.io.clock import MonotonicClock
from mavlink_vehicle.io.driver import Driver
from mavlink_vehicle.io.links import open_link
from mavlink_vehicle.io.router import Router
from navigation_bridge.fleet import FleetApplication, Member
from tests.support.processes import patient_s

LIMIT_S = patient_s(20.0)
WORK_S = 2e-3 * LONG_MS

TURN = LongTurn(60.0, 2.0, {"obstacles": 40.0, "step": 9.0}, 45.0, 0.0, 8.0, 5.0, True)


class Busy:
    """Works for a while at one timer, with a collection, and is quick at all others."""

    def __init__(self) -> None:
        self.timers = 0
        self.done = threading.Event()

    def start(self, now: float) -> None:
        pass

    def receive(self, message: Message, now: float) -> None:
        pass

    def overhear(self, message: Message, now: float) -> None:
        pass

    def handle_timer(self, now: float) -> None:
        self.timers += 1
        if self.timers > 6:
            self.done.set()
        if self.timers == 3:
            gc.collect()
            end_s = time.thread_time() + WORK_S
            while time.thread_time() < end_s:
                pass

    def next_deadline(self) -> float | None:
        return time.monotonic() + 0.001

    def messages_to_send(self) -> list[Message]:
        return []

    def fail(self, error: Exception, now: float) -> None:
        raise error

    def give_up(self, error: Exception) -> None:
        raise error


def test_a_turn_that_works_long_is_reported_with_its_part_and_its_collections() -> None:
    before = {
        (owner, name): getattr(owner, name) for some in PARTS.values() for owner, name in some
    }
    trace, busy = LatenessTrace(), Busy()
    with trace.installed():
        link = open_link("udpin://127.0.0.1:0", lambda _: None)
        fleet = FleetApplication([Member("busy", 0, busy)], MonotonicClock())
        driver = Driver(fleet, Router([link], lambda: Codec(1, 191)), MonotonicClock())
        fleet.attach(driver)
        trace.follow(driver)
        driver.start()
        assert busy.done.wait(LIMIT_S)
        driver.stop(LIMIT_S)
    after = {(owner, name): getattr(owner, name) for owner, name in before}
    assert after == before
    # On a busy machine others are long, too: this one is the one with that much work.
    long = [turn for turn in trace.turns() if turn.own_ms > 0.9e3 * WORK_S]
    assert len(long) == 1
    assert long[0].parts_ms["timer"] >= 0.9e3 * WORK_S
    assert long[0].collections_ms > 0.0
    assert not long[0].searching
    assert trace.turns() == []
    assert "above 20 ms" in trace.summary


def test_the_cause_is_the_longest_wait_or_the_part_that_worked_longest() -> None:
    assert TURN.cause == "obstacles"
    assert replace(TURN, collections_ms=51.0).cause == "collection"
    assert replace(TURN, processor_ms=51.0).cause == "processor"
    assert replace(TURN, threads_ms=51.0).cause == "other threads"
    assert replace(TURN, late_ms=51.0).cause == "woken late"
    assert TURN.sentence == (
        "Turn of 60.0 ms during a path search, cause obstacles: own work 45.0, collections 0.0, "
        "no processor 8.0, other threads 5.0, woken late 2.0; by part: obstacles 40.0, step 9.0"
    )
