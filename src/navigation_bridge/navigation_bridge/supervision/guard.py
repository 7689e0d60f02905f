"""Safety checks before and during a goal. No ROS.

Fence and volume, battery, health of the vehicle, and failsafes that leave the server in control.
Failsafes that change the mode are handled in :mod:`navigation_bridge.vehicle.takeover`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from mavlink_vehicle.events import FailsafeKind
from mavlink_vehicle.profiles import Profile, VehicleKind
from mavlink_vehicle.state.health import arming_faults, estimator_faults
from mavlink_vehicle.state.vehicle_state import VehicleState
from navigation_bridge.configuration.settings import BatteryPolicy, BridgeConfig
from navigation_bridge.goals.admitted import Admitted
from navigation_bridge.goals.battery_forecast import BatteryReckoning
from navigation_bridge.goals.goal import ActiveGoal
from navigation_bridge.goals.straight_legs import FlightPlan
from navigation_bridge.obstacles.standing_obstacles import StandingObstacles
from navigation_bridge.snapshot import LocatedSnapshot, Snapshot
from navigation_bridge.vehicle.failsafes import failsafe_code
from navigation_core.outcomes import OutcomeCode, Rejection
from navigation_core.safety.fences import Fence, check_route, check_targets
from navigation_core.tasks.intents import Outcome
from navigation_core.tasks.watching.plane_route import HEIGHT_ERROR_M, circle_max_m

_PERIOD_S = 0.5
# Tolerance for overshoot and position errors before the vehicle counts as outside.
_LEFT_M = 3.0
# A failsafe that changes the mode does so within this time of its first sign.
_FAILSAFE_ACTS_S = 2.0
# Interrupting the vehicle's reaction to these makes them worse. After others it can be held: when a
# server died and is back, the return is unnecessary.
_NOT_TO_STOP = frozenset({FailsafeKind.BATTERY, FailsafeKind.FENCE, FailsafeKind.GPS})
_UNKNOWN_FENCE = "The vehicle's own fence is not known yet and was not checked."
_UNKNOWN_AREAS = "The zones of the vehicle's own fence are not known yet and were not checked."


@dataclass
class _Memory:
    """State of the checks for the active goal.

    Attributes:
        goal: the goal; a later one may have the same id.
        inside: whether the vehicle has been inside the volume since the goal began.
        fence: the fence that its paths were last checked against.
        failsafe: kind of the failsafe that was last handled.
        warned: whether a low battery was reported.
    """

    goal: ActiveGoal | None
    inside: bool = False
    fence: Fence | None = None
    failsafe: FailsafeKind | None = None
    warned: bool = False


class Guard:
    """Checks goals before they start, and the vehicle while they run.

    Attributes:
        bounded_s: time at which the limits of the flight were last set.
    """

    def __init__(self, config: BridgeConfig, standing: StandingObstacles) -> None:
        """Start without observations; the vehicle's fence is passed to ``standing``."""
        self._standing = standing
        self._battery = BatteryReckoning(config)
        self._memory = _Memory(None)
        self._next_s = -math.inf
        self.bounded_s = -math.inf

    def configure(self, config: BridgeConfig) -> None:
        """Apply other settings."""
        self._battery.configure(config)

    def observe_battery(self, state: VehicleState, profile: Profile | None, now: float) -> None:
        """Process a new battery state."""
        self._battery.observe(state, profile, now)

    def battery_for_return(self, snapshot: Snapshot) -> float:
        """Return the share of the battery that a return from here takes, NaN if unknown."""
        if not isinstance(snapshot, LocatedSnapshot):
            return math.nan
        return self._battery.share_back(snapshot)

    # --- before acceptance -------------------------------------------------------------

    def check(self, admitted: Admitted, snapshot: Snapshot) -> Admitted | Rejection:
        """Return a rejection for a well-formed goal, or add its warnings."""
        if admitted.plan is None:
            return admitted  # a landing or a return is never rejected
        rejection = _check_health(snapshot)
        if rejection is not None:
            return rejection
        fenced = _check_own_fence(admitted.plan, snapshot)
        if isinstance(fenced, Rejection):
            return fenced
        charged = self._check_battery(admitted.plan, snapshot)
        if isinstance(charged, Rejection):
            return charged
        return replace(admitted, warnings=(*admitted.warnings, *fenced, *charged))

    def _check_battery(self, plan: FlightPlan, snapshot: Snapshot) -> tuple[str, ...] | Rejection:
        """Return the warnings about the battery for a plan, or a rejection."""
        policy = snapshot.config.safety.battery_policy
        if policy is BatteryPolicy.IGNORE:
            return ()
        text = None
        if isinstance(snapshot, LocatedSnapshot):
            text = self._battery.problem(plan, snapshot)
        if text is not None and policy is BatteryPolicy.REJECT:
            return Rejection(OutcomeCode.LOW_BATTERY, text)
        notes = (text, self._battery.unknown(snapshot))
        return tuple(note for note in notes if note is not None)

    def bound(self, snapshot: Snapshot) -> None:
        """Plan paths inside the fence as known now, and inside the volume."""
        config, pose = snapshot.config, snapshot.pose
        place = None if pose is None else pose.position_enu_m[:2]
        margin_m = config.safety.fence_margin_m
        self.bounded_s = snapshot.time_s
        self._standing.bound(snapshot.own_fence, margin_m, config.volume, place)

    # --- while flying ------------------------------------------------------------------

    def watch(self, goal: ActiveGoal, snapshot: Snapshot) -> Outcome | None:
        """Return why a goal must end with the vehicle holding; add warnings to its notes."""
        memory, now = self._memory, snapshot.time_s
        if memory.goal is not goal:
            memory = self._memory = _Memory(goal)
        elif now < self._next_s:
            return None
        if goal.cancel_requested_s is not None or goal.closing is not None:
            return None
        self._next_s = now + _PERIOD_S
        self.bound(snapshot)
        outcome = self._watch_failsafe(goal, memory, snapshot)
        if outcome is not None or goal.plan is None:
            return outcome
        if not isinstance(snapshot, LocatedSnapshot):
            return None
        rejection = self._watch_place(goal, goal.plan, memory, snapshot)
        if rejection is not None:
            return Outcome(rejection.code, rejection.message, None)
        return self._watch_battery(goal, goal.plan, snapshot)

    @staticmethod
    def _watch_failsafe(goal: ActiveGoal, memory: _Memory, snapshot: Snapshot) -> Outcome | None:
        """Handle a failsafe that did not change the mode in time."""
        failsafe, now = snapshot.state.failsafe, snapshot.time_s
        if failsafe is None or failsafe.kind is memory.failsafe:
            return None
        if now - failsafe.since_s < _FAILSAFE_ACTS_S:
            return None
        began_before = failsafe.since_s < goal.accepted_s  # so the goal was sent despite it
        memory.failsafe = failsafe.kind
        if goal.plan is None:
            # It lands or returns, perhaps because of it: the failsafe does act.
            if not began_before:
                goal.notes.append(f"The vehicle reported a failsafe ({failsafe.text}).")
            return None
        policy = snapshot.config.safety.battery_policy
        ends = failsafe.kind in (FailsafeKind.FENCE, FailsafeKind.GPS) or (
            failsafe.kind is FailsafeKind.BATTERY and policy is BatteryPolicy.REJECT
        )
        if ends and not began_before:
            text = f"The vehicle is in a failsafe but still under our control: {failsafe.text}."
            return Outcome(failsafe_code(failsafe), text, None)
        if began_before:
            goal.notes.append(
                f"The vehicle was already in a failsafe when the goal arrived ({failsafe.text})."
            )
            return None
        goal.notes.append(
            f"The vehicle reported a failsafe ({failsafe.text}) but took no action; the goal "
            "continued."
        )
        return None

    @staticmethod
    def _watch_place(
        goal: ActiveGoal, plan: FlightPlan, memory: _Memory, snapshot: LocatedSnapshot
    ) -> Rejection | None:
        volume = snapshot.config.volume
        left_m = volume.left_by_m(snapshot.pose.position_enu_m, snapshot.ground_enu_m)
        memory.inside = memory.inside or left_m <= 0.0
        if memory.inside and left_m > _LEFT_M:
            text = f"The vehicle is {left_m:.1f} m outside the flight volume."
            return Rejection(OutcomeCode.OUTSIDE_VOLUME, text)
        fence = snapshot.own_fence
        if fence is None or fence == memory.fence:
            return None
        memory.fence = fence
        route = None if goal.progress is None else goal.progress.route
        again = plan.laps > 1 and (route is None or route.lap < plan.laps - 1)
        first = 0 if route is None or again else route.current
        rejection = _check_fence(snapshot, fence, plan, first, again)
        if rejection is None:
            return None
        return Rejection(rejection.code, f"The vehicle's fence was changed: {rejection.message}")

    def _watch_battery(
        self, goal: ActiveGoal, plan: FlightPlan, snapshot: LocatedSnapshot
    ) -> Outcome | None:
        policy = snapshot.config.safety.battery_policy
        if policy is BatteryPolicy.IGNORE:
            return None
        # A PX4 whose failsafe only warns shows it by the charge state alone (observed).
        code, text = OutcomeCode.FAILSAFE_BATTERY, self._battery.says_low(snapshot)
        if text is None:
            code, text = OutcomeCode.LOW_BATTERY, self._battery.runs_low(plan, snapshot)
        if text is None:
            return None
        if policy is BatteryPolicy.REJECT:
            return Outcome(code, text, None)
        if not self._memory.warned:
            self._memory.warned = True
            goal.notes.append(text)
        return None


def _check_health(snapshot: Snapshot) -> Rejection | None:
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


def _check_own_fence(plan: FlightPlan, snapshot: Snapshot) -> tuple[str, ...] | Rejection:
    """Return the warnings about the vehicle's own fence for a plan, or a rejection."""
    fence, margin_m = snapshot.own_fence, snapshot.config.safety.fence_margin_m
    if fence is None:
        return (_UNKNOWN_FENCE,)
    height_margin_m = margin_m
    if snapshot.profile.kind is VehicleKind.PLANE:
        margin_m += circle_max_m(snapshot.traits.circle_radius_m)
        height_margin_m += HEIGHT_ERROR_M
    margins_m = (margin_m, height_margin_m)
    rejection = _check_fence(snapshot, fence, plan, 0, plan.laps > 1, margins_m)
    if rejection is not None:
        return rejection
    return (_UNKNOWN_AREAS,) if snapshot.areas_missing else ()


def _check_fence(
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
