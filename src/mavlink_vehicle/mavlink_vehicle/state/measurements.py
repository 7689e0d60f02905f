"""Measurements of position and attitude, made of the fields of their messages in wire order.

They come more often than anything else, and without pymavlink's objects where nobody needs those:
the reducer and `protocols.direct_measurements` take the changes of the state from here.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from operator import attrgetter
from typing import Any, NamedTuple, TypeAlias

from mavlink_vehicle.codec import Message, mavlink
from mavlink_vehicle.positions.frames import normalize_angle
from mavlink_vehicle.state.telemetry import Attitude, GlobalPosition, LocalPosition
from mavlink_vehicle.state.vehicle_state import Changes, VehicleState, shows_ground

Values: TypeAlias = tuple[Any, ...]
"""The fields of a message in wire order."""

_UINT16_MAX = 0xFFFF
_INT32_MAX = 0x7FFFFFFF
_CENTIDEGREE = math.radians(0.01)
# Does what a named tuple's own constructor does, without its Python: it runs for every position.
_make: Callable[..., Any] = tuple.__new__


def global_position(
    now: float,
    time_boot_ms: int,
    latitude: int,
    longitude: int,
    altitude_mm: int,
    relative_altitude_mm: int,
    north_cm_s: int,
    east_cm_s: int,
    down_cm_s: int,
    heading: int,
) -> GlobalPosition | None:
    """Return what GLOBAL_POSITION_INT says; None while the vehicle has no position.

    Args:
        now: when it came, in seconds.
        time_boot_ms: the vehicle's time of it.
        latitude: in 1e-7 degrees.
        longitude: in 1e-7 degrees.
        altitude_mm: above mean sea level.
        relative_altitude_mm: above home.
        north_cm_s: ground velocity.
        east_cm_s: ground velocity.
        down_cm_s: ground velocity.
        heading: in centidegrees; 65535 when unknown.
    """
    if latitude == 0 == longitude or latitude == _INT32_MAX or longitude == _INT32_MAX:
        return None
    values = (
        now,
        time_boot_ms,
        latitude * 1e-7,
        longitude * 1e-7,
        altitude_mm * 1e-3,
        relative_altitude_mm * 1e-3,
        (north_cm_s * 0.01, east_cm_s * 0.01, down_cm_s * 0.01),
        None if heading == _UINT16_MAX else normalize_angle(heading * _CENTIDEGREE),
    )
    position: GlobalPosition = _make(GlobalPosition, values)
    return position


def local_position(
    now: float,
    time_boot_ms: int,
    north_m: float,
    east_m: float,
    down_m: float,
    north_m_s: float,
    east_m_s: float,
    down_m_s: float,
) -> LocalPosition | None:
    """Return what LOCAL_POSITION_NED says; None if that is not a number."""
    if not math.isfinite(north_m + east_m + down_m + north_m_s + east_m_s + down_m_s):
        return None
    values = (now, time_boot_ms, (north_m, east_m, down_m), (north_m_s, east_m_s, down_m_s))
    position: LocalPosition = _make(LocalPosition, values)
    return position


def attitude(
    now: float,
    time_boot_ms: int,
    roll_rad: float,
    pitch_rad: float,
    yaw_ned_rad: float,
    roll_rad_s: float,
    pitch_rad_s: float,
    yaw_rad_s: float,
) -> Attitude | None:
    """Return what ATTITUDE says; None if that is not a number."""
    if not math.isfinite(roll_rad + pitch_rad + yaw_ned_rad + roll_rad_s + pitch_rad_s + yaw_rad_s):
        return None
    yaw_ned_rad = normalize_angle(yaw_ned_rad)
    rates = (roll_rad_s, pitch_rad_s, yaw_rad_s)
    made: Attitude = _make(Attitude, (now, time_boot_ms, roll_rad, pitch_rad, yaw_ned_rad, rates))
    return made


class Measurement(NamedTuple):
    """A message that holds nothing but a measurement.

    Attributes:
        number: of the message.
        values: reads the fields of a message object.
        unpack: reads the fields from a frame, where the payload begins.
        time_index: place of the time since boot among the fields; -1: it has none.
        changes: returns the changes of a state by the fields, at a time in seconds, but for the
            time since boot; None if it is no mere measurement.
    """

    number: int
    values: Callable[[Message], Values]
    unpack: Callable[[bytes, int], Values]
    time_index: int
    changes: Callable[[VehicleState, float, Values], Changes | None]


def global_position_changes(state: VehicleState, now: float, values: Values) -> Changes:
    """Return the changes by GLOBAL_POSITION_INT: the position, at rest also the ground's height."""
    position = global_position(now, *values)
    if position is not None and shows_ground(state, state.ground_altitude_amsl_m, now):
        ground_m = position.altitude_amsl_m
        return {"global_position": position, "ground_altitude_amsl_m": ground_m}
    return {"global_position": position}


def local_position_changes(state: VehicleState, now: float, values: Values) -> Changes:
    """Return the changes by LOCAL_POSITION_NED: the position, at rest also the ground's height."""
    position = local_position(now, *values)
    if position is not None and shows_ground(state, state.ground_down_m, now):
        return {"local_position": position, "ground_down_m": position.position_ned_m[2]}
    return {"local_position": position}


def attitude_changes(_: VehicleState, now: float, values: Values) -> Changes:
    """Return the change by ATTITUDE."""
    return {"attitude": attitude(now, *values)}


def _time_changes(_state: VehicleState, _now: float, _values: Values) -> Changes:
    return {}


def _landed_changes(state: VehicleState, _: float, values: Values) -> Changes | None:
    return {} if values[_LANDED_STATE] == state.landed_state else None


def measurement(
    message: type[Message], changes: Callable[[VehicleState, float, Values], Changes | None]
) -> Measurement:
    """Return how a message is taken; `changes` is that of a `Measurement`."""
    names = message.ordered_fieldnames
    time_index = names.index("time_boot_ms") if "time_boot_ms" in names else -1
    unpack = message.unpacker.unpack_from
    return Measurement(message.id, attrgetter(*names), unpack, time_index, changes)


_EXTENDED_SYS_STATE = mavlink.MAVLink_extended_sys_state_message
_LANDED_STATE = _EXTENDED_SYS_STATE.ordered_fieldnames.index("landed_state")
GLOBAL_POSITION = measurement(mavlink.MAVLink_global_position_int_message, global_position_changes)
LOCAL_POSITION = measurement(mavlink.MAVLink_local_position_ned_message, local_position_changes)
ATTITUDE = measurement(mavlink.MAVLink_attitude_message, attitude_changes)
MEASUREMENTS: dict[type[Message], Measurement] = {
    mavlink.MAVLink_global_position_int_message: GLOBAL_POSITION,
    mavlink.MAVLink_local_position_ned_message: LOCAL_POSITION,
    mavlink.MAVLink_attitude_message: ATTITUDE,
    mavlink.MAVLink_system_time_message: measurement(
        mavlink.MAVLink_system_time_message, _time_changes
    ),
    # While the landed state stays, it says nothing.
    _EXTENDED_SYS_STATE: measurement(_EXTENDED_SYS_STATE, _landed_changes),
}
"""The messages that come most often, by class."""
