"""Measurements of position and attitude, made of the fields of their messages in wire order.

They come more often than anything else, and without pymavlink's objects where nobody needs those.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from mavlink_vehicle.positions.frames import normalize_angle
from mavlink_vehicle.state.telemetry import Attitude, GlobalPosition, LocalPosition

_UINT16_MAX = 0xFFFF
_INT32_MAX = 0x7FFFFFFF
_CENTIDEGREE = math.radians(0.01)
# Does what a named tuple's own constructor does, without its Python: it runs for every position.
_make: Callable[..., Any] = tuple.__new__


def global_position(
    now: float,
    time_boot_ms: int,
    latitude: int,
    longitude: int,
    altitude_mm: int,
    relative_altitude_mm: int,
    north_cm_s: int,
    east_cm_s: int,
    down_cm_s: int,
    heading: int,
) -> GlobalPosition | None:
    """Return what GLOBAL_POSITION_INT says; None while the vehicle has no position.

    Args:
        now: when it came, in seconds.
        time_boot_ms: the vehicle's time of it.
        latitude: in 1e-7 degrees.
        longitude: in 1e-7 degrees.
        altitude_mm: above mean sea level.
        relative_altitude_mm: above home.
        north_cm_s: ground velocity.
        east_cm_s: ground velocity.
        down_cm_s: ground velocity.
        heading: in centidegrees; 65535 when unknown.
    """
    if latitude == 0 == longitude or latitude == _INT32_MAX or longitude == _INT32_MAX:
        return None
    values = (
        now,
        time_boot_ms,
        latitude * 1e-7,
        longitude * 1e-7,
        altitude_mm * 1e-3,
        relative_altitude_mm * 1e-3,
        (north_cm_s * 0.01, east_cm_s * 0.01, down_cm_s * 0.01),
        None if heading == _UINT16_MAX else normalize_angle(heading * _CENTIDEGREE),
    )
    position: GlobalPosition = _make(GlobalPosition, values)
    return position


def local_position(
    now: float,
    time_boot_ms: int,
    north_m: float,
    east_m: float,
    down_m: float,
    north_m_s: float,
    east_m_s: float,
    down_m_s: float,
) -> LocalPosition | None:
    """Return what LOCAL_POSITION_NED says; None if that is not a number."""
    if not math.isfinite(north_m + east_m + down_m + north_m_s + east_m_s + down_m_s):
        return None
    values = (now, time_boot_ms, (north_m, east_m, down_m), (north_m_s, east_m_s, down_m_s))
    position: LocalPosition = _make(LocalPosition, values)
    return position


def attitude(
    now: float,
    time_boot_ms: int,
    roll_rad: float,
    pitch_rad: float,
    yaw_ned_rad: float,
    roll_rad_s: float,
    pitch_rad_s: float,
    yaw_rad_s: float,
) -> Attitude | None:
    """Return what ATTITUDE says; None if that is not a number."""
    if not math.isfinite(roll_rad + pitch_rad + yaw_ned_rad + roll_rad_s + pitch_rad_s + yaw_rad_s):
        return None
    yaw_ned_rad = normalize_angle(yaw_ned_rad)
    rates = (roll_rad_s, pitch_rad_s, yaw_rad_s)
    made: Attitude = _make(Attitude, (now, time_boot_ms, roll_rad, pitch_rad, yaw_ned_rad, rates))
    return made
