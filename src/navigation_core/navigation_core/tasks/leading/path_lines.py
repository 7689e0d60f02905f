"""The straight lines of a path, and how gently they are flown."""

from __future__ import annotations

import bisect
from collections.abc import Callable
from dataclasses import dataclass, replace

from navigation_core.geometry import KinematicState, Vector3, add, distance, scale, unit_between
from navigation_core.limits import Limits
from navigation_core.trajectories.route_trajectory import RoutePoint, RouteTrajectory

_SPEED_FACTOR, _CORNER_FACTOR = 0.55, 0.4
# A corner that is cut by less is a stop; slower than this a flight helps nobody.
_CORNER_MIN_M, _SPEED_MIN_M_S = 0.08, 0.4
# Allowance of a point on a straight line, which is not cut at all.
_ON_THE_LINE_M = 0.5


@dataclass(frozen=True)
class Via:
    """A point on the path, and whether it was asked for or is there because of obstacles."""

    point: RoutePoint
    asked: bool


def gentler(
    state: KinematicState,
    vias: list[Via],
    route: RouteTrajectory,
    faults_s: list[float],
    braking_m: Callable[[Limits, Vector3], float],
) -> list[Via] | None:
    """Return the same lines, to be flown more gently where there were faults.

    Args:
        state: where they begin.
        vias: their points.
        route: the trajectory along them.
        faults_s: when that has faults.
        braking_m: the braking path from full speed along a unit vector.

    Returns:
        The points, some more of them; None if it would become too slow.
    """
    legs: dict[int, float] = {}
    for time_s in faults_s:
        leg = min(bisect.bisect_left(route.passed_s, time_s), len(vias) - 1)
        end = vias[leg].point.position_enu_m
        left_m = distance(route.trajectory.sample(time_s).position_enu_m, end)
        legs[leg] = max(legs.get(leg, 0.0), left_m)
    result: list[Via] = []
    places = [state.position_enu_m, *(via.point.position_enu_m for via in vias)]
    for index, (via, place) in enumerate(zip(vias, places, strict=False)):
        point = via.point
        if index in legs or index + 1 in legs:
            point = _sharper(point)
        if index in legs:
            slow = _slower(point)
            if slow is None:
                return None
            result += _fast_part(place, point, legs[index], braking_m)
            point = slow
        result.append(replace(via, point=point))
    return result


def _fast_part(
    begin_enu_m: Vector3,
    point: RoutePoint,
    slow_m: float,
    braking_m: Callable[[Limits, Vector3], float],
) -> list[Via]:
    """Return the point up to which a long line may be flown as it was, if there is one."""
    length_m = distance(begin_enu_m, point.position_enu_m)
    course = unit_between(begin_enu_m, point.position_enu_m)
    if course is None:
        return []
    slow_m += braking_m(point.limits, course)
    if length_m < 2.0 * slow_m:
        return []
    place = add(point.position_enu_m, scale(course, -slow_m))
    return [Via(RoutePoint(place, _ON_THE_LINE_M, point.limits), False)]


def _sharper(point: RoutePoint) -> RoutePoint:
    corner_m = _CORNER_FACTOR * point.corner_m
    return replace(point, corner_m=corner_m if corner_m >= _CORNER_MIN_M else 0.0)


def _slower(point: RoutePoint) -> RoutePoint | None:
    speed_m_s = _SPEED_FACTOR * point.limits.speed_horizontal_m_s
    if speed_m_s < _SPEED_MIN_M_S:
        return None
    # All else stays: a gentler acceleration would make the turns only wider.
    return replace(point, limits=replace(point.limits, speed_horizontal_m_s=speed_m_s))
