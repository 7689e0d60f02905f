"""ArduPilot: copter, rover, boat and plane, and the mode tables of its other vehicles.

Mode numbers are those of the dialect's COPTER_MODE, ROVER_MODE, PLANE_MODE and SUB_MODE
enums. The vehicles' behaviour on commands and setpoints was observed on ArduPilot's own
simulator (master of May 2025) and read in ArduCopter's GCS_MAVLink_Copter.cpp.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType

from mavlink_vehicle.codec import mavlink
from mavlink_vehicle.mission_items import MissionRules
from mavlink_vehicle.positions.frames import MeanLatitude
from mavlink_vehicle.profiles import failsafe_settings
from mavlink_vehicle.profiles.equipment import EquipmentRules
from mavlink_vehicle.profiles.profile import (
    FollowingLimits,
    LandingTargetRules,
    MessageProperties,
    Profile,
    SetpointField,
    SetpointRules,
    SpeedCommand,
    TakeoffForm,
    TakeoffRules,
    VehicleKind,
)
from mavlink_vehicle.profiles.vehicle_types import profile_of_type, profiles_by_type


def _modes(enum_name: str) -> Mapping[str, int]:
    prefix = f"{enum_name}_"
    return MappingProxyType(
        {
            entry.name.removeprefix(prefix): number
            for number, entry in mavlink.enums[enum_name].items()
            if not entry.name.endswith("ENUM_END")
        }
    )


# OBSTACLE_DISTANCE is a companion's, which an ArduPilot hands on; it sends none itself.
_NOT_SENT = frozenset(
    {"ESTIMATOR_STATUS", "ODOMETRY", "CURRENT_MODE", "EVENT", "OBSTACLE_DISTANCE"}
)
# AC_Fence.cpp; a rover has no heights, and older firmwares no FENCE_AUTOENABLE on a copter.
_FENCE_PARAMETERS = (
    "FENCE_ENABLE",
    "FENCE_TYPE",
    "FENCE_RADIUS",
    "FENCE_ALT_MAX",
    "FENCE_ALT_MIN",
    "FENCE_AUTOENABLE",
    "FENCE_OPTIONS",
    "FENCE_TOTAL",
)
# AP_Math's definitions.h, LATLON_TO_M: 0.011131884502145034 m for 1e-7 degree; the recordings
# show 111 319 m a degree over 400 m (tests/replay/test_recorded_projections.py).
PROJECTION = MeanLatitude(metres_per_degree=111318.84502145034)
# AR_AttitudeControl, Rover's Parameters.cpp, AR_WPNav: how tight and how fast it drives.
_DRIVING_PARAMETERS = (
    "TURN_RADIUS",
    "ATC_STR_RAT_MAX",
    "ATC_ACCEL_MAX",
    "ATC_DECEL_MAX",
    "WP_SPEED",
)
_P, _V, _A = SetpointField.POSITION, SetpointField.VELOCITY, SetpointField.ACCELERATION

# AP_Mission.cpp: an item holds 15 bytes, so that a waypoint keeps its time (copter, rover) or
# its radii (plane), and no command keeps what it does not use. NaN is stored as 0.
_MISSIONS = MissionRules(
    home_first=True,
    kept_params={
        mavlink.MAV_CMD_NAV_WAYPOINT: frozenset({0}),
        mavlink.MAV_CMD_NAV_TAKEOFF: frozenset({0}),
        mavlink.MAV_CMD_NAV_LAND: frozenset(),
        mavlink.MAV_CMD_NAV_LOITER_UNLIM: frozenset({2}),
        mavlink.MAV_CMD_NAV_LOITER_TIME: frozenset({0}),
        mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH: frozenset(),
    },
    keeps_nan=False,
    start_command=True,
    # An item that is under way stays the current one when other items are uploaded (observed).
    rewinds=True,
    # At each item that is uploaded in AUTO (observed); the number of items may be the same.
    change_text="Auto mission changed",
    terrain=True,
    # MissionItemProtocol_Rally.cpp: the altitude becomes an int16.
    rally_step_m=1.0,
)
_PLANE_MISSIONS = replace(
    _MISSIONS,
    kept_params={**_MISSIONS.kept_params, mavlink.MAV_CMD_NAV_WAYPOINT: frozenset({1, 2})},
)

OTHER = Profile(
    name="ArduPilot",
    projection=PROJECTION,
    messages=MessageProperties(
        unsupported=_NOT_SENT,
    ),
    # AP_ADSB.cpp: with 0 nothing is heard, and nothing sent.
    traffic_receiver_parameter="ADSB_TYPE",
)
_EQUIPMENT = EquipmentRules(
    # AP_Mount.cpp, AP_Camera.cpp, AP_Gripper.cpp: without them a command is not done.
    absent=MappingProxyType(
        {
            "camera": ("CAM1_TYPE", 0.0),
            "gimbal": ("MNT1_TYPE", 0.0),
            "gripper": ("GRIP_ENABLE", 0.0),
        }
    ),
    # Observed: a mission with NaN for a rate is rejected, and -45.5 degrees come back as -45.
    whole_degrees=True,
    # Observed: behind the last waypoint the first command is done, and the mission ends.
    open_end=True,
)
_GUIDED = replace(
    OTHER,
    control_mode="GUIDED",
    return_mode="RTL",
    mission_mode="AUTO",
    equipment=_EQUIPMENT,
)

# ArduCopter's mode_guided.cpp begins GUIDED with the waypoints' acceleration, and AC_PosControl.cpp
# has the jerk; AP_Math's control.cpp says how a target is come to with both.
_FOLLOWING = FollowingLimits(
    acceleration=("WPNAV_ACCEL", 0.01, 2.5),
    jerk=("PSC_JERK_XY", 1.0, 5.0),
    climb_acceleration=("WPNAV_ACCEL_Z", 0.01, 1.0),
    climb_jerk=("PSC_JERK_Z", 1.0, 5.0),
)

# Renamed in 4.7, most of them from centimetres to metres.
_COPTER_SINCE_4_7 = {
    "LAND_ALT_LOW": ("LAND_ALT_LOW_M", 100.0),
    "LAND_SPEED": ("LAND_SPD_MS", 100.0),
    "LAND_SPEED_HIGH": ("LAND_SPD_HIGH_MS", 100.0),
    "PSC_JERK_XY": ("PSC_NE_JERK", 1.0),
    "PSC_JERK_Z": ("PSC_D_JERK", 1.0),
    "RTL_ALT": ("RTL_ALT_M", 100.0),
    "RTL_SPEED": ("RTL_SPEED_MS", 100.0),
    "WPNAV_ACCEL": ("WP_ACC", 100.0),
    "WPNAV_ACCEL_Z": ("WP_ACC_Z", 100.0),
    "WPNAV_RADIUS": ("WP_RADIUS_M", 100.0),
    "WPNAV_SPEED": ("WP_SPD", 100.0),
    "WPNAV_SPEED_DN": ("WP_SPD_DN", 100.0),
    "WPNAV_SPEED_UP": ("WP_SPD_UP", 100.0),
}

COPTER = replace(
    _GUIDED,
    name="ArduCopter",
    kind=VehicleKind.COPTER,
    modes=_modes("COPTER_MODE"),
    # ArduCopter's defines.h up to 3.1 and 3.2.
    former_modes=MappingProxyType({"POSITION": 8, "OF_LOITER": 10}),
    takeoff=TakeoffRules(
        control_first=True,
        form=TakeoffForm.ABOVE_HOME,
    ),
    # mode.h, allows_arming: a ground station may arm in GUIDED. AUTO would begin the mission
    # (AUTO_OPTIONS), THROW would start the motors when it is lifted.
    arming_mode="GUIDED",
    not_armed_in=frozenset(
        {
            "AUTO",
            "AUTO_RTL",
            "AUTOROTATE",
            "AUTOTUNE",
            "AVOID_ADSB",
            "BRAKE",
            "CIRCLE",
            "FLIP",
            "FOLLOW",
            "LAND",
            "RTL",
            "SMART_RTL",
            "SYSTEMID",
            "THROW",
        }
    ),
    hold_mode="BRAKE",
    land_mode="LAND",
    # AC_PrecLand_Companion.cpp: another frame is ignored. Recorded with these parameters.
    landing_target=LandingTargetRules(
        "LAND",
        mavlink.MAV_FRAME_BODY_FRD,
        MappingProxyType({"PLND_ENABLED": 1.0, "PLND_TYPE": 1.0}),
    ),
    missions=replace(_MISSIONS, yaw_command=True),
    # Rejected on the ground and in other modes.
    speed_command=SpeedCommand(1, frozenset({"GUIDED", "AUTO"})),
    setpoints=SetpointRules(
        # GCS_MAVLink_Copter.cpp, SET_POSITION_TARGET_LOCAL_NED: a position may come with a
        # velocity, and both with an acceleration, but a position with an acceleration alone, or
        # none of the three, is ignored.
        motions=frozenset({_P, _P | _V, _P | _V | _A, _V, _V | _A, _A}),
        # Without the acceleration it overshoots the speed of a trajectory by a tenth.
        form=_P | _V | _A | SetpointField.YAW | SetpointField.YAW_RATE,
        # Observed: GUID_TIMEOUT covers velocities and accelerations; a position has no timeout.
        timeout_s=3.0,
        timeout_parameter="GUID_TIMEOUT",
        # In that time it integrates both (mode_guided.cpp, posvelaccel_control_run): braking with
        # 2 m/s² at 3.4 m/s led a real one to 3.3 m/s backwards.
        following=_FOLLOWING,
    ),
    # ArduCopter's mode_guided.cpp; neither rovers nor planes know the command.
    pauses_in_mode=True,
    # Both in cm/s; the second is that of all waypoints.
    return_speeds=(("RTL_SPEED", 0.01), ("WPNAV_SPEED", 0.01)),
    return_height=("RTL_ALT", 0.01),
    wanted_parameters=(
        *_FENCE_PARAMETERS,
        "GUID_TIMEOUT",
        "PLND_ENABLED",
        "PLND_TYPE",
        "RTL_SPEED",
        "WPNAV_SPEED",
        *_FOLLOWING.parameters,
    ),
    renamed_parameters=MappingProxyType(_COPTER_SINCE_4_7),
    failsafe_settings=failsafe_settings.ARDUCOPTER,
)

ROVER = replace(
    _GUIDED,
    name="ArduRover",
    kind=VehicleKind.ROVER,
    modes=_modes("ROVER_MODE"),
    former_modes=MappingProxyType({"LEARNING": 2}),  # APMrover2's defines.h
    takeoff=TakeoffRules(
        control_first=True,
    ),
    # mode.h, allows_arming; in the others it would drive off by itself.
    arming_mode="HOLD",
    not_armed_in=frozenset(
        {"AUTO", "CIRCLE", "DOCK", "FOLLOW", "INITIALIZING", "RTL", "SMART_RTL"}
    ),
    hold_mode="HOLD",
    # It has no height to follow terrain with.
    missions=replace(_MISSIONS, terrain=False),
    # With velocity setpoints the setpoint is the speed: DO_CHANGE_SPEED fails then
    # (Rover's mode_guided.cpp, set_desired_speed).
    speed_command=SpeedCommand(1, frozenset({"AUTO"})),
    setpoints=SetpointRules(
        # An acceleration is rejected, with a text at every message. A yaw beside a velocity wins
        # over its direction, so none is sent: the heading follows the velocity.
        motions=frozenset({_P, _V}),
        form=_V,
        # GCS_MAVLink_Rover.cpp: a velocity in BODY_NED with a yaw rate is a speed along the nose,
        # whose sign is that of x, and a turn rate. Observed: x = -1 with a yaw rate reverses.
        drives_by_turn_rate=True,
        # Observed: "target not received last 3secs, stopping"; no parameter changes it.
        timeout_s=3.0,
    ),
    return_speeds=(("RTL_SPEED", 1.0), ("WP_SPEED", 1.0), ("CRUISE_SPEED", 1.0)),
    wanted_parameters=(*_FENCE_PARAMETERS, *_DRIVING_PARAMETERS, "RTL_SPEED", "CRUISE_SPEED"),
    failsafe_settings=failsafe_settings.ARDUROVER,
)

BOAT = replace(ROVER, name="ArduRover boat", kind=VehicleKind.BOAT)

PLANE = replace(
    _GUIDED,
    name="ArduPlane",
    kind=VehicleKind.PLANE,
    modes=_modes("PLANE_MODE"),
    # mode.h, _pre_arm_checks; armed in AUTO or TAKEOFF it takes off. In LOITER it keeps the
    # throttle down until it flies.
    arming_mode="LOITER",
    not_armed_in=frozenset({"AUTO", "AUTOLAND", "INITIALIZING", "RTL", "TAKEOFF"}),
    hold_mode="LOITER",
    missions=_PLANE_MISSIONS,
    takeoff=TakeoffRules(
        # NAV_TAKEOFF is rejected outside a mission; the mode takes off and circles at TKOFF_ALT.
        form=TakeoffForm.MODE,
        mode="TAKEOFF",
    ),
    # SET_POSITION_TARGET_LOCAL_NED has no effect (but on the altitude): it is sent to places.
    reposition=True,
    reposition_keeps_mode=True,
    # It climbs at once; Plane::setup_alt_slope, for more than ALT_SLOPE_MIN.
    sinks_along_leg=True,
    circle_radius_m=60.0,
    circle_parameters=("WP_LOITER_RAD",),
    return_circle_parameters=("RTL_RADIUS", "WP_LOITER_RAD"),
    # An airspeed between its limits; it is forgotten when the mode changes.
    speed_command=SpeedCommand(0, frozenset({"GUIDED", "AUTO"})),
    return_speeds=(("AIRSPEED_CRUISE", 1.0),),
    roll_limit_parameter="ROLL_LIMIT_DEG",
    airspeed_limit_parameters=("AIRSPEED_MIN", "AIRSPEED_MAX"),
    wanted_parameters=(
        *_FENCE_PARAMETERS,
        "WP_LOITER_RAD",
        "RTL_RADIUS",
        "AIRSPEED_CRUISE",
        "AIRSPEED_MIN",
        "AIRSPEED_MAX",
        "ROLL_LIMIT_DEG",
    ),
    failsafe_settings=failsafe_settings.ARDUPLANE,
)

QUADPLANE = replace(
    OTHER,
    name="ArduPlane VTOL",
    unsupported="ArduPlane VTOL vehicles are not supported: they both hover and fly as planes, "
    "and goals support only vehicles that do one of the two.",
    modes=PLANE.modes,
    hold_mode="LOITER",
    return_mode="RTL",
    mission_mode="AUTO",
    wanted_parameters=_FENCE_PARAMETERS,
    failsafe_settings=failsafe_settings.ARDUPLANE,
)

SUB = replace(
    OTHER,
    name="ArduSub",
    modes=_modes("SUB_MODE"),
)

_BY_TYPE = {
    **profiles_by_type(copter=COPTER, rover=ROVER, boat=BOAT, plane=PLANE),
    mavlink.MAV_TYPE_SUBMARINE: SUB,
    mavlink.MAV_TYPE_DODECAROTOR: COPTER,
    mavlink.MAV_TYPE_DECAROTOR: COPTER,
}


def ardupilot_profile(vehicle_type: int) -> Profile:
    """Return the profile for a MAV_TYPE that an ArduPilot reports."""
    return profile_of_type(vehicle_type, _BY_TYPE, QUADPLANE, OTHER)
