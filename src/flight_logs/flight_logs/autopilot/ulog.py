"""PX4's ULog logs, read by pyulog."""

from __future__ import annotations

import io
import itertools
import math
from collections.abc import Callable, Iterator
from contextlib import redirect_stdout
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from flight_logs.autopilot.telling import OwnLog, Place, Telling, TimedMessage, credible
from flight_logs.errors import LogError
from flight_logs.extras import extra
from mavlink_vehicle.codec import mavlink

if TYPE_CHECKING:
    from pyulog import ULog

MAGIC = b"ULog\x01\x12\x35"
Topic: TypeAlias = dict[str, NDArray[Any]]

_TOPICS = [
    "vehicle_status",
    "vehicle_global_position",
    "vehicle_local_position",
    "vehicle_gps_position",
    "sensor_gps",
    "battery_status",
    "home_position",
]
_POSITION_US = 100_000
_BATTERY_US = 1_000_000
_ARMED = 2
_AUTO = 4
_FIX_3D = 3
# custom_mode by vehicle_status.nav_state: the main mode in the third byte, the sub mode in the
# fourth (VehicleStatus.msg, px4_custom_mode.h).
_MODES = {
    0: (1, 0),  # MANUAL
    1: (2, 0),  # ALTCTL
    2: (3, 0),  # POSCTL
    3: (_AUTO, 4),  # MISSION
    4: (_AUTO, 3),  # LOITER
    5: (_AUTO, 5),  # RTL
    6: (3, 2),  # POSITION_SLOW, since 1.15
    8: (11, 0),  # ALTITUDE_CRUISE, since 1.17
    10: (5, 0),  # ACRO
    12: (_AUTO, 6),  # DESCEND, shown as LAND
    13: (10, 0),  # TERMINATION
    14: (6, 0),  # OFFBOARD
    15: (7, 0),  # STABILIZED
    17: (_AUTO, 2),  # TAKEOFF
    18: (_AUTO, 6),  # LAND
    19: (_AUTO, 8),  # FOLLOW_TARGET
    20: (_AUTO, 9),  # PRECLAND
    21: (3, 1),  # ORBIT
    22: (_AUTO, 10),  # VTOL_TAKEOFF
    **{22 + number: (_AUTO, 10 + number) for number in range(1, 9)},  # EXTERNAL1 to 8
}
_FORMERLY = {
    6: (_AUTO, 5),  # AUTO_RCRECOVER, a return
    7: (_AUTO, 5),  # AUTO_RTGS, a return
    8: (_AUTO, 6),  # AUTO_LANDENGFAIL
    9: (_AUTO, 6),  # AUTO_LANDGPSFAIL
    16: (8, 0),  # RATTITUDE, until 1.11
}
"""The same in versions before 1.15"""
_SLOW_SINCE = (1, 15)
_KINDS = {
    2: mavlink.MAV_TYPE_FIXED_WING,
    3: mavlink.MAV_TYPE_GROUND_ROVER,
}


def read_ulog(path: Path, progress: Callable[[float], object]) -> OwnLog:
    """Return the content of a `.ulg` log, as messages in the order of time.

    Args:
        path: the file.
        progress: called now and then with the share that was read, 0 to 1.

    Raises:
        LogError: it cannot be read.
    """
    with extra("pyulog", "A ULog file"):
        from pyulog import ULog  # noqa: PLC0415 an extra
    try:
        # It prints what it thinks of the file.
        with path.open("rb") as file, redirect_stdout(io.StringIO()):
            log = ULog(file, _TOPICS)
    except Exception as error:  # it raises whatever a damaged file leads to
        raise LogError(f"{path} cannot be read as a ULog log: {error}.") from error
    progress(0.5)
    damage = ("The file is damaged; what is intact is shown",) if log.file_corruption else ()
    topics = {data.name: _credible(data.data) for data in log.data_list if data.multi_id == 0}
    return OwnLog(_messages(log, topics), damage, _remarks(topics))


def _remarks(topics: dict[str, Topic]) -> tuple[str, ...]:
    local = topics.get("vehicle_local_position")
    if local is None or np.any(local.get("xy_valid", 1)):
        return ()
    return ("The log has no valid horizontal position; what it has of one is shown.",)


def _messages(log: ULog, topics: dict[str, Topic]) -> list[TimedMessage]:
    begun_s = _boot_unix_s(topics)
    telling = Telling(mavlink.MAV_AUTOPILOT_PX4)
    version = log.msg_info_dict.get("ver_sw_release")
    telling.version = None if version is None else int(version) & 0xFFFFFFFF
    happened = [
        *_rows(topics, "vehicle_status", _status(_modes(telling.version))),
        *_rows(topics, "home_position", _home),
        *_rows(topics, "vehicle_local_position", _local, _POSITION_US),
        *_rows(topics, "battery_status", _battery, _BATTERY_US),
        *((text.timestamp, _text(text)) for text in log.logged_messages),
    ]
    if _has_rows(topics, "vehicle_global_position"):
        happened += _rows(topics, "vehicle_global_position", _position, _POSITION_US)
    else:
        happened += _rows(topics, _gps_topic(topics), _gps, _POSITION_US)
    # Equal times stay in this order: a status is known before a position.
    happened.sort(key=lambda item: item[0])
    for time_us, tell in happened:
        tell(telling, begun_s + time_us / 1e6, time_us / 1e6)
        telling.pulse(begun_s + time_us / 1e6)
    return telling.messages


Tell: TypeAlias = Callable[[Telling, float, float], None]


def _rows(
    topics: dict[str, Topic],
    name: str,
    make_tell: Callable[[dict[str, float]], Tell],
    interval_us: int = 0,
) -> Iterator[tuple[int, Tell]]:
    """Yield time and teller of the records of a topic, at most one in each interval."""
    topic = topics.get(name)
    if topic is None:
        return
    names = [key for key in topic if key != "timestamp"]
    next_us = -math.inf
    for place, time_us in enumerate(topic["timestamp"].tolist()):
        if time_us >= next_us:
            next_us = time_us + 0.9 * interval_us
            yield time_us, make_tell({key: topic[key][place].item() for key in names})


def _credible(topic: Topic) -> Topic:
    """Return a topic without the rows whose time lies far ahead of the next."""
    times_s = topic["timestamp"] / 1e6
    kept = [credible(*pair) for pair in itertools.pairwise(times_s.tolist())]
    chosen = np.append(np.array(kept, dtype=np.bool_), np.ones(len(times_s[:1]), dtype=np.bool_))
    return topic if chosen.all() else {name: values[chosen] for name, values in topic.items()}


def _has_rows(topics: dict[str, Topic], name: str) -> bool:
    return name in topics and len(topics[name]["timestamp"]) > 0


def _gps_topic(topics: dict[str, Topic]) -> str:
    """Return the topic of the receiver: sensor_gps is newer, and logged beside the other."""
    return "vehicle_gps_position" if _has_rows(topics, "vehicle_gps_position") else "sensor_gps"


def _boot_unix_s(topics: dict[str, Topic]) -> float:
    """Return when the autopilot started, by its GPS; 0 if it had no time."""
    gps = topics.get(_gps_topic(topics), {})
    utc_us = gps.get("time_utc_usec")
    if utc_us is None or not np.any(utc_us > 0):
        return 0.0
    first = int(np.argmax(utc_us > 0))
    return float(int(utc_us[first]) - int(gps["timestamp"][first])) / 1e6


def _modes(version: int | None) -> dict[int, tuple[int, int]]:
    """Return main and sub mode by nav_state, as a version of the firmware numbers them."""
    number = _SLOW_SINCE if version is None else (version >> 24 & 0xFF, version >> 16 & 0xFF)
    return _MODES if number >= _SLOW_SINCE else _MODES | _FORMERLY


def _status(modes: dict[int, tuple[int, int]]) -> Callable[[dict[str, float]], Tell]:
    def of(row: dict[str, float]) -> Tell:
        def tell(telling: Telling, time_s: float, _boot_s: float) -> None:
            main, sub = modes.get(int(row["nav_state"]), (0, 0))
            mode, armed = main << 16 | sub << 24, int(row["arming_state"]) == _ARMED
            kind = _KINDS.get(int(row.get("vehicle_type", 0)), mavlink.MAV_TYPE_QUADROTOR)
            telling.vehicle_type = int(row.get("system_type", 0)) or kind
            changed = (mode, armed) != (telling.mode, telling.armed)
            telling.mode, telling.armed = mode, armed
            if changed:
                telling.beat(time_s)

        return tell

    return of


def _home(row: dict[str, float]) -> Tell:
    def tell(telling: Telling, time_s: float, _boot_s: float) -> None:
        if row.get("valid_alt", 1) and row.get("valid_hpos", 1):
            telling.home(time_s, (row["lat"], row["lon"], row["alt"]))

    return tell


def _local(row: dict[str, float]) -> Tell:
    def tell(telling: Telling, time_s: float, boot_s: float) -> None:
        velocity = (row["vx"], row["vy"], row["vz"])
        if all(map(math.isfinite, velocity)):
            telling.velocity_ned_m_s = velocity
        heading_rad = row.get("heading", row.get("yaw", math.nan))  # yaw until 1.11
        if math.isfinite(heading_rad):
            telling.heading_deg = math.degrees(heading_rad)
        if row.get("xy_global") and row.get("z_global"):
            telling.origin(time_s, (row["ref_lat"], row["ref_lon"], row["ref_alt"]))
        # As PX4 sends it; where only the height is valid, there is no better position.
        if row.get("xy_valid", 1) or row.get("z_valid", 1):
            telling.local(time_s, boot_s, (row["x"], row["y"], row["z"]), velocity)

    return tell


def _position(row: dict[str, float]) -> Tell:
    def tell(telling: Telling, time_s: float, boot_s: float) -> None:
        if row.get("lat_lon_valid", 1) and row.get("alt_valid", 1):
            telling.position(time_s, boot_s, (row["lat"], row["lon"], row["alt"]))

    return tell


def _gps(row: dict[str, float]) -> Tell:
    """Take the receiver's position, where the log has no estimated one."""

    def tell(telling: Telling, time_s: float, boot_s: float) -> None:
        if row["fix_type"] < _FIX_3D:
            return
        if "latitude_deg" in row:  # since 1.14
            place: Place = (row["latitude_deg"], row["longitude_deg"], row["altitude_msl_m"])
        else:
            place = (row["lat"] * 1e-7, row["lon"] * 1e-7, row["alt"] * 1e-3)
        telling.velocity_ned_m_s = (row["vel_n_m_s"], row["vel_e_m_s"], row["vel_d_m_s"])
        telling.position(time_s, boot_s, place)

    return tell


def _battery(row: dict[str, float]) -> Tell:
    def tell(telling: Telling, time_s: float, _boot_s: float) -> None:
        left = row.get("remaining", -1.0)
        percent = 100.0 * left if left >= 0.0 else None
        telling.battery(time_s, row["voltage_v"], row["current_a"], percent)

    return tell


def _text(text: ULog.MessageLogging) -> Tell:
    def tell(telling: Telling, time_s: float, _boot_s: float) -> None:
        severity = min(max(int(text.log_level) - ord("0"), 0), mavlink.MAV_SEVERITY_DEBUG)
        telling.text(time_s, severity, text.message)

    return tell
