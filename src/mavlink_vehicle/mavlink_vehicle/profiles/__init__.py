"""Differences between ArduPilot, PX4 and other firmware, as data."""

from __future__ import annotations

from mavlink_vehicle.codec import mavlink
from mavlink_vehicle.profiles.ardupilot import ardupilot_profile
from mavlink_vehicle.profiles.profile import (
    CommandAltitude,
    ModePacking,
    Profile,
    SetpointField,
    TakeoffForm,
    VehicleKind,
)
from mavlink_vehicle.profiles.px4 import px4_profile

__all__ = [
    "GENERIC",
    "CommandAltitude",
    "ModePacking",
    "Profile",
    "SetpointField",
    "TakeoffForm",
    "VehicleKind",
    "profile_for",
]

GENERIC = Profile(name="generic autopilot")
"""Telemetry can be read; nothing is known about its modes, so nothing is commanded."""


def profile_for(autopilot: int, vehicle_type: int) -> Profile:
    """Return the profile for the MAV_AUTOPILOT and MAV_TYPE of a HEARTBEAT."""
    if autopilot == mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA:
        return ardupilot_profile(vehicle_type)
    if autopilot == mavlink.MAV_AUTOPILOT_PX4:
        return px4_profile(vehicle_type)
    return GENERIC
