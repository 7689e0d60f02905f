"""Safety checks of a goal before it starts: health, fence, battery, position. No ROS."""

from __future__ import annotations

from dataclasses import replace

from mavlink_vehicle.events import FailsafeKind
from mavlink_vehicle.profiles import VehicleKind
from mavlink_vehicle.state.health import arming_faults, estimator_faults
from mavlink_vehicle.state.position_trust import JUMP_MAX_M, PositionTrust
from navigation_bridge.configuration.settings import BatteryPolicy
from navigation_bridge.goals.admitted import Admitted, FlightPlan
from navigation_bridge.snapshot import LocatedSnapshot, Snapshot
from navigation_bridge.supervision.battery_forecast import shortage, unknown_charge
from navigation_bridge.vehicle.takeover import failsafe_code
from navigation_core.outcomes import OutcomeCode, Rejection
from navigation_core.safety.fences import Fence, check_route, check_targets
from navigation_core.safety.speed_at_bounds import room_in_volume_m
from navigation_core.safety.target_checks import RESOLUTION_M, beside
from navigation_core.tasks.watching.plane_route import HEIGHT_ERROR_M, circle_max_m

__all__ = ["check_fence", "check_position", "check_safety"]

# Interrupting the vehicle's reaction to these makes them worse. After others it can be held: when a
# server died and is back, the return is unnecessary.
_NOT_TO_STOP = frozenset({FailsafeKind.BATTERY, FailsafeKind.FENCE, FailsafeKind.GPS})
_UNKNOWN_FENCE = "The vehicle's own fence is not known yet and was not checked."
_UNKNOWN_AREAS = "The zones of the vehicle's own fence are not known yet and were not checked."


def check_safety(admitted: Admitted, snapshot: Snapshot) -> Admitted | Rejection:
    """Return a rejection for a well-formed goal, or add its warnings."""
    if admitted.plan is None:
        return admitted  # a landing or a return is never rejected
    rejection = _check_health(snapshot) or _check_turn(admitted.plan, snapshot)
    if rejection is not None:
        return rejection
    fenced = _check_own_fence(admitted.plan, snapshot)
    if isinstance(fenced, Rejection):
        return fenced
    charged = _check_battery(admitted.plan, snapshot)
    if isinstance(charged, Rejection):
        return charged
    return replace(admitted, warnings=(*admitted.warnings, *fenced, *charged))


def _check_battery(plan: FlightPlan, snapshot: Snapshot) -> tuple[str, ...] | Rejection:
    """Return the warnings about the battery for a plan, or a rejection."""
    policy = snapshot.config.safety.battery_policy
    if policy is BatteryPolicy.IGNORE:
        return ()
    text = shortage(plan, snapshot) if isinstance(snapshot, LocatedSnapshot) else None
    if text is not None and policy is BatteryPolicy.REJECT:
        return Rejection(OutcomeCode.LOW_BATTERY, text)
    notes = (text, unknown_charge(snapshot))
    return tuple(note for note in notes if note is not None)


def _check_health(snapshot: Snapshot) -> Rejection | None:
    if snapshot.twins:
        return Rejection(OutcomeCode.DUPLICATE_VEHICLE, snapshot.twins)
    state = snapshot.state
    faults = estimator_faults(state)
    if faults:
        text = f"The vehicle is unhealthy: {'; '.join(faults)}."
        return Rejection(OutcomeCode.UNHEALTHY, text)
    if not state.armed:
        words = arming_faults(state, snapshot.time_s)
        if words:
            text = f"The autopilot's pre-arm checks fail: {'; '.join(words)}."
            return Rejection(OutcomeCode.UNHEALTHY, text)
    elif state.failsafe is not None and not snapshot.in_control:
        hold = "" if state.failsafe.kind in _NOT_TO_STOP else " call the hold service,"
        text = (
            f"The vehicle is in a failsafe ({state.failsafe.text}) and flies on its own in "
            f"{snapshot.mode_name}; wait until it ends,{hold} or take over "
            "manually."
        )
        return Rejection(failsafe_code(state.failsafe), text)
    return None


def _check_turn(plan: FlightPlan, snapshot: Snapshot) -> Rejection | None:
    """Return why a vehicle that turned back at a target would leave the flight volume."""
    if plan.margin_m <= 0.0:
        return None
    for x, y, _ in plan.targets_enu_m:
        room_m = room_in_volume_m(snapshot.config.volume, (x, y))
        if room_m < plan.margin_m - RESOLUTION_M:
            return Rejection(
                OutcomeCode.OUTSIDE_VOLUME,
                f"The target ({x:.2f}, {y:.2f}) m is {beside(room_m, plan.margin_m)} m inside "
                "the flight volume. If the server ends, the vehicle returns by itself and "
                f"turns first; keep {plan.margin_m:.1f} m away, or have it hold then "
                f"({snapshot.profile.setpoints.loss_parameter}).",
            )
    return None


def _check_own_fence(plan: FlightPlan, snapshot: Snapshot) -> tuple[str, ...] | Rejection:
    """Return the warnings about the vehicle's own fence for a plan, or a rejection."""
    fence, margin_m = snapshot.own_fence, snapshot.config.safety.fence_margin_m
    if fence is None:
        return (_UNKNOWN_FENCE,)
    height_margin_m = margin_m
    if snapshot.profile.kind is VehicleKind.PLANE:
        margin_m += circle_max_m(snapshot.traits.circle_radius_m)
        height_margin_m += HEIGHT_ERROR_M
    margins_m = (max(margin_m, plan.margin_m), height_margin_m)
    rejection = check_fence(snapshot, fence, plan, 0, plan.laps > 1, margins_m)
    if rejection is not None:
        return rejection
    return (_UNKNOWN_AREAS,) if snapshot.areas_missing else ()


def check_fence(
    snapshot: Snapshot,
    fence: Fence,
    plan: FlightPlan,
    first: int,
    closed: bool,
    margins_m: tuple[float, float] = (0.0, 0.0),
) -> Rejection | None:
    """Check the legs from the vehicle through the targets from the ``first`` on.

    ``closed`` leads back to the first of these; the margins are level and in height. Paths
    around obstacles are planned inside the fence, so only the targets are checked then.
    """
    if snapshot.pose is None:
        return None
    here, home_z_enu_m = snapshot.pose.position_enu_m, snapshot.home_z_enu_m
    targets = plan.targets_enu_m[first:]
    if plan.straight:
        margin_m, height_margin_m = margins_m
        return check_route(fence, here, targets, home_z_enu_m, margin_m, closed, height_margin_m)
    return check_targets(fence, targets, home_z_enu_m, *margins_m)


# A client that repeats a goal at once after a jump has not checked the position.
_JUMP_RECENT_S = 60.0


def check_position(trust: PositionTrust, now: float) -> tuple[Rejection | None, str]:
    """Return a rejection of a goal before it starts, or a warning."""
    if trust.complaint:
        text = f"The position is in doubt: {trust.complaint}."
        return Rejection(OutcomeCode.NO_POSITION, text), ""
    jumped_s, jump_m = trust.jumped_s, trust.jump_m()
    if jumped_s is None or jump_m <= JUMP_MAX_M:
        return None, ""
    text = (
        f"The position jumped by {jump_m:.1f} m, {now - jumped_s:.0f} s ago, and has not "
        "jumped back; positions may be off by that much."
    )
    if now - jumped_s > _JUMP_RECENT_S:
        return None, text
    wait_s = _JUMP_RECENT_S - (now - jumped_s)
    hint = f"Check where the vehicle is; goals are accepted again in {wait_s:.0f} s."
    return Rejection(OutcomeCode.NO_POSITION, f"{text} {hint}"), ""
