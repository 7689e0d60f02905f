"""Remembers since when the vehicle shows that something is wrong. Pure.

Each sign is a change for the worse while the vehicle was watched: what was never well, as a PX4
without a radio says all the time of its receiver, is no sign of anything that has happened.
"""

from __future__ import annotations

from mavlink_vehicle.codec import mavlink
from mavlink_vehicle.state.batteries import charge_rank
from mavlink_vehicle.state.vehicle_state import VehicleState
from mavlink_vehicle.state.warning_signs import Signs

_FIX_3D = mavlink.GPS_FIX_TYPE_3D_FIX
_RADIO = mavlink.MAV_SYS_STATUS_SENSOR_RC_RECEIVER


def radio_ok(enabled: int, health: int) -> bool | None:
    """Return what SYS_STATUS says of the radio's receiver; None: it is not looked at."""
    return bool(health & _RADIO) if enabled & _RADIO else None


def follow(before: VehicleState, after: VehicleState, now: float) -> Signs:
    """Return the signs after a change of the state; the same object when none has changed."""
    old = before.signs
    if _shown(before) == _shown(after):
        return old
    new = Signs(
        _since(old.fence_s, not before.fence_breached, not after.fence_breached, now),
        _battery(before, after, now),
        _since(old.radio_s, before.radio_ok, after.radio_ok, now),
        _since(old.fix_s, _has_fix(before), _has_fix(after), now),
        _since(old.estimator_s, _has_position(before), _has_position(after), now),
        old.stream_s,
    )
    return old if new == old else new


def _shown(state: VehicleState) -> tuple[bool | int | None, ...]:
    """Return all that a sign can begin or end by; while it is the same, all signs are."""
    return (
        state.fence_breached,
        charge_rank(state.battery),
        state.radio_ok,
        _has_fix(state),
        _has_position(state),
    )


def _since(since_s: float | None, was_ok: bool | None, ok: bool | None, now: float) -> float | None:
    if ok is not False:
        return None
    return now if since_s is None and was_ok else since_s


def _battery(before: VehicleState, after: VehicleState, now: float) -> float | None:
    was, rank = charge_rank(before.battery), charge_rank(after.battery)
    if rank == 0:
        return None
    return now if rank > was else before.signs.battery_s


def _has_fix(state: VehicleState) -> bool | None:
    return None if state.gps is None else state.gps.fix_type >= _FIX_3D


def _has_position(state: VehicleState) -> bool | None:
    return None if state.estimator is None else state.estimator.horizontal_position_ok
