"""What is known about the vehicle: a frozen state and a pure `reduce`.

Only messages of the vehicle's own system and autopilot component are taken in; the
HEARTBEATs of ground stations, gimbals and other vehicles on the same link change nothing.
MAVLink's "unknown" markers (65535, -1, INT32_MAX, NaN) become None, never numbers. How old a
value may be is the reader's decision: each part carries the time `time_s` at which it came.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from mavlink_vehicle.codec import Message, mavlink
from mavlink_vehicle.events import LandedState
from mavlink_vehicle.failsafe import assess
from mavlink_vehicle.frames import Vector3, normalize_angle
from mavlink_vehicle.status_text import add_chunk, expire
from mavlink_vehicle.telemetry import (
    Attitude,
    Battery,
    Estimator,
    GlobalPosition,
    GpsFix,
    Home,
    LocalPosition,
    Origin,
)
from mavlink_vehicle.vehicle_state import VehicleState

__all__ = [
    "Attitude",
    "Battery",
    "Estimator",
    "GlobalPosition",
    "GpsFix",
    "Home",
    "LocalPosition",
    "Origin",
    "VehicleState",
    "reduce",
]

REORDER_LIMIT_MS = 3000
"""Time since boot going back by less is a late packet; by more, a restart."""

_ANNOUNCEMENT_S = 60.0
_BOOT = mavlink.MAV_STATE_BOOT
_UINT16_MAX = 0xFFFF
_INT32_MAX = 0x7FFFFFFF
_UINT32 = 1 << 32
_CENTIDEGREE = math.radians(0.01)
_WRAP_MARGIN_MS = 60_000
_AUTOPILOT_INVALID = mavlink.MAV_AUTOPILOT_INVALID
_ARMED_FLAG = mavlink.MAV_MODE_FLAG_SAFETY_ARMED
_PREARM_CHECK = mavlink.MAV_SYS_STATUS_PREARM_CHECK
_GEOFENCE = mavlink.MAV_SYS_STATUS_GEOFENCE
# The same bits in EKF_STATUS_REPORT (ArduPilot) and ESTIMATOR_STATUS (PX4).
_ESTIMATOR_HORIZONTAL_RELATIVE = 0x0008
_ESTIMATOR_HORIZONTAL_ABSOLUTE = 0x0010
_FIRMWARE_TYPES = {0: "-dev", 64: "-alpha", 128: "-beta", 192: "-rc", 255: ""}


def reduce(state: VehicleState, message: Message, now: float) -> VehicleState:
    """Return the state after `message`; the same object when it says nothing about the vehicle.

    Args:
        state: what was known before.
        message: anything that came over the link.
        now: time in seconds; becomes the `time_s` of what the message brings.
    """
    reducer = _REDUCERS.get(message.__class__)
    if reducer is None:
        return state
    header = message._header
    if header.srcComponent != state.component_id:
        return state
    if header.srcSystem != state.system_id and not (state.system_id == 0 and reducer is _heartbeat):
        return state
    after = reducer(state, message, now)
    if reducer in _FAILSAFE_EVIDENCE and after is not state:
        failsafe = assess(after, now)
        if failsafe is not after.failsafe:
            after = _evolve(after, {"failsafe": failsafe})
    return after


def _evolve(state: VehicleState, changes: dict[str, Any]) -> VehicleState:
    """Do what dataclasses.replace does, several times faster: this runs for every message."""
    if not changes:
        return state
    new = object.__new__(VehicleState)
    object.__setattr__(new, "__dict__", {**state.__dict__, **changes})
    return new


def _heartbeat(state: VehicleState, message: Message, now: float) -> VehicleState:
    if message.autopilot == _AUTOPILOT_INVALID:
        return state
    header = message._header
    changes = {
        "system_id": header.srcSystem,
        "component_id": header.srcComponent,
        "autopilot": message.autopilot,
        "vehicle_type": message.type,
        "last_heartbeat_s": now,
        "armed": bool(message.base_mode & _ARMED_FLAG),
        "base_mode": message.base_mode,
        "custom_mode": message.custom_mode,
        "heartbeat_mode": message.custom_mode,
        "system_status": message.system_status,
        "texts": expire(state.texts, now),
    }
    if message.custom_mode != state.custom_mode:
        changes["intended_mode"] = 0  # what was intended is known for the mode before only
    if message.system_status == _BOOT and state.system_status > _BOOT:
        # An ArduCopter that restarts says so in its first second; its time since boot comes
        # only when it has been asked for again.
        changes |= _VOID_AFTER_RESTART
        changes |= {"boot_count": state.boot_count + 1, "boot_announced_s": now}
    return _evolve(state, changes)


_VOID_AFTER_RESTART: dict[str, Any] = {
    "landed_state": LandedState.UNDEFINED,
    "global_position": None,
    "local_position": None,
    "attitude": None,
    "home": None,
    "origin": None,
    "gps": None,
    "estimator": None,
    "ground_altitude_amsl_m": None,
    "ground_down_m": None,
    "sensors_health": None,
    "prearm_ok": None,
    "intended_mode": 0,
    "fence_breached": False,
    "failsafe": None,
}


def _current_mode(state: VehicleState, message: Message, _now: float) -> VehicleState:
    """PX4's HEARTBEAT comes once a second whatever happens; this one can be had more often."""
    changes = {
        "custom_mode": message.custom_mode,
        "intended_mode": message.intended_custom_mode,
    }
    if changes["custom_mode"] == state.custom_mode and (
        changes["intended_mode"] == state.intended_mode
    ):
        return state
    return _evolve(state, changes)


def _on_ground(state: VehicleState) -> bool:
    return state.landed_state is LandedState.ON_GROUND and not state.armed


def _boot_changes(state: VehicleState, time_boot_ms: int, now: float) -> dict[str, Any]:
    """Return what a time since boot changes; after a restart what was measured before is void."""
    last = state.boot_time_ms
    if last is None or last <= time_boot_ms:
        return {"boot_time_ms": time_boot_ms}
    back = last - time_boot_ms
    if back < REORDER_LIMIT_MS:
        return {}
    if back > _UINT32 - _WRAP_MARGIN_MS:  # the counter's own end, after 49.7 days
        return {"boot_time_ms": time_boot_ms}
    announced_s = state.boot_announced_s
    known = announced_s is not None and now - announced_s < _ANNOUNCEMENT_S
    return {
        **_VOID_AFTER_RESTART,
        "boot_count": state.boot_count + (0 if known else 1),
        "boot_time_ms": time_boot_ms,
        "boot_announced_s": None,
    }


def _is_late(part: GlobalPosition | LocalPosition | Attitude | None, time_boot_ms: int) -> bool:
    return part is not None and 0 < part.time_boot_ms - time_boot_ms < REORDER_LIMIT_MS


def _system_time(state: VehicleState, message: Message, now: float) -> VehicleState:
    return _evolve(state, _boot_changes(state, message.time_boot_ms, now))


def _global_position(state: VehicleState, message: Message, now: float) -> VehicleState:
    time_boot_ms = message.time_boot_ms
    if _is_late(state.global_position, time_boot_ms):
        return state
    changes = _boot_changes(state, time_boot_ms, now)
    latitude, longitude, heading = message.lat, message.lon, message.hdg
    if (latitude == 0 and longitude == 0) or _INT32_MAX in (latitude, longitude):
        changes["global_position"] = None
    else:
        changes["global_position"] = GlobalPosition(
            now,
            time_boot_ms,
            latitude * 1e-7,
            longitude * 1e-7,
            message.alt * 1e-3,
            message.relative_alt * 1e-3,
            (message.vx * 0.01, message.vy * 0.01, message.vz * 0.01),
            None if heading == _UINT16_MAX else normalize_angle(heading * _CENTIDEGREE),
        )
        if _on_ground(state):
            changes["ground_altitude_amsl_m"] = message.alt * 1e-3
    return _evolve(state, changes)


def _local_position(state: VehicleState, message: Message, now: float) -> VehicleState:
    time_boot_ms = message.time_boot_ms
    if _is_late(state.local_position, time_boot_ms):
        return state
    changes = _boot_changes(state, time_boot_ms, now)
    position = (message.x, message.y, message.z)
    velocity = (message.vx, message.vy, message.vz)
    if _finite(position) and _finite(velocity):
        changes["local_position"] = LocalPosition(now, time_boot_ms, position, velocity)
        if _on_ground(state):
            changes["ground_down_m"] = message.z
    else:
        changes["local_position"] = None
    return _evolve(state, changes)


def _attitude(state: VehicleState, message: Message, now: float) -> VehicleState:
    time_boot_ms = message.time_boot_ms
    if _is_late(state.attitude, time_boot_ms):
        return state
    changes = _boot_changes(state, time_boot_ms, now)
    roll, pitch, yaw = message.roll, message.pitch, message.yaw
    rates = (message.rollspeed, message.pitchspeed, message.yawspeed)
    changes["attitude"] = (
        Attitude(now, time_boot_ms, roll, pitch, normalize_angle(yaw), rates)
        if _finite((roll, pitch, yaw)) and _finite(rates)
        else None
    )
    return _evolve(state, changes)


def _battery_status(state: VehicleState, message: Message, now: float) -> VehicleState:
    if message.id != 0:
        return state
    # ArduPilot and PX4 put the pack's voltage into the first cells when they don't know cells:
    # in every case the sum of the valid entries is the pack's voltage.
    cells = [mv for mv in message.voltages if mv != _UINT16_MAX]
    cells += [mv for mv in message.voltages_ext if mv not in (0, _UINT16_MAX)]
    current_ca, consumed_mah = message.current_battery, message.current_consumed
    # PX4 also writes its own "unknown" of -1 A, as -100, and adds up the charge from it.
    unknown_current = current_ca == -1 or (
        current_ca == -100 and state.autopilot == mavlink.MAV_AUTOPILOT_PX4
    )
    battery = Battery(
        now,
        _fraction(message.battery_remaining),
        sum(cells) / 1000 if cells else None,
        None if unknown_current else current_ca / 100,
        None if consumed_mah < 0 else consumed_mah / 1000,
        message.charge_state,
    )
    return _evolve(state, {"battery": battery})


def _sys_status(state: VehicleState, message: Message, now: float) -> VehicleState:
    health = message.onboard_control_sensors_health
    # PX4 sets the health bit of a check that it does not list as present.
    tells_prearm = state.autopilot == mavlink.MAV_AUTOPILOT_PX4 or bool(
        message.onboard_control_sensors_present & _PREARM_CHECK
    )
    changes: dict[str, Any] = {
        "sensors_health": health,
        "prearm_ok": bool(health & _PREARM_CHECK) if tells_prearm else None,
    }
    if message.onboard_control_sensors_enabled & _GEOFENCE:
        changes["fence_breached"] = not health & _GEOFENCE
    if state.battery is None or state.battery.from_summary:
        voltage_mv = message.voltage_battery
        changes["battery"] = Battery(
            now,
            _fraction(message.battery_remaining),
            None if voltage_mv in (0, _UINT16_MAX) else voltage_mv * 1e-3,
            None if message.current_battery == -1 else message.current_battery * 0.01,
            from_summary=True,
        )
    return _evolve(state, changes)


def _extended_sys_state(state: VehicleState, message: Message, _now: float) -> VehicleState:
    try:
        landed = LandedState(message.landed_state)
    except ValueError:  # a state that a newer dialect may define
        landed = LandedState.UNDEFINED
    return state if landed is state.landed_state else _evolve(state, {"landed_state": landed})


def _fence_status(state: VehicleState, message: Message, _now: float) -> VehicleState:
    return _evolve(state, {"fence_breached": message.breach_status != 0})


def _home_position(state: VehicleState, message: Message, now: float) -> VehicleState:
    if message.latitude == 0 and message.longitude == 0:
        return state
    position = (message.x, message.y, message.z)
    home = Home(
        now,
        message.latitude * 1e-7,
        message.longitude * 1e-7,
        message.altitude * 1e-3,
        position if _finite(position) else None,
    )
    return _evolve(state, {"home": home})


def _gps_global_origin(state: VehicleState, message: Message, now: float) -> VehicleState:
    if message.latitude == 0 and message.longitude == 0:
        return state
    origin = Origin(now, message.latitude * 1e-7, message.longitude * 1e-7, message.altitude * 1e-3)
    return _evolve(state, {"origin": origin})


def _gps_raw(state: VehicleState, message: Message, now: float) -> VehicleState:
    gps = GpsFix(
        now,
        message.fix_type,
        None if message.satellites_visible == 255 else message.satellites_visible,
        None if message.eph == _UINT16_MAX else message.eph / 100,
        None if message.epv == _UINT16_MAX else message.epv / 100,
    )
    return _evolve(state, {"gps": gps})


def _estimator(state: VehicleState, message: Message, now: float) -> VehicleState:
    # The constant-position flag says nothing more: ArduPilot clears these two with it, PX4's
    # simulator sets it at rest although its position is good.
    flags = message.flags
    estimator = Estimator(
        now,
        flags,
        bool(flags & _ESTIMATOR_HORIZONTAL_ABSOLUTE),
        bool(flags & _ESTIMATOR_HORIZONTAL_RELATIVE),
    )
    return _evolve(state, {"estimator": estimator})


def _autopilot_version(state: VehicleState, message: Message, _now: float) -> VehicleState:
    version = message.flight_sw_version
    changes: dict[str, Any] = {"capabilities": message.capabilities}
    if not version:
        return _evolve(state, changes)
    suffix = _FIRMWARE_TYPES.get(version & 0xFF, "-dev")
    changes["firmware_version"] = (
        f"{version >> 24 & 0xFF}.{version >> 16 & 0xFF}.{version >> 8 & 0xFF}{suffix}"
    )
    return _evolve(state, changes)


def _status_text(state: VehicleState, message: Message, now: float) -> VehicleState:
    texts = add_chunk(
        expire(state.texts, now),
        severity=message.severity,
        text=message.text,
        text_id=message.id,
        chunk=message.chunk_seq,
        sequence=message._header.seq,
        now=now,
    )
    return state if texts is state.texts else _evolve(state, {"texts": texts})


def _finite(vector: Vector3) -> bool:
    return math.isfinite(vector[0] + vector[1] + vector[2])


def _fraction(percent: int) -> float | None:
    return percent / 100 if 0 <= percent <= 100 else None


_Reducer = Callable[[VehicleState, Message, float], VehicleState]
_REDUCERS: dict[type, _Reducer] = {
    mavlink.MAVLink_heartbeat_message: _heartbeat,
    mavlink.MAVLink_current_mode_message: _current_mode,
    mavlink.MAVLink_system_time_message: _system_time,
    mavlink.MAVLink_global_position_int_message: _global_position,
    mavlink.MAVLink_local_position_ned_message: _local_position,
    mavlink.MAVLink_attitude_message: _attitude,
    mavlink.MAVLink_battery_status_message: _battery_status,
    mavlink.MAVLink_sys_status_message: _sys_status,
    mavlink.MAVLink_extended_sys_state_message: _extended_sys_state,
    mavlink.MAVLink_fence_status_message: _fence_status,
    mavlink.MAVLink_home_position_message: _home_position,
    mavlink.MAVLink_gps_global_origin_message: _gps_global_origin,
    mavlink.MAVLink_gps_raw_int_message: _gps_raw,
    mavlink.MAVLink_ekf_status_report_message: _estimator,
    mavlink.MAVLink_estimator_status_message: _estimator,
    mavlink.MAVLink_autopilot_version_message: _autopilot_version,
    mavlink.MAVLink_statustext_message: _status_text,
}
_FAILSAFE_EVIDENCE = frozenset(
    {_heartbeat, _current_mode, _sys_status, _fence_status, _status_text, _battery_status}
)
