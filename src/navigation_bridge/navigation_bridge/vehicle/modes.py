"""Purpose of a vehicle's mode, by its profile. No ROS."""

from __future__ import annotations

from mavlink_vehicle.profiles import Profile, SetpointField
from navigation_core.tasks.observation import VehicleMode

__all__ = ["vehicle_mode", "velocity_only"]


def vehicle_mode(profile: Profile | None, name: str) -> VehicleMode:
    """Classify a mode by the autopilot's own name."""
    if profile is None or not name:
        return VehicleMode.OTHER
    for mode, known in (
        (VehicleMode.CONTROL, profile.control_mode),
        (VehicleMode.HOLD, profile.hold_mode),
        (VehicleMode.LAND, profile.land_mode),
        (VehicleMode.RETURN, profile.return_mode),
        (VehicleMode.MISSION, profile.mission_mode),
        (VehicleMode.TAKE_OFF, profile.takeoff.mode),
    ):
        if name == known:
            return mode
    return VehicleMode.OTHER


def velocity_only(profile: Profile | None) -> bool:
    """True if the vehicle receives velocities only and keeps moving with the last one."""
    return profile is not None and profile.setpoints.form is SetpointField.VELOCITY
