"""The calibration of the accelerometers: six positions, one after the other.

By AP_AccelCal: it asks for a position, as a text and once a second as ACCELCAL_VEHICLE_POS, and
takes its samples once that command, or a COMMAND_ACK, says that the vehicle is there.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from mavlink_sitl.exchange import AccelerometerPosition, Severity

if TYPE_CHECKING:
    from mavlink_sitl.autopilot.common.firmware import Firmware

POSITIONS = (
    "level",
    "on its LEFT side",
    "on its RIGHT side",
    "nose DOWN",
    "nose UP",
    "on its BACK",
)
ASK_S = 1.0
SAMPLES_S = 0.5
SUCCEEDED = 16777215
"""ACCELCAL_VEHICLE_POS at the end"""


class Accelerometers:
    """The calibration of one vehicle's accelerometers."""

    def __init__(self, vehicle: Firmware) -> None:
        self._vehicle = vehicle
        self._step = 0
        self._ask_s = 0.0
        self._sampled_s: float | None = None

    @property
    def running(self) -> bool:
        """Whether a calibration is in progress."""
        return self._step > 0

    def start(self) -> None:
        """PREFLIGHT_CALIBRATION with param5 = 1; one that is under way continues."""
        if not self.running:
            self._begin(1)

    def there(self, position: float | None = None) -> bool:
        """The vehicle is in a position; None for that which is asked for."""
        waits = self.running and self._sampled_s is None
        if not waits or (position is not None and position != self._step):
            return False
        self._sampled_s = self._vehicle.now_s + SAMPLES_S
        return True

    def update(self) -> None:
        """Ask, or end the samples of a position."""
        if not self.running:
            return
        now_s = self._vehicle.now_s
        if self._sampled_s is not None:
            if now_s >= self._sampled_s:
                self._begin(self._step + 1)
        elif now_s >= self._ask_s:
            self._ask_s = now_s + ASK_S
            self._vehicle.events.append(AccelerometerPosition(self._step))

    def _begin(self, step: int) -> None:
        self._sampled_s = None
        self._ask_s = self._vehicle.now_s
        self._step = step
        if step <= len(POSITIONS):
            place = POSITIONS[step - 1]
            self._vehicle.say(Severity.CRITICAL, f"Place vehicle {place} and press any key.")
            return
        self._step = 0
        self._vehicle.say(Severity.CRITICAL, "Calibration successful")
        self._vehicle.events.append(AccelerometerPosition(SUCCEEDED))
