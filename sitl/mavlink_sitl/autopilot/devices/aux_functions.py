"""Auxiliary functions: what the pilot's switches do, by command or by a mission item.

The numbers are RC_Channel's. A function that the firmware does not have FAILED with a text; those
that it has for devices which are not there, and those that change nothing here, are accepted.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from mavlink_sitl.exchange import Severity

if TYPE_CHECKING:
    from mavlink_sitl.autopilot.common.commander import Commander

LOW, MIDDLE, HIGH = 0, 1, 2
"""Positions of a switch"""
GPS_UNIT, OFF, WELL = 4, 1, 0
"""FAILURE_UNIT and FAILURE_TYPE"""
MODES = {
    4: "RTL", 16: "AUTO", 18: "LAND", 33: "BRAKE", 37: "THROW", 42: "SMART_RTL", 51: "MANUAL",
    52: "ACRO", 53: "STEERING", 54: "HOLD", 55: "GUIDED", 56: "LOITER", 68: "STABILIZE",
    69: "POSHOLD", 70: "ALT_HOLD", 72: "CIRCLE", 77: "TAKEOFF", 92: "FLY_BY_WIRE_A",
    150: "CRUISE",
}  # fmt: skip
"""Functions that change the mode, and its name; a vehicle type has those of its modes"""

SAVE_WAYPOINT = 7
"""Planes do not have it"""

_EVERY_KIND = (
    9, 15, 19, 27, 28, 30, 34, 35, 36, 38, 40, 62, 66, 67, 78, 79, 80, 85, 100, 101, 102, 103, 104,
    105, 106, 110, 111, 112, 113, 156, 158, 162, 163, 164, 166, 167, 168, 169, 171, 172, 174, 175,
    177, 212, 213, 214, 215, 216, 217, 218, 300, 301, 302, 303, 304, 305, 306, 307,
)  # fmt: skip
WITHOUT_EFFECT: dict[str, frozenset[int]] = {
    "copter": frozenset(
        (*_EVERY_KIND, 2, 3, 5, 10, 13, 14, 17, 21, 22, 23, 25, 26, 32, 39, 43, 44, 45, 57, 60,
         61, 73, 75, 76, 83, 84, 109, 151, 152, 154, 159, 160, 161, 219)
    ),
    "rover": frozenset((*_EVERY_KIND, 0, 50, 59, 63, 74, 97, 155, 201, 202, 207, 211)),
    "plane": frozenset(
        (*_EVERY_KIND, 22, 39, 43, 64, 82, 84, 86, 87, 88, 89, 91, 95, 96, 98, 107, 108, 154, 155,
         157, 160, 170, 173, 176, 179, 180, 181, 208, 209, 210)
    ),
}  # fmt: skip
"""Functions of tuning, cameras, mounts, sensors, and of modes that are not flown here"""
WITHOUT_EFFECT["boat"] = WITHOUT_EFFECT["rover"]


def _at_top(act: Callable[[Commander], object]) -> Callable[[Commander, int], None]:
    """Only the highest position does something."""

    def run_it(vehicle: Commander, position: int) -> None:
        if position == HIGH:
            act(vehicle)

    return run_it


def _obey_overrides(vehicle: Commander, position: int) -> None:
    if position != MIDDLE:
        vehicle.pilot.obeys_overrides = position == HIGH


def _stop_motors(vehicle: Commander, position: int) -> None:
    if position != MIDDLE:
        vehicle.stop_motors(position == HIGH)


def _arm_or_stop(vehicle: Commander, position: int) -> None:
    vehicle.stop_motors(position == LOW)
    if position == HIGH:
        vehicle.arm()


def _arm(vehicle: Commander, position: int) -> None:
    if position == HIGH:
        vehicle.arm()
    elif position == LOW:
        vehicle.disarm()


FUNCTIONS: dict[int, Callable[[Commander, int], object]] = {
    7: _at_top(lambda v: v.save_waypoint()),
    11: lambda v, position: v.fence.enable(position == HIGH),
    24: _at_top(lambda v: v.plans.rewind()),
    31: _stop_motors,
    46: _obey_overrides,
    58: _at_top(lambda v: v.auto.clear()),
    65: lambda v, position: v.body.inject_failure(GPS_UNIT, OFF if position == HIGH else WELL, 0),
    81: _at_top(lambda v: v.disarm()),
    90: lambda v, position: v.say(Severity.INFO, f"Using EKF Source Set {position + 1}"),
    153: _arm,
    165: _arm_or_stop,
}
"""The functions that every kind of vehicle has, by number"""


def _change_mode(vehicle: Commander, name: str, position: int) -> bool:
    """To a mode, or back to the one that the mode switch has; whether there is such a mode."""
    modes = {spec.name: number for number, spec in vehicle.personality.modes.items()}
    if name not in modes:
        return False
    if position == HIGH:
        vehicle.set_mode(modes[name])
    elif vehicle.switches is not None and vehicle.mode.spec.name == name:
        switch, from_middle = vehicle.switches.mode, vehicle.personality.kind == "copter"
        if position == LOW or from_middle:
            vehicle.set_mode(switch.mode_there(switch.read()))
    return True


def run(vehicle: Commander, function: int, position: int) -> bool:
    """Do what a switch does; whether the firmware has such a function."""
    kind = vehicle.personality.kind
    if function in MODES and _change_mode(vehicle, MODES[function], position):
        return True
    if function in FUNCTIONS and not (function == SAVE_WAYPOINT and kind == "plane"):
        FUNCTIONS[function](vehicle, position)
        return True
    if function in WITHOUT_EFFECT[kind]:
        return True
    vehicle.say(Severity.INFO, f"Invalid channel option ({function})")
    return False
