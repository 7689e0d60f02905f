"""The pilot's mode switch: six positions of one channel, each for a mode (FLTMODEn or MODEn)."""

from __future__ import annotations

from mavlink_sitl.autopilot.state.vehicle_view import VehicleView

BANDS_US = (1231, 1361, 1491, 1621, 1750)
"""Between the positions"""
LEAST_US, MOST_US = 800, 2200
"""A pulse that is not between them is none"""
SETTLED_S = 0.2
"""A position counts once the switch has been there for so long"""


class ModeSwitch:
    """Changes the mode when the switch has moved, and once after the start."""

    def __init__(self, vehicle: VehicleView) -> None:
        self._vehicle = vehicle
        self._position: int | None = None
        self._moved_to: int | None = None
        self._moved_s = 0.0

    def _names(self) -> tuple[str, str]:
        """Of the parameter with the channel, and of those with the modes."""
        of_rover = "MODE_CH" in self._vehicle.parameters
        return ("MODE_CH", "MODE") if of_rover else ("FLTMODE_CH", "FLTMODE")

    def read(self) -> int | None:
        """The position, 0..5; None where there is no such channel or no pulse."""
        vehicle = self._vehicle
        channel = int(vehicle.parameters[self._names()[0]])
        channels = vehicle.radio.channels(vehicle.now_s)
        if not 1 <= channel <= len(channels) or not LEAST_US < channels[channel - 1] < MOST_US:
            return None
        return sum(channels[channel - 1] >= band for band in BANDS_US)

    def settle(self) -> None:
        """It has been where it is for long."""
        self._position = self._moved_to = self.read()

    def mode_there(self, position: int) -> int:
        """The number of the mode that belongs to a position."""
        n, p = position + 1, self._vehicle.parameters
        return int(p[f"MODE{n}" if "MODE_CH" in p else f"FLTMODE{n}"])

    def watch(self) -> None:
        """Look at the switch, while the radio is heard."""
        vehicle = self._vehicle
        if not vehicle.radio.obeyed(vehicle.now_s):
            return
        position = self.read()
        if position is None:
            return
        if position == self._position:
            self._moved_to = position
        elif position != self._moved_to:
            self._moved_to, self._moved_s = position, vehicle.now_s
        elif vehicle.now_s - self._moved_s >= SETTLED_S:
            self._position = position
            vehicle.choose_mode(self.mode_there(position))
