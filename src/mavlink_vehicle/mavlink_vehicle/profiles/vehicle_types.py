"""The profiles of a firmware by the MAV_TYPE of its vehicles."""

from __future__ import annotations

from collections.abc import Mapping

from mavlink_vehicle.codec import mavlink
from mavlink_vehicle.profiles.profile import Profile

_COPTER_TYPES = (
    mavlink.MAV_TYPE_QUADROTOR,
    mavlink.MAV_TYPE_COAXIAL,
    mavlink.MAV_TYPE_HELICOPTER,
    mavlink.MAV_TYPE_HEXAROTOR,
    mavlink.MAV_TYPE_OCTOROTOR,
    mavlink.MAV_TYPE_TRICOPTER,
)


def profiles_by_type(
    *, copter: Profile, rover: Profile, boat: Profile, plane: Profile
) -> dict[int, Profile]:
    """Return the profiles of a firmware by MAV_TYPE."""
    return {
        mavlink.MAV_TYPE_GROUND_ROVER: rover,
        mavlink.MAV_TYPE_SURFACE_BOAT: boat,
        mavlink.MAV_TYPE_FIXED_WING: plane,
        **dict.fromkeys(_COPTER_TYPES, copter),
    }


def profile_of_type(
    vehicle_type: int, by_type: Mapping[int, Profile], vtol: Profile, other: Profile
) -> Profile:
    """Return the profile of a firmware for a MAV_TYPE.

    Args:
        vehicle_type: MAV_TYPE of a HEARTBEAT.
        by_type: the profiles of known types.
        vtol: of all VTOL types.
        other: of the rest.
    """
    entry = mavlink.enums["MAV_TYPE"].get(vehicle_type)
    if entry is not None and entry.name.startswith("MAV_TYPE_VTOL_"):
        return vtol
    return by_type.get(vehicle_type, other)
