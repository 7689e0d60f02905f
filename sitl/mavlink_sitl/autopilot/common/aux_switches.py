"""The pilot's other switches: a channel with an RCn_OPTION runs an auxiliary function.

Three positions by fixed pulses, each settled for 0.2 s (RC_Channel). After the start a switch
counts as low, so that one which is not runs its function at once; those that arm only when they
move.
"""

from __future__ import annotations

from dataclasses import dataclass

from mavlink_sitl.autopilot.common.mode_switch import LEAST_US, MOST_US, SETTLED_S
from mavlink_sitl.autopilot.devices.aux_functions import HIGH, LOW, MIDDLE, SwitchedVehicle, run

HIGH_US, LOW_US = 1800, 1200
CHANNELS = 16
ARMING = frozenset({153, 154, 165})
"""Functions whose first position is where the switch stands"""


@dataclass
class _Switch:
    position: int
    moved_to: int
    moved_s: float = 0.0


def position_of(pulse_us: int) -> int:
    """The position of a switch."""
    if pulse_us < LOW_US:
        return LOW
    return HIGH if pulse_us > HIGH_US else MIDDLE


class AuxSwitches:
    """Runs the functions of the switches that move."""

    def __init__(self, vehicle: SwitchedVehicle) -> None:
        self._vehicle = vehicle
        self._revision = -1
        self._functions: list[tuple[int, int]] = []
        self._switches: dict[int, _Switch] = {}

    def watch(self) -> None:
        """Look at the switches, while the radio is heard."""
        vehicle = self._vehicle
        parameters = vehicle.parameters
        if self._revision != parameters.revision:
            self._revision = parameters.revision
            options = ((n, int(parameters[f"RC{n}_OPTION"])) for n in range(1, CHANNELS + 1))
            self._functions = [(n, function) for n, function in options if function]
        if not self._functions or not vehicle.radio.obeyed(vehicle.now_s):
            return
        channels = vehicle.radio.channels(vehicle.now_s)
        for channel, function in self._functions:
            pulse_us = channels[channel - 1] if channel <= len(channels) else 0
            if LEAST_US < pulse_us < MOST_US:
                self._look(channel, function, position_of(pulse_us))

    def _look(self, channel: int, function: int, position: int) -> None:
        switch = self._switches.get(channel)
        if switch is None:
            first = position if function in ARMING else LOW
            switch = self._switches[channel] = _Switch(first, first)
        now_s = self._vehicle.now_s
        if position == switch.position:
            switch.moved_to = position
        elif position != switch.moved_to:
            switch.moved_to, switch.moved_s = position, now_s
        elif now_s - switch.moved_s >= SETTLED_S:
            switch.position = position
            run(self._vehicle, function, position)
