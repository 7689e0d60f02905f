"""The pilot's mode switch: six positions of one channel, each for a mode (FLTMODEn or MODEn)."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from mavlink_sitl.autopilot.common.commander import Commander


BANDS_US = (1231, 1361, 1491, 1621, 1750)
"""Between the positions"""
SETTLED_S = 0.2
"""A position counts once the switch has been there for this time"""


class SettledPosition:
    """The position of a switch, which counts once the switch has been there for a while.

    Attributes:
        position: the one that counts.
    """

    def __init__(self, position: int | None) -> None:
        self.position = self._moved_to = position
        self._moved_s = 0.0

    def see(self, position: int, now_s: float) -> bool:
        """Take where the switch is; returns whether that has just begun to count."""
        if position == self.position:
            self._moved_to = position
        elif position != self._moved_to:
            self._moved_to, self._moved_s = position, now_s
        elif now_s - self._moved_s >= SETTLED_S:
            self.position = position
            return True
        return False


class ModeSwitch:
    """Changes the mode when the switch has moved, and once after the start."""

    def __init__(self, vehicle: Commander) -> None:
        self._vehicle = vehicle
        self._switch = SettledPosition(None)

    @property
    def _of_rover(self) -> bool:
        return "MODE_CH" in self._vehicle.parameters

    def read(self) -> int | None:
        """The position, 0..5; None where there is no such channel or no pulse."""
        vehicle = self._vehicle
        channel = int(vehicle.parameters["MODE_CH" if self._of_rover else "FLTMODE_CH"])
        pulse_us = vehicle.radio.pulse_us(channel, vehicle.now_s)
        return None if pulse_us is None else sum(pulse_us >= band for band in BANDS_US)

    def settle(self) -> None:
        """It has been where it is for long."""
        self._switch = SettledPosition(self.read())

    def mode_there(self, position: int) -> int:
        """The number of the mode that belongs to a position."""
        n = position + 1
        return int(self._vehicle.parameters[f"MODE{n}" if self._of_rover else f"FLTMODE{n}"])

    def watch(self) -> bool:
        """Look at the switch, while the radio is heard; whether it has yet to settle."""
        vehicle = self._vehicle
        if not vehicle.radio.obeyed(vehicle.now_s):
            return False
        position = self.read()
        if position is None:
            return False
        if self._switch.see(position, vehicle.now_s):
            vehicle.set_mode(self.mode_there(position))
        return self._switch.position != position
