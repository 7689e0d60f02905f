"""ArduPilot: copter, and the mode tables of its other vehicles.

Mode numbers are those of the dialect's COPTER_MODE, ROVER_MODE, PLANE_MODE and SUB_MODE
enums. What the vehicles do with commands and setpoints was observed on ArduPilot's own
simulator (master of May 2025) and read in ArduCopter's GCS_MAVLink_Copter.cpp.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from mavlink_vehicle.codec import mavlink
from mavlink_vehicle.profiles.profile import Profile, SetpointField, TakeoffForm


def _modes(enum_name: str) -> Mapping[str, int]:
    prefix = f"{enum_name}_"
    return MappingProxyType(
        {
            entry.name.removeprefix(prefix): number
            for number, entry in mavlink.enums[enum_name].items()
            if not entry.name.endswith("ENUM_END")
        }
    )


_PX4_MESSAGES = frozenset({"ESTIMATOR_STATUS", "ODOMETRY", "CURRENT_MODE", "EVENT"})
_P, _V, _A = SetpointField.POSITION, SetpointField.VELOCITY, SetpointField.ACCELERATION

COPTER = Profile(
    name="ArduCopter",
    modes=_modes("COPTER_MODE"),
    control_mode="GUIDED",
    hold_mode="BRAKE",
    land_mode="LAND",
    return_mode="RTL",
    mission_mode="AUTO",
    takeoff=TakeoffForm.ABOVE_HOME,
    # GCS_MAVLink_Copter.cpp, SET_POSITION_TARGET_LOCAL_NED: a position may come with a
    # velocity, and both with an acceleration, but a position with an acceleration alone, or
    # none of the three, is ignored.
    setpoint_motions=frozenset({_P, _P | _V, _P | _V | _A, _V, _V | _A, _A}),
    setpoint_form=_P | _V | SetpointField.YAW,
    unsupported_messages=_PX4_MESSAGES,
)

ROVER = Profile(
    name="ArduRover",
    modes=_modes("ROVER_MODE"),
    control_mode="GUIDED",
    hold_mode="HOLD",
    return_mode="RTL",
    mission_mode="AUTO",
    setpoint_motions=frozenset({_P, _V}),
    setpoint_form=_P,
    unsupported_messages=_PX4_MESSAGES,
)

PLANE = Profile(
    name="ArduPlane",
    modes=_modes("PLANE_MODE"),
    hold_mode="LOITER",
    return_mode="RTL",
    mission_mode="AUTO",
    unsupported_messages=_PX4_MESSAGES,
)

SUB = Profile(name="ArduSub", modes=_modes("SUB_MODE"), unsupported_messages=_PX4_MESSAGES)

OTHER = Profile(name="ArduPilot", unsupported_messages=_PX4_MESSAGES)

_COPTER_TYPES = {
    mavlink.MAV_TYPE_QUADROTOR,
    mavlink.MAV_TYPE_COAXIAL,
    mavlink.MAV_TYPE_HELICOPTER,
    mavlink.MAV_TYPE_HEXAROTOR,
    mavlink.MAV_TYPE_OCTOROTOR,
    mavlink.MAV_TYPE_TRICOPTER,
    mavlink.MAV_TYPE_DODECAROTOR,
    mavlink.MAV_TYPE_DECAROTOR,
}
_PLANE_TYPES = {mavlink.MAV_TYPE_FIXED_WING} | {
    number
    for number, entry in mavlink.enums["MAV_TYPE"].items()
    if entry.name.startswith("MAV_TYPE_VTOL_")
}
_ROVER_TYPES = {mavlink.MAV_TYPE_GROUND_ROVER, mavlink.MAV_TYPE_SURFACE_BOAT}


def ardupilot_profile(vehicle_type: int) -> Profile:
    """Return the profile for a MAV_TYPE that an ArduPilot reports."""
    if vehicle_type in _COPTER_TYPES:
        return COPTER
    if vehicle_type in _ROVER_TYPES:
        return ROVER
    if vehicle_type in _PLANE_TYPES:
        return PLANE
    if vehicle_type == mavlink.MAV_TYPE_SUBMARINE:
        return SUB
    return OTHER
