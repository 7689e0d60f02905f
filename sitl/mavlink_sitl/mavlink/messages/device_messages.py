"""Telemetry about relays, and HIGH_LATENCY2."""

from __future__ import annotations

import math

from mavlink_sitl.mavlink.codec import Message, dialect
from mavlink_sitl.mavlink.messages.snapshot import Snapshot, boot_ms, place_e7, to_int
from mavlink_sitl.mavlink.messages.status_messages import heartbeat, sys_status

_FAILURES = {
    0x20: 0x1, 0x10: 0x2, 0x8: 0x4, 0x2: 0x8, 0x1: 0x10, 0x4: 0x20, 0x400000: 0x40,
    0x2000000: 0x80, 0x10000: 0x100, 0x100000: 0x1000, 0x200000: 0x2000,
}  # fmt: skip
"""HL_FAILURE_FLAG by the bit of SYS_STATUS that is not healthy"""
_FIFTHS, _UNKNOWN_C = 5.0, -128


def relay_status(s: Snapshot) -> Message:
    """RELAY_STATUS: which are on, of which there are."""
    outputs = s.vehicle.outputs
    on = sum(1 << number for number in outputs.relays_on)
    return dialect.MAVLink_relay_status_message(boot_ms(s), on, (1 << outputs.relays) - 1)


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
