"""Items of a plan for cameras, gimbals, grippers and outputs, as acts of a waypoint. No ROS.

Meanings: https://mavlink.io/en/messages/common.html#mav_commands.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

from mavlink_vehicle.codec import mavlink
from navigation_bridge.goals.requests import ActKind, ActRequest, PointMode
from navigation_bridge.plan_files.items import PlanError, PlanItem, command_name

__all__ = ["ACT_ITEMS", "act_of"]

_SHOOT = 1.0
_NEUTRAL = ActRequest(ActKind.POINT, point=PointMode.NEUTRAL)


def act_of(item: PlanItem) -> ActRequest | None:
    """Return the act of an item of `ACT_ITEMS`; None for one that no act expresses.

    Raises:
        PlanError: its numbers have no meaning.
    """
    return ACT_ITEMS[item.command](item)


def _photo(item: PlanItem) -> ActRequest | None:
    return ActRequest(ActKind.PHOTO) if item.params[4] == _SHOOT else None


def _capture(item: PlanItem) -> ActRequest | None:
    """A single photo; a series by time is none."""
    return ActRequest(ActKind.PHOTO) if item.params[2] == 1.0 else None


def _by_distance(item: PlanItem) -> ActRequest:
    distance_m = _number(item, 1, "the distance")
    if distance_m < 0.0:
        raise PlanError(f"{item.where}: the distance (param 1) is {distance_m:g}; give 0 or more.")
    return ActRequest(ActKind.TRIGGER_DISTANCE, distance_m=distance_m)


def _point(item: PlanItem) -> ActRequest | None:
    pitch_deg, yaw_deg, *rates = item.params[:4]
    flags = item.params[4]
    bits = int(flags) if math.isfinite(flags) else 0
    if bits & mavlink.GIMBAL_MANAGER_FLAGS_NEUTRAL:
        return _NEUTRAL
    turns = any(math.isfinite(rate) and rate != 0.0 for rate in rates)
    if turns or not (math.isfinite(pitch_deg) and math.isfinite(yaw_deg)):
        return None
    return _angle(pitch_deg, yaw_deg, locked=bool(bits & mavlink.GIMBAL_MANAGER_FLAGS_YAW_LOCK))


def _mount(item: PlanItem) -> ActRequest | None:
    pitch_deg, yaw_deg, mode = item.params[0], item.params[2], item.params[6]
    if mode == float(mavlink.MAV_MOUNT_MODE_NEUTRAL):
        return _NEUTRAL
    is_angle = mode == float(mavlink.MAV_MOUNT_MODE_MAVLINK_TARGETING)
    if not is_angle or not (math.isfinite(pitch_deg) and math.isfinite(yaw_deg)):
        return None
    return _angle(pitch_deg, yaw_deg, locked=False)


def _angle(pitch_deg: float, yaw_deg: float, *, locked: bool) -> ActRequest:
    yaw_rad = math.radians(90.0 - yaw_deg) if locked else -math.radians(yaw_deg)
    return ActRequest(
        ActKind.POINT,
        pitch_rad=math.radians(pitch_deg),
        yaw_rad=math.remainder(yaw_rad, math.tau),
        yaw_locked=locked,
    )


def _at_position(item: PlanItem) -> ActRequest:
    latitude_deg, longitude_deg, altitude_m = item.params[4:7]
    if not all(map(math.isfinite, (latitude_deg, longitude_deg, altitude_m))):
        raise PlanError(f"{item.where}: {command_name(item.command)} has no position.")
    target = (latitude_deg, longitude_deg, altitude_m)
    return ActRequest(ActKind.POINT, point=PointMode.POSITION, target=target)


def _gripper(item: PlanItem) -> ActRequest:
    action = item.params[1]
    if action not in (0.0, 1.0):
        raise PlanError(f"{item.where}: DO_GRIPPER has action {action:g} (param 2); give 0 or 1.")
    return ActRequest(ActKind.GRIPPER, grabs=action == 1.0)


def _servo(item: PlanItem) -> ActRequest:
    channel, pulse_us = _number(item, 1, "the output"), _number(item, 2, "the pulse")
    if not (1.0 <= channel <= 255.0 and 0.0 <= pulse_us <= 65_535.0):
        raise PlanError(f"{item.where}: DO_SET_SERVO of output {channel:g} to {pulse_us:g} us.")
    return ActRequest(ActKind.SERVO, channel=round(channel), pulse_us=round(pulse_us))


def _number(item: PlanItem, number: int, what: str) -> float:
    value = item.params[number - 1]
    if not math.isfinite(value):
        name = command_name(item.command)
        raise PlanError(f"{item.where}: {name}: {what} (param {number}) is {value:g}.")
    return value


ACT_ITEMS: Mapping[int, Callable[[PlanItem], ActRequest | None]] = {
    mavlink.MAV_CMD_DO_DIGICAM_CONTROL: _photo,
    mavlink.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW: _point,
    mavlink.MAV_CMD_DO_GRIPPER: _gripper,
    mavlink.MAV_CMD_DO_MOUNT_CONTROL: _mount,
    mavlink.MAV_CMD_DO_SET_CAM_TRIGG_DIST: _by_distance,
    mavlink.MAV_CMD_DO_SET_ROI_LOCATION: _at_position,
    mavlink.MAV_CMD_DO_SET_ROI_NONE: lambda _: _NEUTRAL,
    mavlink.MAV_CMD_DO_SET_SERVO: _servo,
    mavlink.MAV_CMD_IMAGE_START_CAPTURE: _capture,
}
