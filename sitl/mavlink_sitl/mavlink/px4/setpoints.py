"""PX4's reading of SET_POSITION_TARGET_LOCAL_NED and _GLOBAL_INT.

Every component has its own ignore bit; NaN means the same (read in the firmware). An ignored
component is NaN in the `Setpoint`, and a group that is ignored whole is None. A setpoint
that cannot be flown is rejected with a text at every message, and does not count as part of the
stream.
"""

from __future__ import annotations

import math

from mavlink_sitl.autopilot.px4.vehicle import Px4Vehicle
from mavlink_sitl.autopilot.state.setpoint import Setpoint, SetpointFrame
from mavlink_sitl.exchange import GRAVITY_M_S2, Vector
from mavlink_sitl.geodesy import GeoPoint
from mavlink_sitl.mavlink.codec import Message
from mavlink_sitl.mavlink.setpoints import YAW_IGNORE, YAW_RATE_IGNORE, usable

FORCE = 0x200
BODY_YAW_RATE_IGNORE, THRUST_IGNORE, ATTITUDE_IGNORE = 0x04, 0x40, 0x80
"""ATTITUDE_TARGET_TYPEMASK"""
HOVER_THRUST = 0.5
LEAST_QUATERNION = 1e-6
LOCAL_FRAMES = {1: SetpointFrame.LOCAL, 8: SetpointFrame.BODY}
"""MAV_FRAME_LOCAL_NED; MAV_FRAME_BODY_NED, of which only velocity and acceleration count"""
AMSL, RELATIVE, TERRAIN = 5, 6, 11
"""MAV_FRAME_GLOBAL_INT, _RELATIVE_ALT_INT, _TERRAIN_ALT_INT; 0, 3 and 10 are rejected"""


class RefusedError(ValueError):
    """A setpoint that PX4 does not take; the message is what it says about it."""


def _group(message: Message, names: tuple[str, str, str], first_bit: int) -> Vector | None:
    values = [
        math.nan if message.type_mask & first_bit << place else getattr(message, name)
        for place, name in enumerate(names)
    ]
    used = [value for value in values if not math.isnan(value)]
    if not all(usable(value) for value in used):
        raise RefusedError(f"{message.get_type()} invalid")
    return (values[0], values[1], values[2]) if used else None


def _angle(message: Message, name: str, ignore_bit: int) -> float | None:
    value = float(getattr(message, name))
    if message.type_mask & ignore_bit or math.isnan(value):
        return None
    if not usable(value):
        raise RefusedError(f"{message.get_type()} invalid")
    return value


def _rest(message: Message) -> tuple[Vector | None, Vector | None, float | None, float | None]:
    kind, mask = message.get_type(), message.type_mask
    velocity = _group(message, ("vx", "vy", "vz"), 0x008)
    acceleration = _group(message, ("afx", "afy", "afz"), 0x040)
    if mask & FORCE and acceleration is not None:
        raise RefusedError(f"{kind} force not supported")
    yaw = _angle(message, "yaw", YAW_IGNORE)
    return velocity, acceleration, yaw, _angle(message, "yaw_rate", YAW_RATE_IGNORE)


def _checked(kind: str, setpoint: Setpoint) -> Setpoint:
    vectors = (setpoint.position_m, setpoint.velocity_m_s, setpoint.acceleration_m_s2)
    if all(vector is None for vector in vectors):
        raise RefusedError(f"{kind} invalid")
    return setpoint


def from_local_ned(message: Message) -> Setpoint:
    """The setpoint.

    Raises:
        RefusedError: an illegal frame, nothing to follow, or numbers that are none.
    """
    kind = message.get_type()
    frame = LOCAL_FRAMES.get(message.coordinate_frame)
    if frame is None:
        raise RefusedError(f"{kind} coordinate frame {message.coordinate_frame} unsupported")
    position = _group(message, ("x", "y", "z"), 0x001)
    velocity, acceleration, yaw, yaw_rate = _rest(message)
    if frame is SetpointFrame.BODY:
        position = None
    return _checked(kind, Setpoint(frame, position, velocity, acceleration, yaw, yaw_rate))


def from_attitude_target(message: Message) -> Setpoint:
    """SET_ATTITUDE_TARGET as the acceleration of a multicopter; others do not move by it.

    Rates are those of a level vehicle, of which only the turn counts. Half thrust carries the
    weight (MPC_THR_HOVER).

    Raises:
        RefusedError: numbers that are none.
    """
    mask, (w, x, y, z) = message.type_mask, message.q
    values = (w, x, y, z, message.thrust, message.body_yaw_rate)
    if not all(math.isfinite(value) for value in values):
        raise RefusedError("SET_ATTITUDE_TARGET invalid")
    push = GRAVITY_M_S2 * (1.0 if mask & THRUST_IGNORE else message.thrust / HOVER_THRUST)
    size = w * w + x * x + y * y + z * z
    if mask & ATTITUDE_IGNORE or size < LEAST_QUATERNION:
        w, x, y, z, size = 1.0, 0.0, 0.0, 0.0, 1.0
    down = (2 * (x * z + w * y), 2 * (y * z - w * x), w * w - x * x - y * y + z * z)
    north, east, upright = (-push * value / size for value in down)
    turns = bool(mask & ATTITUDE_IGNORE) or not mask & BODY_YAW_RATE_IGNORE
    heading = math.atan2(2 * (w * z + x * y), w * w + x * x - y * y - z * z)
    return Setpoint(
        SetpointFrame.LOCAL,
        acceleration_m_s2=(north, east, upright + GRAVITY_M_S2),
        yaw_rad=None if turns else heading,
        yaw_rate_rad_s=message.body_yaw_rate if turns else None,
    )


def from_global_int(message: Message, vehicle: Px4Vehicle) -> Setpoint:
    """The setpoint in the local frame.

    Raises:
        RefusedError: as above, or a place that is not on earth.
    """
    kind, frame = message.get_type(), message.coordinate_frame
    navigator = vehicle.navigator
    if frame not in (AMSL, RELATIVE, TERRAIN):
        raise RefusedError(f"{kind} invalid coordinate frame {frame}")
    latitude, longitude = message.lat_int / 1e7, message.lon_int / 1e7
    ignored = [bool(message.type_mask & bit) for bit in (1, 2, 4)]
    position: Vector | None = None
    if not all(ignored):
        on_earth = abs(latitude) <= 90.0 and abs(longitude) <= 180.0
        if not on_earth or not (usable(message.alt) or math.isnan(message.alt)):
            raise RefusedError(f"{kind} invalid")
        base = navigator.home or navigator.origin
        altitude = message.alt + (0.0 if frame == AMSL else base.altitude_amsl_m)
        place = navigator.place_ned_m(GeoPoint(latitude, longitude, altitude))
        axes = [math.nan if skip else value for skip, value in zip(ignored, place, strict=True)]
        position = (axes[0], axes[1], axes[2])
    velocity, acceleration, yaw, yaw_rate = _rest(message)
    return _checked(
        kind, Setpoint(SetpointFrame.LOCAL, position, velocity, acceleration, yaw, yaw_rate)
    )
