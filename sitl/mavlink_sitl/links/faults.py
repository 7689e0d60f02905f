"""A bad radio link: loss, delay, duplication, reordering. Seeded, sans-IO."""

from __future__ import annotations

import heapq
import math
import random
from dataclasses import dataclass


@dataclass(frozen=True)
class LinkFaults:
    """The faults of a link; the same in both directions.

    Attributes:
        loss: share of datagrams that are lost, 0..1.
        duplicate: share of datagrams that arrive twice, 0..1.
        delay_s: how late every datagram is.
        corrupt: share of datagrams that arrive with a byte changed, 0..1.
        jitter_s: up to how much later still, evenly distributed; this is what reorders.
    """

    loss: float = 0.0
    duplicate: float = 0.0
    delay_s: float = 0.0
    jitter_s: float = 0.0
    corrupt: float = 0.0

    def __post_init__(self) -> None:
        """Check the ranges."""
        for name in ("loss", "duplicate", "corrupt"):
            value = getattr(self, name)
            if not 0.0 <= value <= 1.0:
                raise ValueError(f"{name} must be between 0 and 1, not {value}")
        for name in ("delay_s", "jitter_s"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= 0.0):
                raise ValueError(f"{name} must be a time of 0 or more, not {value}")


class FaultyPipe:
    """One direction of a link: datagrams go in, and come out later, or not.

    Args:
        seed: two pipes with the same seed and input do the same.
    """

    def __init__(self, faults: LinkFaults, seed: str) -> None:
        self.faults = faults
        self._random = random.Random(seed)
        self._bad_random = random.Random(f"{seed}:corrupt")
        self._queue: list[tuple[int, int, bytes]] = []
        self._count = 0

    def push(self, data: bytes, now_us: int) -> None:
        """A datagram enters."""
        faults = self.faults
        # Always the same number of draws, so that a changed rate does not change the rest.
        lost, twice, late, later = (self._random.random() for _ in range(4))
        if lost < faults.loss:
            return
        for fraction in (late, later)[: 2 if twice < faults.duplicate else 1]:
            delay_us = round((faults.delay_s + faults.jitter_s * fraction) * 1e6)
            self._count += 1
            arriving = self._bent(data) if faults.corrupt else data
            heapq.heappush(self._queue, (now_us + delay_us, self._count, arriving))

    def _bent(self, data: bytes) -> bytes:
        if not data or self._bad_random.random() >= self.faults.corrupt:
            return data
        place = self._bad_random.randrange(len(data))
        changed = data[place] ^ self._bad_random.randrange(1, 256)
        return data[:place] + bytes([changed]) + data[place + 1 :]

    def pop(self, now_us: int) -> list[bytes]:
        """The datagrams that have arrived by now, in the order of their arrival."""
        arrived = []
        while self._queue and self._queue[0][0] <= now_us:
            arrived.append(heapq.heappop(self._queue)[2])
        return arrived
