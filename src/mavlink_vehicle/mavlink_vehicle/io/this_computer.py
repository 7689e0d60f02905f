"""Readings of this computer by Linux: load, memory, disk, temperature, throttling.

A value that it does not report is None or empty; no other system has any of it.
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from mavlink_vehicle.protocols.streams.computer_status import ComputerStatus

__all__ = ["ComputerReader", "Heat", "read_heat", "read_memory_bytes", "read_model"]

_THERMAL = "sys/class/thermal"
_KIB = 1024
_COOLS_PROCESSOR = ("cpufreq", "processor")
"""In the type of a cooling device that slows the processor; others are fans."""


@dataclass(frozen=True)
class Heat:
    """Temperatures and what they cause.

    Attributes:
        hottest_c: of the hottest zone; None if no zone reports one.
        zone: its type, such as "cpu-thermal".
        limit_c: temperature at which that zone slows the processor down or ends the system; None
            if Linux does not report one.
        throttles: whether the processor is slowed down now; None if Linux does not report it.
    """

    hottest_c: float | None = None
    zone: str = ""
    limit_c: float | None = None
    throttles: bool | None = None


class ComputerReader:
    """Reads the status again and again; loads are those since the last reading."""

    def __init__(self, storage: Path | str = ".", root: Path | str = "/") -> None:
        """Prepare.

        Args:
            storage: a folder on the disk to report.
            root: where `proc` and `sys` are.
        """
        self._root = Path(root)
        self._storage = storage
        self._times = self._core_times()

    def read(self) -> ComputerStatus:
        """Return the status of now."""
        before, self._times = self._times, self._core_times()
        total, available = read_memory_bytes(self._root)
        used = None if total is None or available is None else total - available
        stored = stored_used = None
        with suppress(OSError):
            disk = os.statvfs(self._storage)
            stored = disk.f_blocks * disk.f_frsize
            stored_used = stored - disk.f_bavail * disk.f_frsize
        return ComputerStatus(
            uptime_s=self._uptime_s(),
            core_loads=tuple(_loads(before, self._times)),
            ram_used_bytes=used,
            ram_total_bytes=total,
            storage_used_bytes=stored_used,
            storage_total_bytes=stored,
            temperature_c=read_heat(self._root).hottest_c,
        )

    def _uptime_s(self) -> float | None:
        with suppress(ValueError, IndexError):
            return float(_text(self._root / "proc/uptime").split()[0])
        return None

    def _core_times(self) -> dict[str, tuple[int, int]]:
        """Return for each core its time in all, and its idle time, in clock ticks."""
        times = {}
        for line in _text(self._root / "proc/stat").splitlines():
            name, *words = line.split() or [""]
            if name.startswith("cpu") and name != "cpu":
                with suppress(ValueError, IndexError):
                    # The last two are parts of the first two; the 4th and 5th are idle.
                    spent = [int(word) for word in words[:8]]
                    times[name] = (sum(spent), spent[3] + spent[4])
        return times


def _loads(
    before: dict[str, tuple[int, int]], after: dict[str, tuple[int, int]]
) -> Iterator[float]:
    for name, (total, idle) in after.items():
        total_before, idle_before = before.get(name, (0, 0))
        passed = total - total_before
        if passed > 0:
            yield min(max(1.0 - (idle - idle_before) / passed, 0.0), 1.0)


def read_memory_bytes(root: Path | str = "/") -> tuple[int | None, int | None]:
    """Return the memory in all, and what programs can still get."""
    found: dict[str, int] = {}
    for line in _text(Path(root) / "proc/meminfo").splitlines():
        name, _, rest = line.partition(":")
        with suppress(ValueError, IndexError):
            found[name] = int(rest.split()[0]) * _KIB
    return found.get("MemTotal"), found.get("MemAvailable")


def read_model(root: Path | str = "/") -> str:
    """Return the name of the computer or of its processor; empty if Linux does not report one."""
    root = Path(root)
    # The first of a Raspberry Pi or Jetson.
    board = _text(root / "proc/device-tree/model").rstrip("\0").strip()
    if board:
        return board
    for line in _text(root / "proc/cpuinfo").splitlines():
        name, _, value = line.partition(":")
        if name.strip() == "model name":
            return " ".join(value.split())
    return ""


def read_heat(root: Path | str = "/") -> Heat:
    """Return temperatures, and whether the processor is slowed down for them."""
    folder = Path(root) / _THERMAL
    hottest_c, zone = -math.inf, None
    for path in sorted(folder.glob("thermal_zone*")):
        # A zone that is switched off has none, or reports one that cannot be.
        celsius = _millidegrees(path / "temp")
        if celsius is not None and hottest_c < celsius:
            hottest_c, zone = celsius, path
    throttles = _throttles(folder)
    if zone is None:
        return Heat(throttles=throttles)
    kinds = ("passive", "hot", "critical")
    limits_c = [
        celsius
        for trip in sorted(zone.glob("trip_point_*_type"))
        if _text(trip).strip() in kinds
        and (celsius := _millidegrees(trip.with_name(trip.name.replace("_type", "_temp"))))
    ]
    return Heat(hottest_c, _text(zone / "type").strip(), min(limits_c, default=None), throttles)


def _throttles(folder: Path) -> bool | None:
    states = []
    for device in folder.glob("cooling_device*"):
        kind = _text(device / "type").strip().lower()
        if any(word in kind for word in _COOLS_PROCESSOR):
            with suppress(ValueError):
                states.append(int(_text(device / "cur_state")) > 0)
    return any(states) if states else None


def _millidegrees(path: Path) -> float | None:
    """Return a temperature in degrees Celsius; None without a plausible one."""
    with suppress(ValueError):
        celsius = int(_text(path)) / 1e3
        if -55.0 <= celsius <= 150.0:
            return celsius
    return None


def _text(path: Path) -> str:
    """Return what a file of the kernel has, nothing if it cannot be read."""
    try:
        return path.read_text("utf-8", errors="replace")
    except OSError:
        return ""
