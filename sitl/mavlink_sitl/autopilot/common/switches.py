"""The pilot's switches: of the mode, with auxiliary functions, and the stick that arms.

Six positions of one channel are each for a mode (FLTMODEn or MODEn). A channel with an RCn_OPTION
runs an auxiliary function: three positions by fixed pulses (RC_Channel). After the start such a
switch counts as low, so that one which is not runs its function at once; those that arm only when
they move.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from mavlink_sitl.autopilot.devices.aux_functions import HIGH, LOW, MIDDLE, run
from mavlink_sitl.autopilot.safety.arming import STICK
from mavlink_sitl.autopilot.state.pilot import CHANNELS
from mavlink_sitl.autopilot.state.radio import FULL_STICK

if TYPE_CHECKING:
    from mavlink_sitl.autopilot.common.commander import Commander

HELD_S, HELD_ON_A_PLANE_S = 2.0, 3.0
OFF, ARMS_AND_DISARMS = 0, 2
"""ARMING_RUDDER; 1 only arms"""
DRIVES_ITSELF_M_S = 0.1


class Rudder:
    """Arms and disarms when the throttle is closed and the stick that steers is held to a side.

    It is that of the yaw on aircraft, of the steering on rovers and boats.
    """

    def __init__(self, vehicle: Commander) -> None:
        self._vehicle = vehicle
        self._since_s: float | None = None
        self._done = False

    def watch(self) -> bool:
        """Look at the sticks; whether one is held to a side."""
        vehicle = self._vehicle
        allowed = int(vehicle.parameters["ARMING_RUDDER"])
        side = self._side() if allowed != OFF and self._throttle_closed() else 0
        asked = side > 0 if not vehicle.armed else side < 0 and allowed == ARMS_AND_DISARMS
        if side == 0:
            self._done = False
        if not asked or not self._possible():
            self._since_s = None
            return side != 0
        if self._since_s is None:
            self._since_s = vehicle.now_s
        held_s = HELD_ON_A_PLANE_S if self._kind == "plane" else HELD_S
        if self._done or vehicle.now_s - self._since_s < held_s:
            return True
        if vehicle.armed:
            vehicle.disarm()
        else:
            vehicle.arm(by=STICK)
        # Held on, it tries again; but what is armed is not disarmed by the same push.
        self._since_s, self._done = None, vehicle.armed
        return True

    @property
    def _kind(self) -> str:
        return self._vehicle.personality.kind

    @property
    def _drives(self) -> bool:
        return self._kind in ("rover", "boat")

    def _side(self) -> int:
        """1 with the stick to the right, -1 to the left."""
        axis = "Roll" if self._drives else "Yaw"
        angle = self._vehicle.radio.angle(axis, self._vehicle.now_s)
        return (angle > FULL_STICK) - (angle < -FULL_STICK)

    def _throttle_closed(self) -> bool:
        vehicle = self._vehicle
        if self._drives:
            return vehicle.radio.angle("Throttle", vehicle.now_s) == 0.0
        return vehicle.radio.throttle(vehicle.now_s) == 0.0

    def _possible(self) -> bool:
        """Whether it is of use to hold the stick there."""
        vehicle = self._vehicle
        if not vehicle.radio.obeyed(vehicle.now_s):
            return False
        if self._drives:
            by_itself = vehicle.mode.spec.requires_position
            rolls = vehicle.armed and vehicle.motion.speed_m_s > DRIVES_ITSELF_M_S
            return not by_itself and not rolls
        manual = vehicle.mode.spec.behaviour in ("stabilize", "acro")
        return not vehicle.armed or vehicle.landed or (self._kind == "copter" and manual)


BANDS_US = (1231, 1361, 1491, 1621, 1750)
"""Between the positions"""
SETTLED_S = 0.2
"""A position counts once the switch has been there for this time"""
HIGH_US, LOW_US = 1800, 1200
ARMING = frozenset({153, 154, 165})
"""Functions whose first position is where the switch stands"""


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

    def mode_there(self, position: int | None) -> int:
        """The number of the mode that belongs to a position; without one that of the start."""
        if position is None:
            return self._vehicle.first_mode()
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


class Switches:
    """All that a pilot moves besides the sticks, and the stick that arms."""

    def __init__(self, vehicle: Commander) -> None:
        self._vehicle = vehicle
        self.mode = ModeSwitch(vehicle)
        self._all = (self.mode, Rudder(vehicle), AuxSwitches(vehicle))
        self._seen: tuple[int, int, bool] | None = None
        self._settle = False

    def watch(self) -> None:
        """Act on switches and held sticks, once one has moved."""
        stamp = self._vehicle.radio.stamp(self._vehicle.now_s)
        if stamp != self._seen or self._settle:
            self._seen = stamp
            settle = [each.watch() for each in self._all]
            self._settle = any(settle)
