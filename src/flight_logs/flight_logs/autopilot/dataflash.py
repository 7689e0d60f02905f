"""ArduPilot's DataFlash logs, read by pymavlink's DFReader."""

from __future__ import annotations

import math
import tempfile
from bisect import bisect_right
from collections.abc import Callable, Iterator
from contextlib import closing
from mmap import ACCESS_READ, mmap
from pathlib import Path
from typing import TypeAlias

from pymavlink.DFReader import DFMessage, DFReader_binary, DFReaderClock_usec

from flight_logs.autopilot.dataflash_records import MAGIC, IntactRecords, find_records
from flight_logs.autopilot.dataflash_vehicle import VehicleFacts, arming_of
from flight_logs.autopilot.telling import OwnLog, Telling, TimedMessage, credible
from flight_logs.errors import LogError
from mavlink_vehicle.codec import mavlink

__all__ = ["MAGIC", "read_dataflash"]

_POSITION_S = 0.1
_BATTERY_S = 0.5
_ORIGIN, _HOME = 0, 1
_FIX_3D = 3
_ESTIMATORS = ("XKF1", "NKF1", "EKF1")
_ESTIMATOR_BY_PARAMETER = {1: "EKF1", 2: "NKF1", 3: "XKF1"}
"""AHRS_EKF_TYPE"""

Handler: TypeAlias = Callable[[float, DFMessage], None]


def read_dataflash(path: Path, progress: Callable[[float], object]) -> OwnLog:
    """Return the content of a `.BIN` log, as messages in the order of time.

    Args:
        path: the file.
        progress: called now and then with the share that was read, 0 to 1.

    Raises:
        LogError: it cannot be read, or holds nothing.
        OSError: the intact part of a damaged log cannot be written.
    """
    with path.open("rb") as file, closing(mmap(file.fileno(), 0, access=ACCESS_READ)) as data:
        records = find_records(data, lambda share: progress(0.3 * share))
        if records.spans == ((0, len(data)),):
            return _read(path, path, records, progress)
        with tempfile.TemporaryDirectory() as folder:
            intact = Path(folder) / path.name
            with intact.open("wb") as out:
                for begin, end in records.spans:
                    out.write(data[begin:end])
            return _read(path, intact, records, progress)


def _read(
    path: Path, intact: Path, records: IntactRecords, progress: Callable[[float], object]
) -> OwnLog:
    if not records.spans:
        raise LogError(f"{path} cannot be read as a DataFlash log: it has no intact record.")
    try:
        reader = DFReader_binary(str(intact))
    except Exception as error:  # it raises whatever a damaged file leads to
        raise LogError(f"{path} cannot be read as a DataFlash log: {error}.") from error
    with closing(reader):
        messages = _Reader(reader, records).read(lambda share: progress(0.3 + 0.7 * share))
    damage: tuple[str, ...] = ()
    if records.damaged_bytes:
        damage = (f"{records.damaged_bytes} bytes of the file are damaged and were left out",)
    return OwnLog(messages, damage)


class _Reader:
    """Retells the records of one log."""

    def __init__(self, reader: DFReader_binary, records: IntactRecords) -> None:
        self._reader = reader
        self._telling = Telling(mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA)
        self._begun_s = -math.inf
        self._position_s = -math.inf
        self._battery_s = -math.inf
        # Older clocks count with every record, and records without a time have that of the last.
        clock = reader.clock
        self._has_time_us = isinstance(clock, DFReaderClock_usec)
        self._pulses_s = (
            [clock.timebase + time_us * 1e-6 for time_us in records.times_us]
            if self._has_time_us
            else []
        )
        self._columns: dict[str, dict[str, str]] = {
            form.name: dict(zip(form.columns, form.format, strict=False))
            for kind, form in reader.formats.items()
            if len(reader.offsets[kind])
        }

    def read(self, progress: Callable[[float], object]) -> list[TimedMessage]:
        """Return the messages."""
        self._learn()
        handlers = self._handlers()
        telling, pulses_s, sent = self._telling, self._pulses_s, 0
        wanted = list(handlers) if self._has_time_us else None
        for stamp_s, record in _credible(self._records(wanted, progress)):
            time_s = max(stamp_s, self._begun_s)
            due = bisect_right(pulses_s, time_s, lo=sent)
            for pulse_s in pulses_s[sent:due]:
                telling.pulse(pulse_s)
            sent = due
            handler = handlers.get(record.get_type())
            if handler is not None:
                handler(time_s, record)
            telling.pulse(time_s)
        for pulse_s in pulses_s[sent:]:
            telling.pulse(pulse_s)
        return telling.messages

    def _records(
        self, wanted: list[str] | None, progress: Callable[[float], object]
    ) -> Iterator[tuple[float, DFMessage]]:
        count = 0
        while (record := self._reader.recv_match(type=wanted)) is not None:
            if record.get_type() != "FMT":  # has no time
                yield float(record._timestamp), record
            count += 1
            if count % 1000 == 0:
                progress(self._reader.percent / 100.0)

    def _handlers(self) -> dict[str, Handler]:
        """Return what takes the records of each type, of those that have what it needs."""
        needed: dict[str, tuple[Handler, str]] = {
            "MSG": (self._text, "Message"),
            "MODE": (self._mode, "Mode"),
            "ARM": (self._arm, "ArmState"),
            "EV": (self._arm, "Id"),
            "ERR": (self._error, "Subsys ECode"),
            "ATT": (self._attitude, "Yaw"),
            "ORGN": (self._origin, "Type Lat Lng Alt"),
            "BAT": (self._battery, "Volt"),
            "VER": (self._version, "Maj Min Pat FWT"),
        }
        if "BAT" not in self._columns:
            needed["CURR"] = (self._battery, "Volt")
        if self._has("POS", "Lat Lng Alt"):
            needed["POS"] = (self._position, "Lat Lng Alt")
        elif self._has("GPS", "Status Lat Lng Alt"):
            for kind in ("GPS", "GPS2", "GPSB"):
                needed[kind] = (self._gps, "Status Lat Lng Alt")
        estimator = self._estimator()
        if estimator is not None:
            needed[estimator] = (self._velocity, "VN VE VD")
        return {
            kind: handler for kind, (handler, names) in needed.items() if self._has(kind, names)
        }

    def _has(self, kind: str, names: str) -> bool:
        return kind in self._columns and self._columns[kind].keys() >= set(names.split())

    def _estimator(self) -> str | None:
        """Return the records of the estimator that is in use."""
        there = [kind for kind in _ESTIMATORS if self._has(kind, "VN VE VD")]
        chosen = _ESTIMATOR_BY_PARAMETER.get(self._reader.params.get("AHRS_EKF_TYPE"))
        return chosen if chosen in there else next(iter(there), None)

    def _learn(self) -> None:
        """Learn what HEARTBEAT says from the beginning: the vehicle's type, and whether armed."""
        facts = VehicleFacts()
        wanted = list(facts.kinds) if self._has_time_us else None
        for time_s, record in self._records(wanted, lambda _share: None):
            if self._begun_s == -math.inf and _has_time(record):
                # Without GPS, what comes before has no time.
                self._begun_s = time_s
            facts.take(record)
        self._reader.rewind()
        telling = self._telling
        telling.version = facts.version
        telling.vehicle_type = facts.vehicle_type
        telling.armed = facts.armed_at_first

    def _text(self, time_s: float, record: DFMessage) -> None:
        # DataFlash keeps no severity.
        self._telling.text(time_s, mavlink.MAV_SEVERITY_INFO, str(record.Message))

    def _mode(self, time_s: float, record: DFMessage) -> None:
        # Up to ArduCopter 3.2, Mode is the number, and there is no ModeNum.
        self._telling.mode = int(getattr(record, "ModeNum", record.Mode))
        self._telling.beat(time_s)

    def _arm(self, time_s: float, record: DFMessage) -> None:
        armed = arming_of(record)
        if armed is not None:
            self._telling.armed = armed
            self._telling.beat(time_s)

    def _error(self, time_s: float, record: DFMessage) -> None:
        if record.ECode:
            text = f"ERR subsystem {record.Subsys}, code {record.ECode}"
            self._telling.text(time_s, mavlink.MAV_SEVERITY_WARNING, text)

    def _attitude(self, _time_s: float, record: DFMessage) -> None:
        self._telling.heading_deg = float(record.Yaw)

    def _velocity(self, _time_s: float, record: DFMessage) -> None:
        if getattr(record, "C", 0) == 0:
            self._set_velocity(float(record.VN), float(record.VE), float(record.VD))

    def _set_velocity(self, *velocity_ned_m_s: float) -> None:
        if all(map(math.isfinite, velocity_ned_m_s)):
            north, east, down = velocity_ned_m_s
            self._telling.velocity_ned_m_s = (north, east, down)

    def _origin(self, time_s: float, record: DFMessage) -> None:
        place = (float(record.Lat), float(record.Lng), float(record.Alt))
        if record.Type == _ORIGIN:
            self._telling.origin(time_s, place)
        elif record.Type == _HOME:
            self._telling.home(time_s, place)

    def _position(self, time_s: float, record: DFMessage) -> None:
        if time_s - self._position_s < 0.9 * _POSITION_S:
            return
        self._position_s = time_s
        place = (float(record.Lat), float(record.Lng), float(record.Alt))
        above_home_m = getattr(record, "RelHomeAlt", getattr(record, "RelAlt", None))
        self._telling.position(time_s, time_s - self._begun_s, place, above_home_m)

    def _gps(self, time_s: float, record: DFMessage) -> None:
        """Take the position of the receiver that is in use, where the log has no POS."""
        if record.Status < _FIX_3D:
            return
        used = bool(record.U) if "U" in self._columns[record.get_type()] else None
        if used is False or (used is None and record.get_type() != "GPS"):
            return
        if self._estimator() is None and self._has(record.get_type(), "Spd GCrs"):
            course_rad = math.radians(record.GCrs)
            speed_m_s = float(record.Spd)
            self._set_velocity(
                speed_m_s * math.cos(course_rad),
                speed_m_s * math.sin(course_rad),
                float(getattr(record, "VZ", 0.0)),
            )
        place = (float(record.Lat), float(record.Lng), float(record.Alt))
        above_home_m = getattr(record, "RelAlt", getattr(record, "RAlt", None))
        self._telling.position(time_s, time_s - self._begun_s, place, above_home_m)

    def _battery(self, time_s: float, record: DFMessage) -> None:
        first = getattr(record, "Inst", getattr(record, "Instance", 0)) == 0
        if not first or time_s - self._battery_s < 0.9 * _BATTERY_S:
            return
        self._battery_s = time_s
        percent = getattr(record, "RemPct", None)
        if percent is not None and not 0.0 <= percent <= 100.0:
            percent = None  # 255: the monitor does not measure the charge
        letters = self._columns[record.get_type()]
        voltage_v, current_a = (
            float(getattr(record, name, math.nan)) * (0.01 if letters.get(name) in _CENTI else 1.0)
            for name in ("Volt", "Curr")
        )
        self._telling.battery(time_s, voltage_v, current_a, percent)

    def _version(self, time_s: float, record: DFMessage) -> None:
        number = record.Maj << 24 | record.Min << 16 | record.Pat << 8 | record.FWT
        self._telling.firmware(time_s, number)


_CENTI = frozenset("hHiI")
"""Letters of numbers without a unit: CURR had hundredths in these up to ArduCopter 3.3"""


def _credible(records: Iterator[tuple[float, DFMessage]]) -> Iterator[tuple[float, DFMessage]]:
    """Pass on the records but those whose time lies far ahead of the one after them."""
    before: tuple[float, DFMessage] | None = None
    for now in records:
        if before is not None and credible(before[0], now[0]):
            yield before
        before = now
    if before is not None:
        yield before


def _has_time(record: DFMessage) -> bool:
    names = record._fieldnames
    return names[:1] in (["TimeUS"], ["TimeMS"]) or (record.get_type() == "GPS" and "T" in names)
