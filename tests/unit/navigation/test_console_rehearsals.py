"""Rehearsals of the console: one process for all pages, which may fail."""

from __future__ import annotations

import queue
import sys
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from drone_navigation.console.messages import PageWaypoint, Rehearse
from drone_navigation.console.rehearsing.rehearsals import Rehearsals
from tests.support.processes import patient_s

WAIT_S = patient_s(20.0)
HELLO = 'print(json.dumps({"server": ["arming"], "vehicle": {"Any": ["P"]}}), flush=True)'
OBEDIENT = f"""
import json, sys
{HELLO}
for line in sys.stdin:
    order = json.loads(line)
    flown = {{"accepted": order["speed"] > 0, "speed": order["speed"], "motion": order["motion"]}}
    print(json.dumps({{"number": order["number"], "rehearsal": flown}}), flush=True)
    print(json.dumps({{"number": order["number"], "lost": {{"mode": "RTL"}}}}), flush=True)
"""
MUTE = f"""
import json, sys
{HELLO}
for line in sys.stdin:
    pass
"""
DEADLY = f"""
import json, sys
{HELLO}
sys.stdin.readline()
"""


class Thread:
    """The work of the ROS thread for rehearsals, step by step."""

    def __init__(self, program: str) -> None:
        self._work: queue.SimpleQueue[Callable[[], None]] = queue.SimpleQueue()
        self.rehearsals = Rehearsals(self._work.put, (sys.executable, "-c", program))
        self.told: list[dict[str, Any]] = []

    def until(self, condition: Callable[[], bool]) -> None:
        while not condition():
            self._work.get(timeout=WAIT_S)()

    def begin(self, by: str, number: int, speed_m_s: float = 1.0) -> None:
        goal = PageWaypoint((1.0, 2.0, 3.0), 0.0)
        order = Rehearse("/", (goal,), speed_m_s, 1, False, 0.0, number)
        self.rehearsals.begin(by, order, {"motion": [0.0]}, self.told.append)


@pytest.fixture
def made() -> Iterator[Callable[[str], Thread]]:
    threads: list[Thread] = []

    def make(program: str) -> Thread:
        threads.append(Thread(program))
        return threads[-1]

    yield make
    for thread in threads:
        thread.rehearsals.close()


def test_the_results_reach_the_page_with_its_number(made: Callable[[str], Thread]) -> None:
    thread = made(OBEDIENT)
    thread.begin("page 1", 5)
    thread.until(lambda: len(thread.told) == 2)
    flown, lost = thread.told
    assert flown["number"] == lost["number"] == 5
    assert flown["type"] == "rehearsal"
    assert flown["rehearsal"]["motion"] == [0.0]
    assert lost["lost"]["mode"] == "RTL"
    assert thread.rehearsals.server_names == ("arming",)
    assert thread.rehearsals.vehicle_names("Any") == ("P",)
    assert thread.rehearsals.vehicle_names("Other") == ()


def test_pages_take_turns_and_a_newer_goal_of_a_page_counts(
    made: Callable[[str], Thread],
) -> None:
    thread = made(OBEDIENT)
    for number in (1, 2, 3):
        thread.begin("page 1", number)
        thread.begin("page 2", 10 * number, speed_m_s=0.0)
    thread.until(lambda: any(each["number"] == 30 for each in thread.told))
    assert {each["number"] for each in thread.told} == {3, 30}


def test_a_process_that_dies_is_reported_and_restarted(made: Callable[[str], Thread]) -> None:
    thread = made(DEADLY)
    for number in (1, 2):
        thread.begin("page 1", number)
        thread.until(lambda number=number: len(thread.told) == number)  # type: ignore[misc]
        assert "ended unexpectedly" in thread.told[-1]["error"]
        assert thread.told[-1]["number"] == number


def test_a_process_that_hangs_is_ended(made: Callable[[str], Thread]) -> None:
    thread = made(MUTE)
    thread.rehearsals.tick(100.0)
    thread.begin("page 1", 1)
    thread.rehearsals.tick(110.0)
    thread.begin("page 2", 2)
    thread.rehearsals.tick(121.0)
    thread.until(lambda: bool(thread.told))
    assert thread.told[0]["number"] == 1
    thread.rehearsals.tick(142.0)
    thread.until(lambda: len(thread.told) == 2)
    assert thread.told[1]["number"] == 2


def test_without_a_process_a_page_gets_an_answer_at_once() -> None:
    told: list[dict[str, Any]] = []
    rehearsals = Rehearsals(lambda work: work(), ("/no/such/program",))
    order = Rehearse("/", (PageWaypoint((1.0, 2.0, 3.0), 0.0),), 0.0, 1, False, 0.0, 1)
    rehearsals.begin("page 1", order, {}, told.append)
    assert "Flying does not need it" in told[0]["error"]
