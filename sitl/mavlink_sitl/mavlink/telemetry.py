"""What each telemetry message says: one function per message, from one snapshot.

Values before a position, before the battery is known and so on are those the firmware was
recorded to send.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

from mavlink_sitl.autopilot.copter import Copter
from mavlink_sitl.exchange import BatteryReading, GpsReading, Motion, Motors
from mavlink_sitl.geodesy import GeoPoint
from mavlink_sitl.mavlink.codec import Message, dialect
from mavlink_sitl.mavlink.guided_target import (
    position_target_global_int,
    position_target_local_ned,
)

MAX_VOLTAGE_MV = 65534


class Snapshot(NamedTuple):
    """All that telemetry is made of, of one vehicle at one moment."""

    time_boot_us: int
    unix_time_us: int
    """0 while the GPS has not told the time."""
    copter: Copter
    motion: Motion
    gps: GpsReading | None
    """None before the receiver is found."""
    battery: BatteryReading
    thrust_over_hover: float
    throttle_fraction: float
    truth: Motion
    truth_point: GeoPoint
    wind_ned_m_s: tuple[float, float, float]


def _int(value: float, low: int, high: int) -> int:
    return int(min(max(round(value), low), high))


def _i16(value: float) -> int:
    return _int(value, -32768, 32767)


def _u16(value: float) -> int:
    return _int(value, 0, 65535)


def _i32(value: float) -> int:
    return _int(value, -(2**31), 2**31 - 1)


def _ms(s: Snapshot) -> int:
    return (s.time_boot_us // 1000) & 0xFFFFFFFF


def _heading_deg(yaw_rad: float) -> float:
    return math.degrees(yaw_rad) % 360.0


def heartbeat(s: Snapshot, was_position_controlled: bool = False) -> Message:
    """HEARTBEAT; at a mode change the flag of the old mode still counts, as recorded."""
    copter = s.copter
    mode = copter.mode.spec
    base_mode = dialect.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
    base_mode |= (
        dialect.MAV_MODE_FLAG_STABILIZE_ENABLED | dialect.MAV_MODE_FLAG_MANUAL_INPUT_ENABLED
    )
    if mode.position_controlled or was_position_controlled or not copter.started:
        base_mode |= dialect.MAV_MODE_FLAG_GUIDED_ENABLED
    if copter.armed:
        base_mode |= dialect.MAV_MODE_FLAG_SAFETY_ARMED
    personality = copter.personality
    return dialect.MAVLink_heartbeat_message(
        personality.mav_type,
        personality.mav_autopilot,
        base_mode,
        mode.number,
        int(copter.system_status),
        3,
    )


# SYS_STATUS bit fields as recorded: before the battery is known, before the GPS, after.
_PRESENT_EARLY, _PRESENT_NO_GPS, _PRESENT = 0x5331FC0F, 0x5371FC0F, 0x5371FC2F
_AHRS_ENABLED = 0x00200000
_MOTORS_ENABLED = 0x00016000
_BATTERY = 0x02000000
_PREARM = 0x10000000


def sys_status(s: Snapshot) -> Message:
    """SYS_STATUS."""
    copter = s.copter
    known = copter.battery_known
    if not known:
        present, enabled, health = _PRESENT_EARLY, 0x52019C0F, 0x45119C0B
    elif not copter.estimator.gps_started:
        present, enabled, health = _PRESENT_NO_GPS, 0x52419C0F, 0x47519C0F
    else:
        present, enabled, health = _PRESENT, 0x52419C2F, 0x47519C2F
    if copter.estimator.has_origin:
        enabled |= _AHRS_ENABLED
        health |= _AHRS_ENABLED
    if copter.armed:
        enabled = (enabled | 0x5361FC2F) & ~0
        health |= 0x5771FC2F & ~_PREARM
    if copter.armed or copter.prearm.passed:
        health |= _PREARM
    if copter.failsafe.battery_level:
        health &= ~_BATTERY
    battery = s.battery
    return dialect.MAVLink_sys_status_message(
        present,
        enabled,
        health,
        0,
        _int(battery.voltage_v * 1000.0, 0, MAX_VOLTAGE_MV) if known else 0,
        _i16(battery.current_a * 100.0) if known else -1,
        _int(battery.remaining_percent, 0, 100) if known else -1,
        0, 0, 0, 0, 0, 0,
    )  # fmt: skip


def battery_status(s: Snapshot) -> Message:
    """BATTERY_STATUS: the whole pack's voltage in the first cell's place, as recorded."""
    copter, battery = s.copter, s.battery
    known = copter.battery_known
    voltages = [65535] * 10
    charge_state = dialect.MAV_BATTERY_CHARGE_STATE_UNHEALTHY
    if known:
        voltages[0] = _int(battery.voltage_v * 1000.0, 0, MAX_VOLTAGE_MV)
        charge_state = dialect.MAV_BATTERY_CHARGE_STATE_OK + copter.failsafe.battery_level
    return dialect.MAVLink_battery_status_message(
        0,
        0,
        0,
        32767,
        voltages,
        _i16(battery.current_a * 100.0) if known else 0,
        _i32(battery.consumed_mah) if known else 0,
        _i32(battery.consumed_wh * 36.0) if known else 0,
        _int(battery.remaining_percent, 0, 100) if known else -1,
        0,
        charge_state,
    )


def global_position_int(s: Snapshot) -> Message:
    """GLOBAL_POSITION_INT: zeros before the GPS has been found."""
    m = s.motion
    if s.gps is None:
        return dialect.MAVLink_global_position_int_message(_ms(s), 0, 0, 0, 0, 0, 0, 0, 0)
    here = s.copter.here()
    return dialect.MAVLink_global_position_int_message(
        _ms(s),
        _i32(here.latitude_deg * 1e7),
        _i32(here.longitude_deg * 1e7),
        _i32(here.altitude_amsl_m * 1000.0),
        _i32(s.copter.height_above_home_m() * 1000.0),
        _i16(m.velocity_north_m_s * 100.0),
        _i16(m.velocity_east_m_s * 100.0),
        _i16(m.velocity_down_m_s * 100.0),
        _int(_heading_deg(m.yaw_rad) * 100.0, 0, 35999),
    )


def local_position_ned(s: Snapshot) -> Message | None:
    """LOCAL_POSITION_NED: only while the estimator uses GPS."""
    if not s.copter.estimator.using_gps:
        return None
    return dialect.MAVLink_local_position_ned_message(_ms(s), *s.motion[:6])


def attitude(s: Snapshot) -> Message:
    """ATTITUDE."""
    return dialect.MAVLink_attitude_message(_ms(s), *s.motion[6:12])


def attitude_quaternion(s: Snapshot) -> Message:
    """ATTITUDE_QUATERNION, from body to NED."""
    m = s.motion
    cr, sr = math.cos(m.roll_rad / 2), math.sin(m.roll_rad / 2)
    cp, sp = math.cos(m.pitch_rad / 2), math.sin(m.pitch_rad / 2)
    cy, sy = math.cos(m.yaw_rad / 2), math.sin(m.yaw_rad / 2)
    return dialect.MAVLink_attitude_quaternion_message(
        _ms(s),
        cr * cp * cy + sr * sp * sy,
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
        *m[9:12],
    )


def gps_raw_int(s: Snapshot) -> Message:
    """GPS_RAW_INT: after a loss the position goes on and only the time stands still."""
    gps = s.gps
    if gps is None:
        return dialect.MAVLink_gps_raw_int_message(0, 0, 0, 0, 0, 65535, 65535, 0, 0, 0)
    altitude_mm = _i32(gps.point.altitude_amsl_m * 1000.0)
    accuracy_mm = _int(gps.horizontal_accuracy_m * 1000.0, 0, 2**32 - 1)
    return dialect.MAVLink_gps_raw_int_message(
        _int(gps.time_s * 1e6, 0, 2**63),
        gps.fix_type,
        _i32(gps.point.latitude_deg * 1e7),
        _i32(gps.point.longitude_deg * 1e7),
        altitude_mm,
        gps.eph,
        gps.epv,
        _u16(gps.speed_m_s * 100.0),
        _int(gps.course_deg * 100.0, 0, 35999),
        gps.satellites,
        altitude_mm,
        accuracy_mm,
        accuracy_mm,
    )


def home_position(s: Snapshot) -> Message | None:
    """HOME_POSITION: q is always NaN."""
    home = s.copter.home
    if home is None:
        return None
    return dialect.MAVLink_home_position_message(
        _i32(home.latitude_deg * 1e7),
        _i32(home.longitude_deg * 1e7),
        _i32(home.altitude_amsl_m * 1000.0),
        *s.copter.home_ned_m(),
        [math.nan] * 4,
        0.0,
        0.0,
        0.0,
        s.time_boot_us,
    )


def gps_global_origin(s: Snapshot) -> Message | None:
    """GPS_GLOBAL_ORIGIN."""
    if not s.copter.estimator.has_origin:
        return None
    origin = s.copter.origin
    return dialect.MAVLink_gps_global_origin_message(
        _i32(origin.latitude_deg * 1e7),
        _i32(origin.longitude_deg * 1e7),
        _i32(origin.altitude_amsl_m * 1000.0),
        s.time_boot_us,
    )


def extended_sys_state(s: Snapshot) -> Message:
    """EXTENDED_SYS_STATE: a copter's VTOL state is always MC."""
    return dialect.MAVLink_extended_sys_state_message(
        dialect.MAV_VTOL_STATE_MC, int(s.copter.landed_state)
    )


def system_time(s: Snapshot) -> Message:
    """SYSTEM_TIME: no date before the GPS."""
    return dialect.MAVLink_system_time_message(s.unix_time_us, _ms(s))


def vfr_hud(s: Snapshot) -> Message:
    """VFR_HUD."""
    m = s.motion
    speed = math.hypot(m.velocity_north_m_s, m.velocity_east_m_s)
    altitude = 0.0 if s.gps is None else s.copter.here().altitude_amsl_m
    return dialect.MAVLink_vfr_hud_message(
        math.hypot(speed, m.velocity_down_m_s),
        speed,
        _int(_heading_deg(m.yaw_rad), 0, 359),
        _int(s.throttle_fraction * 100.0, 0, 100),
        altitude,
        -m.velocity_down_m_s,
    )


def autopilot_version(s: Snapshot) -> Message:
    """AUTOPILOT_VERSION."""
    p = s.copter.personality
    return dialect.MAVLink_autopilot_version_message(
        p.capabilities,
        p.flight_sw_version,
        0,
        0,
        0,
        list(p.flight_custom_version.encode("ascii")[:8].ljust(8, b"\0")),
        [0] * 8,
        [0] * 8,
        0,
        0,
        0,
    )


def ekf_status_report(s: Snapshot) -> Message:
    """EKF_STATUS_REPORT."""
    bad = 1.0 if s.copter.estimator.variance else 0.0
    return dialect.MAVLink_ekf_status_report_message(
        s.copter.estimator.flags, 0.005 + bad, 0.001 + bad, 0.007, 0.03, 0.0
    )


def nav_controller_output(s: Snapshot) -> Message:
    """NAV_CONTROLLER_OUTPUT: where the target is, in GUIDED towards a position."""
    copter, m = s.copter, s.motion
    distance = bearing = climb = 0.0
    if copter.guidance.track_position_xy and copter.guidance.motors is Motors.FLY:
        north, east, down = copter.moving_target()
        north, east = north - m.north_m, east - m.east_m
        distance = math.hypot(north, east)
        bearing = math.degrees(math.atan2(east, north))
        climb = m.down_m - down
    return dialect.MAVLink_nav_controller_output_message(
        math.degrees(m.roll_rad),
        math.degrees(m.pitch_rad),
        _i16(bearing),
        _i16(bearing),
        _u16(distance),
        climb,
        0.0,
        0.0,
    )


def servo_output_raw(s: Snapshot) -> Message:
    """SERVO_OUTPUT_RAW: four motors, 1000 at rest; hover is near 1590 as recorded."""
    # Thrust goes with the square of the motor command above idle; hover pins the scale.
    raw = _u16(1000.0 + 590.0 * math.sqrt(max(s.thrust_over_hover, 0.0)))
    motors = [min(raw, 2000)] * 4
    return dialect.MAVLink_servo_output_raw_message(
        s.time_boot_us & 0xFFFFFFFF, 0, *motors, 0, 0, 0, 0
    )


def rc_channels(s: Snapshot) -> Message:
    """RC_CHANNELS."""
    copter = s.copter
    channels = copter.pilot.channels(copter.now_s, copter.parameters["RC_OVERRIDE_TIME"])
    return dialect.MAVLink_rc_channels_message(
        _ms(s), len(channels), *channels, *([0] * (18 - len(channels))), 255
    )


def mission_current(s: Snapshot) -> Message:
    """MISSION_CURRENT: there is none."""
    in_auto = int(s.copter.mode.spec.behaviour == "auto")
    return dialect.MAVLink_mission_current_message(0, 0, 1, in_auto)


def power_status(_: Snapshot) -> Message:
    """POWER_STATUS: a board at 5 V."""
    return dialect.MAVLink_power_status_message(5000, 0, 0)


def simstate(s: Snapshot) -> Message:
    """SIMSTATE: the truth, where the rest is the estimate."""
    t = s.truth
    return dialect.MAVLink_simstate_message(
        *t[6:9],
        0.0,
        0.0,
        -9.80665,
        *t[9:12],
        _i32(s.truth_point.latitude_deg * 1e7),
        _i32(s.truth_point.longitude_deg * 1e7),
    )


def wind(s: Snapshot) -> Message:
    """WIND: where it comes from."""
    north, east, down = s.wind_ned_m_s
    direction = math.degrees(math.atan2(-east, -north))
    return dialect.MAVLink_wind_message(direction, math.hypot(north, east), down)


def vibration(s: Snapshot) -> Message:
    """VIBRATION: a little while the motors run."""
    z = 0.25 if s.thrust_over_hover > 0.0 else 0.003
    return dialect.MAVLink_vibration_message(s.time_boot_us, 0.003, 0.003, z, 0, 0, 0)


BUILDERS: dict[int, Callable[[Snapshot], Message | None]] = {
    0: heartbeat,
    1: sys_status,
    2: system_time,
    24: gps_raw_int,
    30: attitude,
    31: attitude_quaternion,
    32: local_position_ned,
    33: global_position_int,
    36: servo_output_raw,
    42: mission_current,
    49: gps_global_origin,
    62: nav_controller_output,
    65: rc_channels,
    74: vfr_hud,
    85: lambda s: position_target_local_ned(s.copter, _ms(s)),
    87: lambda s: position_target_global_int(s.copter, _ms(s)),
    125: power_status,
    147: battery_status,
    148: autopilot_version,
    164: simstate,
    168: wind,
    193: ekf_status_report,
    241: vibration,
    242: home_position,
    245: extended_sys_state,
}
"""By message id: what can be streamed and requested."""
