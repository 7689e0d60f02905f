"""The way of a survey: parallel lines of the best angle, and short ways between them.

The angle is tried for each direction of an edge of the area's hull, along which the fewest turns
are made (Huang, 2001). The cells of lines are then put into an order, each begun at one of its four
corners: first the nearest one each time, then each cell is moved to where the way becomes shorter.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray

from navigation_core.surveys.area import SurveyArea
from navigation_core.surveys.free_space import FreeSpace
from navigation_core.surveys.lines import Cell, Lines, Points, lines_at

__all__ = ["Survey", "SurveyLeg", "plan_survey"]

# Angles that differ by less are one; so many are tried at most, and so many of them to the end.
_SAME_RAD, _ANGLES_MAX, _PLANNED_MAX = math.radians(1.0), 40, 3
# The hull is simplified by this share of the spacing before its edges are looked at.
_SIMPLER_SHARE = 0.5
# Cells beyond which their order is not improved, and starts of a way around a hole.
_IMPROVED_MAX, _STARTS = 30, 6
_BETTER_M = 1e-6


@dataclass(frozen=True)
class SurveyLeg:
    """A part of the way.

    Attributes:
        points_m: at least two, shape (n, 2); the first is the last of the leg before.
        covers: whether it is a line of the survey, and not a way to one.
    """

    points_m: Points
    covers: bool

    @property
    def length_m(self) -> float:
        """Its length."""
        return float(np.hypot(*np.diff(self.points_m, axis=0).T).sum())


@dataclass(frozen=True)
class Survey:
    """A way that covers an area.

    Attributes:
        legs: from the start of the first line on.
        angle_rad: of the lines, counter-clockwise from east.
        spacing_m: of the lines; at most that asked for.
    """

    legs: tuple[SurveyLeg, ...]
    angle_rad: float
    spacing_m: float

    @property
    def length_m(self) -> float:
        """Length of all legs."""
        return math.fsum(leg.length_m for leg in self.legs)


def plan_survey(
    area: SurveyArea,
    spacing_m: float,
    entry_m: tuple[float, float],
    angle_rad: float | None = None,
    overrun_m: float = 0.0,
) -> Survey:
    """Return a short way that covers an area.

    Args:
        area: what to cover.
        spacing_m: width that one line covers.
        entry_m: where the vehicle comes from, (east, north).
        angle_rad: of the lines, counter-clockwise from east; None for the best.
        overrun_m: how much farther a line begins and ends, where no hole is.

    Raises:
        SurveyAreaError: it takes too many lines.
    """
    angles = [angle_rad] if angle_rad is not None else _angles(area, spacing_m)
    tried = [(angle, lines_at(area, angle, spacing_m, overrun_m)) for angle in angles]
    tried.sort(key=lambda item: item[1].estimate_m)
    entry = np.array(entry_m)
    surveys = [_survey(area, angle, lines, entry) for angle, lines in tried[:_PLANNED_MAX]]
    return min(surveys, key=lambda survey: survey.length_m)


def _angles(area: SurveyArea, spacing_m: float) -> list[float]:
    """Return the directions of the hull's edges, the longest first."""
    hull = shapely.simplify(area.outline.convex_hull, _SIMPLER_SHARE * spacing_m)
    edges = np.diff(shapely.get_coordinates(hull), axis=0)
    edges = edges[np.argsort(-np.hypot(*edges.T))]
    angles: list[float] = []
    for east, north in edges:
        angle = math.atan2(north, east) % math.pi
        if all(abs(math.remainder(angle - other, math.pi)) > _SAME_RAD for other in angles):
            angles.append(angle)
    return angles[:_ANGLES_MAX]


def _survey(area: SurveyArea, angle_rad: float, lines: Lines, entry_m: Points) -> Survey:
    space = FreeSpace(area.outline, lines)
    order = _Order([_variants(cell) for cell in lines.cells], entry_m, space)
    legs: list[SurveyLeg] = []
    for line_m in order.best():
        if legs:
            way_m = space.way(legs[-1].points_m[-1], line_m[0])
            if len(way_m) > 2 or float(np.hypot(*(way_m[1] - way_m[0]))) > _BETTER_M:
                legs.append(SurveyLeg(way_m, covers=False))
        legs.append(SurveyLeg(line_m, covers=True))
    return Survey(tuple(legs), angle_rad, lines.spacing_m)


def _variants(cell: Cell) -> list[list[Points]]:
    """Return the ways to fly a cell: from each of its corners, or around from some of them."""
    if not cell.is_way_around:
        return [
            [line if (i + first) % 2 == 0 else line[::-1] for i, line in enumerate(lines)]
            for lines in (cell.lines_m, cell.lines_m[::-1])
            for first in (0, 1)
        ]
    (way_m,) = cell.lines_m
    if not np.allclose(way_m[0], way_m[-1]):
        return [[way_m], [way_m[::-1]]]
    ring = way_m[:-1]
    starts = np.unique(np.linspace(0, len(ring), _STARTS, endpoint=False).astype(int))
    turned = [np.roll(ring, -start, axis=0) for start in starts]
    return [[np.concatenate([way, way[:1]])] for way in turned]


class _Order:
    """The order of the cells, and the best variant of each."""

    def __init__(
        self, variants: list[list[list[Points]]], entry_m: Points, space: FreeSpace
    ) -> None:
        self._variants = variants
        # All first and last points, the entry before them, and the places of a cell's variants.
        places = [entry_m]
        self._ends: list[list[tuple[int, int]]] = []
        for cell in variants:
            self._ends.append([])
            for lines in cell:
                self._ends[-1].append((len(places), len(places) + 1))
                places += [lines[0][0], lines[-1][-1]]
        self._gaps_m = space.lengths(np.stack(places))

    def best(self) -> list[Points]:
        """Return all lines in a good order."""
        order = self._nearest_first()
        if len(order) <= _IMPROVED_MAX:
            order = self._improved(order)
        _, chosen = self._length(order)
        return [line for cell, k in chosen for line in self._variants[cell][k]]

    def _nearest_first(self) -> list[int]:
        left, order, here = set(range(len(self._variants))), [], 0
        while left:
            _, cell, here = min(
                (float(self._gaps_m[here, first]), i, last)
                for i in left
                for first, last in self._ends[i]
            )
            left.remove(cell)
            order.append(cell)
        return order

    def _length(self, order: list[int]) -> tuple[float, list[tuple[int, int]]]:
        """Return the length between the cells, and each one's best variant."""
        lengths_m, lasts = np.zeros(1), [0]
        came: list[NDArray[np.intp]] = []
        for cell in order:
            firsts = [first for first, _ in self._ends[cell]]
            total = lengths_m[:, None] + self._gaps_m[np.ix_(lasts, firsts)]
            came.append(total.argmin(axis=0))
            lengths_m, lasts = total.min(axis=0), [last for _, last in self._ends[cell]]
        variant = int(lengths_m.argmin())
        chosen = []
        for cell, before in zip(reversed(order), reversed(came), strict=True):
            chosen.append((cell, variant))
            variant = int(before[variant])
        return float(lengths_m.min()), chosen[::-1]

    def _improved(self, order: list[int]) -> list[int]:
        """Move single cells to where the way becomes shorter, as long as one does."""
        length_m, _ = self._length(order)
        moved = True
        while moved:
            moved = False
            for cell in list(order):
                rest = [other for other in order if other != cell]
                tried = ([*rest[:i], cell, *rest[i:]] for i in range(len(order)))
                best_m, best = min((self._length(each)[0], each) for each in tried)
                if best_m < length_m - _BETTER_M:
                    length_m, order, moved = best_m, best, True
        return order
