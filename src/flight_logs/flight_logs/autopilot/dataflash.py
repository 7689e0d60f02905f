"""ArduPilot's DataFlash logs, read by pymavlink's DFReader."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

from pymavlink.DFReader import DFReader_binary

from flight_logs.autopilot.telling import Telling, Told
from flight_logs.errors import LogError
from mavlink_vehicle.codec import mavlink

__all__ = ["MAGIC", "read_dataflash"]

MAGIC = b"\xa3\x95"
_TYPES = {
    1: mavlink.MAV_TYPE_GROUND_ROVER,
    2: mavlink.MAV_TYPE_QUADROTOR,
    3: mavlink.MAV_TYPE_FIXED_WING,
    7: mavlink.MAV_TYPE_SUBMARINE,
}
"""MAV_TYPE by VER.BU, APM_BUILD_TYPE in AP_Vehicle_Type.h"""
_NAMES = {"ArduCopter": 2, "ArduPlane": 3, "ArduRover": 1, "ArduSub": 7}
"""The same by the first words of MSG; older logs have no VER"""
_BOAT = 2
"""FRAME_CLASS of a Rover"""
_POSITION_S = 0.1
_ARMING_EVENTS = {10: True, 11: False}
"""EV.Id, LogEvent in AP_Logger.h; ARM is newer"""
_ORIGIN = 0


def read_dataflash(path: Path, progress: Callable[[float], object]) -> list[Told]:
    """Return what a `.BIN` log tells, as messages in the order of time.

    Args:
        path: the file.
        progress: called now and then with the share that was read, 0 to 1.

    Raises:
        LogError: it cannot be read, or tells nothing.
    """
    try:
        reader = DFReader_binary(str(path))
    except Exception as error:  # it raises whatever a damaged file leads to
        raise LogError(f"{path} cannot be read as a DataFlash log: {error}.") from error
    try:
        return _Reader(reader).read(progress)
    except Exception as error:
        raise LogError(f"{path} is damaged: {error}.") from error
    finally:
        reader.close()


class _Reader:
    """Retells the records of one log."""

    def __init__(self, reader: Any) -> None:
        self._reader = reader
        self._telling = Telling(mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA)
        self._position_s = -math.inf
        self._handlers: dict[str, Callable[[float, Any], None]] = {
            "MSG": self._text,
            "MODE": self._mode,
            "ARM": self._arm,
            "EV": self._arm,
            "ERR": self._error,
            "ATT": self._attitude,
            "XKF1": self._velocity,
            "NKF1": self._velocity,
            "ORGN": self._origin,
            "POS": self._position,
            "BAT": self._battery,
            "VER": self._version,
        }

    def read(self, progress: Callable[[float], object]) -> list[Told]:
        """Return the messages."""
        self._learn()
        wanted, count = list(self._handlers), 0
        while (record := self._reader.recv_match(type=wanted)) is not None:
            self._handlers[record.get_type()](float(record._timestamp), record)
            count += 1
            if count % 1000 == 0:
                progress(self._reader.percent / 100.0)
        return self._telling.told

    def _learn(self) -> None:
        """Learn what HEARTBEAT says from the beginning: the vehicle's type, and whether armed.

        A log usually begins with arming, of which it has no record, and ends with disarming.
        """
        build = frame_class = 0
        arming: list[bool] = []
        logs_disarmed = False
        while (
            record := self._reader.recv_match(type=["VER", "MSG", "PARM", "ARM", "EV"])
        ) is not None:
            kind = record.get_type()
            if kind == "VER":
                build = getattr(record, "BU", 0) or build
            elif kind == "MSG" and not build:
                named = (_NAMES[name] for name in _NAMES if record.Message.startswith(name))
                build = next(named, 0)
            elif kind == "PARM" and record.Name == "FRAME_CLASS":
                frame_class = int(record.Value)
            elif kind == "PARM" and record.Name == "LOG_DISARMED":
                logs_disarmed = bool(record.Value)
            elif kind == "ARM" or (kind == "EV" and record.Id in _ARMING_EVENTS):
                arming.append(_is_armed(record))
        self._reader.rewind()
        telling = self._telling
        telling.vehicle_type = _TYPES.get(build, mavlink.MAV_TYPE_GENERIC)
        if telling.vehicle_type == mavlink.MAV_TYPE_GROUND_ROVER and frame_class == _BOAT:
            telling.vehicle_type = mavlink.MAV_TYPE_SURFACE_BOAT
        telling.armed = not arming[0] if arming else not logs_disarmed

    def _text(self, time_s: float, record: Any) -> None:
        text = str(record.Message)
        # DataFlash keeps no severity.
        self._telling.text(time_s, mavlink.MAV_SEVERITY_INFO, text)

    def _mode(self, time_s: float, record: Any) -> None:
        self._telling.mode = int(record.ModeNum)
        self._telling.beat(time_s)

    def _arm(self, time_s: float, record: Any) -> None:
        if record.get_type() == "ARM" or record.Id in _ARMING_EVENTS:
            self._telling.armed = _is_armed(record)
            self._telling.beat(time_s)

    def _error(self, time_s: float, record: Any) -> None:
        if record.ECode:
            text = f"ERR subsystem {record.Subsys}, code {record.ECode}"
            self._telling.text(time_s, mavlink.MAV_SEVERITY_WARNING, text)

    def _attitude(self, _time_s: float, record: Any) -> None:
        self._telling.heading_deg = float(record.Yaw)

    def _velocity(self, _time_s: float, record: Any) -> None:
        if getattr(record, "C", 0) == 0:
            velocity = (float(record.VN), float(record.VE), float(record.VD))
            if all(map(math.isfinite, velocity)):
                self._telling.velocity_ned_m_s = velocity

    def _origin(self, time_s: float, record: Any) -> None:
        if record.Type == _ORIGIN:
            self._telling.add(
                time_s,
                "GPS_GLOBAL_ORIGIN",
                latitude=round(record.Lat * 1e7),
                longitude=round(record.Lng * 1e7),
                altitude=round(record.Alt * 1e3),
            )

    def _position(self, time_s: float, record: Any) -> None:
        if time_s - self._position_s < 0.9 * _POSITION_S:
            return
        self._position_s = time_s
        place = (float(record.Lat), float(record.Lng), float(record.Alt))
        above_home_m = float(getattr(record, "RelHomeAlt", math.nan))
        self._telling.position(
            time_s,
            record.TimeUS / 1e6,
            place,
            above_home_m if math.isfinite(above_home_m) else None,
        )

    def _battery(self, time_s: float, record: Any) -> None:
        if getattr(record, "Inst", getattr(record, "Instance", 0)) == 0:
            percent = getattr(record, "RemPct", None)
            self._telling.battery(time_s, float(record.Volt), float(record.Curr), percent)

    def _version(self, time_s: float, record: Any) -> None:
        number = record.Maj << 24 | record.Min << 16 | record.Pat << 8 | record.FWT
        self._telling.add(time_s, "AUTOPILOT_VERSION", flight_sw_version=number)


def _is_armed(record: Any) -> bool:
    return _ARMING_EVENTS[record.Id] if record.get_type() == "EV" else bool(record.ArmState)
