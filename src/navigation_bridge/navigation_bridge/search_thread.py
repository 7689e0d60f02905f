"""Thread for path searches, so that the driver thread never waits for one. No ROS.

Python runs one thread at a time, and switches within the switch interval, so a setpoint that is due
during a search is sent within a few milliseconds. docs/adr/0010 compares this with a separate
process.
"""

from __future__ import annotations

import importlib
import sys
import threading
import time
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from functools import partial
from typing import Generic, TypeVar

from navigation_core.searches import IsWanted, Search

__all__ = ["LEAD_MAX_S", "SearchThread"]

ResultT = TypeVar("ResultT")

SWITCH_INTERVAL_S = 0.001
"""Time after which a search yields to the driver thread, if that has work."""

# The parts of SciPy in use, by searches only: the driver thread would wait until they are loaded.
_LOADED_BEFOREHAND = ("scipy.sparse.csgraph", "scipy.spatial", "scipy.ndimage")

# Lead time of a path's start: slightly more than the last searches took.
_LEAD_MIN_S, LEAD_MAX_S, _LEAD_FACTOR, _REMEMBERED = 0.1, 0.6, 1.3, 5


class _ThreadSearch(Generic[ResultT]):
    def __init__(self, future: Future[ResultT], abandoned: threading.Event) -> None:
        self._future = future
        self._abandoned = abandoned

    def result(self) -> ResultT | None:
        return self._future.result() if self._future.done() else None

    def abandon(self) -> None:
        self._abandoned.set()
        self._future.cancel()


class SearchThread:
    """Runs the searches of all vehicles of a server, one at a time.

    Attributes:
        is_warm: whether `warm_up` was called.
    """

    def __init__(self) -> None:
        """Prepare; the thread starts with its first work."""
        self._pool = ThreadPoolExecutor(1, thread_name_prefix="path-search")
        self._took_s: deque[float] = deque(maxlen=_REMEMBERED)
        self.is_warm = False
        sys.setswitchinterval(SWITCH_INTERVAL_S)

    def warm_up(self, then: Callable[[], object] = lambda: None) -> None:
        """Load SciPy beside the flight, before the first search.

        It takes half a second and 35 MB, so the server does not load it to get ready. Call this
        when the server is ready and there is something to avoid, best before a vehicle is under
        control. The driver thread gets its turns meanwhile, as during a search. A goal that avoids
        obstacles does not move before: its search waits here.

        Args:
            then: called in the thread once it is loaded.
        """
        self.is_warm = True
        for name in _LOADED_BEFOREHAND:
            self.run(partial(importlib.import_module, name))
        self.run(then)

    def run(self, work: Callable[[], object]) -> None:
        """Have the thread do something beside searches."""
        self._pool.submit(work)

    @property
    def lead_s(self) -> float:
        """Expected duration of a search."""
        longest_s = max(self._took_s, default=0.0)
        return min(max(_LEAD_FACTOR * longest_s, _LEAD_MIN_S), LEAD_MAX_S)

    def begin(self, work: Callable[[IsWanted], ResultT]) -> Search[ResultT]:
        """Start a search."""
        abandoned = threading.Event()
        asked_s = time.monotonic()

        def run() -> ResultT:
            try:
                return work(lambda: not abandoned.is_set())
            finally:
                self._took_s.append(time.monotonic() - asked_s)

        return _ThreadSearch(self._pool.submit(run), abandoned)

    def close(self) -> None:
        """Start no more searches; a running one ends by itself."""
        self._pool.shutdown(wait=False, cancel_futures=True)
