"""The target of RTL: home, or a closer rally point."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from mavlink_sitl.autopilot.common.commander import Commander


def nearest_rally_ned_m(vehicle: Commander) -> tuple[float, float, float] | None:
    """The nearest rally point, as high as it says above home; None when home counts instead.

    Home counts when it is nearer and RALLY_INCL_HOME is set, or when no point is within
    RALLY_LIMIT_KM (0: at any distance).
    """
    parameters = vehicle.parameters
    if not parameters.acts("RALLY_LIMIT_KM"):
        return None
    home = vehicle.navigator.home_ned_m()
    here = vehicle.motion[:2]
    best_m = parameters["RALLY_LIMIT_KM"] * 1000.0 or math.inf
    if parameters["RALLY_INCL_HOME"]:
        best_m = min(best_m, math.dist(here, home[:2]))
    best = None
    for item in vehicle.plans.rally.items:
        place = item.level_m(vehicle.navigator.frame)
        distance_m = math.dist(here, place)
        if distance_m < best_m:
            best, best_m = (*place, home[2] - item.z), distance_m
    return best


def return_point_ned_m(vehicle: Commander) -> tuple[float, float, float]:
    """Home, or the nearest rally point, at home's height."""
    home = vehicle.navigator.home_ned_m()
    rally = nearest_rally_ned_m(vehicle)
    return home if rally is None else (*rally[:2], home[2])
