"""Makes the MAVLink messages by which both kinds of logs are retold."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TypeAlias

from mavlink_vehicle.codec import Message, make, mavlink

TimedMessage: TypeAlias = tuple[float, Message]
"""Seconds since 1970, and a message."""
Place: TypeAlias = tuple[float, float, float]
"""Latitude and longitude in degrees, altitude above mean sea level in metres."""

_HEARTBEAT_S = 1.0
_CREDIBLE_STEP_S = 60.0
_I16, _U16, _I32 = 2**15 - 1, 2**16 - 1, 2**31 - 1
_TEXT_MAX = 50


@dataclass(frozen=True)
class OwnLog:
    """The content of an autopilot's own log.

    Attributes:
        messages: the messages, in the order of time; since the autopilot started where the log has
            no date.
        damage: what of the file is damaged, a phrase each.
        remarks: what the log lacks, a sentence each.
    """

    messages: list[TimedMessage]
    damage: tuple[str, ...] = ()
    remarks: tuple[str, ...] = ()


def credible(time_s: float, next_s: float) -> bool:
    """Return whether a record's time agrees with that of the next record.

    A time that lies far ahead is damaged; a gap is not, and neither is a clock that starts again.
    """
    return math.isfinite(time_s) and time_s <= next_s + _CREDIBLE_STEP_S


@dataclass
class Telling:
    """The state of a vehicle, as far as its log has been read.

    Attributes:
        autopilot: MAV_AUTOPILOT.
        vehicle_type: MAV_TYPE; GENERIC while unknown.
        mode: custom_mode of HEARTBEAT; None before the log has it.
        armed: whether the motors are armed.
        velocity_ned_m_s: None before the log has it.
        heading_deg: clockwise from North; None before the log has it.
        home_altitude_m: above mean sea level; None before the log has it.
        version: AUTOPILOT_VERSION.flight_sw_version that the log names; None if it doesn't.
        messages: the messages, in the order of the log.
    """

    autopilot: int
    vehicle_type: int = mavlink.MAV_TYPE_GENERIC
    mode: int | None = None
    armed: bool = False
    velocity_ned_m_s: tuple[float, float, float] | None = None
    heading_deg: float | None = None
    home_altitude_m: float | None = None
    version: int | None = None
    messages: list[TimedMessage] = field(default_factory=list)
    _beaten_s: float = -math.inf
    _origin: Place | None = None

    def add(self, time_s: float, name: str, **fields: object) -> None:
        """Add a message, and before it HEARTBEAT if one is due."""
        if time_s - self._beaten_s >= _HEARTBEAT_S:
            self.beat(time_s)
        self.messages.append((time_s, make(name, **fields)))

    def beat(self, time_s: float) -> None:
        """Add HEARTBEAT, once the mode is known."""
        if self.mode is None:
            return
        if self._beaten_s == -math.inf and self.version is not None:
            self._tell_version(time_s, self.version)
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
        self.messages.append((time_s, message))

    def pulse(self, time_s: float) -> None:
        """Add HEARTBEAT if one is due: the log has a record of this time."""
        if time_s - self._beaten_s >= _HEARTBEAT_S:
            self.beat(time_s)

    def firmware(self, time_s: float, version: int) -> None:
        """Add AUTOPILOT_VERSION, if the log has not named the version before."""
        if self.version is None:
            self.version = version
            self._tell_version(time_s, version)

    def _tell_version(self, time_s: float, version: int) -> None:
        message = make("AUTOPILOT_VERSION", flight_sw_version=version & 0xFFFFFFFF)
        self.messages.append((time_s, message))

    def origin(self, time_s: float, place: Place) -> None:
        """Add GPS_GLOBAL_ORIGIN if it has changed."""
        if _is_place(place) and place != self._origin:
            self._origin = place
            self.add(time_s, "GPS_GLOBAL_ORIGIN", **_place(place))

    def home(self, time_s: float, place: Place) -> None:
        """Add HOME_POSITION."""
        if _is_place(place):
            self.home_altitude_m = place[2]
            unknown = dict.fromkeys(("x", "y", "z"), math.nan)
            self.add(time_s, "HOME_POSITION", **_place(place), **unknown)

    def local(
        self,
        time_s: float,
        boot_s: float,
        position_ned_m: tuple[float, float, float],
        velocity_ned_m_s: tuple[float, float, float],
    ) -> None:
        """Add LOCAL_POSITION_NED."""
        values = (*position_ned_m, *velocity_ned_m_s)
        if all(map(math.isfinite, values)):
            fields = dict(zip(("x", "y", "z", "vx", "vy", "vz"), values, strict=True))
            self.add(time_s, "LOCAL_POSITION_NED", time_boot_ms=_boot_ms(boot_s), **fields)

    def position(
        self,
        time_s: float,
        boot_s: float,
        place: Place,
        above_home_m: float | None = None,
    ) -> None:
        """Add GLOBAL_POSITION_INT.

        Args:
            time_s: seconds since 1970.
            boot_s: since the autopilot started.
            place: where.
            above_home_m: height above home; from `home_altitude_m` without it.
        """
        if not _is_place(place):
            return
        latitude_deg, longitude_deg, altitude_m = place
        if above_home_m is None or not math.isfinite(above_home_m):
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
            time_boot_ms=_boot_ms(boot_s),
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
        current_ca = _limited(current_a * 100.0, _I16)
        self.add(
            time_s,
            "SYS_STATUS",
            voltage_battery=_U16
            if not math.isfinite(voltage_v)
            else min(max(round(voltage_v * 1e3), 0), _U16 - 1),
            # -1 means unknown, and a charging current is negative.
            current_battery=(0 if current_ca == -1 else current_ca)
            if math.isfinite(current_a)
            else -1,
            battery_remaining=min(max(round(percent or 0.0), 0), 100) if known else -1,
        )

    def text(self, time_s: float, severity: int, text: str) -> None:
        """Add STATUSTEXT, in pieces where it is long."""
        raw = text.encode("utf-8", "replace")
        number = len(self.messages) % _U16 + 1 if len(raw) > _TEXT_MAX else 0
        for piece in range(0, max(len(raw), 1), _TEXT_MAX):
            self.add(
                time_s,
                "STATUSTEXT",
                severity=severity,
                text=raw[piece : piece + _TEXT_MAX],
                id=number,
                chunk_seq=piece // _TEXT_MAX,
            )


def _is_place(place: Place) -> bool:
    latitude_deg, longitude_deg, _ = place
    return (
        all(map(math.isfinite, place))
        and abs(latitude_deg) <= 90.0
        and abs(longitude_deg) <= 180.0
        and (latitude_deg != 0.0 or longitude_deg != 0.0)
    )


def _place(place: Place) -> dict[str, int]:
    latitude_deg, longitude_deg, altitude_m = place
    return {
        "latitude": round(latitude_deg * 1e7),
        "longitude": round(longitude_deg * 1e7),
        "altitude": _limited(altitude_m * 1e3, _I32),
    }


def _boot_ms(boot_s: float) -> int:
    return round(max(boot_s, 0.0) * 1e3) & 0xFFFFFFFF


def _limited(value: float, limit: int) -> int:
    return min(max(round(value), -limit), limit) if math.isfinite(value) else 0
