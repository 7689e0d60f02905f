"""ArduPilot's DataFlash format: each record has the number of its FMT, which describes it.

Records, fields and numbers as in a log of the real copter 4.7. Only the records that describe a
flight are written: FMT, PARM, MSG, VER, MODE, ARM, ATT, POS, GPS, BAT. A log begins with arming;
the record of arming comes before it and so is not in it (observed).
"""

from __future__ import annotations

import math
import struct

from mavlink_sitl.exchange import Severity, StatusText
from mavlink_sitl.mavlink.logs.logbook import FlightLog
from mavlink_sitl.mavlink.messages.snapshot import Snapshot, heading_deg, place_e7, to_i32

_HEAD = b"\xa3\x95"
_FMT = 128
_FORMATS = {
    "FMT": (_FMT, "BBnNZ", "Type,Length,Name,Format,Columns"),
    "PARM": (32, "QNff", "TimeUS,Name,Value,Default"),
    "MSG": (59, "QBBZ", "TimeUS,ID,Seq,Message"),
    "VER": (
        207,
        "QBHBBBBIZHBBII",
        "TimeUS,BT,BST,Maj,Min,Pat,FWT,GH,FWS,APJ,BU,FV,IMI,ICI",
    ),
    "MODE": (120, "QMBB", "TimeUS,Mode,ModeNum,Rsn"),
    "ARM": (187, "QBIBB", "TimeUS,ArmState,ArmChecks,Forced,Method"),
    "ATT": (72, "QffffffB", "TimeUS,DesRoll,Roll,DesPitch,Pitch,DesYaw,Yaw,AEKF"),
    "POS": (74, "QLLfff", "TimeUS,Lat,Lng,Alt,RelHomeAlt,RelOriginAlt"),
    "GPS": (
        94,
        "QBBIHBcLLeffffB",
        "TimeUS,I,Status,GMS,GWk,NSats,HDop,Lat,Lng,Alt,Spd,GCrs,VZ,Yaw,U",
    ),
    "BAT": (
        88,
        "QBfffffcfBBB",
        "TimeUS,Inst,Volt,VoltR,Curr,CurrTot,EnrgTot,Temp,Res,RemPct,H,SH",
    ),
}
_PACKED = {"n": "4s", "N": "16s", "Z": "64s", "M": "B", "c": "h", "L": "i", "e": "i"}
_STRUCTS = {
    name: struct.Struct("<" + "".join(_PACKED.get(letter, letter) for letter in form))
    for name, (_, form, _) in _FORMATS.items()
}
_GPS_EPOCH_UNIX_S, _LEAP_S = 315_964_800, 18
_WEEK_S = 604_800
_BY_COMMAND, _METHOD_MAVLINK = 2, 1
_BUILDS = {"copter": (2, "ArduCopter"), "plane": (3, "ArduPlane")}
_ROVER = (1, "ArduRover")
"""VER.BU and the name of the firmware, by kind"""
_EVERY_GPS, _EVERY_BATTERY = 2, 10


class DataFlashLog(FlightLog):
    """A `.BIN` file."""

    def __init__(self, s: Snapshot) -> None:
        super().__init__(s)
        self._mode: int | None = None
        self._texts = 0
        for name, (number, form, columns) in _FORMATS.items():
            length = _STRUCTS[name].size + len(_HEAD) + 1
            self._add("FMT", number, length, name.encode(), form.encode(), columns.encode("ascii"))
        parameters = s.vehicle.parameters
        for name in parameters.of_interest():
            default = parameters.specs[name].default
            self._add("PARM", s.time_boot_us, name.encode(), parameters[name], default)
        self._add_version(s)

    def _add_version(self, s: Snapshot) -> None:
        personality = s.vehicle.personality
        build, name = _BUILDS.get(personality.kind, _ROVER)
        number = personality.flight_sw_version & 0xFFFFFFFF
        major, minor, patch, kind = number.to_bytes(4, "big")
        git = personality.flight_custom_version
        text = f"{name} V{major}.{minor}.{patch} ({git})"
        self.text(s.time_boot_us, StatusText(Severity.INFO, text))
        self._add(
            "VER", s.time_boot_us, 3, 0xFFFF, major, minor, patch, kind, int(git, 16),
            text.encode("ascii")[:64], 0, build, 0, 0, 0,
        )  # fmt: skip

    def sample(self, s: Snapshot, count: int) -> None:
        """Add ATT and POS, and now and then GPS and BAT; MODE and ARM when they change."""
        time_us, vehicle, motion = s.time_boot_us, s.vehicle, s.motion
        mode = vehicle.mode.spec.number
        if mode != self._mode:
            self._mode = mode
            self._add("MODE", time_us, mode, mode, _BY_COMMAND)
        if not vehicle.armed:
            self._add("ARM", time_us, 0, 0, 0, _METHOD_MAVLINK)
        roll, pitch = math.degrees(motion.roll_rad), math.degrees(motion.pitch_rad)
        yaw = heading_deg(motion.yaw_rad)
        self._add("ATT", time_us, roll, roll, pitch, pitch, yaw, yaw, 3)
        if vehicle.estimator.gps_started:
            here = vehicle.navigator.here()
            up_m = vehicle.navigator.height_above_home_m()
            self._add("POS", time_us, *place_e7(here), here.altitude_amsl_m, up_m, -motion.down_m)
        if count % _EVERY_GPS == 0:
            self._add_gps(s)
        if count % _EVERY_BATTERY == 0 and vehicle.battery_known:
            battery = s.battery
            percent = min(max(round(battery.remaining_percent), 0), 100)
            drawn = (battery.current_a, battery.consumed_mah, battery.consumed_wh)
            self._add("BAT", time_us, 0, battery.voltage_v, 0.0, *drawn, 0, 0.0, percent, 1, 0)

    def _add_gps(self, s: Snapshot) -> None:
        gps = s.vehicle.body.gps_reading()
        if gps is None or not s.unix_time_us:
            return
        week_s = s.unix_time_us / 1e6 - _GPS_EPOCH_UNIX_S + _LEAP_S
        week = int(week_s // _WEEK_S)
        self._add(
            "GPS", s.time_boot_us, 0, gps.fix_type, round((week_s - week * _WEEK_S) * 1000.0), week,
            gps.satellites, min(gps.eph, 32767), *place_e7(gps.point),
            to_i32(gps.point.altitude_amsl_m * 100.0), gps.speed_m_s, gps.course_deg,
            s.motion.velocity_down_m_s, 0.0, 1,
        )  # fmt: skip

    def text(self, time_boot_us: int, text: StatusText) -> None:
        """Add MSG: 64 bytes of it."""
        self._add("MSG", time_boot_us, self._texts % 256, 0, text.text.encode("utf-8")[:64])
        self._texts += 1

    def _add(self, name: str, *values: float | bytes) -> None:
        self.data += _HEAD + bytes((_FORMATS[name][0],)) + _STRUCTS[name].pack(*values)
