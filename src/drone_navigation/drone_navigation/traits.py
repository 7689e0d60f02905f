"""What a vehicle can do, by its profile. No ROS."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from mavlink_vehicle.profiles import Profile, SetpointField, VehicleKind
from navigation_core.tasks.base import Traits

_NONE: Mapping[str, float] = MappingProxyType({})
# Lower than this a plane's circle is not safe; and the height of a take-off that none asks for.
_PLANE_HEIGHT_MIN_M, _PLANE_TAKEOFF_M = 20.0, 40.0
# TURN_RADIUS of ArduRover is 0.9 m; a boat needs more.
_ROVER_TURN_M, _BOAT_TURN_M = 0.9, 4.0
# A boat has no brakes but its drag.
_BOAT_ARRIVAL_M = 2.0
_ROVER_BRAKING_M_S2, _BOAT_BRAKING_M_S2 = 0.6, 0.2


def circle_radius_m(
    profile: Profile, parameters: Mapping[str, float], about_launch: bool = False
) -> float:
    """Return the radius of a plane's circles, by its own parameters as far as they are known.

    It flies wider than that when it is fast (``circle_max_m`` of the core).
    """
    names = profile.return_circle_parameters if about_launch else profile.circle_parameters
    return next(
        (abs(parameters[name]) for name in names if parameters.get(name)), profile.circle_radius_m
    )


def traits_of(profile: Profile, parameters: Mapping[str, float] = _NONE) -> Traits:
    """Return what navigation has to know about a kind of vehicle, and about this one."""
    lands_itself = profile.land_mode is not None
    before = profile.control_before_takeoff
    if profile.kind is VehicleKind.PLANE:
        return Traits(
            name="plane",
            hovers=False,
            control_before_takeoff=before,
            lands_itself=lands_itself,
            circle_radius_m=circle_radius_m(profile, parameters),
            height_min_m=_PLANE_HEIGHT_MIN_M,
            takeoff_height_m=_PLANE_TAKEOFF_M,
        )
    if profile.kind in (VehicleKind.ROVER, VehicleKind.BOAT):
        boat = profile.kind is VehicleKind.BOAT
        return Traits(
            name="boat" if boat else "rover",
            flies=False,
            control_before_takeoff=before,
            lands_itself=False,
            turning_radius_m=_BOAT_TURN_M if boat else _ROVER_TURN_M,
            arrival_radius_m=_BOAT_ARRIVAL_M if boat else 0.0,
            braking_m_s2=_BOAT_BRAKING_M_S2 if boat else _ROVER_BRAKING_M_S2,
            setpoint_timeout_s=_setpoint_timeout_s(profile, parameters),
        )
    accelerates = SetpointField.ACCELERATION in profile.setpoint_form
    return Traits(
        control_before_takeoff=before,
        lands_itself=lands_itself,
        setpoint_timeout_s=_setpoint_timeout_s(profile, parameters),
        # ArduCopter's; a PX4 takes it for a push, which its velocity loop works against.
        accelerates_on=accelerates and not profile.acceleration_is_push,
    )


def _setpoint_timeout_s(profile: Profile, parameters: Mapping[str, float]) -> float:
    """Return for how long it goes on with the last setpoint when none follows."""
    told = parameters.get(profile.setpoint_timeout_parameter)
    return profile.setpoint_timeout_s if told is None else max(told, 0.0)
