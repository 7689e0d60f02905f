"""Forecast of the battery for a goal and the return. No ROS."""

from __future__ import annotations

import math

from mavlink_vehicle.state.health import battery_is_low
from mavlink_vehicle.state.vehicle_state import VehicleState
from navigation_bridge.goals.admitted import FlightPlan
from navigation_bridge.snapshot import LocatedSnapshot, Snapshot
from navigation_core.geometry import Vector3

__all__ = ["reported_low", "runs_low", "share_for_return", "shortage", "unknown_charge"]

# Time to take control, arm and take off, and to settle at the end.
_BEGIN_S, _SETTLE_S = 10.0, 3.0
# Time within which the vehicle's own failsafe acts first.
_FAILSAFE_ACTS_S = 2.0
# A PX4 reports its battery every 2 s.
_SILENT_S = 10.0


def unknown_charge(snapshot: Snapshot) -> str | None:
    """Return in a sentence how the remaining charge is not known; None if it is."""
    battery, now = snapshot.state.battery, snapshot.time_s
    silent = battery is None or now - battery.time_s > _SILENT_S
    reported = snapshot.battery.reported
    if battery is not None and battery.remaining is not None:
        if not silent:
            return None
        reported = (battery.time_s, battery.remaining)
    if reported is None:
        return "The vehicle has never reported its remaining battery."
    reported_s, remaining = reported
    was = f"{now - reported_s:.0f} s ago it reported {100.0 * remaining:.0f} %."
    if silent:
        return f"The vehicle does not report its battery any more; {was}"
    return f"The vehicle reports its remaining battery as unknown now; {was}"


def share_for_return(snapshot: LocatedSnapshot) -> float:
    """Return the share of the battery that a return from here takes, NaN if unknown."""
    back_s = _back_s(snapshot, snapshot.pose.position_enu_m, None)
    prediction = snapshot.battery.consumption.predict(0.0, back_s)
    return math.nan if prediction is None else prediction.at_end - prediction.back


def shortage(plan: FlightPlan, snapshot: LocatedSnapshot) -> str | None:
    """Return why the battery is insufficient for a plan and the return, or None."""
    if battery_is_low(snapshot.state.battery):
        return _low_text(snapshot.state)
    start_enu_m = snapshot.pose.position_enu_m
    goal_s = _BEGIN_S + plan.duration_s(start_enu_m) + _SETTLE_S
    end_enu_m = plan.targets_enu_m[-1] if plan.targets_enu_m else start_enu_m
    prediction = snapshot.battery.consumption.predict(goal_s, _back_s(snapshot, end_enu_m, plan))
    reserve = snapshot.config.safety.battery_reserve
    if prediction is None or prediction.back >= reserve:
        return None
    words = prediction.describe()
    return f"Insufficient battery: {words}; battery_reserve is {100 * reserve:g} %."


def reported_low(snapshot: Snapshot) -> str | None:
    """Return the warning that the autopilot reports a low battery but does not act, or None."""
    since_s = snapshot.battery.low_since_s
    if since_s is None or snapshot.time_s - since_s <= _FAILSAFE_ACTS_S:
        return None
    return _low_text(snapshot.state)


def runs_low(plan: FlightPlan, snapshot: LocatedSnapshot) -> str | None:
    """Return why the charge requires turning back from a position on the path, or None."""
    back_s = _back_s(snapshot, snapshot.pose.position_enu_m, plan)
    prediction = snapshot.battery.consumption.predict(0.0, back_s)
    reserve = snapshot.config.safety.battery_reserve
    if prediction is None or prediction.back >= reserve:
        return None
    return (
        f"The battery is at {100 * prediction.now:.0f} %; the return takes "
        f"{prediction.back_s:.0f} s and would leave {100 * max(prediction.back, 0.0):.0f} %, "
        f"below battery_reserve ({100 * reserve:g} %)."
    )


def _low_text(state: VehicleState) -> str:
    """Return which battery is low, where there are several."""
    battery, several = state.battery, len(state.batteries) > 1
    number = f" (number {battery.battery_id})" if several and battery is not None else ""
    return f"The autopilot reports a low battery{number}."


def _back_s(snapshot: Snapshot, start_enu_m: Vector3, plan: FlightPlan | None) -> float:
    """Return the time from a position to the launch point, landing included."""
    home = snapshot.home_enu_m or (0.0, 0.0, 0.0)
    return_m = math.dist(start_enu_m[:2], home[:2])
    height_m = max(start_enu_m[2] - home[2], 0.0)
    down_m_s = snapshot.config.goto.limits.speed_down_m_s
    return return_m / _return_speed_m_s(snapshot, plan) + height_m / down_m_s


def _return_speed_m_s(snapshot: Snapshot, plan: FlightPlan | None) -> float:
    """Return the speed of the vehicle's own return; the goal's, or the default, if unknown."""
    parameters = snapshot.parameters
    for name, scale in snapshot.profile.return_speeds:
        if parameters.get(name, 0.0) > 0.0:
            return parameters[name] * scale
    limits = snapshot.config.goto.limits
    return limits.speed_horizontal_m_s if plan is None else plan.speeds_m_s[-1]
