"""Reducers of the vehicle status: HEARTBEAT, battery and other reports."""

from __future__ import annotations

from mavlink_vehicle.codec import Message, is_mavlink_1, mavlink
from mavlink_vehicle.events import LandedState
from mavlink_vehicle.state.batteries import deciding, fraction, read_battery, with_battery
from mavlink_vehicle.state.identity import is_vehicle
from mavlink_vehicle.state.restarts import beat_changes
from mavlink_vehicle.state.signs import radio_ok
from mavlink_vehicle.state.status_text import add_chunk, expire
from mavlink_vehicle.state.telemetry import Battery
from mavlink_vehicle.state.vehicle_state import Changes, VehicleState, evolve, with_rest

_BOOT = mavlink.MAV_STATE_BOOT
_UINT16_MAX = 0xFFFF
_ARMED_FLAG = mavlink.MAV_MODE_FLAG_SAFETY_ARMED
_PREARM_CHECK = mavlink.MAV_SYS_STATUS_PREARM_CHECK
_GEOFENCE = mavlink.MAV_SYS_STATUS_GEOFENCE
# Stations that want FENCE_STATUS ask for it at least once a second.
_FENCE_SILENCE_S = 3.0
_OFFICIAL = 255
_FIRMWARE_TYPES = {192: "-rc", 128: "-beta", 64: "-alpha", 0: "-dev"}
"""FIRMWARE_VERSION_TYPE from the highest on; a number above one is that of the release."""


def heartbeat(
    state: VehicleState, message: mavlink.MAVLink_heartbeat_message, now: float
) -> VehicleState:
    """Process mode, arming and status; a restart may be announced by it."""
    if not is_vehicle(message.autopilot, message.type):
        return state
    header = message._header
    changes: Changes = {
        "system_id": header.srcSystem,
        "component_id": header.srcComponent,
        "autopilot": message.autopilot,
        "vehicle_type": message.type,
        "last_heartbeat_s": now,
        "heartbeats_1": state.heartbeats_1 + 1 if is_mavlink_1(message) else 0,
        "armed": bool(message.base_mode & _ARMED_FLAG),
        "armed_heard": bool(message.base_mode & _ARMED_FLAG),
        "base_mode": message.base_mode,
        "custom_mode": message.custom_mode,
        "heartbeat_mode": message.custom_mode,
        "system_status": message.system_status,
        "texts": expire(state.texts, now),
    }
    if message.custom_mode != state.custom_mode:
        changes["intended_mode"] = 0  # what was intended is known for the mode before only
    changes |= beat_changes(
        state,
        armed=bool(message.base_mode & _ARMED_FLAG),
        custom_mode=message.custom_mode,
        booting=message.system_status == _BOOT,
        now=now,
    )
    return with_rest(evolve(state, changes), now)


def with_late_beat(state: VehicleState, message: Message) -> VehicleState:
    """Return the state after a HEARTBEAT that by its sequence number is older than the last one.

    It may be that of another sender with the same ids, which has numbers of its own.
    """
    if not isinstance(message, mavlink.MAVLink_heartbeat_message):
        return state
    armed = bool(message.base_mode & _ARMED_FLAG)
    return state if armed is state.armed_heard else evolve(state, {"armed_heard": armed})


def current_mode(
    state: VehicleState, message: mavlink.MAVLink_current_mode_message, _now: float
) -> VehicleState:
    """PX4's HEARTBEAT comes once a second whatever happens; this one can be had more often."""
    changes: Changes = {
        "custom_mode": message.custom_mode,
        "intended_mode": message.intended_custom_mode,
    }
    if changes["custom_mode"] == state.custom_mode and (
        changes["intended_mode"] == state.intended_mode
    ):
        return state
    return evolve(state, changes)


def battery_status(
    state: VehicleState, message: mavlink.MAVLink_battery_status_message, now: float
) -> VehicleState:
    """Process a battery, of several perhaps."""
    batteries = with_battery(state, read_battery(message, state.autopilot, now), now)
    battery = deciding(batteries, state.battery_summary, now)
    return evolve(state, {"batteries": batteries, "battery": battery})


def sys_status(
    state: VehicleState, message: mavlink.MAVLink_sys_status_message, now: float
) -> VehicleState:
    """Process health and fence, and the battery where BATTERY_STATUS does not report it."""
    health = message.onboard_control_sensors_health
    # PX4 sets the health bit of a check that it does not list as present.
    reports_prearm = state.autopilot == mavlink.MAV_AUTOPILOT_PX4 or bool(
        message.onboard_control_sensors_present & _PREARM_CHECK
    )
    changes: Changes = {
        "sensors_health": health,
        "prearm_ok": bool(health & _PREARM_CHECK) if reports_prearm else None,
    }
    enabled = message.onboard_control_sensors_enabled
    changes["radio_ok"] = radio_ok(enabled, health)
    if enabled & _GEOFENCE:
        changes["fence_breached"] = not health & _GEOFENCE
    elif state.fence_reported_s is None or now - state.fence_reported_s > _FENCE_SILENCE_S:
        # Switched off. An ArduPilot keeps the health bit of a breach then, and says no more of it;
        # with FENCE_ACTION 0 the fence is not enabled here either, but FENCE_STATUS continues.
        changes["fence_breached"] = False
    voltage_mv = message.voltage_battery
    changes["battery_summary"] = summary = Battery(
        now,
        fraction(message.battery_remaining),
        None if voltage_mv in (0, _UINT16_MAX) else voltage_mv * 1e-3,
        None if message.current_battery == -1 else message.current_battery * 0.01,
        from_summary=True,
    )
    battery = deciding(state.batteries, summary, now)
    if battery != state.battery:
        changes["battery"] = battery
    return evolve(state, changes)


def extended_sys_state(
    state: VehicleState, message: mavlink.MAVLink_extended_sys_state_message, now: float
) -> VehicleState:
    """Process the landed state."""
    try:
        landed = LandedState(message.landed_state)
    except ValueError:  # a state that a newer dialect may define
        landed = LandedState.UNDEFINED
    if landed is state.landed_state:
        return state
    return with_rest(evolve(state, {"landed_state": landed}), now)


def fence_status(
    state: VehicleState, message: mavlink.MAVLink_fence_status_message, now: float
) -> VehicleState:
    """Process whether a fence is breached; it comes only while a fence is enabled."""
    changes: Changes = {"fence_breached": message.breach_status != 0, "fence_reported_s": now}
    return evolve(state, changes)


def autopilot_version(
    state: VehicleState, message: mavlink.MAVLink_autopilot_version_message, _now: float
) -> VehicleState:
    """Process the firmware's version and what it can do."""
    version = message.flight_sw_version
    changes: Changes = {"capabilities": message.capabilities}
    if not version:
        return evolve(state, changes)
    suffix = _release(version & 0xFF)
    changes["firmware_version"] = (
        f"{version >> 24 & 0xFF}.{version >> 16 & 0xFF}.{version >> 8 & 0xFF}{suffix}"
    )
    return evolve(state, changes)


def _release(kind: int) -> str:
    """Return the suffix of a version, such as "-rc1"; empty for an official one."""
    if kind == _OFFICIAL:
        return ""
    base = next(base for base in _FIRMWARE_TYPES if kind >= base)
    number = kind - base if base else 0
    return f"{_FIRMWARE_TYPES[base]}{number or ''}"


def status_text(
    state: VehicleState, message: mavlink.MAVLink_statustext_message, now: float
) -> VehicleState:
    """Process a text, or a chunk of one."""
    texts = add_chunk(
        expire(state.texts, now),
        severity=message.severity,
        text=message.text,
        text_id=message.id,
        chunk=message.chunk_seq,
        sequence=message._header.seq,
        now=now,
        counts_from_0=state.autopilot == mavlink.MAV_AUTOPILOT_PX4,
    )
    return state if texts is state.texts else evolve(state, {"texts": texts})
