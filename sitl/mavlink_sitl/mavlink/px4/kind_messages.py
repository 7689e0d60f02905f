"""PX4's telemetry of rovers, boats and planes where it differs from a multicopter's.

The modules of rovers publish no setpoints of attitude and local position, so ATTITUDE_TARGET
and POSITION_TARGET_LOCAL_NED can be asked for, and never come.
"""

from __future__ import annotations

import math

from mavlink_sitl.autopilot.px4.multicopter.orbit import Orbit
from mavlink_sitl.autopilot.px4.plane.path_guidance import PathPoint
from mavlink_sitl.autopilot.px4.plane.plane import Px4Plane
from mavlink_sitl.autopilot.px4.plane.plane_modes import Hold, PlaneMode
from mavlink_sitl.autopilot.px4.rover.rover_modes import DriveMode
from mavlink_sitl.mavlink.codec import Message, dialect
from mavlink_sitl.mavlink.messages import status_messages as status
from mavlink_sitl.mavlink.messages.snapshot import (
    Builder,
    Snapshot,
    boot_ms,
    never,
    place_e7,
)
from mavlink_sitl.mavlink.px4 import messages
from mavlink_sitl.mavlink.px4.messages import DISARMED_US


def drive_outputs(s: Snapshot) -> Message:
    """SERVO_OUTPUT_RAW: steering on 1 and throttle on 2."""
    outputs = [DISARMED_US] * 2
    if s.vehicle.armed:
        steering, _, throttle, _ = s.vehicle.body.servos_us()
        outputs = [steering, throttle]
    return status.servo_outputs(s, outputs, DISARMED_US)


def drive_target(s: Snapshot) -> Message | None:
    """POSITION_TARGET_GLOBAL_INT: where an AUTO mode drives to; no velocities."""
    vehicle = messages.firmware_of(s)
    mode = vehicle.mode
    if not (isinstance(mode, DriveMode) and mode.way and vehicle.armed):
        return None
    return _global_target(s, (*mode.way.target, s.motion.down_m), 0.0)


def _plane_mode(s: Snapshot) -> PlaneMode:
    mode = messages.firmware_of(s).mode
    assert isinstance(mode, PlaneMode)
    return mode


def _flying_path(s: Snapshot) -> PathPoint | None:
    """The path that an armed plane follows; None while disarmed or without a path."""
    return _plane_mode(s).path if s.vehicle.armed else None


def surface_outputs(s: Snapshot) -> Message:
    """SERVO_OUTPUT_RAW: aileron, elevator, rudder, throttle."""
    aileron, elevator, throttle, rudder = s.vehicle.body.servos_us()
    outputs = [DISARMED_US] * 4
    if s.vehicle.armed:
        outputs = [aileron, elevator, rudder, throttle]
    return status.servo_outputs(s, outputs, DISARMED_US)


def attitude_target(s: Snapshot) -> Message:
    """ATTITUDE_TARGET of a plane."""
    return messages.attitude_target(s, s.throttle_fraction)


def path_target(s: Snapshot) -> Message | None:
    """POSITION_TARGET_LOCAL_NED: the nearest place of the path, at the height to reach."""
    path = _flying_path(s)
    if path is None:
        return None
    nans = [messages.NAN] * 8
    return dialect.MAVLink_position_target_local_ned_message(
        boot_ms(s), 1, 0, *path.nearest, _plane_mode(s).place[2], *nans
    )


def place_target(s: Snapshot) -> Message | None:
    """POSITION_TARGET_GLOBAL_INT: where an AUTO mode flies to; velocities are not given."""
    mode = _plane_mode(s)
    if mode.path is None or not s.vehicle.armed or not mode.spec.name.startswith("AUTO."):
        return None
    return _global_target(s, mode.place, messages.NAN)


def _global_target(s: Snapshot, place: tuple[float, float, float], rest: float) -> Message:
    point = s.vehicle.navigator.frame.to_geodetic(*place)
    return dialect.MAVLink_position_target_global_int_message(
        boot_ms(s), 5, 0, *place_e7(point), point.altitude_amsl_m, *[rest] * 8,
    )  # fmt: skip


def _orbit_status(s: Snapshot, radius_m: float, centre: tuple[float, float, float]) -> Message:
    point = s.vehicle.navigator.frame.to_geodetic(*centre)
    return dialect.MAVLink_orbit_execution_status_message(
        s.time_boot_us, radius_m, dialect.MAV_FRAME_GLOBAL, *place_e7(point), point.altitude_amsl_m,
    )  # fmt: skip


def orbit_status(s: Snapshot) -> Message | None:
    """ORBIT_EXECUTION_STATUS of a multicopter: in its mode, also on the way to the circle."""
    mode = messages.firmware_of(s).mode
    if not isinstance(mode, Orbit) or mode.centre is None or not s.vehicle.armed:
        return None
    return _orbit_status(s, math.copysign(mode.radius_m, mode.speed_m_s), mode.centre)


def circle_status(s: Snapshot) -> Message | None:
    """ORBIT_EXECUTION_STATUS of a plane: in AUTO.LOITER."""
    plane, mode = s.vehicle, _plane_mode(s)
    assert isinstance(plane, Px4Plane)
    if not isinstance(mode, Hold) or mode.target is None or plane.circling is None:
        return None
    (north, east), radius_m = plane.circling
    return _orbit_status(s, radius_m, (north, east, mode.target[2]))


_DRIVE: dict[int, Builder] = {
    36: drive_outputs,
    83: never,
    85: never,
    87: drive_target,
}
_FLY: dict[int, Builder] = {
    36: surface_outputs,
    83: attitude_target,
    85: path_target,
    87: place_target,
    360: circle_status,
}
BUILDERS: dict[str, dict[int, Builder]] = {
    "px4copter": {**messages.BUILDERS, 360: orbit_status},
    "px4rover": {**messages.BUILDERS, **_DRIVE},
    "px4boat": {**messages.BUILDERS, **_DRIVE},
    "px4plane": {**messages.BUILDERS, **_FLY},
}
"""By vehicle type and message id"""
