"""The vehicle's state: a frozen record and a pure `reduce`.

Only messages of the vehicle's own system and autopilot component are taken in; the
HEARTBEATs of ground stations, gimbals and other vehicles on the same link change nothing.
MAVLink's "unknown" markers (65535, -1, INT32_MAX, NaN) become None, never numbers. How old a
value may be is the reader's decision: each part carries the time `time_s` at which it came.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TypeAlias

from mavlink_vehicle.codec import Message, mavlink
from mavlink_vehicle.mission_items import fence_id, mission_id, rally_id
from mavlink_vehicle.positions.frames import Vector3
from mavlink_vehicle.state import measurements, telemetry
from mavlink_vehicle.state.failsafe import assess
from mavlink_vehicle.state.restarts import follow_clock, is_late
from mavlink_vehicle.state.signs import follow
from mavlink_vehicle.state.status_reducers import (
    autopilot_version,
    battery_status,
    current_mode,
    extended_sys_state,
    fence_status,
    heartbeat,
    status_text,
    sys_status,
)
from mavlink_vehicle.state.vehicle_state import VehicleState, evolve

__all__ = ["VehicleState", "reduce"]

_UINT16_MAX = 0xFFFF
_FIX_2D, _FIX_3D = 2, 3
_GPS_TIME_OFF_MS = 2000
_REACHED_MAX = 2000
# The same bit in EKF_STATUS_REPORT (ArduPilot) and ESTIMATOR_STATUS (PX4).
_ESTIMATOR_HORIZONTAL_ABSOLUTE = 0x0010
_Sample: TypeAlias = telemetry.GlobalPosition | telemetry.LocalPosition | telemetry.Attitude
_SampleMessage: TypeAlias = (
    mavlink.MAVLink_global_position_int_message
    | mavlink.MAVLink_local_position_ned_message
    | mavlink.MAVLink_attitude_message
)
_EkfStatus: TypeAlias = mavlink.MAVLink_ekf_status_report_message
_EstimatorStatus: TypeAlias = mavlink.MAVLink_estimator_status_message


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
    if header.srcSystem != state.system_id and not (state.system_id == 0 and reducer is heartbeat):
        return state
    after = reducer(state, message, now)
    if reducer in _FAILSAFE_EVIDENCE and after is not state:
        after = _judged(state, after, now)
    return after


def _judged(before: VehicleState, after: VehicleState, now: float) -> VehicleState:
    """Return the state with what it says of failures."""
    if after.boot_count == before.boot_count:
        signs = follow(before, after, now)
        if signs is not after.signs:
            after = evolve(after, {"signs": signs})
    failsafe = assess(after, now)
    return after if failsafe is after.failsafe else evolve(after, {"failsafe": failsafe})


def _system_time(
    state: VehicleState, message: mavlink.MAVLink_system_time_message, now: float
) -> VehicleState:
    changes = follow_clock(state, message.__class__, message.time_boot_ms, now).changes
    return evolve(state, changes)


def _global_position(
    state: VehicleState, message: mavlink.MAVLink_global_position_int_message, now: float
) -> VehicleState:
    return _measured(state, state.global_position, message, measurements.GLOBAL_POSITION, now)


def _local_position(
    state: VehicleState, message: mavlink.MAVLink_local_position_ned_message, now: float
) -> VehicleState:
    return _measured(state, state.local_position, message, measurements.LOCAL_POSITION, now)


def _attitude(
    state: VehicleState, message: mavlink.MAVLink_attitude_message, now: float
) -> VehicleState:
    return _measured(state, state.attitude, message, measurements.ATTITUDE, now)


def _measured(
    state: VehicleState,
    before: _Sample | None,
    message: _SampleMessage,
    measurement: measurements.Measurement,
    now: float,
) -> VehicleState:
    """Return the state with a measurement, unless it is older than the one before."""
    clock = follow_clock(state, message.__class__, message.time_boot_ms, now)
    if is_late(before, clock.time_ms) and "boot_count" not in clock.changes:
        return state
    values = (clock.time_ms, *measurement.values(message)[1:])
    return evolve(state, clock.changes | (measurement.changes(state, now, values) or {}))


def _home_position(
    state: VehicleState, message: mavlink.MAVLink_home_position_message, now: float
) -> VehicleState:
    if message.latitude == 0 and message.longitude == 0:
        return state
    position = (message.x, message.y, message.z)
    home = telemetry.Home(
        now,
        message.latitude * 1e-7,
        message.longitude * 1e-7,
        message.altitude * 1e-3,
        position if _finite(position) else None,
    )
    return evolve(state, {"home": home})


def _gps_global_origin(
    state: VehicleState, message: mavlink.MAVLink_gps_global_origin_message, now: float
) -> VehicleState:
    if message.latitude == 0 and message.longitude == 0:
        return state
    origin = telemetry.Origin(
        now, message.latitude * 1e-7, message.longitude * 1e-7, message.altitude * 1e-3
    )
    return evolve(state, {"origin": origin})


def _gps_raw(
    state: VehicleState, message: mavlink.MAVLink_gps_raw_int_message, now: float
) -> VehicleState:
    gps = telemetry.GpsFix(
        now,
        message.fix_type,
        None if message.satellites_visible == 255 else message.satellites_visible,
        None if message.eph == _UINT16_MAX else message.eph / 100,
        None if message.epv == _UINT16_MAX else message.epv / 100,
        None if message.fix_type < _FIX_2D else message.lat / 1e7,
        None if message.fix_type < _FIX_2D else message.lon / 1e7,
        # Extensions of the message; 0 is what an autopilot without them sends.
        message.alt_ellipsoid / 1000 if message.alt_ellipsoid else None,
        message.h_acc / 1000 if message.h_acc else None,
        message.v_acc / 1000 if message.v_acc else None,
        message.vel_acc / 1000 if message.vel_acc else None,
        None if message.fix_type < _FIX_3D else message.alt / 1000,
        _gps_time_boot_ms(state, message.time_usec),
    )
    return evolve(state, {"gps": gps})


def _gps_time_boot_ms(state: VehicleState, time_usec: int) -> int | None:
    """Return the time since boot.

    The field may count from 1970 or not be set; after a loss it is the time of the last fix.
    """
    time_ms, newest_ms = time_usec // 1000, state.boot_time_ms
    if not time_usec or newest_ms is None or abs(time_ms - newest_ms) > _GPS_TIME_OFF_MS:
        return None
    return int(time_ms)


def _estimator(
    state: VehicleState, message: _EkfStatus | _EstimatorStatus, now: float
) -> VehicleState:
    # The constant-position flag says nothing more: ArduPilot then clears that of the absolute
    # position, PX4's simulator sets it at rest although its position is good.
    flags = message.flags
    if isinstance(message, _EkfStatus):  # it has the root of the ratio, and no accuracies
        ratio, horizontal_m, vertical_m = message.pos_horiz_variance, 0.0, 0.0
    else:
        ratio = message.pos_horiz_ratio
        horizontal_m, vertical_m = message.pos_horiz_accuracy, message.pos_vert_accuracy
    estimator = telemetry.EstimatorReport(
        now,
        flags,
        bool(flags & _ESTIMATOR_HORIZONTAL_ABSOLUTE),
        ratio > 1.0,
        _accuracy_m(horizontal_m),
        _accuracy_m(vertical_m),
    )
    return evolve(state, {"estimator": estimator, "estimator_reported": True})


def _accuracy_m(accuracy_m: float) -> float | None:
    return accuracy_m if math.isfinite(accuracy_m) and accuracy_m > 0.0 else None


def _mission_current(
    state: VehicleState, message: mavlink.MAVLink_mission_current_message, now: float
) -> VehicleState:
    before = state.mission
    # Before the extension of 2023 there is only `seq`, and the rest reads as 0.
    is_reported = bool(message.total or message.mission_state)
    total = 0 if message.total == _UINT16_MAX else message.total  # PX4: there is no mission
    mission = telemetry.MissionProgress(
        now,
        message.seq,
        total if is_reported else None,
        message.mission_state,
        mission_id(message),
        () if before is None else before.reached,
        fence_id(message),
        rally_id(message),
    )
    return evolve(state, {"mission": mission})


def _mission_item_reached(
    state: VehicleState, message: mavlink.MAVLink_mission_item_reached_message, _now: float
) -> VehicleState:
    before = state.mission
    if before is None or before.reached[-1:] == (message.seq,):
        return state
    reached = (*before.reached, message.seq)[-_REACHED_MAX:]
    return evolve(state, {"mission": before._replace(reached=reached)})


def _finite(vector: Vector3) -> bool:
    return math.isfinite(vector[0] + vector[1] + vector[2])


def _terrain_report(
    state: VehicleState, message: mavlink.MAVLink_terrain_report_message, _now: float
) -> VehicleState:
    # Heights above ground without terrain data are heights above nothing: an ArduCopter sinks
    # until it hits the ground (observed on its own simulator).
    ready = message.spacing > 0 and message.loaded > 0 and message.pending == 0
    return state if ready == state.terrain_ready else evolve(state, {"terrain_ready": ready})


def _wind(state: VehicleState, message: mavlink.MAVLink_wind_message, _now: float) -> VehicleState:
    """Process ArduPilot's WIND, which has the direction that it comes from."""
    if not math.isfinite(message.direction):
        return state
    from_rad = math.radians(message.direction)
    towards = (-math.cos(from_rad), -math.sin(from_rad))
    wind = (message.speed * towards[0], message.speed * towards[1], message.speed_z)
    return evolve(state, {"wind_ned_m_s": wind}) if _finite(wind) else state


def _wind_cov(
    state: VehicleState, message: mavlink.MAVLink_wind_cov_message, _now: float
) -> VehicleState:
    """Process PX4's WIND_COV, a velocity."""
    up_or_down = message.wind_z if math.isfinite(message.wind_z) else 0.0
    wind = (message.wind_x, message.wind_y, up_or_down)
    return evolve(state, {"wind_ned_m_s": wind}) if _finite(wind) else state


# Each takes the state, a message of its class and the time in seconds.
_REDUCERS: dict[type[Message], Callable[..., VehicleState]] = {
    mavlink.MAVLink_system_time_message: _system_time,
    mavlink.MAVLink_global_position_int_message: _global_position,
    mavlink.MAVLink_local_position_ned_message: _local_position,
    mavlink.MAVLink_attitude_message: _attitude,
    mavlink.MAVLink_heartbeat_message: heartbeat,
    mavlink.MAVLink_current_mode_message: current_mode,
    mavlink.MAVLink_battery_status_message: battery_status,
    mavlink.MAVLink_sys_status_message: sys_status,
    mavlink.MAVLink_extended_sys_state_message: extended_sys_state,
    mavlink.MAVLink_fence_status_message: fence_status,
    mavlink.MAVLink_home_position_message: _home_position,
    mavlink.MAVLink_terrain_report_message: _terrain_report,
    mavlink.MAVLink_gps_global_origin_message: _gps_global_origin,
    mavlink.MAVLink_gps_raw_int_message: _gps_raw,
    mavlink.MAVLink_ekf_status_report_message: _estimator,
    mavlink.MAVLink_estimator_status_message: _estimator,
    mavlink.MAVLink_mission_current_message: _mission_current,
    mavlink.MAVLink_mission_item_reached_message: _mission_item_reached,
    mavlink.MAVLink_wind_message: _wind,
    mavlink.MAVLink_wind_cov_message: _wind_cov,
    mavlink.MAVLink_autopilot_version_message: autopilot_version,
    mavlink.MAVLink_statustext_message: status_text,
}
_FAILSAFE_EVIDENCE = frozenset(
    {
        heartbeat,
        current_mode,
        sys_status,
        fence_status,
        status_text,
        battery_status,
        _gps_raw,
        _estimator,
    }
)
