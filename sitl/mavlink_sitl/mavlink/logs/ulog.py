"""PX4's ULog format: definitions first, then data (https://docs.px4.io/main/en/dev_log/ulog_file_format.html).

Topics and fields have PX4 1.17's names; only those that describe a flight are written.
"""

from __future__ import annotations

import math
import struct

from mavlink_sitl.autopilot.parameters import ParameterType
from mavlink_sitl.autopilot.personality import px4
from mavlink_sitl.exchange import StatusText
from mavlink_sitl.mavlink.logs.logbook import FlightLog
from mavlink_sitl.mavlink.messages.position_messages import quaternion
from mavlink_sitl.mavlink.messages.snapshot import Snapshot

_MAGIC = b"ULog\x01\x12\x35\x01"
_FIELDS = {
    "vehicle_attitude": "uint64_t timestamp;float[4] q;",
    "vehicle_local_position": "uint64_t timestamp;float x;float y;float z;float vx;float vy;"
    "float vz;float heading;",
    "vehicle_global_position": "uint64_t timestamp;double lat;double lon;float alt;",
    "vehicle_status": "uint64_t timestamp;uint8_t arming_state;uint8_t nav_state;"
    "uint8_t system_type;",
    "vehicle_gps_position": "uint64_t timestamp;double latitude_deg;double longitude_deg;"
    "double altitude_msl_m;uint64_t time_utc_usec;uint8_t fix_type;uint8_t satellites_used;",
    "battery_status": "uint64_t timestamp;float voltage_v;float current_a;float remaining;",
    "home_position": "uint64_t timestamp;double lat;double lon;float alt;",
}
_STRUCTS = {
    name: struct.Struct("<" + form)
    for name, form in {
        "vehicle_attitude": "Q4f",
        "vehicle_local_position": "Q7f",
        "vehicle_global_position": "Qddf",
        "vehicle_status": "QBBB",
        "vehicle_gps_position": "QdddQBB",
        "battery_status": "Qfff",
        "home_position": "Qddf",
    }.items()
}
_NUMBERS = {name: number for number, name in enumerate(_FIELDS)}
_NAV_STATES = {
    px4.MANUAL: 0,
    px4.ALTCTL: 1,
    px4.POSCTL: 2,
    px4.MISSION: 3,
    px4.LOITER: 4,
    px4.RTL: 5,
    px4.TERMINATION: 13,
    px4.OFFBOARD: 14,
    px4.TAKEOFF: 17,
    px4.LAND: 18,
}
"""vehicle_status.nav_state by HEARTBEAT.custom_mode"""
_MANUAL = 0
_EVERY_GPS, _EVERY_SLOW = 2, 10


class ULog(FlightLog):
    """A `.ulg` file."""

    def __init__(self, s: Snapshot) -> None:
        super().__init__(s)
        self.data += _MAGIC + struct.pack("<Q", s.time_boot_us)
        self._add("B", bytes(40))
        self._inform("char[3] sys_name", b"PX4")
        version = struct.pack("<I", s.vehicle.personality.flight_sw_version & 0xFFFFFFFF)
        self._inform("uint32_t ver_sw_release", version)
        for name, fields in _FIELDS.items():
            self._add("F", f"{name}:{fields}".encode("ascii"))
        parameters = s.vehicle.parameters
        for name in parameters.of_interest():
            is_float = parameters.specs[name].type is ParameterType.REAL32
            key = f"{'float' if is_float else 'int32_t'} {name}"
            value = parameters[name]
            packed = struct.pack("<f", value) if is_float else struct.pack("<i", int(value))
            self._inform(key, packed, "P")
        for name, number in _NUMBERS.items():
            self._add("A", struct.pack("<BH", 0, number) + name.encode("ascii"))
        self._status: tuple[int, ...] | None = None

    def sample(self, s: Snapshot, count: int) -> None:
        """Add attitude and position, now and then the rest; vehicle_status when it changes."""
        time_us, vehicle, motion = s.time_boot_us, s.vehicle, s.motion
        status = (
            2 if vehicle.armed else 1,
            _NAV_STATES.get(vehicle.mode.spec.number, _MANUAL),
            vehicle.personality.mav_type,
        )
        if status != self._status or count % _EVERY_SLOW == 0:
            self._status = status
            self._log("vehicle_status", time_us, *status)
        self._log("vehicle_attitude", time_us, *quaternion(motion))
        if vehicle.estimator.gps_started:
            yaw = math.remainder(motion.yaw_rad, math.tau)
            self._log("vehicle_local_position", time_us, *motion[:6], yaw)
            here = vehicle.navigator.here()
            place = (here.latitude_deg, here.longitude_deg, here.altitude_amsl_m)
            self._log("vehicle_global_position", time_us, *place)
        gps = s.vehicle.body.gps_reading() if count % _EVERY_GPS == 0 else None
        if gps is not None:
            point = gps.point
            place = (point.latitude_deg, point.longitude_deg, point.altitude_amsl_m)
            fix = (s.unix_time_us, gps.fix_type, gps.satellites)
            self._log("vehicle_gps_position", time_us, *place, *fix)
        if count % _EVERY_SLOW == 0:
            self._log_slow(s)

    def _log_slow(self, s: Snapshot) -> None:
        battery, home = s.battery, s.vehicle.navigator.home
        if s.vehicle.battery_known:
            left = battery.remaining_percent / 100.0
            self._log("battery_status", s.time_boot_us, battery.voltage_v, battery.current_a, left)
        if home is not None:
            place = (home.latitude_deg, home.longitude_deg, home.altitude_amsl_m)
            self._log("home_position", s.time_boot_us, *place)

    def text(self, time_boot_us: int, text: StatusText) -> None:
        """Add a logged string; the level is a digit, as syslog's."""
        level = ord("0") + int(text.severity)
        self._add("L", struct.pack("<BQ", level, time_boot_us) + text.text.encode("utf-8"))

    def _log(self, name: str, *values: float) -> None:
        self._add("D", struct.pack("<H", _NUMBERS[name]) + _STRUCTS[name].pack(*values))

    def _inform(self, key: str, value: bytes, kind: str = "I") -> None:
        self._add(kind, bytes((len(key),)) + key.encode("ascii") + value)

    def _add(self, kind: str, payload: bytes) -> None:
        self.data += struct.pack("<HB", len(payload), ord(kind)) + payload
