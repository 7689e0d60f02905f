"""Parameters that ArduPilot saves by itself and then broadcasts as PARAM_VALUE.

Recorded in every flight in `tlogs/ardupilot`: calibrations while it starts, MIS_TOTAL with each
item of an upload and when home is set (RALLY_TOTAL alike, and FENCE_TOTAL with a whole fence, by
the firmware's source), STAT_FLTTIME and STAT_RUNTIME twice a minute and at
disarming.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from mavlink_sitl.autopilot.parameters import ParameterType
from mavlink_sitl.autopilot.personality.shared import BAROMETERS, GYROSCOPES
from mavlink_sitl.exchange import ParameterSaved

if TYPE_CHECKING:
    from mavlink_sitl.autopilot.common.commander import Commander

STATISTICS_S = 30.0
"""How often AP_Stats saves"""


class Saved:
    """Tells what one vehicle saves, from one power-up to the next.

    Args:
        firmware: the vehicle. One whose personality saves nothing while starting never does.
    """

    def __init__(self, firmware: Commander) -> None:
        self._vehicle = firmware
        self._sent = 0
        self._items = 0
        self._was_armed = False
        self._flown_s = 0.0
        self._flown_sent_s = 0
        self._flying_since_s: float | None = None
        self._statistics_at_s = firmware.boot_s + STATISTICS_S
        if firmware.boot_s > 0.0 and "STAT_BOOTCNT" in firmware.parameters:
            boots = firmware.parameters["STAT_BOOTCNT"] + 1.0  # by which programs see a reboot
            firmware.parameters.set("STAT_BOOTCNT", boots)

    def update(self) -> None:
        """Look what there is to save; called at the autopilot's rate."""
        firmware = self._vehicle
        steps = firmware.personality.saved
        if not steps:
            return
        now_s = firmware.now_s
        while self._sent < len(steps):
            step = steps[self._sent]
            if now_s < firmware.estimator.scaled(step.at_s):
                break
            self._sent += 1
            self._tell(step.name, step.value, step.type)
        self._count_flight(now_s)
        disarmed = self._was_armed and not firmware.armed
        self._was_armed = firmware.armed
        if disarmed or now_s >= self._statistics_at_s:
            self._statistics_at_s = now_s + STATISTICS_S
            self._tell_statistics(now_s)

    def mission_length(self, items: int) -> None:
        """Set the number of mission items, home included."""
        if self._vehicle.personality.saved and items != self._items:
            self._items = items
            self._tell("MIS_TOTAL", items, ParameterType.INT16)

    def rally_length(self, points: int) -> None:
        """Set the number of stored rally points."""
        if self._vehicle.personality.saved and points != self._vehicle.parameters["RALLY_TOTAL"]:
            self._tell("RALLY_TOTAL", points, ParameterType.INT8)

    def fence_length(self, total: int) -> None:
        """Another fence is stored, of this many points as FENCE_TOTAL counts them."""
        if self._vehicle.personality.saved:
            self._tell("FENCE_TOTAL", total, ParameterType.INT8)

    def gyroscopes(self) -> None:
        """Their calibration."""
        for step in GYROSCOPES:
            self._tell(step.name, step.value, step.type)

    def barometers(self) -> None:
        """The pressure on the ground."""
        for name, value in BAROMETERS:
            self._tell(name, value, ParameterType.REAL32)

    def accelerometers(self, trim: bool) -> None:
        """Their offsets as they are, which are right, or the angles at which they are built in."""
        names = ("AHRS_TRIM_{}",) if trim else ("INS_ACCOFFS_{}", "INS_ACC2OFFS_{}")
        for name in (each.format(axis) for each in names for axis in "XYZ"):
            self._tell(name, self._vehicle.parameters[name], ParameterType.REAL32)

    def _count_flight(self, now_s: float) -> None:
        flying = self._vehicle.armed and not self._vehicle.landed
        if flying and self._flying_since_s is None:
            self._flying_since_s = now_s
        elif not flying and self._flying_since_s is not None:
            self._flown_s += now_s - self._flying_since_s
            self._flying_since_s = None

    def _tell_statistics(self, now_s: float) -> None:
        since_s = now_s if self._flying_since_s is None else self._flying_since_s
        flown_s = int(self._flown_s + now_s - since_s)
        if flown_s != self._flown_sent_s:
            self._flown_sent_s = flown_s
            self._tell("STAT_FLTTIME", flown_s, ParameterType.INT32)
        self._tell("STAT_RUNTIME", int(now_s - self._vehicle.boot_s), ParameterType.INT32)

    def _tell(self, name: str, value: float, kind: ParameterType) -> None:
        if name in self._vehicle.parameters:
            self._vehicle.parameters.set(name, value)
        self._vehicle.events.append(ParameterSaved(name, float(value), int(kind)))
