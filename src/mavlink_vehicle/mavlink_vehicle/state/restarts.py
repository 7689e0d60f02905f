"""Detects restarts of the autopilot by its time since boot."""

from __future__ import annotations

from typing import Any

from mavlink_vehicle.events import LandedState
from mavlink_vehicle.state.telemetry import Attitude, GlobalPosition, LocalPosition
from mavlink_vehicle.state.vehicle_state import VehicleState
from mavlink_vehicle.state.warning_signs import NO_SIGNS

REORDER_LIMIT_MS = 3000
"""Time since boot going back by less is a late packet; by more, a restart."""

_ANNOUNCEMENT_S = 60.0
_UINT32 = 1 << 32
_WRAP_MARGIN_MS = 60_000

_set_attributes = VehicleState.__dict__["__dict__"].__set__

VOID_AFTER_RESTART: dict[str, Any] = {
    "landed_state": LandedState.UNDEFINED,
    "global_position": None,
    "local_position": None,
    "attitude": None,
    "home": None,
    "origin": None,
    "gps": None,
    "estimator": None,
    "mission": None,
    "ground_altitude_amsl_m": None,
    "ground_down_m": None,
    "sensors_health": None,
    "prearm_ok": None,
    "intended_mode": 0,
    "fence_breached": False,
    "radio_ok": None,
    "signs": NO_SIGNS,
    "failsafe": None,
    "terrain_ready": None,
}


def evolve(state: VehicleState, changes: dict[str, Any]) -> VehicleState:
    """Do what dataclasses.replace does, several times faster: this runs for every message."""
    if not changes:
        return state
    new = object.__new__(VehicleState)
    _set_attributes(new, state.__dict__ | changes)
    return new


def boot_changes(state: VehicleState, time_boot_ms: int, now: float) -> dict[str, Any]:
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
        **VOID_AFTER_RESTART,
        "boot_count": state.boot_count + (0 if known else 1),
        "boot_time_ms": time_boot_ms,
        "boot_announced_s": None,
    }


def is_late(part: GlobalPosition | LocalPosition | Attitude | None, time_boot_ms: int) -> bool:
    """Return whether a sample is older than the one that is there."""
    return part is not None and 0 < part.time_boot_ms - time_boot_ms < REORDER_LIMIT_MS
