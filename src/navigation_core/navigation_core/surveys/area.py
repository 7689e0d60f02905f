"""The area of a survey: a boundary and its holes, checked.

All coordinates are metres east and north.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TypeAlias

import shapely

__all__ = ["CORNERS_MAX", "HOLES_MAX", "Corners", "SurveyArea", "SurveyAreaError", "area_of"]

Corners: TypeAlias = tuple[tuple[float, float], ...]
"""Corners in order, (east, north) in m; the last is joined to the first"""

CORNERS_MAX, HOLES_MAX = 10_000, 50
_LEAST_AREA_M2 = 1.0
# A hole that shares a part of its edge with the boundary may stick out by rounding.
_ROUNDING_M = 1e-6


class SurveyAreaError(ValueError):
    """The area cannot be surveyed; the text says why."""


@dataclass(frozen=True)
class SurveyArea:
    """An area that is covered.

    Attributes:
        outline: the boundary without its holes.
        holes: areas that are neither covered nor entered; they do not overlap.
    """

    outline: shapely.Polygon
    holes: tuple[shapely.Polygon, ...]

    @property
    def area_m2(self) -> float:
        """Area that is to be covered."""
        return float(self.outline.area - sum(hole.area for hole in self.holes))


def area_of(boundary_m: Corners, holes_m: tuple[Corners, ...] = ()) -> SurveyArea:
    """Return an area.

    Args:
        boundary_m: at least three corners.
        holes_m: at least three corners each, inside the boundary.

    Raises:
        SurveyAreaError: it is no area, or too much to plan for.
    """
    corners = sum(map(len, (boundary_m, *holes_m)))
    if corners > CORNERS_MAX or len(holes_m) > HOLES_MAX:
        raise SurveyAreaError(
            f"The area has {corners} corners and {len(holes_m)} holes; at most {CORNERS_MAX} "
            f"corners and {HOLES_MAX} holes are planned for."
        )
    outline = _polygon("The boundary", boundary_m)
    holes = tuple(_polygon(f"Hole {i}", hole_m) for i, hole_m in enumerate(holes_m, 1))
    inside = outline.buffer(_ROUNDING_M)
    for i, hole in enumerate(holes, 1):
        if not inside.covers(hole):
            raise SurveyAreaError(f"Hole {i} is not inside the boundary.")
        for j, other in enumerate(holes[: i - 1], 1):
            if hole.intersection(other).area > _ROUNDING_M:
                raise SurveyAreaError(f"Holes {j} and {i} overlap.")
    area = SurveyArea(outline, holes)
    if area.area_m2 < _LEAST_AREA_M2:
        raise SurveyAreaError(
            f"The area is {area.area_m2:.2g} m2; at least {_LEAST_AREA_M2:g} m2 are surveyed."
        )
    return area


def _polygon(what: str, corners_m: Corners) -> shapely.Polygon:
    if len(set(corners_m)) < 3:
        raise SurveyAreaError(f"{what} has {len(set(corners_m))} different corners; give three.")
    if not all(math.isfinite(value) for corner in corners_m for value in corner):
        raise SurveyAreaError(f"{what} has a corner that is not a finite number.")
    polygon = shapely.Polygon(corners_m)
    if not polygon.is_valid:
        raise SurveyAreaError(f"{what} is no simple polygon: {shapely.is_valid_reason(polygon)} m.")
    return polygon
