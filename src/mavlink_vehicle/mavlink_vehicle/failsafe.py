"""Whether the autopilot is in a failsafe, and against what. Pure.

A failsafe is in force while the vehicle is armed and its HEARTBEAT says CRITICAL or EMERGENCY
(both firmwares), while a fence is breached (ArduPilot stays ACTIVE then), or while PX4 flies
another mode than the one that was chosen (CURRENT_MODE.intended_custom_mode). What it is about
is told by the texts, and where there is none by the other evidence.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from mavlink_vehicle.codec import mavlink
from mavlink_vehicle.events import FailsafeKind

if TYPE_CHECKING:
    from mavlink_vehicle.vehicle_state import VehicleState

TEXT_AGE_S = 3.0
"""A text may come this long before the HEARTBEAT that shows the failsafe."""

_CRITICAL = (mavlink.MAV_STATE_CRITICAL, mavlink.MAV_STATE_EMERGENCY)
_CHARGE_LOW = (
    mavlink.MAV_BATTERY_CHARGE_STATE_LOW,
    mavlink.MAV_BATTERY_CHARGE_STATE_CRITICAL,
    mavlink.MAV_BATTERY_CHARGE_STATE_EMERGENCY,
)
_WARNING = mavlink.MAV_SEVERITY_WARNING
_NOTHING_BEGINS = ("prearm", "arm:", "cleared", "regained", "recovered")

# The words of ArduPilot (events.cpp, ekf_check.cpp, AC_Fence.cpp, AP_BattMonitor.cpp) and PX4
# (Commander.cpp, its checks and navigator); the first that is found counts.
_WORDS: tuple[tuple[str, FailsafeKind], ...] = (
    ("battery failsafe", FailsafeKind.BATTERY),
    ("low battery", FailsafeKind.BATTERY),
    ("critical battery", FailsafeKind.BATTERY),
    ("emergency battery", FailsafeKind.BATTERY),
    ("gcs failsafe", FailsafeKind.GCS),
    ("connection to ground station lost", FailsafeKind.GCS),
    ("radio failsafe", FailsafeKind.RC),
    ("throttle failsafe", FailsafeKind.RC),
    ("manual control lost", FailsafeKind.RC),
    ("ekf failsafe", FailsafeKind.GPS),
    ("ekf variance", FailsafeKind.GPS),
    ("gps failsafe", FailsafeKind.GPS),
    ("gps glitch", FailsafeKind.GPS),
    ("fence breach", FailsafeKind.FENCE),
    ("geofence", FailsafeKind.FENCE),
    ("offboard", FailsafeKind.OFFBOARD),
)


class Failsafe(NamedTuple):
    """A failsafe in force.

    Attributes:
        since_s: when it was first seen.
        kind: what it is about, as far as it is known by now.
        text: the autopilot's words, or what else shows it.
    """

    since_s: float
    kind: FailsafeKind
    text: str


def assess(state: VehicleState, now: float) -> Failsafe | None:
    """Return the failsafe that is in force, with what was known of it before."""
    if not _in_force(state):
        return None
    last = state.failsafe
    since_s = now if last is None else last.since_s
    told = _told(state, since_s - TEXT_AGE_S)
    if told is not None:
        kind, text = told
    elif last is not None and last.kind is not FailsafeKind.OTHER:
        return last
    else:
        kind, text = _shown(state)
    new = Failsafe(since_s, kind, text)
    return last if new == last else new


def _in_force(state: VehicleState) -> bool:
    return state.armed and (
        state.system_status in _CRITICAL or state.fence_breached or _another_mode(state)
    )


def _another_mode(state: VehicleState) -> bool:
    return state.intended_mode not in (0, state.custom_mode)


def _told(state: VehicleState, from_s: float) -> tuple[FailsafeKind, str] | None:
    """Return what the latest of the autopilot's texts since then says."""
    for text in reversed(state.status_texts):
        if text.time_s < from_s:
            return None
        words = text.text.lower()
        if text.severity > _WARNING and "lost" not in words and "breached" not in words:
            continue
        if any(word in words for word in _NOTHING_BEGINS):
            continue
        for word, kind in _WORDS:
            if word in words or _breached(words, kind):
                return kind, text.text
    return None


def _breached(words: str, kind: FailsafeKind) -> bool:
    """Tell whether it is ArduPilot's "<which> fence breached", or "fence(s) breached"."""
    return kind is FailsafeKind.FENCE and "fence" in words and "breached" in words


def _shown(state: VehicleState) -> tuple[FailsafeKind, str]:
    """Return what else is known to be wrong."""
    if state.fence_breached:
        return FailsafeKind.FENCE, "a fence is breached"
    battery = state.battery
    if battery is not None and battery.charge_state in _CHARGE_LOW:
        return FailsafeKind.BATTERY, "the battery's charge state is low"
    if state.estimator is not None and not state.estimator.horizontal_position_ok:
        return FailsafeKind.GPS, "there is no horizontal position"
    if _another_mode(state) and state.intended_mode == OFFBOARD_MODE:
        return FailsafeKind.OFFBOARD, "OFFBOARD is wanted but another mode is flown"
    return FailsafeKind.OTHER, "the autopilot says that its state is critical"


OFFBOARD_MODE = 6 << 16
"""PX4's custom_mode; no other firmware sends `intended_custom_mode`."""
