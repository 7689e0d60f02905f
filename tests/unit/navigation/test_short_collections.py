"""Garbage collections of a server that flies: what they walk through, and what is freed."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from tests.support.processes import HANGS_AFTER_S

ROOT = Path(__file__).resolve().parents[3]

# A process of its own: the garbage collector is one for all tests.
READY = """
import gc, json, weakref
import drone_navigation.navigation_server
from drone_navigation.server.lateness.short_collections import ShortCollections
collections = ShortCollections()
class Node:
    pass
"""

ALLOCATES_MUCH = (
    READY
    + """
walked = []
if {settled}:
    collections.settle()
gc.callbacks.insert(
    0,
    lambda phase, about: (phase, about["generation"]) == ("start", 2)
    and walked.append(len(gc.get_objects())),
)
kept = [[number] for number in range(400_000)]
print(json.dumps([gc.get_freeze_count(), walked]))
"""
)

GARBAGE = (
    READY
    + """
collections.settle()
def survives_and_is_dropped():
    ring = [Node() for _ in range(20_000)]
    for number, node in enumerate(ring):
        node.next = ring[number - 1]
    gc.collect()  # it survives, and is frozen
    return weakref.ref(ring[0])
found = []
seen = survives_and_is_dropped()
gc.collect()
for at_rest in (False, True):
    collections.tend(at_rest)
    found.append(seen() is not None)
collections.settle()
thresholds = gc.get_threshold()
collections.close()
print(json.dumps([found, gc.get_freeze_count(), thresholds != gc.get_threshold()]))
"""
)


BEGUN_IN_FLIGHT = (
    READY
    + """
class Ring:
    def __init__(self):
        self.itself = self
ring, walked, found = Ring(), [], []
seen = weakref.ref(ring)
del ring
gc.callbacks.insert(
    0,
    lambda phase, about: (phase, about["generation"]) == ("start", 2) and walked.append(1),
)
collections.begin(at_rest=False)
frozen, begun = gc.get_freeze_count(), len(walked)
for at_rest in (False, True):
    collections.tend(at_rest)
    found.append([len(walked) > begun, seen() is not None])
print(json.dumps([begun, frozen, found]))
"""
)

COUNTED = (
    READY
    + """
collections.settle()
count, counted = gc.get_freeze_count, []
gc.get_freeze_count = lambda: counted.append(1) or count()
kept = []
def looks(at_rest):
    counted.clear()
    for _ in range(5):
        kept.append([Node() for _ in range(6_000)])
        gc.collect()  # they survive, and are frozen
        collections.tend(at_rest)
    return len(counted)
print(json.dumps([looks(at_rest=False), looks(at_rest=True)]))
"""
)


def printed(statements: str) -> Any:
    done = subprocess.run(
        [sys.executable, "-c", statements],
        cwd=ROOT,
        check=True,
        capture_output=True,
        text=True,
        timeout=HANGS_AFTER_S,
    )
    return json.loads(done.stdout)


@pytest.mark.skipif(
    sys.version_info >= (3, 14), reason="Python 3.14 collects the oldest generation in increments"
)
def test_no_collection_walks_through_more_than_what_is_new_however_much_is_allocated() -> None:
    frozen, walked = printed(ALLOCATES_MUCH.format(settled=True))
    assert frozen > 300_000
    assert walked
    assert max(walked) < 40_000
    _, walked = printed(ALLOCATES_MUCH.format(settled=False))
    assert max(walked) > 100_000  # so the figure above is due to the freezing


def test_a_goal_that_has_begun_before_the_server_is_ready_is_not_held_up_by_a_collection() -> None:
    begun, frozen, (in_flight, at_rest) = printed(BEGUN_IN_FLIGHT)
    assert begun == 0
    assert frozen > 10_000
    assert in_flight == [False, True]
    assert at_rest == [True, False]


def test_frozen_garbage_is_freed_at_rest_and_not_in_flight() -> None:
    (in_flight, at_rest), frozen, reset = printed(GARBAGE)
    assert in_flight
    assert not at_rest
    assert frozen == 0
    assert reset


def test_all_that_is_frozen_is_not_counted_at_each_look_in_flight() -> None:
    in_flight, at_rest = printed(COUNTED)
    assert in_flight == 0
    assert at_rest > 0  # so the count above sees what is counted
