"""Placement of goal labels in a picture without overlaps."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from flight_reports.pictures.scene import Array
from navigation_core.geometry import Vector3

_GAP_PX = 9.0
# Cost of a label over another one or the edge, in points of a line.
_FORBIDDEN = 10_000
# Right, left, above and below first, then the corners; the label's near side is at the point.
_SIDES = ((1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (1, -1), (-1, 1), (-1, -1))
_STEPS_M = 0.1
_SAME_PLACE_M = 0.5


def names_of(targets: Sequence[Vector3]) -> list[tuple[Vector3, str]]:
    """Return each point once, with its name: "1, 4: (0, 0, 4)" for two goals at one point."""
    places: list[tuple[Vector3, list[int]]] = []
    for number, target in enumerate(targets, 1):
        for place, numbers in places:
            if float(np.linalg.norm(np.subtract(place, target))) < _SAME_PLACE_M:
                numbers.append(number)
                break
        else:
            places.append((target, [number]))
    return [
        (place, f"{', '.join(map(str, numbers))}: ({', '.join(_number(part) for part in place)})")
        for place, numbers in places
    ]


def _number(part: float) -> str:
    return f"{round(part, 1) + 0.0:g}"


def along(path_enu_m: Array) -> Array:
    """Return closely spaced points along a path, shape (N, 3), to be counted."""
    path = np.asarray(path_enu_m, dtype=np.float64).reshape(-1, 3)
    if len(path) < 2:
        return path
    so_far_m = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))])
    at_m = np.arange(0.0, so_far_m[-1], _STEPS_M)
    return np.stack([np.interp(at_m, so_far_m, part) for part in path.T], axis=-1)


def free_places(
    places_px: Array, sizes_px: Array, busy_px: Array, frame_px: Sequence[float]
) -> list[tuple[float, float]]:
    """Return the lower left corner of each label: beside its point, where least is drawn.

    Args:
        places_px: the labelled points, shape (N, 2).
        sizes_px: width and height of each label, shape (N, 2).
        busy_px: points of what is drawn, shape (K, 2).
        frame_px: left, bottom, right and top of the picture.
    """
    taken: list[Array] = [
        np.array([*place - _GAP_PX, *place + _GAP_PX]) for place in places_px
    ]  # fmt: skip
    corners = []
    for place, size in zip(places_px, sizes_px, strict=True):
        boxes = [_box(place, size, side) for side in _SIDES]
        best = min(boxes, key=lambda box: _cost(box, busy_px, taken, frame_px))
        taken.append(best)
        corners.append((float(best[0]), float(best[1])))
    return corners


def _box(place: Array, size: Array, side: tuple[int, int]) -> Array:
    """Return left, bottom, right and top of a label on one side of its point."""
    middle = place + np.array(side) * (0.5 * size + _GAP_PX)
    return np.concatenate([middle - 0.5 * size, middle + 0.5 * size])


def _cost(box: Array, busy_px: Array, taken: Iterable[Array], frame_px: Sequence[float]) -> int:
    left, bottom, right, top = box
    inside = (busy_px > (left, bottom)).all(axis=1) & (busy_px < (right, top)).all(axis=1)
    cost = int(inside.sum())
    cost += _FORBIDDEN * sum(
        bool(left < other[2] and right > other[0] and bottom < other[3] and top > other[1])
        for other in taken
    )
    outside = left < frame_px[0] or bottom < frame_px[1] or right > frame_px[2] or top > frame_px[3]
    return cost + _FORBIDDEN * bool(outside)
