"""Telemetry of raw sensors, one function per message.

There is one set of sensors, read without noise of their own: the second of each kind shows the
same, and a third accelerometer and gyroscope are not there, as recorded. The magnetic field is
that of the default home everywhere.
"""

from __future__ import annotations

import math

from mavlink_sitl.autopilot.ardupilot.rover.rover import Rover
from mavlink_sitl.exchange import GRAVITY_M_S2, Vector
from mavlink_sitl.mavlink.codec import Message, dialect
from mavlink_sitl.mavlink.messages.snapshot import Snapshot, boot_ms, place_e7, to_i16

FIELD_NED_MGAUSS = (231.0, 53.0, -528.0)
"""Recorded with the nose to the North (`rover_guided`)"""
BOARD_C = 28.0
SEA_LEVEL_HPA, LAPSE_1_M, EXPONENT = 1013.25, 2.25577e-5, 5.25588
"""The standard atmosphere (ISO 2533) as an altitude formula"""
DIFFERENTIAL_PA = 1.9936
"""ARSPD_RATIO: airspeed squared over pressure"""
NOT_MEASURED = 32767
FREE_BYTES = 524288
SCALED_FULL = 10000
"""RC_CHANNELS_SCALED: full deflection"""


def _to_body(s: Snapshot, vector: Vector) -> Vector:
    """A vector in NED as the vehicle sees it: forward, right, down."""
    m = s.motion
    cr, sr = math.cos(m.roll_rad), math.sin(m.roll_rad)
    cp, sp = math.cos(m.pitch_rad), math.sin(m.pitch_rad)
    cy, sy = math.cos(m.yaw_rad), math.sin(m.yaw_rad)
    north, east, down = vector
    ahead, right = cy * north + sy * east, cy * east - sy * north
    below = sp * ahead + cp * down
    return cp * ahead - sp * down, cr * right + sr * below, cr * below - sr * right


def specific_force_m_s2(s: Snapshot) -> Vector:
    """The specific force: gravity and turning; changes of speed are left out."""
    m = s.motion
    u, v, w = _to_body(s, m[3:6])
    p, q, r = m.roll_rate_rad_s, m.pitch_rate_rad_s, m.yaw_rate_rad_s
    gravity = _to_body(s, (0.0, 0.0, GRAVITY_M_S2))
    turning = (q * w - r * v, r * u - p * w, p * v - q * u)
    return (turning[0] - gravity[0], turning[1] - gravity[1], turning[2] - gravity[2])


def _inertial(s: Snapshot) -> tuple[int, ...]:
    """Acceleration in thousandths of gravity and rates in thousandths of a radian a second."""
    force = [to_i16(f / GRAVITY_M_S2 * 1000.0) for f in specific_force_m_s2(s)]
    return (*force, *(to_i16(rate * 1000.0) for rate in s.motion[9:12]))


def _magnetic(s: Snapshot) -> tuple[int, ...]:
    return tuple(to_i16(value) for value in _to_body(s, FIELD_NED_MGAUSS))


def raw_imu(s: Snapshot) -> Message:
    """RAW_IMU."""
    return dialect.MAVLink_raw_imu_message(
        s.time_boot_us, *_inertial(s), *_magnetic(s), 0, round(BOARD_C * 100.0)
    )


def scaled_imu2(s: Snapshot) -> Message:
    """SCALED_IMU2."""
    return dialect.MAVLink_scaled_imu2_message(
        boot_ms(s), *_inertial(s), *_magnetic(s), round(BOARD_C * 100.0)
    )


def scaled_imu3(s: Snapshot) -> Message:
    """SCALED_IMU3: only a magnetometer."""
    return dialect.MAVLink_scaled_imu3_message(boot_ms(s), 0, 0, 0, 0, 0, 0, *_magnetic(s), 0)


def pressure_hpa(altitude_amsl_m: float) -> float:
    """The pressure of the standard atmosphere, up to 11 km."""
    return SEA_LEVEL_HPA * math.pow(1.0 - LAPSE_1_M * min(altitude_amsl_m, 11_000.0), EXPONENT)


def _pressure_hpa(s: Snapshot) -> float:
    return pressure_hpa(s.vehicle.navigator.here().altitude_amsl_m)


def _airspeed_pa(s: Snapshot) -> float:
    return (s.airspeed_m_s or 0.0) ** 2 / DIFFERENTIAL_PA


def scaled_pressure(s: Snapshot) -> Message:
    """SCALED_PRESSURE, with the differential pressure of an airspeed sensor if there is one."""
    return dialect.MAVLink_scaled_pressure_message(
        boot_ms(s), _pressure_hpa(s), _airspeed_pa(s) / 100.0, round(BOARD_C * 100.0)
    )


def scaled_pressure2(s: Snapshot) -> Message:
    """SCALED_PRESSURE2."""
    return dialect.MAVLink_scaled_pressure2_message(
        boot_ms(s), _pressure_hpa(s), 0.0, round(BOARD_C * 100.0)
    )


def airspeed(s: Snapshot) -> Message | None:
    """AIRSPEED; None without an airspeed sensor."""
    if s.airspeed_m_s is None:
        return None
    return dialect.MAVLink_airspeed_message(
        0, s.airspeed_m_s, NOT_MEASURED, _airspeed_pa(s), dialect.AIRSPEED_SENSOR_USING
    )


def aoa_ssa(s: Snapshot) -> Message | None:
    """AOA_SSA: the angles of the airflow; None without an airspeed sensor."""
    if s.airspeed_m_s is None:
        return None
    wind = s.vehicle.body.wind_ned_m_s
    m = s.motion
    through = (
        m.velocity_north_m_s - wind[0],
        m.velocity_east_m_s - wind[1],
        m.velocity_down_m_s - wind[2],
    )
    ahead, right, below = _to_body(s, through)
    speed = math.hypot(ahead, right, below)
    if speed < 1.0:
        return dialect.MAVLink_aoa_ssa_message(s.time_boot_us, 0.0, 0.0)
    attack = math.degrees(math.atan2(below, ahead))
    slip = math.degrees(math.asin(max(-1.0, min(1.0, right / speed))))
    return dialect.MAVLink_aoa_ssa_message(s.time_boot_us, attack, slip)


def ahrs(_: Snapshot) -> Message:
    """AHRS: an estimator without errors of its own."""
    return dialect.MAVLink_ahrs_message(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


def ahrs2(s: Snapshot) -> Message:
    """AHRS2: the second estimator says the same."""
    here = s.vehicle.navigator.here()
    return dialect.MAVLink_ahrs2_message(
        *s.motion[6:9],
        here.altitude_amsl_m,
        *place_e7(here),
    )


def meminfo(_: Snapshot) -> Message:
    """MEMINFO: as recorded."""
    return dialect.MAVLink_meminfo_message(0, 65535, FREE_BYTES)


def rc_channels_scaled(s: Snapshot) -> Message | None:
    """RC_CHANNELS_SCALED: what ArduRover steers and drives with; others do not send it."""
    if not isinstance(s.vehicle, Rover):
        return None
    scaled = [
        to_i16((us - 1500) / 500.0 * SCALED_FULL) if us else 0 for us in s.vehicle.body.servos_us()
    ]
    return dialect.MAVLink_rc_channels_scaled_message(boot_ms(s), 0, *scaled[:4], 0, 0, 0, 0, 255)
