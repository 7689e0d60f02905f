"""Pull a way tight: fewer corners, and each as near to the direct line as is clear."""

from __future__ import annotations

import numpy as np

from navigation_core.obstacles import Array, Obstacles
from navigation_core.ways import cost_m

__all__ = ["pulled_tight"]

_ROUNDS = 6
# How far a corner is drawn towards the line between its neighbours, as shares.
_SHARES = np.array([1.0, 0.7, 0.45, 0.25, 0.12, 0.05, 0.02])
# A corner that can't be drawn by more than this stays.
_TINY_M = 0.005
_POINTS_MAX = 64


def pulled_tight(way: Array, obstacles: Obstacles, clearance_m: float) -> Array:
    """Return a shorter way on the same side of each obstacle, or on a better one.

    Args:
        way: points, shape (N, 3); its lines are clear.
        obstacles: all that count.
        clearance_m: that each line keeps.
    """
    low, high = way.min(axis=0), way.max(axis=0)
    nearby = obstacles.near(tuple(low), tuple(high), clearance_m)
    way = _skipped(way, nearby, clearance_m)
    for _ in range(_ROUNDS):
        if len(way) == 2:
            break
        drawn = _drawn(way, nearby, clearance_m)
        shorter = _skipped(drawn, nearby, clearance_m)
        before, after = (float(cost_m(np.diff(w, axis=0)).sum()) for w in (way, shorter))
        way = shorter
        if before - after < 0.001 * before:
            break
    return way


def _skipped(way: Array, obstacles: Obstacles, clearance_m: float) -> Array:
    """Leave out points, from either end, as far as lines are clear; the shorter result."""
    if len(way) == 2:
        return way
    ways = (
        _skipped_forward(way, obstacles, clearance_m),
        _skipped_forward(way[::-1], obstacles, clearance_m)[::-1],
    )
    return min(ways, key=lambda w: float(cost_m(np.diff(w, axis=0)).sum()))


def _skipped_forward(way: Array, obstacles: Obstacles, clearance_m: float) -> Array:
    kept, here = [0], 0
    while here < len(way) - 1:
        there = np.arange(here + 2, min(len(way), here + _POINTS_MAX))
        starts = np.broadcast_to(way[here], (len(there), 3))
        clear = np.flatnonzero(obstacles.are_clear(starts, way[there], clearance_m))
        here = int(there[clear[-1]]) if len(clear) else here + 1
        kept.append(here)
    return way[kept]


def _drawn(way: Array, obstacles: Obstacles, clearance_m: float) -> Array:
    """Draw each corner towards the line between its neighbours, every second one at a time."""
    way = way.copy()
    for first in (1, 2):
        corners = np.arange(first, len(way) - 1, 2)
        if not len(corners):
            continue
        before, corner, after = way[corners - 1], way[corners], way[corners + 1]
        chord = after - before
        length2 = np.maximum((chord * chord).sum(axis=1), 1e-12)
        share = np.clip(((corner - before) * chord).sum(axis=1) / length2, 0.0, 1.0)
        step = before + share[:, None] * chord - corner
        candidates = corner[:, None] + _SHARES[:, None] * step[:, None]
        flat = candidates.reshape(-1, 3)
        times = len(_SHARES)
        clear = obstacles.are_clear(np.repeat(before, times, axis=0), flat, clearance_m)
        clear &= obstacles.are_clear(flat, np.repeat(after, times, axis=0), clearance_m)
        clear = clear.reshape(-1, times)
        best = clear.argmax(axis=1)
        moved = clear.any(axis=1)
        way[corners[moved]] = candidates[moved, best[moved]]
    return way
