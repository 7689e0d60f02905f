"""Requested acts at waypoints, checked and resolved into the map frame. No ROS."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

from mavlink_vehicle.profiles import Profile
from navigation_bridge.goals.point_requests import check_geodetic
from navigation_bridge.goals.requests import ActKind, ActRequest, PointMode, WaypointRequest
from navigation_core.geometry import Vector3
from navigation_core.outcomes import OutcomeCode, Rejection
from navigation_core.tasks.inputs.waypoint_acts import (
    PointAngle,
    PointNeutral,
    PointPosition,
    SetServo,
    TakePhoto,
    TriggerDistance,
    UseGripper,
    VehicleAct,
    WaitHere,
    WaypointAct,
)

__all__ = ["ACTS_MAX", "check_acts", "check_equipment", "resolve_acts"]

ACTS_MAX = 20
"""At one waypoint."""
_WAIT_MIN_S, _WAIT_MAX_S = 0.1, 3600.0
# Below this an autopilot's estimate moves as far by itself.
_DISTANCE_MIN_M, _DISTANCE_MAX_M = 0.1, 10_000.0
# ArduPilot has 32 outputs. Pulses of servos and motor controllers are within this range.
_CHANNEL_MAX = 32
_PULSE_MIN_US, _PULSE_MAX_US = 500, 2500
_EQUIPMENT = {
    ActKind.PHOTO: "camera",
    ActKind.TRIGGER_DISTANCE: "camera",
    ActKind.POINT: "gimbal",
    ActKind.GRIPPER: "gripper",
}


def check_acts(waypoint: WaypointRequest) -> Rejection | None:
    """Check the acts of a waypoint without a vehicle."""
    count = len(waypoint.acts)
    if count > ACTS_MAX:
        text = f"it has {count} acts; send at most {ACTS_MAX} for one waypoint."
        return Rejection(OutcomeCode.INVALID_WAYPOINTS, text)
    for number, act in enumerate(waypoint.acts, start=1):
        if act.kind is None:
            text = f"act {number} has an unknown kind; send one of those in WaypointAct.msg."
            return Rejection(OutcomeCode.INVALID_WAYPOINTS, text)
        rejection = _CHECKS[act.kind](act)
        if rejection is None and _is_at_position(act) and waypoint.altitude_reference is not None:
            rejection = check_geodetic(act.target)
        if rejection is not None:
            text = f"act {number} ({act.kind.name}): {rejection.message}"
            return Rejection(rejection.code, text)
    return None


def check_equipment(
    waypoint: WaypointRequest,
    profile: Profile,
    parameters: Mapping[str, float],
    *,
    by_mission: bool = False,
) -> Rejection | None:
    """Return why this vehicle cannot do the acts, by its kind and its parameters, or None.

    Args:
        waypoint: the waypoint.
        profile: that of the vehicle.
        parameters: what is known of its parameters.
        by_mission: whether the acts are stored in the vehicle.
    """
    rules = profile.equipment
    for number, act in enumerate(waypoint.acts, start=1):
        what = "" if act.kind is None else _EQUIPMENT.get(act.kind, "")
        name, absent = rules.absent.get(what, ("", math.nan))
        text = ""
        if parameters.get(name) == absent:
            text = f"the vehicle has no {what} ({name} is {absent:g})"
        elif act.kind is ActKind.SERVO and act.channel > rules.channel_max:
            text = f"channel is {act.channel}; {profile.name} has {rules.channel_max} outputs"
        elif act.kind is ActKind.SERVO and by_mission and rules.actuators:
            text = f"{profile.name} takes outputs by setpoints only, not in a mission"
        elif act.required and by_mission:
            text = "required is for setpoints; a vehicle does not report the acts of its mission"
        if act.kind is not None and text:
            text = f"act {number} ({act.kind.name}): {text}; change or remove the act."
            return Rejection(OutcomeCode.UNSUPPORTED_VEHICLE, text)
    return None


def resolve_acts(
    waypoint: WaypointRequest, to_map: Callable[[Vector3], Vector3]
) -> tuple[WaypointAct, ...]:
    """Return the acts of a waypoint that passed :func:`check_acts`.

    Args:
        waypoint: the waypoint.
        to_map: converts a position in the waypoint's frame into the map frame.
    """
    return tuple(WaypointAct(_resolved(act, to_map), act.required) for act in waypoint.acts)


def _resolved(act: ActRequest, to_map: Callable[[Vector3], Vector3]) -> VehicleAct | WaitHere:
    if act.kind is ActKind.PHOTO:
        return TakePhoto()
    if act.kind is ActKind.TRIGGER_DISTANCE:
        return TriggerDistance(act.distance_m)
    if act.kind is ActKind.GRIPPER:
        return UseGripper(act.grabs is True)
    if act.kind is ActKind.SERVO:
        return SetServo(act.channel, act.pulse_us)
    if act.kind is ActKind.WAIT:
        return WaitHere(act.duration_s)
    if act.point is PointMode.POSITION:
        return PointPosition(to_map(act.target))
    if act.point is PointMode.NEUTRAL:
        return PointNeutral()
    return PointAngle(act.pitch_rad, act.yaw_rad, act.yaw_locked)


def _is_at_position(act: ActRequest) -> bool:
    return act.kind is ActKind.POINT and act.point is PointMode.POSITION


def _finite(**numbers: float) -> Rejection | None:
    for name, number in numbers.items():
        if not math.isfinite(number):
            text = f"{name} is {number}; every number must be finite."
            return Rejection(OutcomeCode.INVALID_NUMBER, text)
    return None


def _invalid(text: str) -> Rejection:
    return Rejection(OutcomeCode.INVALID_WAYPOINTS, text)


def _check_photo(_act: ActRequest) -> None:
    return None


def _check_distance(act: ActRequest) -> Rejection | None:
    distance_m = act.distance_m
    rejection = _finite(distance=distance_m)
    if rejection is None and not (
        distance_m == 0.0 or _DISTANCE_MIN_M <= distance_m <= _DISTANCE_MAX_M
    ):
        return _invalid(
            f"distance is {distance_m:g} m; give {_DISTANCE_MIN_M:g} to {_DISTANCE_MAX_M:g} m, or "
            "0 to end the photos."
        )
    return rejection


def _check_point(act: ActRequest) -> Rejection | None:
    if act.point is None:
        return _invalid("point is unknown; send POINT_ANGLE, POINT_POSITION or POINT_NEUTRAL.")
    if act.point is PointMode.POSITION:
        return _finite(**{f"target.{a}": n for a, n in zip("xyz", act.target, strict=True)})
    if act.point is PointMode.NEUTRAL:
        return None
    rejection = _finite(pitch=act.pitch_rad, yaw=act.yaw_rad)
    if rejection is None and not abs(act.pitch_rad) <= math.pi / 2.0 + 1e-3:
        return _invalid(
            f"pitch is {act.pitch_rad:g} rad; give -1.5708 (straight down) to 1.5708 rad."
        )
    if rejection is None and not abs(act.yaw_rad) <= math.tau:
        return _invalid(f"yaw is {act.yaw_rad:g} rad; give -6.2832 to 6.2832 rad.")
    return rejection


def _check_gripper(act: ActRequest) -> Rejection | None:
    if act.grabs is None:
        return _invalid("gripper is unknown; send GRIPPER_RELEASE or GRIPPER_GRAB.")
    return None


def _check_servo(act: ActRequest) -> Rejection | None:
    if not 1 <= act.channel <= _CHANNEL_MAX:
        return _invalid(f"channel is {act.channel}; outputs are 1 to {_CHANNEL_MAX}.")
    if not _PULSE_MIN_US <= act.pulse_us <= _PULSE_MAX_US:
        return _invalid(f"pulse is {act.pulse_us} us; give {_PULSE_MIN_US} to {_PULSE_MAX_US} us.")
    return None


def _check_wait(act: ActRequest) -> Rejection | None:
    rejection = _finite(duration=act.duration_s)
    if rejection is None and not _WAIT_MIN_S <= act.duration_s <= _WAIT_MAX_S:
        return _invalid(
            f"duration is {act.duration_s:g} s; give {_WAIT_MIN_S:g} to {_WAIT_MAX_S:g} s."
        )
    return rejection


_CHECKS: Mapping[ActKind, Callable[[ActRequest], Rejection | None]] = {
    ActKind.PHOTO: _check_photo,
    ActKind.TRIGGER_DISTANCE: _check_distance,
    ActKind.POINT: _check_point,
    ActKind.GRIPPER: _check_gripper,
    ActKind.SERVO: _check_servo,
    ActKind.WAIT: _check_wait,
}
