"""A rehearsed flight with its surroundings, for its picture. No I/O."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from flight_reports.planned_flight import PlannedArea, PlannedFlight
from navigation_core.geometry import Vector3
from navigation_core.mapping.obstacles import BOX_COLUMNS, POST_COLUMNS, Obstacles

__all__ = ["scene_of"]


def scene_of(
    title: str,
    rehearsal: Mapping[str, Any],
    targets_enu_m: Sequence[Vector3],
    value: Callable[[str], Any],
) -> PlannedFlight:
    """Return what was rehearsed, as a picture shows it.

    Args:
        title: lines above the picture.
        rehearsal: what `flight_rehearsal` has flown; `Rehearsal` has its members.
        targets_enu_m: targets of the act, m in the map.
        value: returns a value by the console's name; None while unknown.
    """
    seen: Mapping[str, Any] = value("obstacles") or {}
    posts = [*seen.get("posts", ()), *seen.get("seen", ())]
    bounds = [each for each in (value("fence"), value("flight_volume")) if each]
    home = (value("home") or {}).get("at") or (0.0, 0.0, 0.0)
    heights_m = (home[2] + each[end] for each in bounds for end in ("low", "high") if each[end])
    return PlannedFlight(
        title=title,
        path_enu_m=tuple(rehearsal["path_enu_m"]),
        targets_enu_m=tuple(targets_enu_m),
        obstacles=Obstacles(
            np.array(posts, dtype=np.float64).reshape(-1, POST_COLUMNS),
            np.array(seen.get("boxes", ()), dtype=np.float64).reshape(-1, BOX_COLUMNS),
        ),
        areas=tuple(_area(area) for each in bounds for area in each["areas"] if area["in_force"]),
        heights_m=tuple(heights_m),
    )


def _area(area: Mapping[str, Any]) -> PlannedArea:
    points = tuple((east, north) for east, north in area["points"])
    return PlannedArea(area["inclusion"], points, area["radius"])
