"""The releases of the firmwares that are explored, and how they name parameters."""

from __future__ import annotations

from tests.explore.scenario import Craft

RELEASES = {
    "ardupilot": ("ardupilot-4.6", "ardupilot-4.7", "ardupilot-4.7"),
    "px4": ("px4-1.18",),
}
"""Those besides the recorded ones, which fly where none is drawn"""
_SINCE_4_7 = {
    "LAND_SPEED": ("LAND_SPD_MS", 0.01),
    "RTL_ALT": ("RTL_ALT_M", 0.01),
    "RTL_SPEED": ("RTL_SPEED_MS", 0.01),
    "WPNAV_ACCEL": ("WP_ACC", 0.01),
    "WPNAV_ACCEL_Z": ("WP_ACC_Z", 0.01),
    "WPNAV_JERK": ("WP_JERK", 1.0),
    "WPNAV_RADIUS": ("WP_RADIUS_M", 0.01),
    "WPNAV_SPEED": ("WP_SPD", 0.01),
    "WPNAV_SPEED_DN": ("WP_SPD_DN", 0.01),
    "WPNAV_SPEED_UP": ("WP_SPD_UP", 0.01),
}
_GONE = {
    "ardupilot-4.7": frozenset({"ARMING_CHECK"}),
    "px4-1.18": frozenset({"COM_RC_OVERRIDE"}),
}


def as_named(craft: Craft, name: str, value: float) -> tuple[str, float] | None:
    """Return a parameter as the vehicle's release has it; None where it has none.

    Args:
        craft: the vehicle.
        name: as the recorded release has it.
        value: in its unit.
    """
    if name in _GONE.get(craft.firmware, ()):
        return None
    if craft.firmware == "ardupilot-4.7" and name in _SINCE_4_7:
        name, scale = _SINCE_4_7[name]
        value *= scale
    return name, value
