"""Detects whether the autopilot is in a failsafe, and of which kind. Pure.

A failsafe is in force while the vehicle is armed and its HEARTBEAT says CRITICAL or EMERGENCY
(both firmwares), while a fence is breached (ArduPilot stays ACTIVE then), while an ArduPilot
reports a low charge state (ArduRover stays ACTIVE then), or while PX4 flies another mode than the
one that was chosen (CURRENT_MODE.intended_custom_mode). Its kind is that of the fault that began
last of those that the vehicle shows (:mod:`.signs`). Only where it shows none its words name the
kind: the loss of a ground station, and the fence of a PX4.
"""

from __future__ import annotations

from mavlink_vehicle.codec import mavlink
from mavlink_vehicle.events import FailsafeKind
from mavlink_vehicle.state.batteries import charge_rank
from mavlink_vehicle.state.status_text import StatusText
from mavlink_vehicle.state.vehicle_state import VehicleState
from mavlink_vehicle.state.warning_signs import Failsafe

TEXT_AGE_S = 3.0
"""A text may come this long before the HEARTBEAT that shows the failsafe."""
_SIGN_LATE_S = 2.0
"""A fault may show this long after its failsafe: EKF_STATUS_REPORT comes once a second."""
_SIGN_AGE_S = 30.0
"""A fault that has lasted longer without a failsafe is not the cause of this one."""
_STREAM_AGE_S = 3.0
"""PX4 acts on a lost stream after COM_OF_LOSS_T, 1 s; an older gap was another one."""

_CRITICAL = (mavlink.MAV_STATE_CRITICAL, mavlink.MAV_STATE_EMERGENCY)
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
)


def assess(state: VehicleState, now: float) -> Failsafe | None:
    """Return the failsafe that is in force, with what was known of it before."""
    if not _in_force(state):
        return None
    last = state.failsafe
    since_s = now if last is None else last.since_s
    shown = _shown(state, since_s)
    found = _kind_and_text(state, since_s - TEXT_AGE_S)
    if shown is not None:
        kind, text = shown
        if found is not None and found[0] is kind:
            text = found[1]
    elif found is not None:
        kind, text = found
    elif last is not None and last.kind is not FailsafeKind.OTHER:
        return last  # the fault has ended
    else:
        kind, text = FailsafeKind.OTHER, _unknown(state)
    new = Failsafe(since_s, kind, text)
    return last if new == last else new


def failsafe_words(state: VehicleState, failsafe: Failsafe | None, since_s: float) -> list[str]:
    """Return the autopilot's words about a failsafe: warnings, and those that name its kind."""
    kind = None if failsafe is None else failsafe.kind
    return [
        text.text
        for text in state.status_texts
        if text.time_s >= since_s - TEXT_AGE_S
        and not _begins_nothing(text)
        and (text.severity <= _WARNING or (_kind_of(text) is kind is not None))
    ]


def _in_force(state: VehicleState) -> bool:
    return state.armed and (
        state.system_status in _CRITICAL
        or state.fence_breached
        or _battery_failsafe(state)
        or _another_mode(state)
    )


def _battery_failsafe(state: VehicleState) -> bool:
    """Return whether ArduPilot's battery failsafe has begun.

    Its charge state is low from then on (AP_BattMonitor, `get_mavlink_charge_state`). PX4's is
    also low where it only warns.
    """
    ardupilot = state.autopilot == mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA
    return ardupilot and charge_rank(state.battery) > 0


def _another_mode(state: VehicleState) -> bool:
    return state.intended_mode not in (0, state.custom_mode)


def _shown(state: VehicleState, since_s: float) -> tuple[FailsafeKind, str] | None:
    """Return what began last of what is wrong, until the failsafe or shortly after it."""
    signs = state.signs
    found = [
        (began_s, kind, text)
        for began_s, kind, text in (
            (signs.fence_s, FailsafeKind.FENCE, "a fence is breached"),
            (signs.battery_s, FailsafeKind.BATTERY, "the battery reports a low charge state"),
            (signs.radio_s, FailsafeKind.RC, "the radio receiver is unhealthy"),
            (signs.fix_s, FailsafeKind.GPS, "the GPS has no 3D fix"),
            (signs.estimator_s, FailsafeKind.GPS, "there is no horizontal position"),
            (signs.stream_s, FailsafeKind.OFFBOARD, "the stream of setpoints had a gap"),
        )
        if began_s is not None
        and began_s <= since_s + _SIGN_LATE_S
        and since_s - began_s <= (_STREAM_AGE_S if kind is FailsafeKind.OFFBOARD else _SIGN_AGE_S)
    ]
    if not found:
        return None
    _, kind, text = max(found, key=lambda sign: sign[0])
    return kind, text


def _kind_and_text(state: VehicleState, from_s: float) -> tuple[FailsafeKind, str] | None:
    """Return what the latest of the autopilot's texts since then says."""
    for text in reversed(state.status_texts):
        if text.time_s < from_s:
            return None
        if _begins_nothing(text):
            continue
        words = text.text.lower()
        if text.severity > _WARNING and "lost" not in words and "breached" not in words:
            continue
        kind = _kind_of(text)
        if kind is not None:
            return kind, text.text
    return None


def _begins_nothing(text: StatusText) -> bool:
    words = text.text.lower()
    return any(word in words for word in _NOTHING_BEGINS)


def _kind_of(text: StatusText) -> FailsafeKind | None:
    words = text.text.lower()
    for word, kind in _WORDS:
        if word in words or _breached(words, kind):
            return kind
    return None


def _breached(words: str, kind: FailsafeKind) -> bool:
    """Return whether it is ArduPilot's "<which> fence breached", or "fence(s) breached"."""
    return kind is FailsafeKind.FENCE and "fence" in words and "breached" in words


def _unknown(state: VehicleState) -> str:
    if _another_mode(state):
        return "it flies a different mode than the selected one"
    return "the autopilot reports a critical state"
