"""Makes the MAVLink messages by which both kinds of logs are retold."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TypeAlias

from mavlink_vehicle.codec import Message, make, mavlink

Told: TypeAlias = tuple[float, Message]
"""Seconds since 1970, and a message."""

_HEARTBEAT_S = 1.0
_I16, _U16, _I32 = 2**15 - 1, 2**16 - 1, 2**31 - 1
_TEXT_MAX = 50


@dataclass
class Telling:
    """What a log has told so far of a vehicle.

    Attributes:
        autopilot: MAV_AUTOPILOT.
        vehicle_type: MAV_TYPE; GENERIC while unknown.
        mode: custom_mode of HEARTBEAT; None before it was told.
        armed: whether the motors are armed.
        velocity_ned_m_s: None before it was told.
        heading_deg: clockwise from North; None before it was told.
        home_altitude_m: above mean sea level; None before it was told.
        told: the messages, in the order of the log.
    """

    autopilot: int
    vehicle_type: int = mavlink.MAV_TYPE_GENERIC
    mode: int | None = None
    armed: bool = False
    velocity_ned_m_s: tuple[float, float, float] | None = None
    heading_deg: float | None = None
    home_altitude_m: float | None = None
    told: list[Told] = field(default_factory=list)
    _beaten_s: float = -math.inf

    def add(self, time_s: float, name: str, **fields: object) -> None:
        """Add a message, and before it HEARTBEAT if one is due."""
        if time_s - self._beaten_s >= _HEARTBEAT_S:
            self.beat(time_s)
        self.told.append((time_s, make(name, **fields)))

    def beat(self, time_s: float) -> None:
        """Add HEARTBEAT, once the mode is known."""
        if self.mode is None:
            return
        self._beaten_s = time_s
        base_mode = mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
        if self.armed:
            base_mode |= mavlink.MAV_MODE_FLAG_SAFETY_ARMED
        message = make(
            "HEARTBEAT",
            type=self.vehicle_type,
            autopilot=self.autopilot,
            base_mode=base_mode,
            custom_mode=self.mode,
            system_status=mavlink.MAV_STATE_ACTIVE if self.armed else mavlink.MAV_STATE_STANDBY,
            mavlink_version=3,
        )
        self.told.append((time_s, message))

    def position(
        self,
        time_s: float,
        boot_s: float,
        place: tuple[float, float, float],
        above_home_m: float | None = None,
    ) -> None:
        """Add GLOBAL_POSITION_INT.

        Args:
            time_s: seconds since 1970.
            boot_s: since the autopilot started.
            place: latitude and longitude in degrees, altitude above mean sea level in metres.
            above_home_m: height above home; from `home_altitude_m` without it.
        """
        latitude_deg, longitude_deg, altitude_m = place
        if not all(map(math.isfinite, place)) or not (latitude_deg or longitude_deg):
            return
        if above_home_m is None:
            above_home_m = (
                0.0 if self.home_altitude_m is None else altitude_m - self.home_altitude_m
            )
        heading = (
            _U16 if self.heading_deg is None else round(self.heading_deg % 360.0 * 100) % 36000
        )
        velocity = self.velocity_ned_m_s or (0.0, 0.0, 0.0)
        self.add(
            time_s,
            "GLOBAL_POSITION_INT",
            time_boot_ms=round(boot_s * 1e3) & 0xFFFFFFFF,
            lat=round(latitude_deg * 1e7),
            lon=round(longitude_deg * 1e7),
            alt=_limited(altitude_m * 1e3, _I32),
            relative_alt=_limited(above_home_m * 1e3, _I32),
            vx=_limited(velocity[0] * 100.0, _I16),
            vy=_limited(velocity[1] * 100.0, _I16),
            vz=_limited(velocity[2] * 100.0, _I16),
            hdg=heading,
        )

    def battery(
        self, time_s: float, voltage_v: float, current_a: float, percent: float | None
    ) -> None:
        """Add SYS_STATUS with the battery; numbers that are not finite are unknown."""
        known = percent is not None and math.isfinite(percent)
        self.add(
            time_s,
            "SYS_STATUS",
            voltage_battery=_U16
            if not math.isfinite(voltage_v)
            else min(max(round(voltage_v * 1e3), 0), _U16 - 1),
            current_battery=-1 if not math.isfinite(current_a) else _limited(current_a * 100, _I16),
            battery_remaining=min(max(round(percent or 0.0), 0), 100) if known else -1,
        )

    def text(self, time_s: float, severity: int, text: str) -> None:
        """Add STATUSTEXT, in pieces where it is long."""
        raw = text.encode("utf-8", "replace")
        number = len(self.told) % _U16 + 1 if len(raw) > _TEXT_MAX else 0
        for piece in range(0, max(len(raw), 1), _TEXT_MAX):
            self.add(
                time_s,
                "STATUSTEXT",
                severity=severity,
                text=raw[piece : piece + _TEXT_MAX],
                id=number,
                chunk_seq=piece // _TEXT_MAX,
            )


def _limited(value: float, limit: int) -> int:
    return min(max(round(value), -limit), limit) if math.isfinite(value) else 0
