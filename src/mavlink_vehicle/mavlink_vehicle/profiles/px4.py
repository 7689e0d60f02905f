"""PX4: multicopter, rover, boat and plane.

Read in PX4 v1.17.0, where a file is named, and seen in the recordings of its own simulator
(multicopter). Modes are those of commander/px4_custom_mode.h: custom_mode is
main << 16 | sub << 24.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType

from mavlink_vehicle.codec import mavlink
from mavlink_vehicle.mission_items import MissionRules
from mavlink_vehicle.positions.frames import AzimuthalEquidistant
from mavlink_vehicle.profiles import failsafe_settings
from mavlink_vehicle.profiles.equipment import EquipmentRules
from mavlink_vehicle.profiles.profile import (
    CommandAltitude,
    LandingTargetRules,
    MessageProperties,
    ModePacking,
    Profile,
    SetpointField,
    SetpointRules,
    SpeedCommand,
    TakeoffForm,
    TakeoffRules,
    VehicleKind,
)
from mavlink_vehicle.profiles.vehicle_types import profile_of_type, profiles_by_type

_MAIN = {
    "MANUAL": 1, "ALTCTL": 2, "POSCTL": 3, "ACRO": 5, "OFFBOARD": 6, "STABILIZED": 7,
    "TERMINATION": 10, "ALTITUDE_CRUISE": 11,
}  # fmt: skip
_AUTO = {
    "READY": 1, "TAKEOFF": 2, "LOITER": 3, "MISSION": 4, "RTL": 5, "LAND": 6, "FOLLOW_TARGET": 8,
    "PRECLAND": 9, "VTOL_TAKEOFF": 10,
    **{f"EXTERNAL{number}": 10 + number for number in range(1, 9)},
}  # fmt: skip
_POSCTL = {"ORBIT": 1, "SLOW": 2}
_MAIN_POSCTL, _MAIN_AUTO = 3, 4


def _modes() -> Mapping[str, int]:
    modes = {name: main << 16 for name, main in _MAIN.items()}
    modes |= {f"POSCTL.{name}": _MAIN_POSCTL << 16 | sub << 24 for name, sub in _POSCTL.items()}
    modes |= {f"AUTO.{name}": _MAIN_AUTO << 16 | sub << 24 for name, sub in _AUTO.items()}
    return MappingProxyType(modes)


# lib/geo, MapProjection and CONSTANTS_RADIUS_OF_EARTH; the recordings show 111 195 m a degree
# over 50 m (tests/replay/test_recorded_projections.py).
PROJECTION = AzimuthalEquidistant(radius_north_m=6_371_000.0, radius_east_m=6_371_000.0)
_P, _V, _A = SetpointField.POSITION, SetpointField.VELOCITY, SetpointField.ACCELERATION

# mavlink_mission.cpp: what a command does not use is not kept; of a take-off and a waypoint
# that is all but the time, the radius and the heading. Starting over comes with every upload.
_MISSIONS = MissionRules(
    kept_params={
        mavlink.MAV_CMD_NAV_WAYPOINT: frozenset({0, 1, 3}),
        mavlink.MAV_CMD_NAV_TAKEOFF: frozenset({3}),
        mavlink.MAV_CMD_NAV_LAND: frozenset({3}),
        mavlink.MAV_CMD_NAV_LOITER_UNLIM: frozenset({2, 3}),
        mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH: frozenset(),
    },
    # MissionFeasibility: a take-off must end a metre above NAV_ACC_RAD, which is 2 m for a
    # multicopter. The verdict comes as a text, after the acknowledgement.
    takeoff_least_m=3.5,
    rejections=("Mission rejected", "Geofence violation"),
)

_COMMON = Profile(
    name="PX4",
    projection=PROJECTION,
    modes=_modes(),
    former_modes=MappingProxyType({"RATTITUDE": 8 << 16}),  # until v1.11
    mode_packing=ModePacking.MAIN_AND_SUB,
    # mode_requirements.cpp: some modes prevent arming, and OFFBOARD needs setpoints, which a
    # disarmed vehicle does not get. A PX4 that landed by a failsafe shows OFFBOARD again. Armed
    # in AUTO.MISSION or AUTO.TAKEOFF it takes off.
    arming_mode="AUTO.LOITER",
    not_armed_in=frozenset(
        {
            "OFFBOARD",
            "POSCTL.ORBIT",
            "AUTO.FOLLOW_TARGET",
            "AUTO.LAND",
            "AUTO.MISSION",
            "AUTO.PRECLAND",
            "AUTO.RTL",
            "AUTO.TAKEOFF",
            "AUTO.VTOL_TAKEOFF",
        }
    ),
    hold_mode="AUTO.LOITER",
    return_mode="AUTO.RTL",
    mission_mode="AUTO.MISSION",
    missions=_MISSIONS,
    altitude_reference=CommandAltitude.AMSL,
    # navigator_main.cpp: the cruising speed of the navigator's modes; OFFBOARD has none. It
    # does not distinguish ground speed from airspeed.
    speed_command=SpeedCommand(1, frozenset({"AUTO.LOITER", "AUTO.MISSION"})),
    status_shows_runnable=True,
    earlier_mode_after_landing=True,
    messages=MessageProperties(
        # STATUSTEXT goes only to links on which a ground station was heard (mavlink_main.h,
        # is_gcs_connected); docs/autopilots.md says what else follows from it.
        heartbeat_type=mavlink.MAV_TYPE_GCS,
        # mavlink_receiver.cpp acknowledges at once, the commander acknowledges its verdict.
        later_ack_counts=frozenset({mavlink.MAV_CMD_DO_SET_MODE}),
        unsupported=frozenset({"EKF_STATUS_REPORT", "TERRAIN_REPORT"}),
        # The commander publishes its status twice a second (Commander.cpp), and the mission manager
        # sends MISSION_CURRENT by itself (mavlink_mission.cpp).
        own_rates_hz=MappingProxyType({"CURRENT_MODE": 2.0, "MISSION_CURRENT": 1.0}),
        link_rate_parameter="MAV_x_RATE",  # mavlink_main.cpp, update_rate_mult
    ),
    setpoints=SetpointRules(
        # Observed: the failsafe comes 1.04 to 1.06 s after the last setpoint.
        timeout_s=1.0,
        timeout_parameter="COM_OF_LOSS_T",
    ),
    # Navigator's geofence.cpp.
    wanted_parameters=("GF_ACTION", "GF_MAX_HOR_DIST", "GF_MAX_VER_DIST", "COM_OF_LOSS_T"),
    failsafe_settings=failsafe_settings.PX4_ANY,
    # Observed: DO_SET_SERVO is rejected as a command and in a mission. A command for equipment
    # whose module does not run is not answered at all. DO_GIMBAL_MANAGER_PITCHYAW is denied to all
    # but the one in control, the autopilot's own mission too.
    # A command for a photo is UNSUPPORTED by the autopilot; its router hands it on to a camera.
    equipment=EquipmentRules(
        actuators=True, channel_max=4, controlled_missions=True, own_camera=True
    ),
    parameters_bytewise=True,
)

# OFFBOARD is rejected until setpoints have come for a second (offboardCheck.cpp, COM_OF_LOSS_T).
_OFFBOARD = replace(
    _COMMON,
    control_mode="OFFBOARD",
    setpoints=replace(
        _COMMON.setpoints,
        prestream_s=1.2,
        lost_s=1.0,
        outside_control_mode=True,
    ),
    failsafe_settings=failsafe_settings.PX4_OFFBOARD,
)

COPTER = replace(
    _OFFBOARD,
    name="PX4 multicopter",
    kind=VehicleKind.COPTER,
    land_mode="AUTO.LAND",
    # mavlink_receiver.cpp: a position in another frame is ignored.
    landing_target=LandingTargetRules("AUTO.PRECLAND", mavlink.MAV_FRAME_LOCAL_NED),
    takeoff=TakeoffRules(
        form=TakeoffForm.AMSL,
        mode="AUTO.TAKEOFF",
        mode_after="AUTO.LOITER",
    ),
    setpoints=replace(
        _OFFBOARD.setpoints,
        # Each axis may be given in any combination (mavlink_receiver.cpp, PositionControl.cpp);
        # nothing at all is "invalid" and counts as a lost stream.
        motions=frozenset({_P, _V, _A, _P | _V, _P | _A, _V | _A, _P | _V | _A}),
        form=_P | _V | _A | SetpointField.YAW | SetpointField.YAW_RATE,
        acceleration_is_push=True,
        # AUTO.TAKEOFF does not look at the stream, which must run when it is over.
        before_takeoff=True,
    ),
    failsafe_settings=failsafe_settings.PX4_COPTER,
    return_speeds=(("MPC_XY_CRUISE", 1.0),),
    return_height=("RTL_RETURN_ALT", 1.0),
    wanted_parameters=(*_COMMON.wanted_parameters, "MPC_XY_CRUISE"),
)

ROVER = replace(
    _OFFBOARD,
    name="PX4 rover",
    kind=VehicleKind.ROVER,
    setpoints=replace(
        _OFFBOARD.setpoints,
        # The rover modules' OffboardMode: a position, if there is one, wins over a velocity. Of a
        # velocity the length is the speed and the direction the heading; yaw is not looked at.
        motions=frozenset({_P, _V}),
        form=_V,
        # failsafe.cpp: without a pilot it drives home in AUTO.RTL, and turns there under power,
        # unless it is to land (which stops it) or to hold.
        loss_parameter="COM_OBL_RC_ACT",
        loss_stops=frozenset({4, 5}),
    ),
    return_speeds=(("RO_SPEED_LIM", 1.0),),
    # The modules rover_ackermann and lib/rover_control; other rovers lack the first two.
    wanted_parameters=(
        *_COMMON.wanted_parameters,
        "COM_OBL_RC_ACT",
        "RA_WHEEL_BASE",
        "RA_MAX_STR_ANG",
        "RO_YAW_RATE_LIM",
        "RO_SPEED_LIM",
        "RO_ACCEL_LIM",
        "RO_DECEL_LIM",
    ),
)

BOAT = replace(ROVER, name="PX4 boat", kind=VehicleKind.BOAT)

PLANE = replace(
    _COMMON,
    name="PX4 plane",
    missions=replace(_MISSIONS, takeoff_least_m=12.0),  # NAV_ACC_RAD is 10 m
    kind=VehicleKind.PLANE,
    # DO_REPOSITION goes there by itself (Commander.cpp).
    control_mode="AUTO.LOITER",
    land_mode="AUTO.LAND",
    takeoff=TakeoffRules(
        form=TakeoffForm.AMSL,
        mode="AUTO.TAKEOFF",
        mode_after="AUTO.LOITER",
    ),
    reposition=True,
    circles_by_orbit=True,
    circle_radius_m=80.0,
    circle_parameters=("NAV_LOITER_RAD",),
    return_circle_parameters=("RTL_LOITER_RAD",),
    return_speeds=(("FW_AIRSPD_TRIM", 1.0),),
    roll_limit_parameter="FW_R_LIM",
    airspeed_limit_parameters=("FW_AIRSPD_MIN", "FW_AIRSPD_MAX"),
    wanted_parameters=(
        *_COMMON.wanted_parameters,
        "NAV_LOITER_RAD",
        "RTL_LOITER_RAD",
        "FW_AIRSPD_TRIM",
        "FW_AIRSPD_MIN",
        "FW_AIRSPD_MAX",
        "FW_R_LIM",
    ),
)

VTOL = replace(
    _COMMON,
    name="PX4 VTOL",
    unsupported="PX4 VTOL vehicles are not supported: they both hover and fly as planes, and "
    "goals support only vehicles that do one of the two.",
)

OTHER = replace(_COMMON, name="PX4 vehicle of another kind")

_BY_TYPE = profiles_by_type(copter=COPTER, rover=ROVER, boat=BOAT, plane=PLANE)


def px4_profile(vehicle_type: int) -> Profile:
    """Return the profile for a MAV_TYPE that a PX4 reports."""
    return profile_of_type(vehicle_type, _BY_TYPE, VTOL, OTHER)
