"""The pilot's other switches: a channel with an RCn_OPTION runs an auxiliary function.

Three positions by fixed pulses, each settled for 0.2 s (RC_Channel). After the start a switch
counts as low, so that one which is not runs its function at once; those that arm only when they
move.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from mavlink_sitl.autopilot.common.mode_switch import SettledPosition
from mavlink_sitl.autopilot.devices.aux_functions import HIGH, LOW, MIDDLE, run
from mavlink_sitl.autopilot.state.pilot import CHANNELS

if TYPE_CHECKING:
    from mavlink_sitl.autopilot.common.commander import Commander

HIGH_US, LOW_US = 1800, 1200
ARMING = frozenset({153, 154, 165})
"""Functions whose first position is where the switch stands"""


def position_of(pulse_us: int) -> int:
    """The position of a switch."""
    if pulse_us < LOW_US:
        return LOW
    return HIGH if pulse_us > HIGH_US else MIDDLE


class AuxSwitches:
    """Runs the functions of the switches that move."""

    def __init__(self, vehicle: Commander) -> None:
        self._vehicle = vehicle
        self._revision = -1
        self._functions: list[tuple[int, int]] = []
        self._switches: dict[int, SettledPosition] = {}

    def watch(self) -> bool:
        """Look at the switches, while the radio is heard; whether one has yet to settle."""
        vehicle = self._vehicle
        parameters = vehicle.parameters
        if self._revision != parameters.revision:
            self._revision = parameters.revision
            options = ((n, int(parameters[f"RC{n}_OPTION"])) for n in range(1, CHANNELS + 1))
            self._functions = [(n, function) for n, function in options if function]
        if not self._functions or not vehicle.radio.obeyed(vehicle.now_s):
            return False
        settles = False
        for channel, function in self._functions:
            pulse_us = vehicle.radio.pulse_us(channel, vehicle.now_s)
            if pulse_us is not None:
                settles |= self._look(channel, function, position_of(pulse_us))
        return settles

    def _look(self, channel: int, function: int, position: int) -> bool:
        switch = self._switches.get(channel)
        if switch is None:
            first = position if function in ARMING else LOW
            switch = self._switches[channel] = SettledPosition(first)
        if switch.see(position, self._vehicle.now_s):
            run(self._vehicle, function, position)
        return switch.position != position
