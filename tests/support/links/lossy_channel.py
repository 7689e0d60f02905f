"""A channel whose every packet has a fate drawn by hypothesis: lost, late, doubled."""

from __future__ import annotations

import heapq
import itertools
from collections.abc import Sequence
from typing import Generic, TypeVar

from hypothesis import strategies as st

ItemT = TypeVar("ItemT")

Fate = tuple[float, ...]
"""The delays in seconds after which copies arrive; none means lost."""

_DELAYS_S = st.sampled_from([0.0, 0.01, 0.2, 0.5, 1.0])
FATES: st.SearchStrategy[list[Fate]] = st.lists(
    st.lists(_DELAYS_S, max_size=3).map(tuple), min_size=1, max_size=24
)


class LossyChannel(Generic[ItemT]):
    """One direction; the fates repeat when they are used up."""

    def __init__(self, fates: Sequence[Fate]) -> None:
        self._fates = itertools.cycle(fates)
        self._queue: list[tuple[float, int, ItemT]] = []
        self._count = itertools.count()

    def push(self, item: ItemT, now: float) -> None:
        for delay_s in next(self._fates):
            heapq.heappush(self._queue, (now + delay_s, next(self._count), item))

    def pop(self, now: float) -> list[ItemT]:
        items = []
        while self._queue and self._queue[0][0] <= now:
            items.append(heapq.heappop(self._queue)[2])
        return items

    @property
    def next_arrival(self) -> float | None:
        return self._queue[0][0] if self._queue else None
