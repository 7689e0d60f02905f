"""Where RTL goes: home, or a rally point that is nearer."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from mavlink_sitl.geodesy import GeoPoint, to_local

if TYPE_CHECKING:
    from mavlink_sitl.autopilot.copter import Copter


def return_point_ned_m(copter: Copter) -> tuple[float, float, float]:
    """Home, or the nearest rally point within RALLY_LIMIT_KM (0: at any distance)."""
    home = copter.navigator.home_ned_m()
    if "RALLY_LIMIT_KM" not in copter.parameters:
        return home
    here = copter.motion[:2]
    limit_m = copter.parameters["RALLY_LIMIT_KM"] * 1000.0 or math.inf
    best, best_m = home, math.dist(here, home[:2])
    for item in copter.plans.rally.items:
        point = GeoPoint(item.x / 1e7, item.y / 1e7, 0.0)
        north, east, _ = to_local(copter.navigator.origin, point)
        distance_m = math.dist(here, (north, east))
        if distance_m < min(best_m, limit_m):
            best, best_m = (north, east, home[2]), distance_m
    return best
