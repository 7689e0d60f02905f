"""Telemetry about position and motion, one function per message.

Values before a position and after its loss are those the firmware was recorded to send.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from mavlink_sitl.autopilot.ardupilot.rover.rover import Rover
from mavlink_sitl.exchange import GRAVITY_M_S2, GpsReading, Motion, Motors
from mavlink_sitl.mavlink.codec import Message, dialect
from mavlink_sitl.mavlink.messages.snapshot import (
    Snapshot,
    boot_ms,
    heading_deg,
    place_e7,
    place_mm,
    to_i16,
    to_i32,
    to_int,
    to_u16,
)


def global_position_int(s: Snapshot) -> Message:
    """GLOBAL_POSITION_INT: zeros before the GPS has been found."""
    m = s.motion
    if not s.vehicle.estimator.gps_started:
        return dialect.MAVLink_global_position_int_message(boot_ms(s), 0, 0, 0, 0, 0, 0, 0, 0)
    here = s.vehicle.navigator.here()
    return dialect.MAVLink_global_position_int_message(
        boot_ms(s), *place_mm(here), to_i32(s.vehicle.navigator.height_above_home_m() * 1000.0),
        to_i16(m.velocity_north_m_s * 100.0), to_i16(m.velocity_east_m_s * 100.0),
        to_i16(m.velocity_down_m_s * 100.0), to_int(heading_deg(m.yaw_rad) * 100.0, 0, 35999),
    )  # fmt: skip


def local_position_ned(s: Snapshot) -> Message | None:
    """LOCAL_POSITION_NED: only while the estimator uses GPS."""
    if not s.vehicle.estimator.using_gps:
        return None
    return dialect.MAVLink_local_position_ned_message(boot_ms(s), *s.motion[:6])


def attitude(s: Snapshot) -> Message:
    """ATTITUDE."""
    return dialect.MAVLink_attitude_message(boot_ms(s), *s.motion[6:12])


def attitude_quaternion(s: Snapshot) -> Message:
    """ATTITUDE_QUATERNION, from body to NED."""
    m = s.motion
    return dialect.MAVLink_attitude_quaternion_message(boot_ms(s), *quaternion(m), *m[9:12])


def quaternion(m: Motion) -> list[float]:
    """The attitude, from body to NED."""
    return quaternion_of(m.roll_rad, m.pitch_rad, m.yaw_rad)


def quaternion_of(roll_rad: float, pitch_rad: float, yaw_rad: float) -> list[float]:
    """The attitude with these angles."""
    cr, sr = math.cos(roll_rad / 2), math.sin(roll_rad / 2)
    cp, sp = math.cos(pitch_rad / 2), math.sin(pitch_rad / 2)
    cy, sy = math.cos(yaw_rad / 2), math.sin(yaw_rad / 2)
    return [
        cr * cp * cy + sr * sp * sy,
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
    ]


def gps_raw_int(s: Snapshot) -> Message:
    """GPS_RAW_INT: after a loss the position continues and only the time stands still."""
    gps = s.vehicle.body.gps_reading()
    if gps is None:
        return dialect.MAVLink_gps_raw_int_message(0, 0, 0, 0, 0, 65535, 65535, 0, 0, 0)
    accuracy_mm = to_int(gps.horizontal_accuracy_m * 1000.0, 0, 2**32 - 1)
    return gps_raw(gps, gps.fix_type, (gps.eph, gps.epv), (accuracy_mm, accuracy_mm))


def gps_raw(
    gps: GpsReading, fix_type: int, dilution: tuple[int, int], accuracy: tuple[int, ...]
) -> Message:
    """GPS_RAW_INT of a reading: eph and epv, and h_acc, v_acc, ... as the firmware says them."""
    place = place_mm(gps.point)
    return dialect.MAVLink_gps_raw_int_message(
        to_int(gps.time_s * 1e6, 0, 2**63), fix_type, *place, *dilution,
        to_u16(gps.speed_m_s * 100.0), to_int(gps.course_deg * 100.0, 0, 35999), gps.satellites,
        place[2], *accuracy,
    )  # fmt: skip


def home_position(s: Snapshot, attitude: Sequence[float] = (math.nan,) * 4) -> Message | None:
    """HOME_POSITION: q is always NaN."""
    home = s.vehicle.navigator.home
    if home is None:
        return None
    return dialect.MAVLink_home_position_message(
        *place_mm(home), *s.vehicle.navigator.home_ned_m(), list(attitude), *[0.0] * 3,
        s.time_boot_us,
    )  # fmt: skip


def gps_global_origin(s: Snapshot) -> Message | None:
    """GPS_GLOBAL_ORIGIN."""
    if not s.vehicle.estimator.has_origin:
        return None
    origin = s.vehicle.navigator.origin
    return dialect.MAVLink_gps_global_origin_message(
        *place_mm(origin),
        s.time_boot_us,
    )


def vfr_hud(s: Snapshot) -> Message:
    """VFR_HUD: the airspeed of a copter is its speed."""
    m = s.motion
    speed = m.speed_m_s
    return hud(s, math.hypot(speed, m.velocity_down_m_s), s.throttle_fraction)


def hud(s: Snapshot, airspeed_m_s: float, throttle: float, always: bool = False) -> Message:
    """VFR_HUD; without `always` there is no altitude before the GPS has been found."""
    m = s.motion
    known = always or s.vehicle.estimator.gps_started
    return dialect.MAVLink_vfr_hud_message(
        airspeed_m_s, m.speed_m_s, to_int(heading_deg(m.yaw_rad), 0, 359),
        to_int(throttle * 100.0, 0, 100),
        s.vehicle.navigator.here().altitude_amsl_m if known else 0.0, -m.velocity_down_m_s,
    )  # fmt: skip


def nav_controller_output(s: Snapshot) -> Message:
    """NAV_CONTROLLER_OUTPUT: where the target is, in GUIDED towards a position."""
    vehicle, m = s.vehicle, s.motion
    distance = bearing = climb = 0.0
    if vehicle.guidance.track_position_xy and vehicle.guidance.motors is Motors.FLY:
        north, east, down = vehicle.body.moving_target()
        north, east = north - m.north_m, east - m.east_m
        distance = math.hypot(north, east)
        bearing = math.degrees(math.atan2(east, north))
        climb = m.down_m - down
    return dialect.MAVLink_nav_controller_output_message(
        math.degrees(m.roll_rad), math.degrees(m.pitch_rad), to_i16(bearing), to_i16(bearing),
        to_u16(distance), climb, 0.0, 0.0,
    )  # fmt: skip


TERRAIN_SPACING_M, CACHED, PENDING = 100, 56, 504
"""TERR_SPACING; how many blocks of heights it waits for before it knows its place, and after"""


def terrain_report(s: Snapshot) -> Message | None:
    """TERRAIN_REPORT of a firmware to which nobody has sent heights; a rover has none.

    As recorded (`copter_auto_cleared`): then the ground is taken to be at sea level.
    """
    if isinstance(s.vehicle, Rover):
        return None
    if not s.vehicle.estimator.gps_started:
        report = (0, 0, TERRAIN_SPACING_M, 0.0, 0.0, CACHED, 0)
    else:
        here = s.vehicle.navigator.here()
        place = place_e7(here)
        report = (*place, 0, 0.0, here.altitude_amsl_m, PENDING, 0)
    return dialect.MAVLink_terrain_report_message(*report)


def simstate(s: Snapshot) -> Message:
    """SIMSTATE: the truth, where the rest is the estimate."""
    t, place = s.vehicle.body.truth(), s.vehicle.body.truth_point()
    return dialect.MAVLink_simstate_message(
        *t[6:9], 0.0, 0.0, -GRAVITY_M_S2, *t[9:12], *place_e7(place),
    )  # fmt: skip


def wind(s: Snapshot) -> Message:
    """WIND: where it comes from."""
    north, east, down = s.vehicle.body.wind_ned_m_s
    direction = math.degrees(math.atan2(-east, -north))
    return dialect.MAVLink_wind_message(direction, math.hypot(north, east), down)
