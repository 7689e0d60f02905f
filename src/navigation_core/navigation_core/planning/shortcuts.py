"""Shortens a path: fewer corners, each as close to the direct line as the clearance allows."""

from __future__ import annotations

import math

import numpy as np

from navigation_core.mapping.obstacles import Array, Obstacles
from navigation_core.planning.path_search import cost_m, path_cost_m

__all__ = ["pulled_tight", "with_fewer_corners"]

_ROUNDS = 6
# How far a corner is drawn towards the line between its neighbours, as shares.
_SHARES = np.array([0.9, 0.6, 0.35, 0.2, 0.1, 0.04, 0.015])
# Where a corner is cut off, as shares of the lines beside it; less than half of both.
_CUTS = np.array([0.49, 0.35, 0.2, 0.1, 0.05])
# A corner that can't be drawn by more than this stays.
_TINY_M = 0.005
_POINTS_MAX = 24
# Two corners become one if it turns by no more than this, and it takes no more than this share
# of the clearance longer.
_TURN_MAX_RAD = math.radians(50.0)
_LONGER_SHARE = 0.06


def pulled_tight(path: Array, obstacles: Obstacles, clearance_m: float) -> Array:
    """Return a shorter path on the same side of each obstacle, or on a better one.

    Args:
        path: points, shape (N, 3); its lines are clear.
        obstacles: all that count.
        clearance_m: that each line keeps.
    """
    low, high = path.min(axis=0), path.max(axis=0)
    nearby = obstacles.near(tuple(low), tuple(high), clearance_m)
    path = _skipped(path, nearby, clearance_m)
    for number in range(_ROUNDS):
        if len(path) == 2:
            break
        drawn = _drawn(_split(path, nearby, clearance_m), nearby, clearance_m)
        # From the other end each time: both are worth their time only for the first, long path.
        turn = -1 if number % 2 else 1
        shorter = _skipped_forward([drawn[::turn]], nearby, clearance_m)[0][::turn]
        before, after = path_cost_m(path), path_cost_m(shorter)
        path = shorter
        if before - after < 0.001 * before:
            break
    return path


def _skipped(path: Array, obstacles: Obstacles, clearance_m: float) -> Array:
    """Leave out points, from either end, as far as lines are clear; the shorter result."""
    if len(path) == 2:
        return path
    forward, back = _skipped_forward([path, path[::-1]], obstacles, clearance_m)
    return min((forward, back[::-1]), key=path_cost_m)


def _skipped_forward(paths: list[Array], obstacles: Obstacles, clearance_m: float) -> list[Array]:
    """Leave out the points of paths up to the farthest that can be seen from each that is kept.

    All are followed at once: a question about few lines takes as long as one about some more.
    """
    kept = [[0] for _ in paths]
    while open_ := [k for k, path in enumerate(paths) if kept[k][-1] < len(path) - 1]:
        starts, ends = [], []
        for k in open_:
            here = kept[k][-1]
            ends.append(paths[k][here + 2 : here + _POINTS_MAX])
            starts.append(np.broadcast_to(paths[k][here], ends[-1].shape))
        clear = obstacles.are_clear(np.concatenate(starts), np.concatenate(ends), clearance_m)
        for k, those in zip(open_, ends, strict=True):
            seen, clear = np.flatnonzero(clear[: len(those)]), clear[len(those) :]
            kept[k].append(kept[k][-1] + (int(seen[-1]) + 2 if len(seen) else 1))
    return [path[rows] for path, rows in zip(paths, kept, strict=True)]


def _drawn(path: Array, obstacles: Obstacles, clearance_m: float) -> Array:
    """Draw each corner towards the line between its neighbours, every second one at a time."""
    path = path.copy()
    for first in (1, 2):
        corners = np.arange(first, len(path) - 1, 2)
        if not len(corners):
            continue
        before, corner, after = path[corners - 1], path[corners], path[corners + 1]
        candidates = _candidates(before, corner, after)
        times = candidates.shape[1]
        flat = candidates.reshape(-1, 3)
        starts, ends = np.repeat(before, times, axis=0), np.repeat(after, times, axis=0)
        costs = cost_m(flat - starts) + cost_m(ends - flat)
        better = (
            costs < np.repeat(cost_m(corner - before) + cost_m(after - corner), times) - _TINY_M
        )
        better[better] = obstacles.are_clear(starts[better], flat[better], clearance_m)
        better[better] = obstacles.are_clear(flat[better], ends[better], clearance_m)
        costs = np.where(better, costs, np.inf).reshape(-1, times)
        best = costs.argmin(axis=1)
        moved = np.isfinite(costs.min(axis=1))
        path[corners[moved]] = candidates[moved, best[moved]]
    return path


def _split(path: Array, obstacles: Obstacles, clearance_m: float) -> Array:
    """Cut corners off: two points on the lines beside a corner take its place where it can be."""
    corner = path[1:-1]
    shares = _CUTS[:, None]
    before = corner[:, None] + shares * (path[:-2] - corner)[:, None]
    after = corner[:, None] + shares * (path[2:] - corner)[:, None]
    flat = obstacles.are_clear(before.reshape(-1, 3), after.reshape(-1, 3), clearance_m)
    clear = flat.reshape(-1, len(_CUTS))
    best = np.where(clear.any(axis=1), clear.argmax(axis=1), -1)
    parts = [path[:1]]
    for row, column in enumerate(best):
        cut = column >= 0
        here = (before[row, column], after[row, column]) if cut else (corner[row],)
        parts.append(np.array(here))
    return np.concatenate([*parts, path[-1:]])


def _candidates(before: Array, corner: Array, after: Array) -> Array:
    """Return places for corners nearer to the lines between their neighbours, shape (N, C, 3).

    They are on the way to the nearest point of that line, and to both neighbours.
    """
    chord = after - before
    length2 = np.maximum((chord * chord).sum(axis=1), 1e-12)
    share = np.clip(((corner - before) * chord).sum(axis=1) / length2, 0.0, 1.0)
    nearest = before + share[:, None] * chord
    return np.concatenate(
        [
            corner[:, None] + _SHARES[:, None] * (to - corner)[:, None]
            for to in (nearest, before, after)
        ],
        axis=1,
    )


def with_fewer_corners(path: Array, obstacles: Obstacles, clearance_m: float) -> Array:
    """Join corners that follow each other closely, as about the end of a wall.

    A vehicle is slower on many short lines than on few longer ones.
    """
    row = 1
    while row < len(path) - 2:
        joined = _joined(path[row - 1 : row + 3])
        if joined is not None:
            starts = np.array([path[row - 1], joined])
            ends = np.array([joined, path[row + 2]])
            if obstacles.are_clear(starts, ends, clearance_m).all() and (
                path_cost_m(np.array([path[row - 1], joined, path[row + 2]]))
                < path_cost_m(path[row - 1 : row + 3]) + _LONGER_SHARE * clearance_m
            ):
                path = np.concatenate([path[:row], joined[None], path[row + 2 :]])
                continue
        row += 1
    return path


def _joined(points: Array) -> Array | None:
    """Return where the first and the last of three lines meet, seen from above."""
    before, after = points[1] - points[0], points[2] - points[3]
    cross = before[0] * after[1] - before[1] * after[0]
    turn = math.atan2(cross, -(before[0] * after[0] + before[1] * after[1]))
    if not 1e-6 < abs(turn) <= _TURN_MAX_RAD:
        return None
    gap = points[3] - points[0]
    share = (gap[0] * after[1] - gap[1] * after[0]) / cross
    meeting = points[0] + share * before
    meeting[2] = 0.5 * (points[1, 2] + points[2, 2])
    return meeting if share >= 1.0 else None
