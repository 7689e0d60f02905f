"""Distinguishes vehicles from other senders of HEARTBEAT, by MAV_TYPE and MAV_AUTOPILOT."""

from __future__ import annotations

from mavlink_vehicle.codec import mavlink

NOT_VEHICLES = frozenset(
    getattr(mavlink, f"MAV_TYPE_{name}")
    for name in (
        *("ANTENNA_TRACKER", "GCS", "ONBOARD_CONTROLLER", "GIMBAL", "ADSB", "CAMERA"),
        *("CHARGING_STATION", "FLARM", "SERVO", "ODID", "BATTERY", "PARACHUTE", "LOG", "OSD"),
        *("IMU", "GPS", "WINCH", "ILLUMINATOR", "GRIPPER"),
    )
)
"""Each MAV_TYPE of what is on board or on the ground, and is led nowhere, whatever MAV_AUTOPILOT it
gives: many leave that at 0, GENERIC (https://mavlink.io/en/services/heartbeat.html)."""


def is_vehicle(autopilot: int, vehicle_type: int) -> bool:
    """Return whether a HEARTBEAT with this MAV_AUTOPILOT and MAV_TYPE is that of a vehicle."""
    return autopilot != mavlink.MAV_AUTOPILOT_INVALID and vehicle_type not in NOT_VEHICLES


def sender_name(autopilot: int, vehicle_type: int) -> str:
    """Return what sends a HEARTBEAT, for people: "GCS", "QUADROTOR, autopilot PX4"."""
    kind = _entry("MAV_TYPE", vehicle_type)
    if autopilot == mavlink.MAV_AUTOPILOT_INVALID:
        return kind
    return f"{kind}, autopilot {_entry('MAV_AUTOPILOT', autopilot)}"


def _entry(enum: str, value: int) -> str:
    entry = mavlink.enums[enum].get(value)
    if entry is None or entry.name.endswith("ENUM_END"):
        return f"{enum} {value}"
    return entry.name.removeprefix(f"{enum}_")
