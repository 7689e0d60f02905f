"""PX4's telemetry where it differs from what `mavlink.telemetry` builds; values as recorded."""

from __future__ import annotations

import math
import struct

from mavlink_sitl.autopilot.personality import px4
from mavlink_sitl.autopilot.px4.multicopter.copter import Px4Copter
from mavlink_sitl.autopilot.px4.multicopter.orbit import Orbit
from mavlink_sitl.autopilot.px4.plane.path_guidance import PathPoint
from mavlink_sitl.autopilot.px4.plane.plane import Px4Plane
from mavlink_sitl.autopilot.px4.plane.plane_modes import Hold, PlaneMode
from mavlink_sitl.autopilot.px4.rover.rover_modes import DriveMode
from mavlink_sitl.autopilot.px4.vehicle import Px4Vehicle
from mavlink_sitl.exchange import GRAVITY_M_S2, Motors
from mavlink_sitl.mavlink.codec import Message, Raw, dialect
from mavlink_sitl.mavlink.files import component_metadata
from mavlink_sitl.mavlink.messages import kind_messages
from mavlink_sitl.mavlink.messages import position_messages as position
from mavlink_sitl.mavlink.messages import range_messages as ranges
from mavlink_sitl.mavlink.messages import sensor_messages as sensors
from mavlink_sitl.mavlink.messages import status_messages as status
from mavlink_sitl.mavlink.messages.snapshot import (
    Builder,
    Snapshot,
    boot_ms,
    never,
    place_e7,
    to_i32,
    to_int,
    to_u16,
)
from mavlink_sitl.mavlink.px4 import remote_id

NAN = math.nan
DISARMED_US = 900
HOVER_THRUST = 0.48
"""Thrust 0..1 in hover, of ATTITUDE_TARGET and VFR_HUD"""

_PRESENT, _ENABLED, _HEALTHY = 0x0300402F, 0x0301402F, 0x0320C83F
_PREARM, _BATTERY, _RADIO = 0x10000000, 0x02000000, 0x00010000
_NOTHING_YET = (0x0300400F, 0x0321480F, 0x0300803F)

_FLAGS_GROUND, _FLAGS_FLYING, _FLAGS_NO_POSITION = 1023, 831, 0x0A7
"""ESTIMATOR_STATUS.flags on the ground, in flight, and without a position"""


def firmware_of(s: Snapshot) -> Px4Vehicle:
    """The firmware as what it is."""
    assert isinstance(s.vehicle, Px4Vehicle)
    return s.vehicle


def heartbeat(s: Snapshot) -> Message:
    """HEARTBEAT."""
    vehicle = firmware_of(s)
    base_mode = dialect.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED | vehicle.base_flags
    if vehicle.armed:
        base_mode |= dialect.MAV_MODE_FLAG_SAFETY_ARMED
    personality = vehicle.personality
    return dialect.MAVLink_heartbeat_message(
        personality.mav_type, personality.mav_autopilot, base_mode, vehicle.mode.spec.number,
        int(vehicle.system_status), 3,
    )  # fmt: skip


def current_mode(s: Snapshot) -> Message:
    """CURRENT_MODE: the active mode and the intended one."""
    vehicle = firmware_of(s)
    number = vehicle.mode.spec.number
    standard = next(mode[1] for mode in vehicle.personality.available_modes if mode[0] == number)
    return dialect.MAVLink_current_mode_message(standard, number, vehicle.intention)


def available_mode(vehicle: Px4Vehicle, place: int) -> Message:
    """AVAILABLE_MODES: one of them, from 1."""
    modes = vehicle.personality.available_modes
    number, standard, properties, name = modes[place - 1]
    return dialect.MAVLink_available_modes_message(
        len(modes), place, standard, number, properties, name.encode("ascii")
    )


def sys_status(s: Snapshot) -> Message:
    """SYS_STATUS: ready to arm is one bit; the charge is rounded up.

    Sticks count as present only while they are heard, and a low battery as unhealthy; a lost
    receiver shows only in the fix type (all seen on its own simulator).
    """
    vehicle = firmware_of(s)
    present, enabled, health = _PRESENT, _ENABLED, _HEALTHY
    if not vehicle.estimator.gps_started:
        present, enabled, health = _NOTHING_YET
    if vehicle.can_arm():
        health |= _PREARM
    if vehicle.sticks.held() is not None:
        present, health = present | _RADIO, health | _RADIO
    if vehicle.failsafe.battery_level:
        health &= ~_BATTERY
    battery = vehicle.battery
    return dialect.MAVLink_sys_status_message(
        present,
        enabled,
        health,
        780,
        to_int(battery.voltage_v * 1000.0, 0, 65534),
        -100,
        to_int(math.ceil(battery.remaining * 100.0 - 1e-9), 0, 100),
        0, 0, 0, 0, 0, 0, 0, 0, 1,
    )  # fmt: skip


def battery_status(s: Snapshot) -> Message:
    """BATTERY_STATUS: the pack's voltage in the first place, a current of -1 A, rounded charge."""
    battery, further = firmware_of(s).battery, s.vehicle.body.next_battery()
    if further is not None:
        return status.further_battery_status(further)
    return dialect.MAVLink_battery_status_message(
        0, 1, 1, 32767, [to_int(battery.voltage_v * 1000.0, 0, 65534), *[65535] * 9], -100,
        to_i32(battery.consumed_mah), -1, to_int(battery.remaining * 100.0, 0, 100), 0,
        1 + min(s.vehicle.failsafe.battery_level, 3),
    )  # fmt: skip


def estimator_status(s: Snapshot) -> Message:
    """ESTIMATOR_STATUS."""
    vehicle = firmware_of(s)
    if not vehicle.estimator.position_ok:
        flags = _FLAGS_NO_POSITION
    else:
        flags = _FLAGS_FLYING if vehicle.armed else _FLAGS_GROUND
        flags |= 0x40  # absolute height is there in any case
    if vehicle.estimator.glitching:
        flags |= dialect.ESTIMATOR_GPS_GLITCH
    ratio = 0.03 + min(vehicle.estimator.gps_test_ratio, 1.97)  # 2.00 is the most it said
    return dialect.MAVLink_estimator_status_message(
        s.time_boot_us, flags, 0.04, ratio, 0.02, 0.09, 0.003, NAN, 0.29, 0.1
    )


def attitude_target(s: Snapshot, thrust: float | None = None) -> Message:
    """ATTITUDE_TARGET: the attitude loop is fast, so it is where the vehicle is.

    Args:
        s: the vehicle.
        thrust: 0..1; that of a multicopter's motors if left out.
    """
    if thrust is None:
        thrust = max(s.thrust_over_hover * HOVER_THRUST, 0.001)
    return dialect.MAVLink_attitude_target_message(
        boot_ms(s), 0, position.quaternion(s.motion), *s.motion[9:12], min(thrust, 1.0)
    )


def position_target_local_ned(s: Snapshot) -> Message:
    """POSITION_TARGET_LOCAL_NED: what the loops follow; NaN on the ground."""
    vehicle, yaw = firmware_of(s), s.motion.yaw_rad
    g = vehicle.guidance
    if g.motors is not Motors.FLY:
        nans = (NAN,) * 6
        return dialect.MAVLink_position_target_local_ned_message(
            boot_ms(s), 1, 63, *nans, 0.0, 0.0, 100.0, yaw, 0.0
        )
    north, east, down = vehicle.body.moving_target()
    m = s.motion
    limits = g.limits
    speed_n = g.velocity_north_m_s + g.track_position_xy * 0.95 * (north - m.north_m)
    speed_e = g.velocity_east_m_s + g.track_position_xy * 0.95 * (east - m.east_m)
    speed_d = g.velocity_down_m_s + g.track_position_z * (down - m.down_m)
    scale = limits.speed_xy_m_s / max(math.hypot(speed_n, speed_e), limits.speed_xy_m_s)
    return dialect.MAVLink_position_target_local_ned_message(
        boot_ms(s), 1, 0, north if g.track_position_xy else m.north_m,
        east if g.track_position_xy else m.east_m, down if g.track_position_z else m.down_m,
        speed_n * scale, speed_e * scale,
        min(max(speed_d, -limits.speed_up_m_s), limits.speed_down_m_s), g.acceleration_north_m_s2,
        g.acceleration_east_m_s2, g.acceleration_down_m_s2, g.yaw_rad if g.yaw_mode == 1 else yaw,
        g.yaw_rate_rad_s,
    )  # fmt: skip


def position_target_global_int(s: Snapshot) -> Message | None:
    """POSITION_TARGET_GLOBAL_INT: in the AUTO modes only; altitude 0, as recorded for LAND."""
    vehicle = firmware_of(s)
    number = vehicle.mode.spec.number
    if number >> 16 & 0xFF != px4.MAIN_AUTO or not vehicle.armed:
        return None
    target = vehicle.body.moving_target()
    point = vehicle.navigator.frame.to_geodetic(*target)
    altitude = 0.0 if number == px4.LAND else point.altitude_amsl_m
    local = position_target_local_ned(s)
    return dialect.MAVLink_position_target_global_int_message(
        boot_ms(s), 5, 0, *place_e7(point), altitude, local.vx, local.vy, local.vz, local.afx,
        local.afy, local.afz, local.yaw, 0.0,
    )  # fmt: skip


_POSE = [0.042, *[NAN] * 5, 0.042, *[NAN] * 4, 0.01, *[NAN] * 3, 3e-4, NAN, NAN, 6e-5, NAN, 3e-4]
_VELOCITY = [0.009, *[NAN] * 5, 0.009, *[NAN] * 4, 0.005, *[NAN] * 9]
"""Covariances of ODOMETRY"""
_ODOMETRY = struct.Struct("<Q13f")
# Packed once: most of the message never changes, and it comes often.
_ODOMETRY_END = struct.pack("<42f4Bb", *_POSE, *_VELOCITY, 1, 1, 1, 8, 0)


def odometry(s: Snapshot) -> Message:
    """ODOMETRY: velocity in the same NED frame as the position, as recorded."""
    m = s.motion
    moving = _ODOMETRY.pack(s.time_boot_us, *m[:3], *position.quaternion(m), *m[3:6], *m[9:12])
    return Raw(331, 91, moving + _ODOMETRY_END)


def highres_imu(s: Snapshot) -> Message:
    """HIGHRES_IMU: what an accelerometer in the middle feels, and standard air."""
    m = s.motion
    altitude = s.vehicle.body.truth_point().altitude_amsl_m
    flies = isinstance(s.vehicle, Px4Copter) and s.vehicle.guidance.motors is Motors.FLY
    lift = s.thrust_over_hover if flies else 1.0
    c, yaw = math.cos(m.pitch_rad), m.yaw_rad
    pressure = sensors.pressure_hpa(altitude)
    return dialect.MAVLink_highres_imu_message(
        s.time_boot_us, 0.0, 0.0, -GRAVITY_M_S2 * max(lift, 0.0), *m[9:12],
        0.21 * c * math.cos(yaw), -0.21 * c * math.sin(yaw), 0.43, pressure, 0.0, altitude, 15.0,
        0x1DFF,
    )  # fmt: skip


def altitude(s: Snapshot) -> Message:
    """ALTITUDE."""
    amsl = s.vehicle.navigator.here().altitude_amsl_m
    relative = s.vehicle.navigator.height_above_home_m()
    above = -s.vehicle.body.truth().down_m
    return dialect.MAVLink_altitude_message(
        s.time_boot_us, amsl, amsl, -s.motion.down_m, relative, -s.motion.down_m - above, above
    )


def distance_sensor(s: Snapshot) -> Message:
    """DISTANCE_SENSOR: the simulated vehicle looks down."""
    seen = s.vehicle.body.measure_ranges()
    height = max(-s.vehicle.body.truth().down_m, 0.0) if seen is None else min(seen.down_m, 100.0)
    return dialect.MAVLink_distance_sensor_message(
        boot_ms(s), 0, 10000, to_u16(height * 100.0), 0, 0, 25, 0
    )


def gps_raw_int(s: Snapshot) -> Message:
    """GPS_RAW_INT: a fix in three dimensions, ten satellites."""
    gps = s.vehicle.body.gps_reading()
    if gps is None:
        return dialect.MAVLink_gps_raw_int_message(0, 0, 0, 0, 0, 65535, 65535, 0, 0, 0)
    return position.gps_raw(gps, 3 if gps.fix_type >= 3 else 0, (70, 110), (900, 1780, 400))


def home_position(s: Snapshot) -> Message | None:
    """HOME_POSITION: with the attitude on the ground."""
    half = s.motion.yaw_rad / 2.0
    return position.home_position(s, (math.cos(half), 0.0, 0.0, math.sin(half)))


def vfr_hud(s: Snapshot) -> Message:
    """VFR_HUD, with the airspeed where the vehicle has a sensor for it."""
    throttle = s.throttle_fraction if isinstance(s.vehicle, Px4Plane) else 0.0  # so with rovers
    if isinstance(s.vehicle, Px4Copter):
        throttle = s.thrust_over_hover * HOVER_THRUST
    return position.hud(s, NAN if s.airspeed_m_s is None else s.airspeed_m_s, throttle, always=True)


def servo_output_raw(s: Snapshot) -> Message:
    """SERVO_OUTPUT_RAW: 900 disarmed, near 1480 in hover."""
    raw = DISARMED_US
    if s.vehicle.armed:
        raw = to_int(1000.0 + 480.0 * max(s.thrust_over_hover, 0.0), 1000, 2000)
    return status.servo_outputs(s, [raw] * 4, DISARMED_US)


def scaled_pressure(s: Snapshot) -> Message:
    """SCALED_PRESSURE."""
    imu = highres_imu(s)
    return dialect.MAVLink_scaled_pressure_message(boot_ms(s), imu.abs_pressure, 0.0, 1180)


def wind_cov(s: Snapshot) -> Message | None:
    """WIND_COV: the wind that blows; of planes only, others do not estimate it."""
    if not isinstance(s.vehicle, Px4Plane):
        return None
    north, east, down = s.vehicle.body.wind_ned_m_s
    altitude_m = s.vehicle.navigator.here().altitude_amsl_m
    return dialect.MAVLink_wind_cov_message(
        s.time_boot_us, north, east, down, 0.1, 0.1, altitude_m, 0.5, NAN
    )


def autopilot_version(s: Snapshot) -> Message:
    """AUTOPILOT_VERSION: v1.17.0; the git hash ends backwards in the custom version."""
    p = s.vehicle.personality
    code = list(bytes.fromhex(p.flight_custom_version)[::-1])
    custom = [*code[::-1][3::-1], 0, 0, 0, 0]
    return dialect.MAVLink_autopilot_version_message(
        p.capabilities, p.flight_sw_version, p.flight_sw_version, 0, 1, custom, custom,
        [0] * 8, 0, 0, 0,
    )  # fmt: skip


def wire_time(s: Snapshot) -> int:
    """Nanoseconds since power-up, never 0."""
    return s.time_boot_us * 1000 + 1


def timesync(s: Snapshot) -> Message:
    """TIMESYNC: a request."""
    return dialect.MAVLink_timesync_message(0, wire_time(s))


def protocol_version(_: Snapshot) -> Message:
    """PROTOCOL_VERSION: versions 200, 100 to 203, no hashes."""
    return Raw(300, 217, struct.pack("<HHH8s8s", 200, 100, 203, b"", b""))


def metadata(s: Snapshot) -> Message:
    """COMPONENT_METADATA."""
    return component_metadata.message(boot_ms(s), s.vehicle.parameters.table)


_EVERY_KIND: dict[int, Builder] = {
    0: heartbeat,
    1: sys_status,
    2: status.system_time,
    24: gps_raw_int,
    29: scaled_pressure,
    30: position.attitude,
    31: position.attitude_quaternion,
    32: position.local_position_ned,
    33: position.global_position_int,
    36: servo_output_raw,
    42: status.mission_current,
    49: position.gps_global_origin,
    65: never,  # there is no receiver
    74: vfr_hud,
    83: attitude_target,
    85: position_target_local_ned,
    87: position_target_global_int,
    105: highres_imu,
    111: timesync,
    132: distance_sensor,
    141: altitude,
    147: battery_status,
    148: autopilot_version,
    230: estimator_status,
    231: wind_cov,
    241: status.vibration,
    242: home_position,
    245: kind_messages.extended_sys_state,
    300: protocol_version,
    330: ranges.obstacle_distance,
    331: odometry,
    component_metadata.NUMBER: metadata,
    436: current_mode,
    remote_id.LOCATION: remote_id.location,
    remote_id.SYSTEM: remote_id.system,
}
"""By message id: what can be streamed and requested; PING and AVAILABLE_MODES aside."""


def drive_outputs(s: Snapshot) -> Message:
    """SERVO_OUTPUT_RAW: steering on 1 and throttle on 2."""
    outputs = [DISARMED_US] * 2
    if s.vehicle.armed:
        steering, _, throttle, _ = s.vehicle.body.servos_us()
        outputs = [steering, throttle]
    return status.servo_outputs(s, outputs, DISARMED_US)


def drive_target(s: Snapshot) -> Message | None:
    """POSITION_TARGET_GLOBAL_INT: where an AUTO mode drives to; no velocities."""
    vehicle = firmware_of(s)
    mode = vehicle.mode
    if not (isinstance(mode, DriveMode) and mode.way and vehicle.armed):
        return None
    return _global_target(s, (*mode.way.target, s.motion.down_m), 0.0)


def _plane_mode(s: Snapshot) -> PlaneMode:
    mode = firmware_of(s).mode
    assert isinstance(mode, PlaneMode)
    return mode


def _flying_path(s: Snapshot) -> PathPoint | None:
    """The path that an armed plane follows; None while disarmed or without a path."""
    return _plane_mode(s).path if s.vehicle.armed else None


def surface_outputs(s: Snapshot) -> Message:
    """SERVO_OUTPUT_RAW: aileron, elevator, rudder, throttle."""
    aileron, elevator, throttle, rudder = s.vehicle.body.servos_us()
    outputs = [DISARMED_US] * 4
    if s.vehicle.armed:
        outputs = [aileron, elevator, rudder, throttle]
    return status.servo_outputs(s, outputs, DISARMED_US)


def plane_attitude_target(s: Snapshot) -> Message:
    """ATTITUDE_TARGET of a plane."""
    return attitude_target(s, s.throttle_fraction)


def path_target(s: Snapshot) -> Message | None:
    """POSITION_TARGET_LOCAL_NED: the nearest place of the path, at the height to reach."""
    path = _flying_path(s)
    if path is None:
        return None
    nans = [NAN] * 8
    return dialect.MAVLink_position_target_local_ned_message(
        boot_ms(s), 1, 0, *path.nearest, _plane_mode(s).place[2], *nans
    )


def place_target(s: Snapshot) -> Message | None:
    """POSITION_TARGET_GLOBAL_INT: where an AUTO mode flies to; velocities are not given."""
    mode = _plane_mode(s)
    if mode.path is None or not s.vehicle.armed or not mode.spec.name.startswith("AUTO."):
        return None
    return _global_target(s, mode.place, NAN)


def _global_target(s: Snapshot, place: tuple[float, float, float], rest: float) -> Message:
    point = s.vehicle.navigator.frame.to_geodetic(*place)
    return dialect.MAVLink_position_target_global_int_message(
        boot_ms(s), 5, 0, *place_e7(point), point.altitude_amsl_m, *[rest] * 8,
    )  # fmt: skip


def _orbit_status(s: Snapshot, radius_m: float, centre: tuple[float, float, float]) -> Message:
    point = s.vehicle.navigator.frame.to_geodetic(*centre)
    return dialect.MAVLink_orbit_execution_status_message(
        s.time_boot_us, radius_m, dialect.MAV_FRAME_GLOBAL, *place_e7(point), point.altitude_amsl_m,
    )  # fmt: skip


def orbit_status(s: Snapshot) -> Message | None:
    """ORBIT_EXECUTION_STATUS of a multicopter: in its mode, also on the way to the circle."""
    mode = firmware_of(s).mode
    if not isinstance(mode, Orbit) or mode.centre is None or not s.vehicle.armed:
        return None
    return _orbit_status(s, math.copysign(mode.radius_m, mode.speed_m_s), mode.centre)


def circle_status(s: Snapshot) -> Message | None:
    """ORBIT_EXECUTION_STATUS of a plane: in AUTO.LOITER."""
    plane, mode = s.vehicle, _plane_mode(s)
    assert isinstance(plane, Px4Plane)
    if not isinstance(mode, Hold) or mode.target is None or plane.circling is None:
        return None
    (north, east), radius_m = plane.circling
    return _orbit_status(s, radius_m, (north, east, mode.target[2]))


_DRIVE: dict[int, Builder] = {
    36: drive_outputs,
    83: never,
    85: never,
    87: drive_target,
}
_FLY: dict[int, Builder] = {
    36: surface_outputs,
    83: plane_attitude_target,
    85: path_target,
    87: place_target,
    360: circle_status,
}
BUILDERS: dict[str, dict[int, Builder]] = {
    "px4copter": {**_EVERY_KIND, 360: orbit_status},
    "px4rover": {**_EVERY_KIND, **_DRIVE},
    "px4boat": {**_EVERY_KIND, **_DRIVE},
    "px4plane": {**_EVERY_KIND, **_FLY},
}
"""By vehicle type and message id"""
