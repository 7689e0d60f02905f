"""Logs such as each release of both firmwares writes them: its records, fields and names.

The fields are those of ArduPilot's LogStructure.h and Log.pde or Log.cpp, and of PX4's msg folder,
at the time of each release. The flight is always the same: `SECONDS` on a circle, with three modes.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Iterator
from dataclasses import dataclass, field

SECONDS = 60
RADIUS_M = 30.0
SPEED_M_S = 4.0
HEIGHT_M = 10.0
HOME = (47.397742, 8.545594, 488.0)
BEGUN_UNIX_S = 1_500_000_000
BOOT_S = 75
VOLTAGE_V = (16.4, 15.8)
PERCENT = (90.0, 80.0)
MODES_AT_S = (0, 20, 40)
_METRES_PER_DEGREE = 111_318.845
_GPS_EPOCH_UNIX_S, _LEAP_S, _WEEK_S = 315_964_800, 18, 604_800


@dataclass(frozen=True)
class Sample:
    """Where the vehicle is at a time; angles in degrees, velocity NED."""

    time_s: float
    latitude_deg: float
    longitude_deg: float
    heading_deg: float
    north_m: float
    east_m: float
    velocity_ned_m_s: tuple[float, float, float]


def sample(time_s: float) -> Sample:
    """The vehicle at a time since the log's beginning."""
    angle = SPEED_M_S / RADIUS_M * time_s
    north_m, east_m = RADIUS_M * math.sin(angle), RADIUS_M * (1.0 - math.cos(angle))
    latitude, longitude, _ = HOME
    return Sample(
        time_s,
        latitude + north_m / _METRES_PER_DEGREE,
        longitude + east_m / _METRES_PER_DEGREE / math.cos(math.radians(latitude)),
        math.degrees(angle) % 360.0,
        north_m,
        east_m,
        (SPEED_M_S * math.cos(angle), SPEED_M_S * math.sin(angle), 0.0),
    )


# --- ArduPilot --------------------------------------------------------------------------------

_LETTERS = {"n": "4s", "N": "16s", "Z": "64s", "M": "b", "c": "h", "C": "H", "L": "i", "e": "i",
            "E": "I"}  # fmt: skip
_SCALES = {"c": 100.0, "C": 100.0, "e": 100.0, "E": 100.0, "L": 1e7}
_FMT = ("BBnNZ", "Type,Length,Name,Format,Columns")
# By the first ArduCopter that has them; a later one of the same name replaces them.
_FORMATS: dict[str, dict[str, tuple[str, str]]] = {
    "3.1": {
        "PARM": ("Nf", "Name,Value"),
        "MSG": ("Z", "Message"),
        "ATT": ("IccccCC", "TimeMS,DesRoll,Roll,DesPitch,Pitch,DesYaw,Yaw"),
        "GPS": ("BIHBcLLeeEefI", "Status,TimeMS,Week,NSats,HDop,Lat,Lng,RelAlt,Alt,Spd,GCrs,VZ,T"),
        "CURR": ("IhIhhhf", "TimeMS,ThrOut,ThrInt,Volt,Curr,Vcc,CurrTot"),
        "EV": ("B", "Id"),
    },
    "3.2": {
        "ATT": ("IccccCCCC", "TimeMS,DesRoll,Roll,DesPitch,Pitch,DesYaw,Yaw,ErrRP,ErrYaw"),
        "EKF1": ("IccCffffffccc", "TimeMS,Roll,Pitch,Yaw,VN,VE,VD,PN,PE,PD,GX,GY,GZ"),
    },
    "3.3": {
        "PARM": ("QNf", "TimeUS,Name,Value"),
        "MSG": ("QZ", "TimeUS,Message"),
        "ATT": ("QccccCCCC", "TimeUS,DesRoll,Roll,DesPitch,Pitch,DesYaw,Yaw,ErrRP,ErrYaw"),
        "GPS": (
            "QBIHBcLLeeEefB",
            "TimeUS,Status,GMS,GWk,NSats,HDop,Lat,Lng,RAlt,Alt,Spd,GCrs,VZ,U",
        ),
        "CURR": ("QhhhHfh", "TimeUS,Throttle,Volt,Curr,Vcc,CurrTot,Volt2"),
        "EV": ("QB", "TimeUS,Id"),
        "MODE": ("QMB", "TimeUS,Mode,ModeNum"),
        "POS": ("QLLff", "TimeUS,Lat,Lng,Alt,RelAlt"),
        "EKF1": ("QccCffffffccc", "TimeUS,Roll,Pitch,Yaw,VN,VE,VD,PN,PE,PD,GX,GY,GZ"),
        "ORGN": ("QBLLe", "TimeUS,Type,Lat,Lng,Alt"),
    },
    "3.4": {
        "GPS": ("QBIHBcLLefffB", "TimeUS,Status,GMS,GWk,NSats,HDop,Lat,Lng,Alt,Spd,GCrs,VZ,U"),
        "CURR": ("Qfff", "TimeUS,Volt,Curr,CurrTot"),
        "MODE": ("QMBB", "TimeUS,Mode,ModeNum,Rsn"),
        "EKF1": ("", ""),
        "NKF1": ("QccCfffffffccc", "TimeUS,Roll,Pitch,Yaw,VN,VE,VD,dPD,PN,PE,PD,GX,GY,GZ"),
    },
    "3.5": {
        "POS": ("QLLfff", "TimeUS,Lat,Lng,Alt,RelHomeAlt,RelOriginAlt"),
        "CURR": ("", ""),
        "BAT": ("Qffffcf", "TimeUS,Volt,VoltR,Curr,CurrTot,Temp,Res"),
    },
    "3.6": {"BAT": ("Qfffffcf", "TimeUS,Volt,VoltR,Curr,CurrTot,EnrgTot,Temp,Res")},
    "4.0": {
        "GPS": (
            "QBIHBcLLeffffB",
            "TimeUS,Status,GMS,GWk,NSats,HDop,Lat,Lng,Alt,Spd,GCrs,VZ,Yaw,U",
        ),
        "ARM": ("QBH", "TimeUS,ArmState,ArmChecks"),
        "NKF1": ("QBccCfffffffccce", "TimeUS,C,Roll,Pitch,Yaw,VN,VE,VD,dPD,PN,PE,PD,GX,GY,GZ,OH"),
    },
    "4.1": {
        "ATT": (
            "QccccCCCCB",
            "TimeUS,DesRoll,Roll,DesPitch,Pitch,DesYaw,Yaw,ErrRP,ErrYaw,AEKF",
        ),
        "GPS": (
            "QBBIHBcLLeffffB",
            "TimeUS,I,Status,GMS,GWk,NSats,HDop,Lat,Lng,Alt,Spd,GCrs,VZ,Yaw,U",
        ),
        "ARM": ("QBIBB", "TimeUS,ArmState,ArmChecks,Forced,Method"),
        "BAT": ("QBfffffcfB", "TimeUS,Instance,Volt,VoltR,Curr,CurrTot,EnrgTot,Temp,Res,RemPct"),
        "NKF1": ("", ""),
        "XKF1": ("QBccCfffffffccce", "TimeUS,C,Roll,Pitch,Yaw,VN,VE,VD,dPD,PN,PE,PD,GX,GY,GZ,OH"),
    },
    "4.3": {
        "PARM": ("QNff", "TimeUS,Name,Value,Default"),
        "VER": ("QBHBBBBIZH", "TimeUS,BT,BST,Maj,Min,Pat,FWT,GH,FWS,APJ"),
    },
    "4.5": {"VER": ("QBHBBBBIZHBB", "TimeUS,BT,BST,Maj,Min,Pat,FWT,GH,FWS,APJ,BU,FV")},
    "4.7": {
        "MSG": ("QBBZ", "TimeUS,ID,Seq,Message"),
        "ATT": ("QffffffB", "TimeUS,DesRoll,Roll,DesPitch,Pitch,DesYaw,Yaw,AEKF"),
        "BAT": (
            "QBfffffcfBBB",
            "TimeUS,Inst,Volt,VoltR,Curr,CurrTot,EnrgTot,Temp,Res,RemPct,H,SH",
        ),
    },
}
ARDUPILOT_RELEASES = tuple(_FORMATS)
_BUILDS = {"copter": 2, "plane": 3, "rover": 1, "sub": 7}
_MODES = {
    "copter": ((0, "STABILIZE"), (5, "LOITER"), (6, "RTL")),
    "plane": ((0, "MANUAL"), (5, "FLY_BY_WIRE_A"), (11, "RTL")),
    "rover": ((0, "MANUAL"), (4, "HOLD"), (10, "AUTO")),
    "sub": ((19, "MANUAL"), (2, "ALT_HOLD"), (9, "SURFACE")),
}
# The text of the first MSG, by the ArduCopter of the same time, and the version in it.
_NAMES: dict[str, dict[str, tuple[str, str]]] = {
    "3.1": {
        "copter": ("ArduCopter V3.1.3 (92cdd2a3)", "3.1.3"),
        "plane": ("ArduPlane V2.76 (1c2f4e9f)", "2.76.0"),
        "rover": ("ArduRover v2.44beta1 (d01fa3bf)", "2.44.0-beta1"),
    },
    "3.2": {
        "copter": ("ArduCopter V3.2-rc14 (9a1b2c3d)", "3.2.0-rc14"),
        "plane": ("ArduPlane V3.1.2beta1 (834f90e8)", "3.1.2-beta1"),
        "rover": ("ArduRover v2.47beta1 (834f90e8)", "2.47.0-beta1"),
    },
    "3.3": {
        "copter": ("APM:Copter V3.3.3 (acf3c5b2)", "3.3.3"),
        "plane": ("ArduPlane V3.4.1dev (acf3c5b2)", "3.4.1-dev"),
        "rover": ("ArduRover v2.51-beta (acf3c5b2)", "2.51.0-beta"),
    },
    "3.4": {
        "copter": ("APM:Copter V3.4.4-rc1 (65ffe9d7)", "3.4.4-rc1"),
        "plane": ("ArduPlane V3.7.1 (22b5c415)", "3.7.1"),
        "rover": ("APM:Rover v3.1.0beta6 (22b5c415)", "3.1.0-beta6"),
        "sub": ("ArduSub V3.4 (22b5c415)", "3.4.0"),
    },
    "3.5": {
        "copter": ("APM:Copter V3.5.5 (27229c83)", "3.5.5"),
        "plane": ("ArduPlane V3.8.0beta1 (27229c83)", "3.8.0-beta1"),
        "rover": ("APM:Rover v3.1.2 (27229c83)", "3.1.2"),
        "sub": ("ArduSub V3.5.0-dev (27229c83)", "3.5.0-dev"),
    },
}
_PATCHES = {"3.6": 12, "4.0": 7, "4.1": 5, "4.3": 6, "4.5": 7, "4.7": 0}


@dataclass(frozen=True)
class ArduPilotLog:
    """A log of one release.

    Attributes:
        release: of ArduCopter.
        kind: copter, plane, rover or sub.
        data: the file.
        version: as the project shows it.
        modes: by name, in order.
        has_percent: whether it has the remaining charge.
    """

    release: str
    kind: str
    data: bytes
    version: str
    modes: tuple[str, ...]
    has_percent: bool


def ardupilot_kinds(release: str) -> list[str]:
    """The vehicles that the firmware had then."""
    return [kind for kind in _BUILDS if release not in _NAMES or kind in _NAMES[release]]


def ardupilot_log(
    release: str,
    kind: str = "copter",
    *,
    percent: bool = True,
    without: tuple[str, ...] = (),
    gps_time: bool = True,
    position_hz: int = 5,
    idle_s: int = 0,
) -> ArduPilotLog:
    """Return a log of a release.

    Args:
        release: of ArduCopter; the other vehicles are those of that time.
        kind: copter, plane, rover or sub.
        percent: whether the battery monitor measures the charge; else it logs 255.
        without: records that this log has not.
        gps_time: whether the receiver knows the date.
        position_hz: how often there are records of position and attitude.
        idle_s: how long it stands disarmed afterwards, and logs a parameter every half minute.
    """
    formats = _formats_of(release, kind)
    if release in _NAMES:
        text, version = _NAMES[release][kind]
    else:
        version = f"{release}.{_PATCHES[release]}"
        text = f"Ardu{kind.capitalize()} V{version} (6c4da9e3)"
    writer = _DataFlash({name: form for name, form in formats.items() if name not in without})
    numbers = [number for number, _ in _MODES[kind]]
    writer.add("PARM", 0.0, Name=b"LOG_BITMASK", Value=176126.0)
    writer.add("MSG", 0.0, Message=text.encode())
    major, minor, patch = (int(part) for part in version.split("-")[0].split("."))
    writer.add("VER", 0.0, BT=3, BST=0xFFFF, Maj=major, Min=minor, Pat=patch, FWT=255,
               FWS=text.encode(), BU=_BUILDS[kind])  # fmt: skip
    for number in (0, 1):
        writer.add("ORGN", 0.0, Type=number, Lat=HOME[0], Lng=HOME[1], Alt=HOME[2])
    for step in range(SECONDS * position_hz + 1):
        now = sample(step / position_hz)
        if now.time_s in MODES_AT_S:
            mode = numbers[MODES_AT_S.index(int(now.time_s))]
            writer.add("MODE", now.time_s, Mode=mode, ModeNum=mode)
        _add_sample(writer, now, gps_time)
        if step % position_hz == 0:
            _add_battery(writer, formats, now.time_s, percent)
    writer.add("EV", float(SECONDS), Id=11)
    writer.add("ARM", float(SECONDS), ArmState=0)
    for later_s in range(31, idle_s + 1, 31):
        writer.add("PARM", float(SECONDS + later_s), Name=b"STAT_RUNTIME", Value=later_s)
    return ArduPilotLog(
        release,
        kind,
        writer.data,
        version,
        tuple(name for _, name in _MODES[kind]),
        percent and "RemPct" in formats.get("BAT", ("", ""))[1],
    )


def _formats_of(release: str, kind: str) -> dict[str, tuple[str, str]]:
    formats = {"FMT": _FMT}
    # Only ArduCopter had a MODE without the number.
    formats["MODE"] = ("Mh", "Mode,ThrCrs") if kind == "copter" else ("IMB", "TimeMS,Mode,ModeNum")
    for name in ARDUPILOT_RELEASES[: ARDUPILOT_RELEASES.index(release) + 1]:
        formats |= _FORMATS[name]
    return {name: form for name, form in formats.items() if form[0]}


def _add_sample(writer: _DataFlash, now: Sample, gps_time: bool) -> None:
    north, east, down = now.velocity_ned_m_s
    writer.add("ATT", now.time_s, DesYaw=now.heading_deg, Yaw=now.heading_deg)
    for estimator in ("EKF1", "NKF1", "XKF1"):
        writer.add(estimator, now.time_s, VN=north, VE=east, VD=down, PN=now.north_m,
                   PE=now.east_m, PD=-HEIGHT_M)  # fmt: skip
    week_s = BEGUN_UNIX_S + now.time_s - _GPS_EPOCH_UNIX_S + _LEAP_S
    week, of_week_ms = divmod(round(week_s * 1000), _WEEK_S * 1000)
    place = {"Lat": now.latitude_deg, "Lng": now.longitude_deg, "Alt": HOME[2] + HEIGHT_M}
    above = {"RelAlt": HEIGHT_M, "RAlt": HEIGHT_M, "RelHomeAlt": HEIGHT_M, "RelOriginAlt": HEIGHT_M}
    date = {"Week": week, "GWk": week, "GMS": of_week_ms} if gps_time else {}
    fix = {"Status": 3, "NSats": 12, "HDop": 1.2, "Spd": SPEED_M_S, "GCrs": now.heading_deg, "U": 1}
    writer.add("GPS", now.time_s, of_week_ms, **fix, **place, **above, **date)
    writer.add("POS", now.time_s, **place, **above)


def _add_battery(
    writer: _DataFlash, formats: dict[str, tuple[str, str]], time_s: float, percent: bool
) -> None:
    share = time_s / SECONDS
    voltage_v = VOLTAGE_V[0] + share * (VOLTAGE_V[1] - VOLTAGE_V[0])
    left = round(PERCENT[0] + share * (PERCENT[1] - PERCENT[0])) if percent else 255
    scale = 100.0 if "h" in formats.get("CURR", ("", ""))[0] else 1.0
    writer.add("CURR", time_s, Volt=voltage_v * scale, Curr=3.1 * scale)
    writer.add("BAT", time_s, Volt=voltage_v, Curr=-3.1 if left == 255 else 3.1, RemPct=left)


class _DataFlash:
    """Writes records."""

    def __init__(self, formats: dict[str, tuple[str, str]]) -> None:
        self.data = b""
        self._types = {name: 128 if name == "FMT" else 140 + i for i, name in enumerate(formats)}
        self._formats = formats
        for name, (form, columns) in formats.items():
            size = self._struct(form).size + 3
            self.add("FMT", 0.0, Type=self._types[name], Length=size, Name=name.encode(),
                     Format=form.encode(), Columns=columns.encode())  # fmt: skip

    @staticmethod
    def _struct(form: str) -> struct.Struct:
        return struct.Struct("<" + "".join(_LETTERS.get(letter, letter) for letter in form))

    def add(
        self, name: str, time_s: float, of_week_ms: int = 0, /, **values: float | bytes
    ) -> None:
        """Add a record, zero where there is no value; nothing in logs without such records."""
        if name not in self._formats:
            return
        form, columns = self._formats[name]
        since_boot_s = BOOT_S + time_s
        times: dict[str, float] = {"TimeUS": round(since_boot_s * 1e6)}
        times |= {"TimeMS": round(since_boot_s * 1e3), "T": round(since_boot_s * 1e3)}
        if name == "GPS" and "T" in columns.split(","):
            times["TimeMS"] = of_week_ms
        fields: list[float | bytes] = []
        for letter, column in zip(form, columns.split(","), strict=True):
            value = (times | values).get(column, b"" if letter in "nNZ" else 0)
            if letter in _SCALES:
                value = round(float(value) * _SCALES[letter])
            elif letter not in "fdnNZ":
                value = round(float(value))
            fields.append(value)
        head = b"\xa3\x95" + bytes([self._types[name]])
        self.data += head + self._struct(form).pack(*fields)


# --- PX4 --------------------------------------------------------------------------------------

PX4_RELEASES = ("1.6", "1.7", "1.8", "1.9", "1.11", "1.12", "1.13", "1.14", "1.15", "1.16", "1.18")
_ULOG_TYPES = {"uint64_t": "Q", "uint8_t": "B", "bool": "?", "int32_t": "i", "float": "f",
               "double": "d", "uint32_t": "I"}  # fmt: skip
PX4_MODES = ((1, "ALTCTL"), (2, "POSCTL"), (5, "AUTO.RTL"))
_OLD_GPS = (("lat", "int32_t"), ("lon", "int32_t"), ("alt", "int32_t"))
_NEW_GPS = (("latitude_deg", "double"), ("longitude_deg", "double"), ("altitude_msl_m", "double"))


@dataclass
class Px4Options:
    """The parts that a log of PX4 lacks.

    Attributes:
        without: topics that it has not.
        gps_time: whether the receiver knows the date.
        remaining: whether the charge is known.
        xy_valid: whether the local position is.
        nav_states: the numbers of the three modes.
    """

    without: tuple[str, ...] = ()
    gps_time: bool = True
    remaining: bool = True
    xy_valid: bool = True
    nav_states: tuple[int, ...] = field(
        default_factory=lambda: tuple(number for number, _ in PX4_MODES)
    )


def px4_version(release: str) -> str:
    """The version of a release, as the project shows it."""
    return f"{release}.0-beta" if release == "1.18" else f"{release}.3"


def px4_log(release: str, options: Px4Options | None = None) -> bytes:
    """Return a ULog of a release of PX4: a quadrotor."""
    options = options or Px4Options()
    minor = int(release.split(".")[1])
    topics = {n: f for n, f in _px4_topics(minor).items() if n not in options.without}
    out = b"ULog\x01\x12\x35\x01" + struct.pack("<Q", round(BOOT_S * 1e6))
    if minor >= 8:
        out += _ulog_message(b"B", bytes(40))
    for name, fields in topics.items():
        columns = "".join(f"{kind} {column};" for column, kind in fields)
        out += _ulog_message(b"F", f"{name}:{columns}".encode())
    patch, kind = (0, 128) if release == "1.18" else (3, 255)
    number = 1 << 24 | minor << 16 | patch << 8 | kind
    out += _ulog_info("uint32_t ver_sw_release", struct.pack("<I", number))
    for number, name in enumerate(topics):
        out += _ulog_message(b"A", struct.pack("<BH", 0, number) + name.encode())
    names = list(topics)
    for name, time_s, values in _px4_samples(minor, options):
        if name == "text":
            text = struct.pack("<BQ", ord("4"), round((BOOT_S + time_s) * 1e6)) + b"Low battery"
            out += _ulog_message(b"L", text)
        elif name in topics:
            fields = topics[name]
            row = {"timestamp": round((BOOT_S + time_s) * 1e6), **values}
            packed = struct.pack(
                "<" + "".join(_ULOG_TYPES[kind] for _, kind in fields),
                *(row.get(column, 0) for column, _ in fields),
            )
            out += _ulog_message(b"D", struct.pack("<H", names.index(name)) + packed)
    return out


def _px4_topics(minor: int) -> dict[str, tuple[tuple[str, str], ...]]:
    stamp = (("timestamp", "uint64_t"),)
    status: tuple[tuple[str, str], ...] = (
        *((name, "uint8_t") for name in ("nav_state", "arming_state", "system_type")),
    )
    status += (("is_rotary_wing", "bool"),) if minor < 9 else (("vehicle_type", "uint8_t"),)
    place: tuple[tuple[str, str], ...] = (("lat", "double"), ("lon", "double"), ("alt", "float"))
    if minor < 9:
        place += (("vel_n", "float"), ("vel_e", "float"), ("vel_d", "float"))
    if minor >= 16:
        place += (("lat_lon_valid", "bool"), ("alt_valid", "bool"))
    local = (
        *((name, "float") for name in ("x", "y", "z", "vx", "vy", "vz", "ref_alt")),
        ("yaw" if minor < 11 else "heading", "float"),
        *((name, "double") for name in ("ref_lat", "ref_lon")),
        *((name, "bool") for name in ("xy_valid", "z_valid", "xy_global", "z_global")),
    )
    gps = (
        ("time_utc_usec", "uint64_t"),
        *(_OLD_GPS if minor < 14 else _NEW_GPS),
        *((name, "float") for name in ("vel_n_m_s", "vel_e_m_s", "vel_d_m_s")),
        ("fix_type", "uint8_t"),
    )
    home = (*place[:3], ("valid_alt", "bool"), ("valid_hpos", "bool"))
    topics = {
        "vehicle_status": stamp + status,
        "vehicle_global_position": stamp + place,
        "vehicle_local_position": stamp + local,
        "vehicle_gps_position": stamp + gps,
        "battery_status": (
            *stamp,
            *((name, "float") for name in ("voltage_v", "current_a", "remaining")),
        ),
        "home_position": stamp + home,
    }
    if minor >= 12:
        topics["sensor_gps"] = stamp + gps
    return topics


def _px4_samples(
    minor: int, options: Px4Options
) -> Iterator[tuple[str, float, dict[str, float | bool]]]:
    home = {"lat": HOME[0], "lon": HOME[1], "alt": HOME[2], "valid_alt": True, "valid_hpos": True}
    yield "home_position", 0.0, home
    for step in range(SECONDS * 10 + 1):
        now = sample(step / 10)
        north, east, down = now.velocity_ned_m_s
        altitude_m, share = HOME[2] + HEIGHT_M, now.time_s / SECONDS
        mode = options.nav_states[sum(now.time_s >= at_s for at_s in MODES_AT_S) - 1]
        if step % 5 == 0:
            armed = 2 if step < SECONDS * 10 else 1
            status = {"nav_state": mode, "arming_state": armed, "system_type": 2}
            yield "vehicle_status", now.time_s, {**status, "vehicle_type": 1}
        yield "vehicle_local_position", now.time_s, {
            "x": now.north_m, "y": now.east_m, "z": -HEIGHT_M, "vx": north, "vy": east, "vz": down,
            "ref_lat": HOME[0], "ref_lon": HOME[1], "ref_alt": HOME[2],
            "yaw": math.radians(now.heading_deg), "heading": math.radians(now.heading_deg),
            "xy_valid": options.xy_valid, "z_valid": True,
            "xy_global": "vehicle_global_position" not in options.without,
            "z_global": "vehicle_global_position" not in options.without,
        }  # fmt: skip
        place = {"lat": now.latitude_deg, "lon": now.longitude_deg, "alt": altitude_m}
        valid = {"lat_lon_valid": True, "alt_valid": True}
        yield "vehicle_global_position", now.time_s, place | valid
        names = [name for name, _ in _NEW_GPS]
        fix: dict[str, float] = dict(zip(names, place.values(), strict=True))
        if minor < 14:
            fix = {name: round(value * (1e3 if name == "alt" else 1e7))
                   for name, value in place.items()}  # fmt: skip
        utc_us = round((BEGUN_UNIX_S + now.time_s) * 1e6) if options.gps_time else 0
        moving = {"vel_n_m_s": north, "vel_e_m_s": east, "vel_d_m_s": down}
        for topic in ("vehicle_gps_position", "sensor_gps"):
            yield topic, now.time_s, {"time_utc_usec": utc_us, "fix_type": 3, **moving, **fix}
        if step % 10 == 0:
            left = PERCENT[0] + share * (PERCENT[1] - PERCENT[0])
            yield "battery_status", now.time_s, {
                "voltage_v": VOLTAGE_V[0] + share * (VOLTAGE_V[1] - VOLTAGE_V[0]),
                "current_a": 3.1,
                "remaining": left / 100.0 if options.remaining else math.nan,
            }  # fmt: skip
    yield "text", SECONDS - 1.0, {}


def _ulog_message(kind: bytes, body: bytes) -> bytes:
    return struct.pack("<H", len(body)) + kind + body


def _ulog_info(key: str, value: bytes) -> bytes:
    return _ulog_message(b"I", bytes([len(key)]) + key.encode() + value)
