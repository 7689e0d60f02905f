"""One vehicle at one moment, as telemetry needs it, and numbers that fit into fields."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

from mavlink_sitl.autopilot.copter import Copter
from mavlink_sitl.exchange import BatteryReading, GpsReading, Motion, RangeReading
from mavlink_sitl.geodesy import GeoPoint


class Snapshot(NamedTuple):
    """All that telemetry is made of, of one vehicle at one moment."""

    time_boot_us: int
    unix_time_us: int
    """0 while the GPS has not told the time."""
    copter: Copter
    motion: Motion
    gps: GpsReading | None
    """None before the receiver is found."""
    battery: BatteryReading
    thrust_over_hover: float
    throttle_fraction: float
    truth: Motion
    truth_point: GeoPoint
    wind_ned_m_s: tuple[float, float, float]
    servos_us: tuple[int, ...]
    """Of who has no four equal motors"""
    airspeed_m_s: float | None
    """Of who measures it"""
    look_around: Callable[[], RangeReading | None]
    """The range sensors; None when there are none"""


def to_int(value: float, low: int, high: int) -> int:
    """Rounded and limited to a field's range."""
    return int(min(max(round(value), low), high))


def to_i16(value: float) -> int:
    """Rounded, limited to int16."""
    return to_int(value, -32768, 32767)


def to_u16(value: float) -> int:
    """Rounded, limited to uint16."""
    return to_int(value, 0, 65535)


def to_i32(value: float) -> int:
    """Rounded, limited to int32."""
    return to_int(value, -(2**31), 2**31 - 1)


def boot_ms(s: Snapshot) -> int:
    """time_boot_ms of a message; wraps after 49 days as the field does."""
    return (s.time_boot_us // 1000) & 0xFFFFFFFF


def heading_deg(yaw_rad: float) -> float:
    """0..360, clockwise from North."""
    return math.degrees(yaw_rad) % 360.0
