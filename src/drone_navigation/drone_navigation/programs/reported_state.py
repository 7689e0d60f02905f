"""The state that a vehicle reports, as one value."""

from __future__ import annotations

import math
from dataclasses import dataclass

from geometry_msgs.msg import PoseStamped
from sensor_msgs.msg import BatteryState, NavSatFix

from custom_interfaces.msg import VehicleStatus
from drone_navigation.client.commands import status_facts
from navigation_core.geometry import Vector3

__all__ = ["ReportedState", "reported_state"]


@dataclass(frozen=True)
class ReportedState:
    """State of a vehicle; None is unknown.

    Attributes:
        connected: whether its HEARTBEAT is received; else the others are the last known.
        autopilot: "ArduCopter", "PX4 multicopter", ...
        firmware_version: of the autopilot.
        mode: the autopilot's own name.
        armed: whether its motors are armed.
        landed_state: "on ground", "in air", "taking off" or "landing".
        position_valid: whether the autopilot knows its position.
        position_enu_m: east, north, up in the map, to the centimetre.
        battery_percent: 0 to 100.
        voltage_v: of the battery.
        failsafe: the code of an active failsafe.
        active_goal: hexadecimal digits.
        last_status_text: the vehicle's last text.
        global_position: latitude and longitude in degrees, altitude above mean sea level in m.
    """

    connected: bool
    autopilot: str | None
    firmware_version: str | None
    mode: str | None
    armed: bool
    landed_state: str | None
    position_valid: bool
    position_enu_m: Vector3 | None
    battery_percent: float | None
    voltage_v: float | None
    failsafe: str | None
    active_goal: str | None
    last_status_text: str | None
    global_position: Vector3 | None = None


def reported_state(
    status: VehicleStatus,
    pose: PoseStamped | None,
    battery: BatteryState | None,
    fix: NavSatFix | None,
) -> ReportedState:
    """Return the state that messages report; those that have not arrived are None."""
    facts = status_facts(status, pose, battery)
    position = facts.pop("position_enu_m")
    globe = None
    if fix is not None and math.isfinite(fix.latitude) and math.isfinite(fix.longitude):
        globe = (fix.latitude, fix.longitude, fix.altitude)
    enu_m = None if position is None else tuple(position)
    return ReportedState(**facts, position_enu_m=enu_m, global_position=globe)
