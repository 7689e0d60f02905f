"""The calibration of the compasses: somebody turns the vehicle, as long as it takes.

By AP_Compass: it waits, collects in two steps, and ends with a report for each compass, which is
accepted by command or by itself. Until the next start the vehicle does not arm after it.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import TYPE_CHECKING

from mavlink_sitl.autopilot.parameters import ParameterType
from mavlink_sitl.exchange import ParameterSaved, Result, Severity

if TYPE_CHECKING:
    from mavlink_sitl.autopilot.common.firmware import Firmware

COMPASSES = 3
STEP_ONE_S, STEP_TWO_S = 15.0, 15.0
"""How long it takes whoever turns the vehicle"""
NAMES = ("OFS", "DIA", "ODI")


class Status(IntEnum):
    """The numbers are MAG_CAL_STATUS's."""

    NOT_STARTED = 0
    WAITING_TO_START = 1
    RUNNING_STEP_ONE = 2
    RUNNING_STEP_TWO = 3
    SUCCESS = 4


RUNNING = (Status.WAITING_TO_START, Status.RUNNING_STEP_ONE, Status.RUNNING_STEP_TWO)


@dataclass
class Calibration:
    """Of one compass.

    Attributes:
        began_s: when it began, after the delay.
        status: how far it is.
        saved: whether its outcome was.
    """

    began_s: float
    status: Status = Status.WAITING_TO_START
    saved: bool = False

    def percent(self, now_s: float) -> int:
        """How much of it is done."""
        done = (now_s - self.began_s) / (STEP_ONE_S + STEP_TWO_S)
        return round(min(max(done, 0.0), 1.0) * 100.0)

    def update(self, now_s: float) -> None:
        """Advance with time."""
        gone_s = now_s - self.began_s
        if self.status in RUNNING and gone_s >= 0.0:
            self.status = Status.RUNNING_STEP_ONE
            if gone_s >= STEP_ONE_S:
                self.status = Status.RUNNING_STEP_TWO
            if gone_s >= STEP_ONE_S + STEP_TWO_S:
                self.status = Status.SUCCESS


class Compasses:
    """The compasses of one vehicle, from one power-up to the next.

    Attributes:
        calibrations: by compass; those that are under way, or have a report.
    """

    def __init__(self, vehicle: Firmware) -> None:
        self._vehicle = vehicle
        self.calibrations: dict[int, Calibration] = {}
        self._autosave = self._autoreboot = False
        self._requires_reboot = False

    @property
    def mask(self) -> int:
        """Bits of the compasses with a calibration."""
        return sum(1 << compass for compass in self.calibrations)

    @property
    def running(self) -> bool:
        """Whether one is being calibrated."""
        return any(each.status in RUNNING for each in self.calibrations.values())

    def reasons(self) -> list[str]:
        """Why the vehicle does not arm."""
        if self.running:
            return ["Compass calibration running"]
        return ["Compass calibrated requires reboot"] if self._requires_reboot else []

    def start(self, mask: int, autosave: bool, delay_s: float, autoreboot: bool) -> Result:
        """DO_START_MAG_CAL: of all, or of those in a mask."""
        vehicle = self._vehicle
        if vehicle.soft_armed:
            vehicle.say(Severity.NOTICE, "Disarm to allow compass calibration")
            return Result.FAILED
        if not 0 <= mask <= 255 or mask >> COMPASSES:
            return Result.FAILED
        self._autosave, self._autoreboot = autosave, autoreboot
        for compass in self._of(mask):
            self.calibrations[compass] = Calibration(vehicle.now_s + max(delay_s, 0.0))
        self._requires_reboot = True
        return Result.ACCEPTED

    def accept(self, mask: int) -> Result:
        """DO_ACCEPT_MAG_CAL: save what has succeeded; what has not is given up."""
        if not 0 <= mask <= 255:
            return Result.FAILED
        chosen = {c: self.calibrations.pop(c) for c in self._of(mask) if c in self.calibrations}
        for compass, calibration in chosen.items():
            if calibration.status is Status.SUCCESS:
                self._save(compass, calibration)
        succeeded = all(each.status is Status.SUCCESS for each in chosen.values())
        return Result.ACCEPTED if succeeded else Result.FAILED

    def cancel(self, mask: int) -> Result:
        """DO_CANCEL_MAG_CAL."""
        if not 0 <= mask <= 255:
            return Result.FAILED
        for compass in self._of(mask):
            self.calibrations.pop(compass, None)
        return Result.ACCEPTED

    def update(self) -> None:
        """Advance; save and start again where that was asked for."""
        if not self.running:
            return
        for compass, calibration in self.calibrations.items():
            calibration.update(self._vehicle.now_s)
            if calibration.status is Status.SUCCESS and self._autosave:
                self._save(compass, calibration)
        over = all(each.status is Status.SUCCESS for each in self.calibrations.values())
        if over and self._autoreboot:
            self._vehicle.reboot()

    def values(self, compass: int, name: str) -> tuple[float, float, float]:
        """OFS, DIA or ODI of a compass: those that it has are right."""
        x, y, z = (self._vehicle.parameters[each] for each in self._names(compass, name))
        return x, y, z

    def _names(self, compass: int, name: str) -> list[str]:
        number = str(compass + 1) if compass else ""
        return [f"COMPASS_{name}{number}_{axis}" for axis in "XYZ"]

    def _of(self, mask: int) -> list[int]:
        return [c for c in range(COMPASSES) if mask == 0 or mask >> c & 1]

    def _save(self, compass: int, calibration: Calibration) -> None:
        if calibration.saved:
            return
        calibration.saved = True
        for kind in NAMES:
            for name in self._names(compass, kind):
                value = self._vehicle.parameters[name]
                saved = ParameterSaved(name, value, int(ParameterType.REAL32))
                self._vehicle.events.append(saved)
