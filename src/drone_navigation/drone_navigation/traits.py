"""What a vehicle can do, by its profile. No ROS."""

from __future__ import annotations

from mavlink_vehicle.profiles import Profile
from navigation_core.tasks.base import COPTER, Traits


def traits_of(profile: Profile) -> Traits:
    """Return what navigation has to know about a kind of vehicle."""
    del profile
    return COPTER
