"""Orbit: go round a point on a circle."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from navigation_bridge.goals.admitted import Admitted, FlightPlan, may_move
from navigation_bridge.goals.obstacle_admission import (
    avoidance_of,
    check_obstacles,
    obstacle_on_line,
)
from navigation_bridge.goals.point_requests import (
    check_frame,
    check_speed,
    on_ground,
    position_in_map,
    volume_for,
)
from navigation_bridge.goals.requests import LAPS_MAX, OrbitRequest, OrbitYaw
from navigation_bridge.names import ORBIT_ACTION_NAME
from navigation_bridge.snapshot import LocatedSnapshot
from navigation_bridge.tasks.navigate_waypoints import admit_plane
from navigation_bridge.tasks.task_kind import TaskKind
from navigation_core.geometry import Vector3
from navigation_core.outcomes import OutcomeCode
from navigation_core.safety.target_checks import Rejection, check_target
from navigation_core.tasks.flying.orbit import Orbit, fly_orbit
from navigation_core.tasks.intents import Handover
from navigation_core.tasks.leading.flight_terms import FlightTerms
from navigation_core.tasks.leading.ring_path import RingYaw
from navigation_core.tasks.task import Task
from navigation_core.tasks.traits import Traits
from navigation_core.tasks.watching.plane_orbit import FlyPlaneOrbit
from navigation_core.tasks.watching.plane_route import circle_max_m
from navigation_core.tasks.waypoint import Route, RouteWaypoint
from navigation_core.trajectories.ring import Ring, ring_speed_m_s

__all__ = ["ORBIT"]

_YAWS = {
    OrbitYaw.CENTRE: RingYaw.CENTRE,
    OrbitYaw.TANGENT: RingYaw.TANGENT,
    OrbitYaw.KEEP: RingYaw.KEEP,
}
# A smaller circle would be lost in the noise of any position estimate.
_RADIUS_MIN_M = 1.0
# A plane's circle is the one that was asked for within this share of its radius.
_OWN_CIRCLE_SHARE = 0.1
# Corners of the polygon about the circle by which fence, flight volume and battery are checked.
_CORNERS = 36


def _check_request(request: OrbitRequest) -> Rejection | None:
    """Check a request without a vehicle: numbers, frame, speed, yaw."""
    numbers = {
        **{
            f"centre.pose.position.{axis}": number
            for axis, number in zip("xyz", request.centre, strict=True)
        },
        "radius": request.radius_m,
        "laps": request.laps,
    }
    bad = [f"{name} is {number}" for name, number in numbers.items() if not math.isfinite(number)]
    if math.isinf(request.height_m):
        bad.append(f"height is {request.height_m}")
    if bad:
        words = f"{', '.join(bad)}; every number must be finite, but a height may be NaN."
        return Rejection(OutcomeCode.INVALID_NUMBER, words)
    rejection = check_frame(request.frame_id, request.centre) or check_speed(request.max_speed_m_s)
    if rejection is not None:
        return rejection
    text = None
    if abs(request.radius_m) < _RADIUS_MIN_M:
        text = (
            f"radius is {request.radius_m:g} m; give at least {_RADIUS_MIN_M:g} m, positive for "
            "anticlockwise seen from above, negative for clockwise."
        )
    elif not 0.0 <= request.laps <= LAPS_MAX:
        text = f"laps is {request.laps:g}; give 0 (until it is cancelled) to {LAPS_MAX}."
    elif request.yaw is None:
        text = "yaw_mode is none of YAW_CENTRE (0), YAW_TANGENT (1) and YAW_KEEP (2)."
    return None if text is None else Rejection(OutcomeCode.INVALID_NUMBER, text)


def _resolve(request: OrbitRequest, snapshot: LocatedSnapshot) -> Ring | Rejection:
    """Return the circle in the map frame, or the reason for its rejection."""
    traits, ground_m, radius_m = snapshot.traits, snapshot.ground_enu_m, abs(request.radius_m)
    x, y, _ = position_in_map(request.frame_id, request.centre, snapshot.pose, snapshot.enu)
    if not math.isnan(request.height_m):
        z = ground_m + request.height_m
    elif not traits.flies:
        z = ground_m
    elif snapshot.flies:
        z = snapshot.pose.position_enu_m[2]
    else:
        z = ground_m + max(snapshot.config.goto.takeoff_height_m, traits.takeoff_height_m)
    if not traits.hovers:
        rejection = _check_plane_circle(request, traits)
        if rejection is not None:
            return rejection
    if radius_m < traits.turning_radius_m:
        return Rejection(
            OutcomeCode.UNSUPPORTED_VEHICLE,
            f"The radius, {radius_m:g} m, is less than that of this {traits.name}'s turning "
            f"circle, {traits.turning_radius_m:.1f} m.",
        )
    centre = on_ground((x, y, z), ground_m, traits)
    if isinstance(centre, Rejection):
        return centre
    return Ring(centre, radius_m, request.radius_m > 0.0)


def _least_circle_m(request: OrbitRequest, traits: Traits) -> float:
    """Return the radius of a plane's turning circle at its speed; infinite if it is not known."""
    if not (traits.airspeed_m_s > 0.0 and traits.circle_acceleration_m_s2 > 0.0):
        return math.inf
    speed_m_s = max(traits.airspeed_m_s, request.max_speed_m_s)
    return speed_m_s * speed_m_s / traits.circle_acceleration_m_s2


def _check_plane_circle(request: OrbitRequest, traits: Traits) -> Rejection | None:
    """Return why a plane does not fly this circle, or None: its usual one it always does."""
    own_m = traits.circle_radius_m if traits.circles_left else -traits.circle_radius_m
    least_m = _least_circle_m(request, traits)
    is_own = abs(request.radius_m - own_m) <= _OWN_CIRCLE_SHARE * traits.circle_radius_m
    if is_own or abs(request.radius_m) >= least_m:
        return None
    text = (
        f"The radius, {abs(request.radius_m):g} m, is less than that of this {traits.name}'s "
        f"turning circle at its airspeed, {least_m:.0f} m; its own is {own_m:g} m (negative is "
        "clockwise)."
    )
    if math.isinf(least_m):
        text = (
            f"The radius is {request.radius_m:g} m; this {traits.name} circles with {own_m:g} m "
            "(negative is clockwise), and its airspeed and greatest bank, which bound other "
            "circles, have not been read from it."
        )
    return Rejection(OutcomeCode.UNSUPPORTED_VEHICLE, text)


def _admit_plane(
    request: OrbitRequest, ring: Ring, snapshot: LocatedSnapshot
) -> Admitted | Rejection:
    """Return the goal of a plane, which is sent to the centre and goes round by itself."""
    config, traits = snapshot.config.goto, snapshot.traits
    circle_m = traits.circle_radius_m if traits.circles_left else -traits.circle_radius_m
    if abs(request.radius_m) >= _least_circle_m(request, traits):
        circle_m = request.radius_m
    speed_m_s = min(request.max_speed_m_s, snapshot.speed_max_m_s) or None
    centre = RouteWaypoint(ring.centre_enu_m, config.arrival_radius_m, max_speed_m_s=speed_m_s)
    warnings = check_obstacles((ring.centre_enu_m,), request.avoid_obstacles, False, snapshot)
    if isinstance(warnings, Rejection):
        return warnings
    admitted = admit_plane(Route((centre,)), snapshot, warnings, abs(circle_m))
    if isinstance(admitted, Rejection) or admitted.plan is None:
        return admitted
    height_m = ring.centre_enu_m[2] - snapshot.ground_enu_m
    takeoff_m = min(height_m, max(config.takeoff_height_m, traits.takeoff_height_m))
    round_s = max(request.laps, 1.0) * math.tau * abs(circle_m) / admitted.plan.speeds_m_s[0]
    laps = request.laps or math.inf
    return replace(
        admitted,
        description=f"circle of {circle_m:g} m, {_laps(request)}",
        make_task=lambda _handover: FlyPlaneOrbit(
            centre, circle_m, laps, config, traits, takeoff_m
        ),
        plan=replace(admitted.plan, hold_s=round_s, margin_m=circle_max_m(abs(circle_m))),
    )


def _laps(request: OrbitRequest) -> str:
    return f"{request.laps:g} laps" if request.laps else "until it is cancelled"


def _speed_m_s(request: OrbitRequest, ring: Ring, snapshot: LocatedSnapshot) -> tuple[float, str]:
    """Return the speed on the circle, and a sentence if it is less than was asked for."""
    limits, traits = snapshot.goto.limits, snapshot.traits
    wanted_m_s = min(request.max_speed_m_s or limits.speed_horizontal_m_s, snapshot.speed_max_m_s)
    turns = traits.flies and request.yaw is not OrbitYaw.KEEP
    most_m_s = ring_speed_m_s(limits, ring.radius_m, turns=turns)
    if not traits.flies:
        most_m_s = min(most_m_s, traits.turn_rate_rad_s * ring.radius_m)
    if wanted_m_s <= most_m_s:
        return wanted_m_s, ""
    if not request.max_speed_m_s:
        return most_m_s, ""
    return most_m_s, (
        f"The speed is {most_m_s:.1f} m/s instead of {wanted_m_s:g} m/s: a circle of "
        f"{ring.radius_m:g} m allows no more with the acceleration and the turn rate of this "
        "vehicle."
    )


def _corners(ring: Ring, from_rad: float) -> tuple[Vector3, ...]:
    """Return the polygon around the circle, from an angle on, in its direction."""
    about = Ring(ring.centre_enu_m, ring.radius_m / math.cos(math.pi / _CORNERS))
    steps = np.linspace(0.0, math.tau, _CORNERS, endpoint=False)
    return tuple(about.point(from_rad + ring.sign * float(step)) for step in steps)


def _check_ring(
    ring: Ring, corners: tuple[Vector3, ...], avoid: bool, snapshot: LocatedSnapshot
) -> Rejection | None:
    """Return why the circle leaves the flight volume or meets a known obstacle, or None."""
    volume = volume_for(snapshot.config.volume, snapshot.traits)
    for step in range(_CORNERS):
        point = ring.point(math.tau * step / _CORNERS)
        rejection = check_target(point, None, snapshot.ground_enu_m, volume)
        if rejection is not None:
            return Rejection(rejection.code, f"On the circle: {rejection.message}")
    return obstacle_on_line((*corners, corners[0]), avoid, snapshot)


def _admit(request: OrbitRequest, snapshot: LocatedSnapshot) -> Admitted | Rejection:
    rejection = _check_request(request) or may_move(snapshot)
    if rejection is not None:
        return rejection
    ring = _resolve(request, snapshot)
    if isinstance(ring, Rejection):
        return ring
    here_enu_m, traits = snapshot.pose.position_enu_m, snapshot.traits
    if not traits.hovers:
        return _admit_plane(request, ring, snapshot)
    from_rad = ring.entry_rad(here_enu_m)
    corners = _corners(ring, from_rad)
    rejection = _check_ring(ring, corners, request.avoid_obstacles, snapshot)
    if rejection is not None:
        return rejection
    # The circle itself is clear of what is known.
    warnings = check_obstacles(corners, request.avoid_obstacles, False, snapshot)
    if isinstance(warnings, Rejection):
        return warnings
    speed_m_s, note = _speed_m_s(request, ring, snapshot)
    avoidance = avoidance_of(request.avoid_obstacles, snapshot)
    orbit = Orbit(
        ring,
        request.laps or math.inf,
        _YAWS[request.yaw or OrbitYaw.CENTRE],
        snapshot.pose.yaw_enu_rad,
        speed_m_s,
    )

    def make_task(handover: Handover) -> Task:
        terms = FlightTerms(snapshot.goto, handover, traits, avoidance, snapshot.bounds)
        return fly_orbit(orbit, terms, here_enu_m)

    end_rad = from_rad + ring.sign * math.tau * request.laps
    direction = "anticlockwise" if ring.anticlockwise else "clockwise"
    x, y, z = ring.centre_enu_m
    return Admitted(
        f"circle of {ring.radius_m:g} m about east {x:.2f}, north {y:.2f}, up {z:.2f} m, "
        f"{direction}, {_laps(request)}, at up to {speed_m_s:.3g} m/s",
        ring.point(end_rad),
        make_task,
        (*warnings, note) if note else warnings,
        FlightPlan(
            corners,
            (speed_m_s,) * len(corners),
            max(math.ceil(request.laps), 1),
            straight=avoidance is None,
            margin_m=traits.target_margin_m,
        ),
    )


ORBIT = TaskKind(ORBIT_ACTION_NAME, OrbitRequest, _admit)
