"""The target of AUTO.RTL: home, a safe (rally) point or the mission's landing, by RTL_TYPE.

Read in the firmware's `rtl`: 0 home or a safe point; 1 a safe point or the mission's landing,
home only without either; 3 the nearest of all; 5 safe points only, else here. Types 2 and 4
follow the mission's path in the firmware; here they go straight to its landing, or home.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from mavlink_sitl.autopilot.plans.plans import Cmd, PlanItem

if TYPE_CHECKING:
    from mavlink_sitl.autopilot.px4.vehicle import Px4Vehicle

HOME_OR_SAFE, SAFE_OR_LANDING, ANY_NEAREST, SAFE_ONLY = 0, 1, 3, 5
ALONG_MISSION = (2, 4)
"""RTL_TYPE"""
NEARER_M = 2.0
"""So much nearer than the other choices must one be"""
FAR_FROM_HOME_M = 10.0
"""A safe point this near to home is home, unless only safe points count"""

Place = tuple[float, float, float]


def destination_ned_m(vehicle: Px4Vehicle) -> Place:
    """The destination of RTL: north, east and down of the ground there, in the local frame."""
    kind = int(vehicle.parameters["RTL_TYPE"])
    here = vehicle.motion[:3]
    home = vehicle.navigator.true_home_ned_m()
    landing = _mission_landing(vehicle)
    best: Place | None = None
    least_m = math.inf
    if kind in (HOME_OR_SAFE, ANY_NEAREST):
        best, least_m = home, math.dist(here[:2], home[:2])
    elif kind in ALONG_MISSION:
        return landing or home
    if landing is not None and kind in (SAFE_OR_LANDING, ANY_NEAREST):
        away_m = math.dist(here[:2], landing[:2])
        if away_m + NEARER_M < least_m:
            best, least_m = landing, away_m
    for point in (_place(vehicle, item) for item in vehicle.plans.rally.items):
        away_m = math.dist(here[:2], point[:2])
        counts = kind == SAFE_ONLY or math.dist(point[:2], home[:2]) > FAR_FROM_HOME_M
        if counts and away_m + NEARER_M < least_m:
            best, least_m = point, away_m
    if best is None:
        best = (here[0], here[1], home[2]) if kind == SAFE_ONLY else home
    return best


def _mission_landing(vehicle: Px4Vehicle) -> Place | None:
    if not vehicle.auto.has_mission:
        return None
    lands = (item for item in vehicle.plans.mission.items if item.command == Cmd.LAND)
    return next((_place(vehicle, item) for item in lands), None)


def _place(vehicle: Px4Vehicle, item: PlanItem) -> Place:
    navigator = vehicle.navigator
    from_home_m = navigator.true_home_down_m() - item.z
    down_m = navigator.down_of_amsl(item.z) if item.is_amsl else from_home_m
    return (*item.level_m(navigator.frame), down_m)


def return_text(vehicle: Px4Vehicle, down_m: float, destination: Place) -> str:
    """The text of a return of planes, rovers and boats that begins, to a height, NED."""
    altitude_m = vehicle.navigator.origin.altitude_amsl_m - down_m
    above_m = destination[2] - down_m
    return (
        f"RTL: start return at {math.ceil(altitude_m)} m ({math.ceil(above_m)} m above destination)"
    )


def return_down_m(vehicle: Px4Vehicle, destination: Place) -> float:
    """The altitude of RTL: RTL_RETURN_ALT above the destination, less within a cone.

    The cone stands on the destination; RTL_CONE_ANG is its half angle, and it counts within
    RTL_MIN_DIST. Inside NAV_ACC_RAD twice the distance is enough.
    """
    p = vehicle.parameters
    down = vehicle.motion.down_m
    away_m = math.dist(vehicle.motion[:2], destination[:2])
    highest = height = p["RTL_RETURN_ALT"]
    if p["RTL_CONE_ANG"] <= 0.0:
        return min(down, destination[2] - highest)
    if away_m <= p["NAV_ACC_RAD"]:
        height = 2.0 * away_m
    else:
        if away_m <= p["RTL_MIN_DIST"]:
            half_rad = math.radians(min(max(p["RTL_CONE_ANG"], 1.0), 89.0))
            height = min(away_m / math.tan(half_rad), height)
        height = max(height, 2.0 * p["NAV_ACC_RAD"])
    return min(down, destination[2] - min(height, highest))
