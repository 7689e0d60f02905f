"""Detects restarts of the autopilot by its time since boot and its HEARTBEAT.

One sign is not enough. A message whose time since boot is not set, or is that of another clock,
does not stop the clock that the other messages follow; a HEARTBEAT may be damaged. Two signs are:

- a clock that began lately, in two kinds of messages or in three of one kind, instead of the old
  one. It is believed at once after a silence or a disarming, else after a second of it alone;
- MAV_STATE_BOOT of a vehicle that was running, with such a clock, a silence of its clock, a
  disarming, another mode, or again (an ArduCopter sends its first two HEARTBEATs within 30 ms,
  recorded).

A clock that goes back but runs for longer than the vehicle was out of sight is no restart.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from mavlink_vehicle.events import LandedState
from mavlink_vehicle.state.telemetry import Attitude, GlobalPosition, LocalPosition
from mavlink_vehicle.state.vehicle_state import (
    REORDER_LIMIT_MS,
    Changes,
    ClockDoubt,
    RestartSigns,
    VehicleState,
)
from mavlink_vehicle.state.warning_signs import NO_SIGNS

_ANNOUNCEMENT_S = 60.0
_UINT32 = 1 << 32
_WRAP_MARGIN_MS = 60_000
# Simulators run this much faster than real time.
_SPEED_MAX = 20.0
# Of a clock that has just begun, beyond the time for which the old one was not heard.
_YOUNG_S = 10.0
_ALONE_S, _LISTENED_S = 1.0, 0.5
_SIGN_AGE_S = 10.0
_SAME_CLOCK_S = 3.0
_BOOT_AGAIN_S = 5.0
# A restarted clock is not followed by the old one: that must have been silent for this time.
_OLD_SILENT_S = 0.25
# No packet is late by this; and two clocks that are heard in turn are so at least this often.
_TWIN_APART_S, _TWIN_EVERY_S = 10.0, 3.0
_SAMPLES = ("global_position", "local_position", "attitude")

VOID_AFTER_RESTART: Changes = {
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
    "rests_s": None,
    "sensors_health": None,
    "prearm_ok": None,
    "intended_mode": 0,
    "fence_breached": False,
    "radio_ok": None,
    "signs": NO_SIGNS,
    "failsafe": None,
    "terrain_ready": None,
}


class BootTime(NamedTuple):
    """The time since boot of one message.

    Attributes:
        time_ms: by the clock of the vehicle that is followed, counted on beyond 32 bits; the
            newest known for a message of which it is not known.
        changes: what it changes of the state.
    """

    time_ms: int
    changes: Changes


def follow_clock(state: VehicleState, kind: type, time_boot_ms: int, now: float) -> BootTime:
    """Return the time since boot after a message; a restart discards earlier measurements.

    Args:
        state: what is known.
        kind: class of the message.
        time_boot_ms: as sent; 0 is not set.
        now: time in seconds.
    """
    last_ms, signs = state.boot_time_ms, state.restart_signs
    if time_boot_ms == 0:
        return BootTime(last_ms or 0, {})
    if last_ms is None:
        return _followed(time_boot_ms, now)
    unheard_s = max(now - state.boot_time_s, 0.0)
    longest_ms = REORDER_LIMIT_MS + 1000.0 * _SPEED_MAX * unheard_s
    ahead_ms = _ahead_ms(last_ms, time_boot_ms, longest_ms)
    if -REORDER_LIMIT_MS < ahead_ms < 0:
        return BootTime(last_ms + ahead_ms, {})
    if 0 <= ahead_ms <= longest_ms:
        clock = _followed(last_ms + ahead_ms, now)
        if signs.doubt is not None:
            signs = _taken_in_turn(signs, signs.doubt, kind, time_boot_ms, now)
            clock.changes["restart_signs"] = signs._replace(doubt=None, refuted_s=now)
        return clock
    doubt = _doubted(signs.doubt, kind, time_boot_ms, now)
    signs = signs._replace(doubt=doubt)
    if ahead_ms < 0 and _is_young(state, doubt, now):
        announced_s = state.boot_announced_s
        if announced_s is not None and now - announced_s < _ANNOUNCEMENT_S:
            return BootTime(time_boot_ms, _begun(state, 0, time_boot_ms, now))
        if _has_restarted(state, signs, now):
            return BootTime(time_boot_ms, _begun(state, 1, time_boot_ms, now))
    elif doubt.is_clock and (ahead_ms > 0 or now - doubt.since_s >= _ALONE_S):
        clock = _followed(time_boot_ms, now)  # set, not started again
        clock.changes["restart_signs"] = signs._replace(doubt=None)
        return BootTime(time_boot_ms, clock.changes | _moved(state, time_boot_ms - last_ms))
    return BootTime(last_ms, {"restart_signs": signs})


def _moved(state: VehicleState, shift_ms: int) -> Changes:
    """Return what another clock changes: the times of the samples that are there are by it, too."""
    parts = {name: getattr(state, name) for name in _SAMPLES}
    moved = {
        name: part._replace(time_boot_ms=part.time_boot_ms + shift_ms)
        for name, part in parts.items()
        if part is not None
    }
    return {**moved, "clock_count": state.clock_count + 1}


def beat_changes(
    state: VehicleState, *, armed: bool, custom_mode: int, booting: bool, now: float
) -> Changes:
    """Return the changes by a HEARTBEAT, which may be evidence of a restart.

    Args:
        state: before it.
        armed: as it says.
        custom_mode: as it says.
        booting: it says MAV_STATE_BOOT.
        now: time in seconds.
    """
    old = signs = state.restart_signs
    disarmed = state.armed and not armed
    if disarmed:
        signs = signs._replace(disarmed_s=now)
    if not booting:
        signs = signs._replace(booting_s=-math.inf)
    again = booting and now - signs.booting_s <= _BOOT_AGAIN_S
    begins = booting and not state.booting and now - signs.restarted_s > _BOOT_AGAIN_S
    if begins:
        signs = signs._replace(booting_s=now)
    silent = now - state.boot_time_s >= _ALONE_S
    other = disarmed or silent or custom_mode != state.custom_mode
    doubt = signs.doubt
    if again or (begins and other):
        return _begun(state, 1, None, now) | {"boot_announced_s": now}
    if doubt is not None and _is_young(state, doubt, now) and _has_restarted(state, signs, now):
        return _begun(state, 1, doubt.newest_ms, now)
    return {} if signs == old else {"restart_signs": signs}


def _followed(time_ms: int, now: float) -> BootTime:
    return BootTime(time_ms, {"boot_time_ms": time_ms, "boot_time_s": now})


def _ahead_ms(last_ms: int, time_boot_ms: int, longest_ms: float) -> int:
    """Return by how much a time is ahead of the last, which counts on after 49.7 days."""
    ahead_ms = time_boot_ms - last_ms % _UINT32
    if 0 <= ahead_ms + _UINT32 <= max(longest_ms, _WRAP_MARGIN_MS):
        return ahead_ms + _UINT32
    if ahead_ms - _UINT32 > -REORDER_LIMIT_MS:
        return ahead_ms - _UINT32
    return ahead_ms


def _taken_in_turn(
    signs: RestartSigns, doubt: ClockDoubt, kind: type, time_ms: int, now: float
) -> RestartSigns:
    """Return the signs after a message by the vehicle's clock, which another clock came before."""
    apart_s = abs(now - 1e-3 * time_ms - doubt.begun_s)
    if kind not in doubt.kinds or apart_s < _TWIN_APART_S:
        return signs
    before = signs.in_turn if now - signs.in_turn_s <= _TWIN_EVERY_S else 0
    return signs._replace(in_turn=before + 1, in_turn_s=now)


def _doubted(last: ClockDoubt | None, kind: type, time_ms: int, now: float) -> ClockDoubt:
    begun_s = now - 1e-3 * time_ms
    if last is None or abs(begun_s - last.begun_s) > _SAME_CLOCK_S:
        return ClockDoubt(now, now, begun_s, time_ms, frozenset({kind}), 1)
    # In a silence nothing shows which clock continues.
    silent_s = max(now - last.heard_s - _LISTENED_S, 0.0)
    return ClockDoubt(
        last.since_s + silent_s,
        now,
        begun_s,
        max(time_ms, last.newest_ms),
        last.kinds | {kind},
        last.messages + (time_ms > last.newest_ms),
    )


def _is_young(state: VehicleState, doubt: ClockDoubt, now: float) -> bool:
    """Whether the clock may have begun since the old one was heard last."""
    return 1e-3 * doubt.newest_ms <= _YOUNG_S + _SPEED_MAX * (now - state.boot_time_s)


def _has_restarted(state: VehicleState, signs: RestartSigns, now: float) -> bool:
    """Whether there is a second sign beside a clock that began lately."""
    doubt = signs.doubt
    if doubt is None:
        return False
    if now - signs.booting_s <= _SIGN_AGE_S:
        return True
    if not doubt.is_clock:
        return False
    # A vehicle that sends by two clocks is believed only once one of them has stopped.
    sure = now - signs.refuted_s > _SIGN_AGE_S
    unheard_s = now - state.boot_time_s
    disarmed = now - signs.disarmed_s <= _SIGN_AGE_S and unheard_s >= _OLD_SILENT_S
    silent = unheard_s >= _ALONE_S
    return now - doubt.since_s >= _ALONE_S or (sure and (disarmed or silent))


def _begun(state: VehicleState, boots: int, time_ms: int | None, now: float) -> Changes:
    """Return what a restart changes."""
    old = state.restart_signs
    signs = RestartSigns(in_turn=old.in_turn, in_turn_s=old.in_turn_s)
    changes = {
        **VOID_AFTER_RESTART,
        "boot_count": state.boot_count + boots,
        "clock_count": state.clock_count + 1,
        "boot_announced_s": None,
        "restart_signs": signs,
    }
    if time_ms is None:
        return changes
    changes["restart_signs"] = signs._replace(restarted_s=now)
    return changes | _followed(time_ms, now).changes


def is_late(part: GlobalPosition | LocalPosition | Attitude | None, time_boot_ms: int) -> bool:
    """Return whether a sample is older than the one that is there."""
    return part is not None and 0 < part.time_boot_ms - time_boot_ms < REORDER_LIMIT_MS
