"""Telemetry about devices: relays, and compasses that are calibrated; and HIGH_LATENCY2."""

from __future__ import annotations

import math

from mavlink_sitl.autopilot.devices.compasses import RUNNING, Status
from mavlink_sitl.exchange import AccelerometerPosition
from mavlink_sitl.mavlink.codec import Message, dialect
from mavlink_sitl.mavlink.messages.snapshot import Snapshot, boot_ms, place_e7, to_int
from mavlink_sitl.mavlink.messages.status_messages import heartbeat, sys_status

FITNESS = 4.0
"""Of a calibrated compass, milligauss"""
_FAILURES = {
    0x20: 0x1, 0x10: 0x2, 0x8: 0x4, 0x2: 0x8, 0x1: 0x10, 0x4: 0x20, 0x400000: 0x40,
    0x2000000: 0x80, 0x10000: 0x100, 0x100000: 0x1000, 0x200000: 0x2000,
}  # fmt: skip
"""HL_FAILURE_FLAG by the bit of SYS_STATUS that is not healthy"""
_FIFTHS, _UNKNOWN_C = 5.0, -128


def accelerometer_position(asked: AccelerometerPosition) -> Message:
    """ACCELCAL_VEHICLE_POS, for everybody."""
    command = dialect.MAV_CMD_ACCELCAL_VEHICLE_POS
    values = (float(asked.position), *[0.0] * 6)
    return dialect.MAVLink_command_long_message(0, 0, command, 0, *values)


def relay_status(s: Snapshot) -> Message:
    """RELAY_STATUS: which are on, of which there are."""
    outputs = s.vehicle.outputs
    on = sum(1 << number for number in outputs.relays_on)
    return dialect.MAVLink_relay_status_message(boot_ms(s), on, (1 << outputs.relays) - 1)


def mag_cal_progress(s: Snapshot) -> list[Message]:
    """MAG_CAL_PROGRESS: one for each compass that is being calibrated."""
    compasses, now_s = s.vehicle.compasses, s.vehicle.now_s
    made: list[Message] = []
    for compass, calibration in compasses.calibrations.items():
        if calibration.status not in RUNNING:
            continue
        percent = calibration.percent(now_s)
        bits = (1 << round(80 * percent / 100)) - 1
        made.append(
            dialect.MAVLink_mag_cal_progress_message(
                compass, compasses.mask, int(calibration.status), 1, percent,
                list(bits.to_bytes(10, "little")), 0.0, 0.0, 0.0,
            )
        )  # fmt: skip
    return made


def mag_cal_report(s: Snapshot) -> list[Message]:
    """MAG_CAL_REPORT: one for each compass that is calibrated, until it is accepted."""
    compasses = s.vehicle.compasses
    return [
        dialect.MAVLink_mag_cal_report_message(
            compass, compasses.mask, int(calibration.status), int(calibration.saved), FITNESS,
            *compasses.values(compass, "OFS"), *compasses.values(compass, "DIA"),
            *compasses.values(compass, "ODI"), 0.0, 0, 0, 1.0,
        )
        for compass, calibration in compasses.calibrations.items()
        if calibration.status is Status.SUCCESS
    ]  # fmt: skip


def high_latency2(s: Snapshot) -> Message:
    """HIGH_LATENCY2: all in short."""
    vehicle, beat, status = s.vehicle, heartbeat(s), sys_status(s)
    latitude, longitude = place_e7(vehicle.navigator.here())
    health = status.onboard_control_sensors_health
    heading = round(math.degrees(s.motion.yaw_rad) % 360.0) // 2
    speed = s.motion.speed_m_s
    airspeed = speed if s.airspeed_m_s is None else s.airspeed_m_s
    altitude_m = to_int(vehicle.navigator.here().altitude_amsl_m, -32768, 32767)
    return dialect.MAVLink_high_latency2_message(
        boot_ms(s),
        beat.type,
        beat.autopilot,
        beat.custom_mode & 0xFFFF,
        latitude,
        longitude,
        altitude_m,
        altitude_m,
        heading,
        heading,
        0,
        to_int(s.throttle_fraction * 100.0, 0, 100),
        to_int(airspeed * _FIFTHS, 0, 255),
        to_int(airspeed * _FIFTHS, 0, 255),
        to_int(speed * _FIFTHS, 0, 255),
        0,
        0,
        0,
        0,
        _UNKNOWN_C,
        0,
        status.battery_remaining,
        vehicle.plans.current,
        sum(flag for bit, flag in _FAILURES.items() if not health & bit),
        beat.base_mode - (256 if beat.base_mode > 127 else 0),
        0,
        0,
    )
