"""One vehicle at one moment for telemetry, and conversions of numbers to field ranges."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

from mavlink_sitl.autopilot.common.commander import Commander
from mavlink_sitl.exchange import BatteryReading, Motion
from mavlink_sitl.geodesy import GeoPoint
from mavlink_sitl.mavlink.codec import Message


class Snapshot(NamedTuple):
    """All that telemetry is made of, of one vehicle at one moment."""

    time_boot_us: int
    unix_time_us: int
    """0 until the GPS has reported the time."""
    vehicle: Commander
    motion: Motion
    battery: BatteryReading
    thrust_over_hover: float
    throttle_fraction: float
    airspeed_m_s: float | None
    """Of who measures it"""


Builder = Callable[[Snapshot], Message | list[Message] | None]
"""Makes a message, or none where there is nothing to say"""


def never(_: Snapshot) -> None:
    """For messages that are accepted when asked for, and never sent."""
    return


def to_int(value: float, low: int, high: int) -> int:
    """Rounded and limited to a field's range."""
    number = round(value)
    return number if low <= number <= high else low if number < low else high


def to_i16(value: float) -> int:
    """Rounded, limited to int16."""
    number = round(value)
    return number if -32768 <= number <= 32767 else to_int(number, -32768, 32767)


def to_u16(value: float) -> int:
    """Rounded, limited to uint16."""
    number = round(value)
    return number if 0 <= number <= 65535 else to_int(number, 0, 65535)


def to_i32(value: float) -> int:
    """Rounded, limited to int32."""
    number = round(value)
    return number if -(2**31) <= number < 2**31 else to_int(number, -(2**31), 2**31 - 1)


def place_e7(point: GeoPoint) -> tuple[int, int]:
    """Latitude and longitude, 1e7 degrees."""
    return to_i32(point.latitude_deg * 1e7), to_i32(point.longitude_deg * 1e7)


def place_mm(point: GeoPoint) -> tuple[int, int, int]:
    """The same, and the altitude above sea level in millimetres."""
    return (*place_e7(point), to_i32(point.altitude_amsl_m * 1000.0))


def boot_ms(s: Snapshot) -> int:
    """time_boot_ms of a message; wraps after 49 days as the field does."""
    return (s.time_boot_us // 1000) & 0xFFFFFFFF


def heading_deg(yaw_rad: float) -> float:
    """0..360, clockwise from North."""
    return math.degrees(yaw_rad) % 360.0
