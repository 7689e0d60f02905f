"""A flight that is planned, with its surroundings, as a picture shows it. No I/O."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from navigation_core.geometry import Vector3
from navigation_core.mapping.obstacles import Obstacles

__all__ = ["PlannedArea", "PlannedFlight"]


@dataclass(frozen=True)
class PlannedArea:
    """An area of a fence or of the flight volume; lengths in m.

    Attributes:
        inclusion: whether the vehicle has to stay inside; outside otherwise.
        points_enu_m: corners, or the centre of a circle; east and north.
        radius_m: of a circle; None for a polygon.
    """

    inclusion: bool
    points_enu_m: tuple[tuple[float, float], ...]
    radius_m: float | None = None


@dataclass(frozen=True)
class PlannedFlight:
    """A flight that is planned; lengths in m in the map frame: east, north, up.

    Attributes:
        title: lines above the picture.
        path_enu_m: the path, at least one point.
        targets_enu_m: targets of the goal.
        obstacles: what is known and sensed.
        areas: of the fence and the flight volume.
        heights_m: their lowest and highest height, as far as there are any.
    """

    title: str
    path_enu_m: Sequence[Vector3]
    targets_enu_m: Sequence[Vector3]
    obstacles: Obstacles
    areas: Sequence[PlannedArea]
    heights_m: Sequence[float]
