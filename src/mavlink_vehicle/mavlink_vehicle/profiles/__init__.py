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
from mavlink_vehicle.state.identity import is_vehicle

__all__ = [
    "GENERIC",
    "CommandAltitude",
    "ModePacking",
    "Profile",
    "SetpointField",
    "TakeoffForm",
    "VehicleKind",
    "profile_for",
    "vehicle_rank",
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


def vehicle_rank(autopilot: int, vehicle_type: int) -> int:
    """Return how well a sender of HEARTBEAT is known as a vehicle; 0: it is none.

    3: one that goals are flown with; 2: another of a known firmware; 1: any other.
    """
    if not is_vehicle(autopilot, vehicle_type):
        return 0
    profile = profile_for(autopilot, vehicle_type)
    if profile is GENERIC:
        return 1
    return 3 if profile.control_mode is not None and profile.unsupported is None else 2
