"""A trace of the driver's long turns with their causes: ``navigation_server --trace-lateness``.

A turn is what the driver thread does between two waits. Its time is split in two ways: by the part
of the server that it passed in, and by what the thread got of the computer: its own work, garbage
collections, waiting for a processor, and waiting for other threads of the server, since Python runs
one at a time. The methods of :data:`PARTS` are replaced by timed ones, which costs some
microseconds for each call; without the trace nothing is measured.
"""

from __future__ import annotations

import functools
import gc
import threading
import time
from collections import Counter, deque
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from drone_navigation.server.vehicle_outputs import VehicleOutputs
from mavlink_vehicle.io.driver import Driver
from mavlink_vehicle.io.router import Router
from navigation_bridge.engine import Engine
from navigation_bridge.fleet import FleetApplication
from navigation_bridge.obstacles.obstacle_feed import ObstacleFeed
from navigation_bridge.requests.feature import Features
from navigation_bridge.search_thread import SearchThread

LONG_MS = 20.0
"""Turns above this are reported."""

PARTS: Mapping[str, tuple[tuple[type, str], ...]] = {
    "receive": ((Router, "receive"), (Router, "overhear"), (Driver, "_hand_over")),
    "requests": ((Driver, "do_next"),),
    "obstacles": tuple(
        (ObstacleFeed, name) for name in ("take_ranges", "take_scan", "take_points", "look")
    ),
    "timer": ((FleetApplication, "handle_timer"),),
    "step": ((Engine, "turn"),),
    "plan": ((Engine, "_replan"),),
    "features": ((Features, "update"),),
    "publish": ((VehicleOutputs, "update"), (VehicleOutputs, "put_out")),
    "send": ((Driver, "_flush"),),
}
"""The methods of each part. Time in a part that another one calls counts for the inner one."""

_REST = "rest"
_KEPT = 1000
_NS = 1e-6


@dataclass(frozen=True)
class LongTurn:
    """One turn above :data:`LONG_MS`, in ms.

    Attributes:
        whole_ms: from the end of a wait to the next one, and what the end of the wait was late.
        late_ms: how much later than asked for the wait ended.
        parts_ms: by part.
        own_ms: processor time of the driver thread, without collections.
        collections_ms: garbage collections, in any thread.
        processor_ms: the driver thread was ready and had no processor.
        threads_ms: the rest of the turn: other threads of the server ran, or a system call waited.
        searching: whether a path was being searched for.
    """

    whole_ms: float
    late_ms: float
    parts_ms: Mapping[str, float]
    own_ms: float
    collections_ms: float
    processor_ms: float
    threads_ms: float
    searching: bool

    @property
    def cause(self) -> str:
        """The part that took most, if the thread's own work did; otherwise what it waited for."""
        causes = {
            "collection": self.collections_ms,
            "processor": self.processor_ms,
            "other threads": self.threads_ms,
            "woken late": self.late_ms,
            "": self.own_ms,
        }
        longest = max(causes, key=causes.__getitem__)
        return longest or max(self.parts_ms, key=self.parts_ms.__getitem__, default=_REST)

    @property
    def sentence(self) -> str:
        """The turn as one line."""
        parts = ", ".join(
            f"{part} {ms:.1f}"
            for part, ms in sorted(self.parts_ms.items(), key=lambda item: -item[1])
            if ms >= 0.1
        )
        search = " during a path search" if self.searching else ""
        return (
            f"Turn of {self.whole_ms:.1f} ms{search}, cause {self.cause}: own work "
            f"{self.own_ms:.1f}, collections {self.collections_ms:.1f}, no processor "
            f"{self.processor_ms:.1f}, other threads {self.threads_ms:.1f}, woken late "
            f"{self.late_ms:.1f}; by part: {parts}"
        )


class LatenessTrace:
    """Times the turns of a driver; :meth:`installed` comes before the server is made."""

    def __init__(self) -> None:
        """Begin without a turn."""
        self._long: deque[LongTurn] = deque(maxlen=_KEPT)
        self._causes: Counter[str] = Counter()
        self._turns = 0
        self._longest_ms = 0.0
        self._thread: int | None = None
        self._stack: list[str] = []
        self._parts_ns: Counter[str] = Counter()
        self._since_ns = 0
        self._collections_ns = self._own_collections_ns = self._collection_began_ns = 0
        self._collection_began_own_ns = 0
        self._searches = 0
        self._searched = False
        self._schedule: Path | None = None

    @contextmanager
    def installed(self) -> Iterator[LatenessTrace]:
        """Replace the methods of the parts by timed ones, for a while."""
        replaced: list[tuple[type, str, Callable[..., Any]]] = []
        for part, methods in PARTS.items():
            for owner, name in methods:
                replaced.append((owner, name, getattr(owner, name)))
                setattr(owner, name, self._timed(part, getattr(owner, name)))
        replaced.append((SearchThread, "begin", SearchThread.begin))
        SearchThread.begin = self._noticed(SearchThread.begin)  # type: ignore[method-assign]
        gc.callbacks.append(self._collected)
        try:
            yield self
        finally:
            gc.callbacks.remove(self._collected)
            for owner, name, method in replaced:
                setattr(owner, name, method)

    def follow(self, driver: Driver) -> None:
        """Time the turns of a driver that has not been started."""
        driver.wait = self._around(driver.wait)

    def turns(self) -> list[LongTurn]:
        """Return and forget the long turns since the last call."""
        return [self._long.popleft() for _ in range(len(self._long))]

    @property
    def summary(self) -> str:
        """All turns in one sentence."""
        causes = ", ".join(f"{cause} {count}" for cause, count in self._causes.most_common())
        return (
            f"{self._turns} turns, {self._causes.total()} above {LONG_MS:g} ms, the longest of "
            f"{self._longest_ms:.1f} ms; {gc.get_freeze_count()} objects frozen"
            + (f"; causes: {causes}" if causes else "")
        )

    # --- on the driver's thread ------------------------------------------------------------

    def _around(self, wait: Callable[[float], object]) -> Callable[[float], object]:
        """Return a wait that ends one turn and begins the next."""
        began_ns = own_ns = ready_ns = late_ns = 0

        def timed(wait_ms: float) -> object:
            nonlocal began_ns, own_ns, ready_ns, late_ns
            now_ns = time.perf_counter_ns()
            if self._thread is None:
                self._thread = threading.get_ident()
                self._schedule = Path(f"/proc/self/task/{threading.get_native_id()}/schedstat")
            else:
                self._end(
                    now_ns - began_ns,
                    time.thread_time_ns() - own_ns,
                    self._ready_ns() - ready_ns,
                    late_ns,
                )
            ready_ns = self._ready_ns()
            asked_ns = time.perf_counter_ns()
            found = wait(wait_ms)
            began_ns = self._since_ns = time.perf_counter_ns()
            own_ns = time.thread_time_ns()
            # Where something came before the time was over, only the scheduler knows since when.
            over_ns = began_ns - asked_ns - int(wait_ms * 1e6)
            delay_ns = self._ready_ns() - ready_ns
            late_ns = max(0, delay_ns if found else max(over_ns, delay_ns))
            ready_ns += delay_ns
            self._collections_ns = self._own_collections_ns = 0
            self._searched = self._searches > 0
            return found

        return timed

    def _end(self, whole_ns: int, own_ns: int, processor_ns: int, late_ns: int) -> None:
        self._turns += 1
        if self._stack:
            self._stack.clear()
        whole_ms = (whole_ns + late_ns) * _NS
        self._longest_ms = max(self._longest_ms, whole_ms)
        if whole_ms > LONG_MS:
            own_ns = max(own_ns - self._own_collections_ns, 0)
            left_ns = whole_ns - own_ns - self._collections_ns - processor_ns
            parts_ms = {part: spent_ns * _NS for part, spent_ns in self._parts_ns.items()}
            parts_ms[_REST] = max(whole_ns * _NS - sum(parts_ms.values()), 0.0)
            turn = LongTurn(
                whole_ms,
                late_ns * _NS,
                parts_ms,
                own_ns * _NS,
                self._collections_ns * _NS,
                processor_ns * _NS,
                max(left_ns, 0) * _NS,
                self._searched or self._searches > 0,
            )
            self._causes[turn.cause] += 1
            self._long.append(turn)
        self._parts_ns.clear()

    def _ready_ns(self) -> int:
        """Return for how long the thread was ready without a processor; 0 where unknown."""
        assert self._schedule is not None
        try:
            return int(self._schedule.read_bytes().split()[1])
        except (OSError, IndexError):
            return 0

    def _timed(self, part: str, method: Callable[..., Any]) -> Callable[..., Any]:
        @functools.wraps(method)
        def timed(*args: Any, **named: Any) -> Any:
            if threading.get_ident() != self._thread:
                return method(*args, **named)
            self._enter(part)
            try:
                return method(*args, **named)
            finally:
                self._leave()

        return timed

    def _enter(self, part: str) -> None:
        self._spend()
        self._stack.append(part)

    def _leave(self) -> None:
        self._spend()
        self._stack.pop()

    def _spend(self) -> None:
        """Count the time since the last change of part."""
        now_ns = time.perf_counter_ns()
        if self._stack:
            self._parts_ns[self._stack[-1]] += now_ns - self._since_ns
        self._since_ns = now_ns

    # --- on any thread ---------------------------------------------------------------------

    def _collected(self, phase: str, _about: dict[str, Any]) -> None:
        """Count a garbage collection; every thread waits for it."""
        if phase == "start":
            self._collection_began_ns = time.perf_counter_ns()
            self._collection_began_own_ns = time.thread_time_ns()
            return
        self._collections_ns += time.perf_counter_ns() - self._collection_began_ns
        if threading.get_ident() == self._thread:
            self._own_collections_ns += time.thread_time_ns() - self._collection_began_own_ns

    def _noticed(self, begin: Callable[..., Any]) -> Callable[..., Any]:
        """Return a method that begins searches which this trace knows to run."""

        @functools.wraps(begin)
        def noticed(searches: SearchThread, work: Callable[..., Any]) -> Any:
            def counted(is_wanted: Callable[[], bool]) -> Any:
                self._searches += 1
                self._searched = True
                try:
                    return work(is_wanted)
                finally:
                    self._searches -= 1

            return begin(searches, counted)

        return noticed
