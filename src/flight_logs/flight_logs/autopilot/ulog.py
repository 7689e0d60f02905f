"""PX4's ULog logs, read by pyulog."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray
from pyulog import ULog

from flight_logs.autopilot.telling import Telling, Told
from flight_logs.errors import LogError
from mavlink_vehicle.codec import mavlink

__all__ = ["MAGIC", "read_ulog"]

MAGIC = b"ULog\x01\x12\x35"
Topic: TypeAlias = dict[str, NDArray[Any]]

_TOPICS = [
    "vehicle_status",
    "vehicle_global_position",
    "vehicle_local_position",
    "vehicle_gps_position",
    "battery_status",
    "home_position",
]
_POSITION_US = 100_000
_BATTERY_US = 1_000_000
_ARMED = 2
_AUTO = 4
# custom_mode by vehicle_status.nav_state: the main mode in the third byte, the sub mode in the
# fourth (VehicleStatus.msg, px4_custom_mode.h).
_MODES = {
    0: (1, 0),  # MANUAL
    1: (2, 0),  # ALTCTL
    2: (3, 0),  # POSCTL
    3: (_AUTO, 4),  # MISSION
    4: (_AUTO, 3),  # LOITER
    5: (_AUTO, 5),  # RTL
    6: (3, 2),  # POSITION_SLOW
    8: (11, 0),  # ALTITUDE_CRUISE
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
}
_KINDS = {
    2: mavlink.MAV_TYPE_FIXED_WING,
    3: mavlink.MAV_TYPE_GROUND_ROVER,
}


def read_ulog(path: Path, progress: Callable[[float], object]) -> list[Told]:
    """Return what a `.ulg` log tells, as messages in the order of time.

    Args:
        path: the file.
        progress: called now and then with the share that was read, 0 to 1.

    Raises:
        LogError: it cannot be read.
    """
    try:
        with path.open("rb") as file:
            log = ULog(file, _TOPICS)
        progress(0.5)
        return _told(log, path.stat().st_mtime)
    except Exception as error:  # it raises whatever a damaged file leads to
        raise LogError(f"{path} cannot be read as a ULog log: {error}.") from error


def _told(log: Any, changed_s: float) -> list[Told]:
    topics: dict[str, Topic] = {}
    for data in log.data_list:
        if data.multi_id == 0:
            topics[data.name] = data.data
    begun_s = _boot_unix_s(log, topics, changed_s)
    telling = Telling(mavlink.MAV_AUTOPILOT_PX4)
    version = log.msg_info_dict.get("ver_sw_release")
    happened = [
        *_rows(topics, "vehicle_status", _status),
        *_rows(topics, "home_position", _home),
        *_rows(topics, "vehicle_local_position", _velocity, _POSITION_US),
        *_rows(topics, "vehicle_global_position", _position, _POSITION_US),
        *_rows(topics, "battery_status", _battery, _BATTERY_US),
        *((text.timestamp, _text(text)) for text in log.logged_messages),
    ]
    # Equal times stay in this order: a status is known before a position.
    happened.sort(key=lambda item: item[0])
    if version is not None and happened:
        unix_s = begun_s + happened[0][0] / 1e6
        telling.add(unix_s, "AUTOPILOT_VERSION", flight_sw_version=int(version) & 0xFFFFFFFF)
    for time_us, tell in happened:
        tell(telling, begun_s + time_us / 1e6, time_us / 1e6)
    return telling.told


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


def _boot_unix_s(log: Any, topics: dict[str, Topic], changed_s: float) -> float:
    """Return when the autopilot started, by its GPS, else by the age of the file."""
    gps = topics.get("vehicle_gps_position", {})
    utc_us = gps.get("time_utc_usec")
    if utc_us is not None and np.any(utc_us > 0):
        first = int(np.argmax(utc_us > 0))
        return float(utc_us[first] - gps["timestamp"][first]) / 1e6
    return changed_s - float(log.last_timestamp) / 1e6


def _status(row: dict[str, float]) -> Tell:
    def tell(telling: Telling, time_s: float, _boot_s: float) -> None:
        main, sub = _MODES.get(int(row["nav_state"]), (0, 0))
        mode, armed = main << 16 | sub << 24, int(row["arming_state"]) == _ARMED
        kind = _KINDS.get(int(row.get("vehicle_type", 0)), mavlink.MAV_TYPE_QUADROTOR)
        telling.vehicle_type = int(row.get("system_type", 0)) or kind
        changed = (mode, armed) != (telling.mode, telling.armed)
        telling.mode, telling.armed = mode, armed
        if changed:
            telling.beat(time_s)

    return tell


def _home(row: dict[str, float]) -> Tell:
    def tell(telling: Telling, _time_s: float, _boot_s: float) -> None:
        telling.home_altitude_m = row["alt"]

    return tell


def _velocity(row: dict[str, float]) -> Tell:
    def tell(telling: Telling, _time_s: float, _boot_s: float) -> None:
        velocity = (row["vx"], row["vy"], row["vz"])
        if all(map(math.isfinite, velocity)):
            telling.velocity_ned_m_s = velocity
        if math.isfinite(row.get("heading", math.nan)):
            telling.heading_deg = math.degrees(row["heading"])

    return tell


def _position(row: dict[str, float]) -> Tell:
    def tell(telling: Telling, time_s: float, boot_s: float) -> None:
        if row.get("lat_lon_valid", 1):
            telling.position(time_s, boot_s, (row["lat"], row["lon"], row["alt"]))

    return tell


def _battery(row: dict[str, float]) -> Tell:
    def tell(telling: Telling, time_s: float, _boot_s: float) -> None:
        left = row.get("remaining", -1.0)
        percent = 100.0 * left if left >= 0.0 else None
        telling.battery(time_s, row["voltage_v"], row["current_a"], percent)

    return tell


def _text(text: Any) -> Tell:
    def tell(telling: Telling, time_s: float, _boot_s: float) -> None:
        severity = min(max(int(text.log_level) - ord("0"), 0), mavlink.MAV_SEVERITY_DEBUG)
        telling.text(time_s, severity, text.message)

    return tell
