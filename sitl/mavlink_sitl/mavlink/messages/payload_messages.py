"""Messages about the camera and the gimbal; none without them."""

from __future__ import annotations

import math

from mavlink_sitl.autopilot.devices.payload import PITCH_DEG, YAW_DEG
from mavlink_sitl.mavlink.codec import Message, dialect
from mavlink_sitl.mavlink.messages.snapshot import Snapshot, boot_ms

DEVICE = 1
CAPABILITIES = 206819
"""As recorded of a servo gimbal: retract, neutral, axes, lock, position"""
_HORIZON, _YAW_IN_VEHICLE, _YAW_LOCK = 12, 32, 16
_ROLL_RAD = math.radians(30.0)
_NAN = math.nan


def gimbal_manager_information(s: Snapshot) -> Message | None:
    """GIMBAL_MANAGER_INFORMATION."""
    if not s.vehicle.payload.has_gimbal:
        return None
    limits = [-_ROLL_RAD, _ROLL_RAD, *map(math.radians, (*PITCH_DEG, *YAW_DEG))]
    return dialect.MAVLink_gimbal_manager_information_message(
        boot_ms(s), CAPABILITIES, DEVICE, *limits
    )


def gimbal_manager_status(s: Snapshot) -> Message | None:
    """GIMBAL_MANAGER_STATUS."""
    payload = s.vehicle.payload
    if not payload.has_gimbal:
        return None
    return dialect.MAVLink_gimbal_manager_status_message(
        boot_ms(s), _HORIZON, DEVICE, *payload.control, 0, 0
    )


def gimbal_device_attitude_status(s: Snapshot) -> Message | None:
    """GIMBAL_DEVICE_ATTITUDE_STATUS: its yaw is from the nose, also where it is locked."""
    payload = s.vehicle.payload
    if not payload.has_gimbal:
        return None
    pitch_rad, yaw_rad, locked = payload.angles_rad()
    if locked:
        yaw_rad = math.remainder(yaw_rad - s.motion.yaw_rad, math.tau)
    cp, sp = math.cos(pitch_rad / 2), math.sin(pitch_rad / 2)
    cy, sy = math.cos(yaw_rad / 2), math.sin(yaw_rad / 2)
    flags = _HORIZON | _YAW_IN_VEHICLE | (_YAW_LOCK if locked else 0)
    return dialect.MAVLink_gimbal_device_attitude_status_message(
        0, 0, boot_ms(s), flags, [cp * cy, -sp * sy, sp * cy, cp * sy], _NAN, _NAN, _NAN, 0,
        _NAN, _NAN, DEVICE,
    )  # fmt: skip


def camera_information(s: Snapshot) -> Message | None:
    """CAMERA_INFORMATION, with capture of images only."""
    if not s.vehicle.payload.has_camera:
        return None
    nameless = [0] * 32
    return dialect.MAVLink_camera_information_message(
        boot_ms(s), nameless, nameless, 0, _NAN, _NAN, _NAN, 0, 0, 0, 2, 0, b"", DEVICE
    )


def camera_settings(s: Snapshot) -> Message | None:
    """CAMERA_SETTINGS."""
    if not s.vehicle.payload.has_camera:
        return None
    return dialect.MAVLink_camera_settings_message(boot_ms(s), 0, _NAN, _NAN, 0)


def camera_capture_status(s: Snapshot) -> Message | None:
    """CAMERA_CAPTURE_STATUS."""
    payload = s.vehicle.payload
    if not payload.has_camera:
        return None
    return dialect.MAVLink_camera_capture_status_message(
        boot_ms(s), 0, 0, 0.0, 0, _NAN, payload.photos, 0
    )


def camera_feedback(s: Snapshot) -> Message | None:
    """CAMERA_FEEDBACK of the last photo."""
    payload = s.vehicle.payload
    if not payload.has_camera:
        return None
    place, m = s.vehicle.navigator.here(), s.motion
    home_m = (s.vehicle.navigator.home or s.vehicle.navigator.origin)[2]
    return dialect.MAVLink_camera_feedback_message(
        s.unix_time_us, 0, 0, payload.photos, round(place[0] * 1e7), round(place[1] * 1e7),
        place[2], place[2] - home_m, math.degrees(m.roll_rad), math.degrees(m.pitch_rad),
        math.degrees(m.yaw_rad) % 360.0, 0.0, 0, 0,
    )  # fmt: skip
