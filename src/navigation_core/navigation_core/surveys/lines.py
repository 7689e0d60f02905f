"""Parallel lines that cover an area.

The area is cut into strips of the spacing, and each strip is covered by a line along its middle:
as far as the strip's part of the area reaches, so that also its corners are covered. On a slanted
border a line ends up to half a spacing divided by the tangent of the angle outside of the area.
Holes are not entered: a line ends half a spacing before one, and what is left there is covered by
a way around the hole at that distance. (A point that a line does not reach is nearer to the hole
than a spacing.) A gap between two holes that is narrower than a spacing is not
entered, and not covered.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray

from navigation_core.surveys.area import SurveyArea, SurveyAreaError

__all__ = ["LINES_MAX", "Cell", "Lines", "Points", "lines_at"]

Points = NDArray[np.float64]
"""Shape (n, 2), (east, north) in m"""

LINES_MAX = 2000
# Shorter lines, and thinner parts of a strip, are rounding.
_SHORTEST_M = 1e-3
# Corners of the way around a corner of a hole.
_ROUND_SEGMENTS = 3
# Share of a strip's height that may be left of the last strip by rounding.
_ROUNDING = 1e-9


@dataclass(frozen=True)
class Cell:
    """Lines beside each other that are flown one after the other, to and fro; or a way around.

    Attributes:
        lines_m: one behind the other, each of shape (2, 2) and from left to right; a way around a
            hole is one of them, of shape (n, 2).
        is_way_around: whether it is that.
    """

    lines_m: tuple[Points, ...]
    is_way_around: bool = False


@dataclass(frozen=True)
class Lines:
    """The lines of one angle.

    Attributes:
        cells: all of them.
        spacing_m: between two lines; at most that asked for.
        kept_clear: the holes with what is kept around them.
    """

    cells: tuple[Cell, ...]
    spacing_m: float
    kept_clear: shapely.Geometry

    @property
    def count(self) -> int:
        """Number of lines."""
        return sum(len(cell.lines_m) for cell in self.cells)

    @property
    def estimate_m(self) -> float:
        """Length of all lines and of the turns between them, without ways between cells."""
        lines = [line_m for cell in self.cells for line_m in cell.lines_m]
        steps = (np.diff(line_m, axis=0) for line_m in lines)
        return math.fsum(float(np.hypot(*step.T).sum()) for step in steps) + (
            len(lines) * self.spacing_m
        )


def lines_at(area: SurveyArea, angle_rad: float, spacing_m: float, overrun_m: float) -> Lines:
    """Return the lines of an angle.

    Args:
        area: what they cover.
        angle_rad: of the lines, counter-clockwise from east.
        spacing_m: greatest distance of two lines, and the width that one covers.
        overrun_m: how much farther a line begins and ends, where no hole is.

    Raises:
        SurveyAreaError: they are too many.
    """
    turn = _turned_by(-angle_rad)
    outline = shapely.transform(area.outline, turn)
    left, low, right, high = outline.bounds
    strips = max(math.ceil((high - low) / spacing_m - _ROUNDING), 1)
    if strips > LINES_MAX:
        raise SurveyAreaError(
            f"The area takes {strips} lines {spacing_m:g} m apart; at most {LINES_MAX} are planned."
        )
    height_m = (high - low) / strips
    holes = shapely.union_all([shapely.transform(hole, turn) for hole in area.holes])
    kept_clear = holes.buffer(height_m / 2.0, quad_segs=_ROUND_SEGMENTS)
    edges = low + height_m * np.arange(strips + 1)
    boxes = shapely.box(left - 1.0, edges[:-1], right + 1.0, edges[1:])
    parts = shapely.intersection(outline, boxes)
    rows = [
        _row(part, y, overrun_m, kept_clear)
        for part, y in zip(parts, edges[:-1] + height_m / 2.0, strict=True)
    ]
    back = _turned_by(angle_rad)
    cells = [Cell(tuple(back(line) for line in lines)) for lines in _cells(rows)]
    # Between a hole and a border that is near, the way around is outside of the border.
    ways = shapely.intersection(kept_clear.boundary, outline.buffer(height_m / 2.0))
    cells += [
        Cell((back(shapely.get_coordinates(way)),), is_way_around=True)
        for way in shapely.get_parts(shapely.line_merge(ways))
        if way.length > _SHORTEST_M
    ]
    return Lines(tuple(cells), height_m, shapely.transform(kept_clear, back))


def _turned_by(angle_rad: float) -> Callable[[Points], Points]:
    cosine, sine = math.cos(angle_rad), math.sin(angle_rad)
    matrix = np.array([[cosine, sine], [-sine, cosine]])
    return lambda points: points @ matrix


def _row(
    part: shapely.Geometry, y: float, overrun_m: float, kept_clear: shapely.Geometry
) -> list[Points]:
    """Return the lines along the middle of one strip, from left to right."""
    reaches: list[list[float]] = []
    bounds = [tuple(p.bounds) for p in shapely.get_parts(part) if p.area > _SHORTEST_M**2]
    for left, _, right, _ in sorted(bounds):
        if reaches and left <= reaches[-1][1]:
            reaches[-1][1] = max(reaches[-1][1], right)
        else:
            reaches.append([left, right])
    lines = []
    for left, right in reaches:
        whole = shapely.LineString([(left - overrun_m, y), (right + overrun_m, y)])
        for piece in shapely.get_parts(shapely.difference(whole, kept_clear)):
            line = shapely.get_coordinates(piece)
            # Overruns of two lines of one strip may meet.
            if piece.length > _SHORTEST_M:
                lines.append(line[np.argsort(line[:, 0])])
    return sorted(lines, key=lambda line: float(line[0, 0]))


def _cells(rows: list[list[Points]]) -> list[list[Points]]:
    """Join lines that lie beside each other, and beside no other, into cells."""
    cells: list[list[Points]] = []
    open_cells: list[list[Points]] = []
    for before, row in itertools.pairwise([[], *rows]):
        beside = [[_overlap(a, b) for a in before] for b in row]
        next_open = []
        for line, overlaps in zip(row, beside, strict=True):
            found = [i for i, is_beside in enumerate(overlaps) if is_beside]
            if len(found) == 1 and sum(other[found[0]] for other in beside) == 1:
                cell = open_cells[found[0]]
            else:
                cell = []
                cells.append(cell)
            cell.append(line)
            next_open.append(cell)
        open_cells = next_open
    return cells


def _overlap(one: Points, other: Points) -> bool:
    return bool(one[0, 0] < other[1, 0] and other[0, 0] < one[1, 0])
