"""The parts of planning that take most of its time, compiled: lines beside obstacles, and paths.

The functions are those of a C++ library beside this file, called through ctypes, which releases
the interpreter's lock meanwhile. They keep nothing, so threads may call them at once. Coordinates
are those of the map frame (ENU) in metres.

Obstacles are rows of two tables. Posts, shape (P, 5): east, north, radius, bottom, top. Boxes,
shape (B, 7): east, north, half the length, half the width, yaw (rad, counter-clockwise from east),
bottom, top. Obstacles are numbered with the posts first. A line keeps a clearance to an obstacle
if it is that far beside its outline, or that far above its top or below its bottom.
"""

from __future__ import annotations

import ctypes
import math
from enum import IntEnum
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

__all__ = ["LOOKS_MAX", "SearchEnd", "are_clear", "hits", "tangent_path"]

Array: TypeAlias = NDArray[np.float64]
Indices: TypeAlias = NDArray[np.intp]

LOOKS_MAX = 10_000_000
"""Looks at a pair of an obstacle and a line, a point or another obstacle, in one search at most"""

_POST_COLUMNS, _BOX_COLUMNS = 5, 7
_LIBRARY = Path(__file__).with_name("libnavigation_kernels.so")
_HITS_EXPECTED, _POINTS_EXPECTED = 256, 256


class SearchEnd(IntEnum):
    """How a search ended."""

    FOUND = 0
    NONE = 1
    """There is none along outlines, or none as short as wanted"""
    TOO_MUCH_WORK = 2
    """The bound on the work was reached first"""


def are_clear(
    posts: Array, boxes: Array, starts_enu_m: Array, ends_enu_m: Array, clearance_m: float
) -> NDArray[np.bool_]:
    """Return whether straight lines keep a clearance to all obstacles, shape (N,).

    Args:
        posts: shape (P, 5), see the module.
        boxes: shape (B, 7).
        starts_enu_m: shape (N, 3).
        ends_enu_m: shape (N, 3).
        clearance_m: a line of which a coordinate is not a number keeps none to what it may meet.

    Raises:
        ValueError: an array has another shape.
    """
    tables, lines = _Tables(posts, boxes), _Lines(starts_enu_m, ends_enu_m)
    clear = np.empty(len(lines), dtype=np.bool_)
    _checked(_ARE_CLEAR(*tables.arguments, *lines.arguments, clearance_m, _at(clear)))
    return clear


def hits(
    posts: Array, boxes: Array, starts_enu_m: Array, ends_enu_m: Array, clearance_m: float
) -> tuple[Indices, Indices]:
    """Return which straight lines come nearer than a clearance to which obstacles.

    Args:
        posts: shape (P, 5), see the module.
        boxes: shape (B, 7).
        starts_enu_m: shape (N, 3).
        ends_enu_m: shape (N, 3).
        clearance_m: a line of which a coordinate is not a number comes nearer to what it may meet.

    Returns:
        Rows of the lines, in their order, and of the obstacles; both of shape (K,).

    Raises:
        ValueError: an array has another shape.
    """
    tables, lines = _Tables(posts, boxes), _Lines(starts_enu_m, ends_enu_m)
    capacity = _HITS_EXPECTED
    while True:
        rows, obstacles = np.empty((2, capacity), dtype=np.int64)
        into = _at(rows), _at(obstacles), capacity
        found = _checked(_HITS(*tables.arguments, *lines.arguments, clearance_m, *into))
        if found <= capacity:
            return rows[:found].astype(np.intp), obstacles[:found].astype(np.intp)
        capacity = found


def tangent_path(
    posts: Array,
    boxes: Array,
    start_m: Array,
    goal_m: Array,
    clearance_m: float,
    longest_m: float = math.inf,
    looks_max: int = LOOKS_MAX,
) -> tuple[SearchEnd, Array, int]:
    """Search the shortest path in the plane, along polygons about the outlines of obstacles.

    The same arguments give the same answer on each machine, for the work is counted, not timed.

    Args:
        posts: shape (P, 5), see the module; all are taken as endless upwards and downwards.
        boxes: shape (B, 7).
        start_m: east and north, shape (2,), clear of all obstacles.
        goal_m: east and north, shape (2,), clear of all obstacles.
        clearance_m: that every line of the path keeps.
        longest_m: no path of this length or more is wanted.
        looks_max: bound on the work, see LOOKS_MAX.

    Returns:
        How it ended; the points of the path, shape (K, 2), with K 0 if it was not found; and how
        many looks it took.

    Raises:
        ValueError: an array has another shape.
    """
    start, goal = _rows(np.reshape(start_m, (1, -1)), 2), _rows(np.reshape(goal_m, (1, -1)), 2)
    tables = _Tables(posts, boxes)
    count, looks = ctypes.c_int64(), ctypes.c_int64()
    capacity = _POINTS_EXPECTED
    while True:
        points = np.empty((capacity, 2))
        given = _at(start), _at(goal), clearance_m, longest_m, looks_max
        into = _at(points), capacity, ctypes.addressof(count), ctypes.addressof(looks)
        answer = _checked(_TANGENT_PATH(*tables.arguments, *given, *into))
        if count.value <= capacity:
            return SearchEnd(answer), points[: count.value], looks.value
        capacity = count.value


class _Tables:
    """Obstacles as arguments of the library; keeps the arrays that it reads."""

    def __init__(self, posts: Array, boxes: Array) -> None:
        self._posts, self._boxes = _rows(posts, _POST_COLUMNS), _rows(boxes, _BOX_COLUMNS)
        self.arguments = _at(self._posts), len(self._posts), _at(self._boxes), len(self._boxes)


class _Lines:
    """Straight lines as arguments of the library; keeps the arrays that it reads."""

    def __init__(self, starts_enu_m: Array, ends_enu_m: Array) -> None:
        self._starts, self._ends = _rows(starts_enu_m, 3), _rows(ends_enu_m, 3)
        if len(self._starts) != len(self._ends):
            raise ValueError(
                f"there are {len(self._starts)} starts and {len(self._ends)} ends of lines"
            )
        self.arguments = _at(self._starts), _at(self._ends), len(self._starts)

    def __len__(self) -> int:
        return len(self._starts)


def _rows(values: Array, columns: int) -> Array:
    rows = np.ascontiguousarray(values, dtype=np.float64)
    if rows.ndim != 2 or rows.shape[1] != columns:
        raise ValueError(f"rows of {columns} numbers are needed, and the shape is {rows.shape}")
    return rows


def _at(array: NDArray[np.generic]) -> int:
    return array.ctypes.data


def _checked(answer: int) -> int:
    """Return an answer of the library, which is below 0 if the memory was not enough."""
    if answer < 0:
        raise MemoryError("there is not enough memory for these obstacles")
    return answer


def _library() -> ctypes.CDLL:
    try:
        return ctypes.CDLL(str(_LIBRARY))
    except OSError as error:
        raise ImportError(
            f"The compiled part of navigation_kernels cannot be loaded: {error}. 'make setup' or "
            "'colcon build' builds it."
        ) from error


_NATIVE = _library()
_POINTER, _COUNT, _NUMBER = ctypes.c_void_p, ctypes.c_int64, ctypes.c_double
_OBSTACLES = (_POINTER, _COUNT, _POINTER, _COUNT)
_LINES = (_POINTER, _POINTER, _COUNT, _NUMBER)

_ARE_CLEAR = _NATIVE.navigation_kernels_are_clear
_ARE_CLEAR.argtypes = (*_OBSTACLES, *_LINES, _POINTER)
_ARE_CLEAR.restype = ctypes.c_int
_HITS = _NATIVE.navigation_kernels_hits
_HITS.argtypes = (*_OBSTACLES, *_LINES, _POINTER, _POINTER, _COUNT)
_HITS.restype = _COUNT
_TANGENT_PATH = _NATIVE.navigation_kernels_tangent_path
_TANGENT_PATH.argtypes = (
    *(*_OBSTACLES, _POINTER, _POINTER, _NUMBER, _NUMBER, _COUNT),
    *(_POINTER, _COUNT, _POINTER, _POINTER),
)
_TANGENT_PATH.restype = ctypes.c_int
