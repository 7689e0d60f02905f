"""Keeps Python's garbage collections short while vehicles fly.

A collection of the oldest generation walks through every object that may be part of a cycle, on
whichever thread happens to allocate, while all other threads wait: 51 ms with the 96,000 objects
that a server has once it is ready. So these objects are frozen: collections pass them by. What
survives a collection of the oldest generation later is frozen, too, so that the next one walks only
through what came in between. Frozen garbage is collected when nothing flies.
"""

from __future__ import annotations

import gc
from typing import Any

# The oldest generation is collected after two of the middle one instead of ten: at most some
# 20,000 objects are new by then, which take 10 ms.
_THRESHOLDS = (700, 10, 2)
# As many more frozen objects are worth a collection at rest, and make one necessary in flight.
_SOME, _MOST = 10_000, 200_000
# This number of collections may add the most. To count walks through all that is frozen, 14 ms with
# 20 vehicles, in which no other thread runs.
_COLLECTIONS_WITHIN_MOST = 10


class ShortCollections:
    """Freezes what survives collections, and collects all while the vehicles are at rest."""

    def __init__(self) -> None:
        """Leave Python's collections as they are until :meth:`begin`."""
        self._settled = 0
        self._uncounted = 0
        self._before = gc.get_threshold()

    def begin(self, at_rest: bool) -> None:
        """Freeze what is there, and first collect the garbage in it if the vehicles are at rest.

        Args:
            at_rest: whether no vehicle is armed or has a goal. Otherwise :meth:`tend` collects
                once they are.
        """
        if at_rest:
            self.settle()
        else:
            self._shorten()
            gc.freeze()
            self._uncounted += 1

    def settle(self) -> None:
        """Collect all garbage, which takes 0.1 s, and freeze the rest; the vehicles are at rest."""
        self._shorten()
        gc.unfreeze()
        gc.collect()
        # Python waits with the next one until a quarter of what this one found has been added.
        gc.collect()
        self._settled, self._uncounted = gc.get_freeze_count(), 0

    def tend(self, at_rest: bool) -> None:
        """Collect frozen garbage if there may be much; call periodically.

        Args:
            at_rest: whether no vehicle is armed or has a goal.
        """
        if self._uncounted < (1 if at_rest else _COLLECTIONS_WITHIN_MOST):
            return
        grown = gc.get_freeze_count() - self._settled
        if grown > (_SOME if at_rest else _MOST):
            self.settle()
        else:
            self._uncounted = 1 if grown > _SOME else 0  # 1: for when they are at rest

    def close(self) -> None:
        """Let Python collect as before."""
        if self._collected in gc.callbacks:
            gc.callbacks.remove(self._collected)
            gc.set_threshold(*self._before)
            gc.unfreeze()

    def _shorten(self) -> None:
        if self._collected not in gc.callbacks:
            gc.set_threshold(*_THRESHOLDS)
            gc.callbacks.append(self._collected)

    def _collected(self, phase: str, about: dict[str, Any]) -> None:
        if phase == "stop" and about["generation"] == 2:
            gc.freeze()
            self._uncounted += 1
