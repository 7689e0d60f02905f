"""Safety checks before and during a goal. No ROS.

Fence and volume, battery, health of the vehicle, and failsafes that leave the server in control.
Failsafes that change the mode are handled in :mod:`navigation_bridge.vehicle.takeover`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from mavlink_vehicle.events import FailsafeKind
from mavlink_vehicle.mission_items import MissionItem
from mavlink_vehicle.positions.projections import LocalFrame
from mavlink_vehicle.profiles import VehicleKind
from mavlink_vehicle.state.health import arming_faults, estimator_faults
from mavlink_vehicle.vehicle import Vehicle
from navigation_bridge.configuration.settings import BatteryPolicy, BridgeConfig
from navigation_bridge.goals.admitted import Admitted
from navigation_bridge.goals.battery_forecast import BatteryReckoning
from navigation_bridge.goals.goal import ActiveGoal
from navigation_bridge.goals.straight_legs import FlightPlan
from navigation_bridge.obstacles.standing_obstacles import StandingObstacles
from navigation_bridge.vehicle.failsafes import failsafe_code
from navigation_bridge.vehicle.fence import areas_of, fence_of, has_areas
from navigation_bridge.vehicle.map_frame import MapFrame
from navigation_bridge.vehicle.traits import circle_radius_m
from navigation_core.geometry import Vector3
from navigation_core.outcomes import OutcomeCode, Rejection
from navigation_core.safety.fences import Area, Fence, check_route, check_targets
from navigation_core.safety.target_checks import RESOLUTION_M, beside
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
    """Checks goals before they start, and the vehicle while they run."""

    def __init__(
        self,
        vehicle: Vehicle,
        map_frame: MapFrame,
        config: BridgeConfig,
        standing: StandingObstacles,
    ) -> None:
        """Start to monitor ``vehicle``; its fence is passed to ``standing``."""
        self._standing = standing
        self._vehicle = vehicle
        self._map_frame = map_frame
        self._config = config
        self._battery = BatteryReckoning(vehicle, map_frame, config)
        self._memory = _Memory(None)
        self._next_s = -math.inf
        self._items: tuple[MissionItem, ...] = ()
        self._items_frame: LocalFrame | None = None
        self._known_areas: tuple[Area, ...] = ()

    def configure(self, config: BridgeConfig) -> None:
        """Apply other settings."""
        self._config = config
        self._battery.configure(config)

    def observe_battery(self, now: float) -> None:
        """Process the current battery state."""
        self._battery.observe(now)

    def battery_for_return(self) -> float:
        """Return the share of the battery that a return from here takes, NaN if unknown."""
        here = self._here()
        return math.nan if here is None else self._battery.share_back(here)

    # --- before acceptance -------------------------------------------------------------

    def check(self, admitted: Admitted, now: float) -> Admitted | Rejection:
        """Return a rejection for a well-formed goal, or add its warnings."""
        if admitted.plan is None:
            return admitted  # a landing or a return is never rejected
        rejection = self._check_health(now) or self._check_turn(admitted.plan)
        if rejection is not None:
            return rejection
        notes = list(admitted.warnings)
        fence = self.fence()
        if fence is None:
            notes.append(_UNKNOWN_FENCE)
        else:
            plan, margin_m = admitted.plan, self._config.safety.fence_margin_m
            height_margin_m, profile = margin_m, self._vehicle.profile
            if profile is not None and profile.kind is VehicleKind.PLANE:
                margin_m += circle_max_m(circle_radius_m(profile, self._vehicle.parameters))
                height_margin_m += HEIGHT_ERROR_M
            margin_m = max(margin_m, plan.margin_m)
            rejection = self._check_fence(
                fence, plan, 0, plan.laps > 1, (margin_m, height_margin_m)
            )
            if rejection is not None:
                return rejection
            if self.areas_unknown():
                notes.append(_UNKNOWN_AREAS)
        here = self._here()
        text = None if here is None else self._battery.problem(admitted.plan, here)
        policy = self._config.safety.battery_policy
        if text is not None and policy is BatteryPolicy.REJECT:
            return Rejection(OutcomeCode.LOW_BATTERY, text)
        if text is not None and policy is BatteryPolicy.WARN:
            notes.append(text)
        unknown = self._battery.unknown(now)
        if unknown is not None and policy is not BatteryPolicy.IGNORE:
            notes.append(unknown)
        return replace(admitted, warnings=tuple(notes))

    def _check_turn(self, plan: FlightPlan) -> Rejection | None:
        """Return why a vehicle that turned back at a target would leave the flight volume."""
        if plan.margin_m <= 0.0:
            return None
        for x, y, _ in plan.targets_enu_m:
            room_m = self._config.volume.room_m((x, y))
            if room_m < plan.margin_m - RESOLUTION_M:
                profile = self._vehicle.profile
                parameter = "" if profile is None else profile.setpoint_loss_parameter
                return Rejection(
                    OutcomeCode.OUTSIDE_VOLUME,
                    f"The target ({x:.2f}, {y:.2f}) m is {beside(room_m, plan.margin_m)} m inside "
                    "the flight volume. If the server ends, the vehicle returns by itself and "
                    f"turns first; keep {plan.margin_m:.1f} m away, or have it hold then "
                    f"({parameter}).",
                )
        return None

    def _check_health(self, now: float) -> Rejection | None:
        vehicle, state = self._vehicle, self._vehicle.state
        faults = estimator_faults(state)
        if faults:
            text = f"The vehicle is unhealthy: {'; '.join(faults)}."
            return Rejection(OutcomeCode.UNHEALTHY, text)
        if not state.armed:
            words = arming_faults(state, now)
            if words:
                text = f"The autopilot's pre-arm checks fail: {'; '.join(words)}."
                return Rejection(OutcomeCode.UNHEALTHY, text)
        elif state.failsafe is not None and not vehicle.in_control_mode:
            hold = "" if state.failsafe.kind in _NOT_TO_STOP else " call the hold service,"
            text = (
                f"The vehicle is in a failsafe ({state.failsafe.text}) and flies on its own in "
                f"{vehicle.mode_name}; wait until it ends,{hold} or take over "
                "manually."
            )
            return Rejection(failsafe_code(state.failsafe), text)
        return None

    def fence(self) -> Fence | None:
        """Return the vehicle's own fence, None while unknown."""
        vehicle = self._vehicle
        if vehicle.profile is None:
            return None
        home = self._map_frame.home_enu_m(vehicle.state)
        return fence_of(vehicle.profile, vehicle.parameters, home, self.areas())

    def tell_fence(self) -> None:
        """Plan paths inside the fence as known now, and inside the volume."""
        here, margin_m = self._here(), self._config.safety.fence_margin_m
        place = None if here is None else here[:2]
        self._standing.bound(self.fence(), margin_m, self._config.volume, place)

    def areas(self) -> tuple[Area, ...]:
        """Return the uploaded areas as far as known, whether in force or not."""
        items, frame = self._vehicle.fence_items, self._map_frame.frame
        if not items or frame is None:
            return ()
        if self._items is not items or self._items_frame != frame:
            self._items, self._items_frame = items, frame
            self._known_areas = areas_of(items, self._map_frame.enu)
        return self._known_areas

    def areas_unknown(self) -> bool:
        """Return whether uploaded areas are in force that are not known yet."""
        vehicle = self._vehicle
        if vehicle.profile is None or vehicle.fence_items is not None:
            return False
        return has_areas(vehicle.profile, vehicle.parameters)

    def _check_fence(
        self,
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
        here = self._here()
        if here is None:
            return None
        home_z_enu_m = self._map_frame.home_z_enu_m(self._vehicle.state)
        targets = plan.targets_enu_m[first:]
        if plan.straight:
            margin_m, height_margin_m = margins_m
            return check_route(
                fence, here, targets, home_z_enu_m, margin_m, closed, height_margin_m
            )
        return check_targets(fence, targets, home_z_enu_m, *margins_m)

    def _here(self) -> Vector3 | None:
        pose = self._map_frame.pose(self._vehicle.state)
        return None if pose is None else pose.position_enu_m

    # --- while flying ------------------------------------------------------------------

    def watch(self, goal: ActiveGoal, now: float) -> Outcome | None:
        """Return why a goal must end with the vehicle holding; add warnings to its notes."""
        memory = self._memory
        if memory.goal is not goal:
            memory = self._memory = _Memory(goal)
        elif now < self._next_s:
            return None
        if goal.cancel_requested_s is not None or goal.closing is not None:
            return None
        self._next_s = now + _PERIOD_S
        self.tell_fence()
        outcome = self._watch_failsafe(goal, memory, now)
        if outcome is not None or goal.plan is None:
            return outcome
        here = self._here()
        if here is None:
            return None
        rejection = self._watch_place(goal, goal.plan, memory, here)
        if rejection is not None:
            return Outcome(rejection.code, rejection.message, None)
        return self._watch_battery(goal, goal.plan, here, now)

    def _watch_failsafe(self, goal: ActiveGoal, memory: _Memory, now: float) -> Outcome | None:
        """Handle a failsafe that did not change the mode in time."""
        failsafe = self._vehicle.state.failsafe
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
        policy = self._config.safety.battery_policy
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

    def _watch_place(
        self, goal: ActiveGoal, plan: FlightPlan, memory: _Memory, here: Vector3
    ) -> Rejection | None:
        volume = self._config.volume
        left_m = volume.left_by_m(here, self._map_frame.ground_enu_m(self._vehicle.state))
        memory.inside = memory.inside or left_m <= 0.0
        if memory.inside and left_m > _LEFT_M:
            text = f"The vehicle is {left_m:.1f} m outside the flight volume."
            return Rejection(OutcomeCode.OUTSIDE_VOLUME, text)
        fence = self.fence()
        if fence is None or fence == memory.fence:
            return None
        memory.fence = fence
        route = None if goal.progress is None else goal.progress.route
        again = plan.laps > 1 and (route is None or route.lap < plan.laps - 1)
        first = 0 if route is None or again else route.current
        rejection = self._check_fence(fence, plan, first, again)
        if rejection is None:
            return None
        return Rejection(rejection.code, f"The vehicle's fence was changed: {rejection.message}")

    def _watch_battery(
        self, goal: ActiveGoal, plan: FlightPlan, here: Vector3, now: float
    ) -> Outcome | None:
        policy = self._config.safety.battery_policy
        if policy is BatteryPolicy.IGNORE:
            return None
        # A PX4 whose failsafe only warns shows it by the charge state alone (observed).
        code, text = OutcomeCode.FAILSAFE_BATTERY, self._battery.says_low(now)
        if text is None:
            code, text = OutcomeCode.LOW_BATTERY, self._battery.runs_low(plan, here)
        if text is None:
            return None
        if policy is BatteryPolicy.REJECT:
            return Outcome(code, text, None)
        if not self._memory.warned:
            self._memory.warned = True
            goal.notes.append(text)
        return None
