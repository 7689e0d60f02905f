"""Judges by estimator, GPS and checks whether the autopilot is fit to fly. Pure."""

from __future__ import annotations

from mavlink_vehicle.codec import mavlink
from mavlink_vehicle.state.batteries import charge_rank
from mavlink_vehicle.state.telemetry import Battery
from mavlink_vehicle.state.vehicle_state import VehicleState

# ArduPilot repeats the reasons against arming every 30 s.
_CHECK_TEXTS_S = 40.0
_CHECKS = ("prearm:", "arm:", "preflight fail")

# The bits that EKF_STATUS_REPORT and ESTIMATOR_STATUS have in common, all of which were set in
# every recorded flight.
_NEEDED = {
    mavlink.ESTIMATOR_ATTITUDE: "attitude",
    mavlink.ESTIMATOR_VELOCITY_HORIZ: "horizontal velocity",
    mavlink.ESTIMATOR_POS_HORIZ_ABS: "horizontal position",
}


def estimator_faults(state: VehicleState) -> tuple[str, ...]:
    """Return what is wrong with the estimate of where the vehicle is; empty when all is well.

    A GPS that is there but has no 3D fix counts: an ArduCopter that has just lost it continues
    to say for 8 s that its position is good (observed).
    """
    faults = []
    gps = state.gps
    if gps is not None and mavlink.GPS_FIX_TYPE_NO_GPS < gps.fix_type < mavlink.GPS_FIX_TYPE_3D_FIX:
        faults.append(f"the GPS has no 3D fix (GPS_FIX_TYPE {gps.fix_type})")
    if state.estimator is not None:
        flags = state.estimator.flags
        lacking = [name for bit, name in _NEEDED.items() if not flags & bit]
        if lacking:
            faults.append(f"the estimator has no {' and no '.join(lacking)}")
    if sees_glitch(state):
        faults.append("the estimator reports GPS glitches")
    return tuple(faults)


def sees_glitch(state: VehicleState) -> bool:
    """Whether the estimator says that its GPS errs; each firmware has a bit of its own."""
    px4 = state.autopilot == mavlink.MAV_AUTOPILOT_PX4
    bit = mavlink.ESTIMATOR_GPS_GLITCH if px4 else mavlink.EKF_GPS_GLITCHING
    return state.estimator is not None and bool(state.estimator.flags & bit)


def arming_faults(state: VehicleState, now: float) -> tuple[str, ...]:
    """Return the autopilot's own recent words on why it would not arm, each once.

    Reasons about the mode are left out: a goal is not flown in that one.

    Empty when it would, doesn't say whether, or gives no reason.
    """
    if state.prearm_ok is not False:
        return ()
    words = [
        text.text.strip()
        for text in state.status_texts
        if now - text.time_s <= _CHECK_TEXTS_S
        and text.text.lower().startswith(_CHECKS)
        and " mode" not in text.text.lower()
    ]
    return tuple(dict.fromkeys(words))


def battery_is_low(battery: Battery | None) -> bool:
    """Whether the autopilot itself says that the battery is low or worse."""
    return charge_rank(battery) > 0
