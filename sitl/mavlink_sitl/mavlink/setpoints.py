"""SET_POSITION_TARGET_LOCAL_NED and _GLOBAL_INT to `Setpoint`.

How masks are read, as the recordings show and the firmware does: one ignore bit of a group
ignores the whole group. `Guided.setpoint` decides whether the groups that are left can be flown.
"""

from __future__ import annotations

import math

from mavlink_sitl.autopilot.common.commander import Commander
from mavlink_sitl.autopilot.state.setpoint import DriveTarget, Setpoint, SetpointFrame
from mavlink_sitl.exchange import Vector
from mavlink_sitl.geodesy import GeoPoint
from mavlink_sitl.mavlink.codec import Message
from mavlink_sitl.mavlink.received_command import ReceivedCommand

POSITION_IGNORE = 0x007
VELOCITY_IGNORE = 0x038
ACCELERATION_IGNORE = 0x1C0
YAW_IGNORE = 0x400
YAW_RATE_IGNORE = 0x800

LOCAL_FRAMES = {
    1: SetpointFrame.LOCAL,
    7: SetpointFrame.OFFSET,
    8: SetpointFrame.BODY,
    9: SetpointFrame.BODY,
}
"""MAV_FRAME_LOCAL_NED, _LOCAL_OFFSET_NED, _BODY_NED, _BODY_OFFSET_NED"""

AMSL_FRAMES = (0, 5)
"""MAV_FRAME_GLOBAL, _GLOBAL_INT"""
RELATIVE_FRAMES = (3, 6)
"""MAV_FRAME_GLOBAL_RELATIVE_ALT, _GLOBAL_RELATIVE_ALT_INT"""
TERRAIN_FRAMES = (10, 11)
"""MAV_FRAME_GLOBAL_TERRAIN_ALT, _INT: the ground is flat, so the same as above home"""


MOST = 1e9
"""No sensible metre, metre per second or radian is larger; beyond it floats run out"""


class UnusableError(ValueError):
    """A field that is not ignored is NaN, infinite or beyond all sense."""

    def __init__(self, fields: list[str]) -> None:
        """Name the fields."""
        super().__init__(f"{', '.join(fields)} not usable")


def usable(value: float) -> bool:
    """Whether a number is finite and not beyond all sense."""
    return abs(value) <= MOST  # false for NaN, too


def _groups(message: Message) -> tuple[Vector | None, Vector | None, float | None, float | None]:
    """Velocity, acceleration, yaw and yaw rate as far as they are not ignored."""
    mask = message.type_mask
    velocity = None if mask & VELOCITY_IGNORE else (message.vx, message.vy, message.vz)
    acceleration = None if mask & ACCELERATION_IGNORE else (message.afx, message.afy, message.afz)
    yaw = None if mask & YAW_IGNORE else message.yaw
    yaw_rate = None if mask & YAW_RATE_IGNORE else message.yaw_rate
    return velocity, acceleration, yaw, yaw_rate


def _refuse_unusable(setpoint: Setpoint) -> Setpoint:
    bad = []
    named = (
        ("position", setpoint.position_m),
        ("velocity", setpoint.velocity_m_s),
        ("acceleration", setpoint.acceleration_m_s2),
        ("yaw", None if setpoint.yaw_rad is None else (setpoint.yaw_rad,)),
        ("yaw_rate", None if setpoint.yaw_rate_rad_s is None else (setpoint.yaw_rate_rad_s,)),
    )
    for name, values in named:
        if values is not None and not all(usable(value) for value in values):
            bad.append(name)
    if bad:
        raise UnusableError(bad)
    return setpoint


def from_local_ned(message: Message) -> Setpoint | None:
    """The setpoint, or None for a frame that is silently ignored.

    Raises:
        UnusableError: a field in use is NaN, infinite or absurd. (The real firmware's simulator
            aborts on a NaN in a position.)
    """
    frame = LOCAL_FRAMES.get(message.coordinate_frame)
    if frame is None:
        return None
    position = None
    if not message.type_mask & POSITION_IGNORE:
        position = (message.x, message.y, message.z)
    velocity, acceleration, yaw, yaw_rate = _groups(message)
    return _refuse_unusable(Setpoint(frame, position, velocity, acceleration, yaw, yaw_rate))


def from_global_int(message: Message, vehicle: Commander) -> Setpoint | None:
    """The setpoint in the local frame, or None for a frame or place that is ignored.

    Raises:
        UnusableError: a field in use is NaN, infinite or absurd.
    """
    frame = message.coordinate_frame
    if frame not in AMSL_FRAMES + RELATIVE_FRAMES + TERRAIN_FRAMES:
        return None
    position = None
    if not message.type_mask & POSITION_IGNORE:
        if not usable(message.alt):
            raise UnusableError(["altitude"])
        position = local_position(vehicle, frame, message.lat_int, message.lon_int, message.alt)
        if position is None:
            return None
    velocity, acceleration, yaw, yaw_rate = _groups(message)
    return _refuse_unusable(
        Setpoint(
            SetpointFrame.LOCAL, position, velocity, acceleration, yaw, yaw_rate, is_global=True
        )
    )


def place_of(vehicle: Commander, command: ReceivedCommand, long_frame: int) -> Vector | None:
    """The position a command names, in the local frame; None if it names none."""
    x, y, frame = command.x, command.y, command.frame
    if not usable(command.z):
        return None
    if command.is_long:
        if not (usable(x) and usable(y)):
            return None
        x, y, frame = x * 1e7, y * 1e7, long_frame
    return local_position(vehicle, frame, int(x), int(y), command.z)


TURN_RATE_IGNORE, THRUST_IGNORE, ATTITUDE_IGNORE = 0x04, 0x40, 0x80
"""ATTITUDE_TARGET_TYPEMASK"""
UNIT_TOLERANCE = 1e-3


def from_attitude_target(message: Message) -> DriveTarget | None:
    """The target of a rover, or None for what is silently ignored: no thrust, or no attitude.

    The message's yaw rate counts more than its attitude, which has to be of length 1.

    Raises:
        UnusableError: a field in use is NaN, infinite or absurd.
    """
    mask = message.type_mask
    if mask & THRUST_IGNORE:
        return None
    turns = not mask & TURN_RATE_IGNORE
    rate = message.body_yaw_rate if turns else 0.0
    quaternion = (1.0, 0.0, 0.0, 0.0) if mask & ATTITUDE_IGNORE else tuple(message.q)
    parts = {"attitude": quaternion, "body rates": (rate,), "thrust": (message.thrust,)}
    bad = [name for name, values in parts.items() if not all(map(usable, values))]
    if bad:
        raise UnusableError(bad)
    if turns:
        return DriveTarget(message.thrust, None, rate)
    if abs(math.hypot(*quaternion) - 1.0) > UNIT_TOLERANCE:
        return None
    w, x, y, z = quaternion
    heading = math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    return DriveTarget(message.thrust, heading, 0.0)


def local_position(
    vehicle: Commander, frame: int, latitude_e7: int, longitude_e7: int, altitude_m: float
) -> Vector | None:
    """A global place in the local frame; None when it is not on earth or the frame unknown."""
    latitude, longitude = latitude_e7 / 1e7, longitude_e7 / 1e7
    if abs(latitude) > 90.0 or abs(longitude) > 180.0:
        return None
    if frame in AMSL_FRAMES:
        altitude_amsl_m = altitude_m
    elif frame in RELATIVE_FRAMES + TERRAIN_FRAMES:
        home = vehicle.navigator.home or vehicle.navigator.origin
        altitude_amsl_m = home.altitude_amsl_m + altitude_m
    else:
        return None
    return vehicle.navigator.frame.to_local(GeoPoint(latitude, longitude, altitude_amsl_m))
