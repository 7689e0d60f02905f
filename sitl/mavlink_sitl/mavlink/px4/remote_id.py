"""OPEN_DRONE_ID_*: sent by PX4 once a second on every link, unrequested.

With values of the firmware's simulator, which has no remote id module: OPEN_DRONE_ID_ARM_STATUS
never comes.
"""

from __future__ import annotations

import math

from mavlink_sitl.autopilot.px4.vehicle import Px4Vehicle
from mavlink_sitl.mavlink.codec import Message, dialect
from mavlink_sitl.mavlink.messages.snapshot import Snapshot, place_e7, to_int

LOCATION, SYSTEM = 12901, 12904
EPOCH_2019_S = 1_546_300_800
"""OPEN_DRONE_ID_SYSTEM counts from 1 January 2019"""
_NOBODY = b"\0" * 20
_UNKNOWN_M = -1000.0
_HOUR_S = 3600.0
_UNCERTAINTY = (
    dialect.MAV_ODID_HOR_ACC_1_METER,
    dialect.MAV_ODID_VER_ACC_3_METER,
    dialect.MAV_ODID_VER_ACC_UNKNOWN,
    dialect.MAV_ODID_SPEED_ACC_1_METERS_PER_SECOND,
)


def location(s: Snapshot) -> Message | None:
    """OPEN_DRONE_ID_LOCATION: where the receiver says that it is."""
    gps = s.vehicle.body.gps_reading()
    if gps is None:
        return None
    vehicle = s.vehicle
    assert isinstance(vehicle, Px4Vehicle)
    status = dialect.MAV_ODID_STATUS_AIRBORNE
    if not vehicle.in_flight:
        status = dialect.MAV_ODID_STATUS_GROUND
    if vehicle.armed and vehicle.failsafe.active:
        status = dialect.MAV_ODID_STATUS_EMERGENCY
    home = vehicle.navigator.home
    amsl_m = vehicle.navigator.here().altitude_amsl_m
    return dialect.MAVLink_open_drone_id_location_message(
        0, 0, _NOBODY, status, to_int(round(gps.course_deg) * 100, 0, 35999),
        to_int(gps.speed_m_s * 100.0, 0, 25425),
        to_int(-s.motion.velocity_down_m_s * 100.0, -6200, 6200), *place_e7(gps.point), amsl_m,
        float(round(gps.point.altitude_amsl_m)), dialect.MAV_ODID_HEIGHT_REF_OVER_TAKEOFF,
        _UNKNOWN_M if home is None else amsl_m - home.altitude_amsl_m, *_UNCERTAINTY,
        math.fmod(s.unix_time_us / 1e6, _HOUR_S), dialect.MAV_ODID_TIME_ACC_0_1_SECOND,
    )  # fmt: skip


def system(s: Snapshot) -> Message | None:
    """OPEN_DRONE_ID_SYSTEM: where the operator is taken to be, at home."""
    home = s.vehicle.navigator.home
    if home is None or s.vehicle.body.gps_reading() is None:
        return None
    return dialect.MAVLink_open_drone_id_system_message(
        0, 0, _NOBODY, dialect.MAV_ODID_OPERATOR_LOCATION_TYPE_TAKEOFF,
        dialect.MAV_ODID_CLASSIFICATION_TYPE_UNDECLARED, *place_e7(home), 1, 0, _UNKNOWN_M,
        _UNKNOWN_M, dialect.MAV_ODID_CATEGORY_EU_UNDECLARED, dialect.MAV_ODID_CLASS_EU_UNDECLARED,
        home.altitude_amsl_m, to_int(s.unix_time_us // 1_000_000 - EPOCH_2019_S, 0, 2**32 - 1),
    )  # fmt: skip
