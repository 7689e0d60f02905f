"""Status of this computer for the autopilot: ONBOARD_COMPUTER_STATUS.

PX4 logs it, and 1.18 warns when `temperature_board` reaches COM_CC_TEMP_WARN; it looks at nothing
else, prevents no arming by it, and ignores a status older than 5 s (companionComputerCheck.cpp). An
ArduPilot at most passes it on.
"""

from __future__ import annotations

from dataclasses import dataclass

from mavlink_vehicle.codec import make
from mavlink_vehicle.protocols.service import Conversation, SendingRank, VehicleService
from mavlink_vehicle.state.vehicle_state import VehicleState

__all__ = ["ComputerStatus", "ComputerStatusSender"]

_U8_MAX, _I8_MAX, _I16_MAX, _U32_MAX = 0xFF, 0x7F, 0x7FFF, 0xFFFFFFFF
_I8_MIN = -0x80
_CORES, _GPU_CORES, _SLICES, _FANS, _STORAGES, _LINKS = 8, 4, 10, 4, 4, 6
_MIB = 1 << 20
_UINT32 = 1 << 32


@dataclass(frozen=True)
class ComputerStatus:
    """Status of a computer; None is unknown.

    Attributes:
        uptime_s: time since its start.
        core_loads: load of each core in the last second, from 0 to 1; empty while unknown.
        ram_used_bytes: memory that programs cannot get.
        ram_total_bytes: all of it.
        storage_used_bytes: taken on the disk where recordings go.
        storage_total_bytes: all of it.
        temperature_c: of the hottest part with a sensor.
    """

    uptime_s: float | None = None
    core_loads: tuple[float, ...] = ()
    ram_used_bytes: int | None = None
    ram_total_bytes: int | None = None
    storage_used_bytes: int | None = None
    storage_total_bytes: int | None = None
    temperature_c: float | None = None


class ComputerStatusSender(VehicleService):
    """Sends each status that it gets while the vehicle is heard."""

    rank = SendingRank.DATA

    def __init__(self) -> None:
        """Begin without a vehicle."""
        super().__init__()
        self._is_heard = False

    def offer(self, status: ComputerStatus) -> None:
        """Send a status, unless there is nobody to send it to."""
        if not self._is_heard:
            return
        uptime_ms = round(1e3 * (status.uptime_s or 0.0))
        loads = [min(max(round(100.0 * load), 0), 100) for load in status.core_loads]
        storages = (_mib(status.storage_used_bytes), _mib(status.storage_total_bytes))
        self.outbox.append(
            make(
                "ONBOARD_COMPUTER_STATUS",
                time_usec=1000 * uptime_ms,
                uptime=uptime_ms % _UINT32,
                type=0,
                cpu_cores=_filled(loads, _CORES, _U8_MAX),
                cpu_combined=_filled([], _SLICES, _U8_MAX),
                gpu_cores=_filled([], _GPU_CORES, _U8_MAX),
                gpu_combined=_filled([], _SLICES, _U8_MAX),
                temperature_board=_degrees(status.temperature_c),
                temperature_core=_filled([], _CORES, _I8_MAX),
                fan_speed=_filled([], _FANS, _I16_MAX),
                ram_usage=_mib(status.ram_used_bytes),
                ram_total=_mib(status.ram_total_bytes),
                storage_type=_filled([], _STORAGES, _U32_MAX),
                storage_usage=_filled([storages[0]], _STORAGES, _U32_MAX),
                storage_total=_filled([storages[1]], _STORAGES, _U32_MAX),
                link_type=_filled([], _LINKS, _U32_MAX),
                link_tx_rate=_filled([], _LINKS, _U32_MAX),
                link_rx_rate=_filled([], _LINKS, _U32_MAX),
                link_tx_max=_filled([], _LINKS, _U32_MAX),
                link_rx_max=_filled([], _LINKS, _U32_MAX),
            )
        )

    def vehicle_came(self, conversation: Conversation, now: float) -> None:
        """Begin to send."""
        self._is_heard = True

    def link_lost(self, state: VehicleState, now: float) -> None:
        """Send nothing."""
        self._is_heard = False

    def vehicle_gone(self, reason: str, now: float) -> None:
        """Send nothing."""
        self._is_heard = False


def _filled(values: list[int], size: int, unknown: int) -> list[int]:
    """Return an array of the message; more values than it takes are left out."""
    return (values + [unknown] * size)[:size]


def _mib(size_bytes: int | None) -> int:
    return _U32_MAX if size_bytes is None else min(size_bytes // _MIB, _U32_MAX - 1)


def _degrees(temperature_c: float | None) -> int:
    if temperature_c is None:
        return _I8_MAX
    return min(max(round(temperature_c), _I8_MIN), _I8_MAX - 1)
