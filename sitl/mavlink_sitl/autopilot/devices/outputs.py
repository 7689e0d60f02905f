"""Servos that commands and mission items move."""

from __future__ import annotations

from typing import TYPE_CHECKING

from mavlink_sitl.exchange import Result, Severity

if TYPE_CHECKING:
    from mavlink_sitl.autopilot.common.commander import Commander

OUTPUTS = 16
OWN = {"copter": (1, 2, 3, 4), "rover": (1, 3), "boat": (1, 3), "plane": (1, 2, 3, 4)}
"""Outputs of the vehicle's own motors and servos, by its kind"""


class Outputs:
    """The outputs of one vehicle, from one power-up to the next.

    Attributes:
        servos_us: what was put on outputs, by their number.
    """

    def __init__(self, vehicle: Commander) -> None:
        self._vehicle = vehicle
        self.servos_us: dict[int, int] = {}

    def set_servo(self, output: int, pulse_us: float) -> Result:
        """DO_SET_SERVO: an output that nothing else uses."""
        if not self._free(output) or not 0.0 <= pulse_us <= 65535.0:
            return Result.FAILED
        self.servos_us[output] = round(pulse_us)
        return Result.ACCEPTED

    def _free(self, output: int) -> bool:
        if output in OWN.get(self._vehicle.personality.kind, ()):
            text = f"ServoRelayEvent: Channel {output} is already in use"
            self._vehicle.say(Severity.INFO, text)
            return False
        return 1 <= output <= OUTPUTS
