"""Obstacle avoidance during a flight: continue, replan, stop, wait or give way.

It joins three pure parts: the checked path (:mod:`.checked_path`), the decision to replan it
(:mod:`navigation_core.planning.replanner`) and the brake (:mod:`navigation_core.safety.braking`).
"""

from __future__ import annotations

import math
from dataclasses import replace

from navigation_core.geometry import KinematicState, Vector3, distance, norm
from navigation_core.outcomes import OutcomeCode
from navigation_core.planning.conflicts import MotionSamples, clearance_at_m, first_conflict
from navigation_core.planning.planner import NoPath
from navigation_core.planning.replanner import Decision, Replanner, ReplanRules, State
from navigation_core.safety.braking import must_brake
from navigation_core.tasks.conditions import measured_state
from navigation_core.tasks.leading.carrot import Carrot
from navigation_core.tasks.leading.checked_path import CheckedPath, braking_limits
from navigation_core.tasks.leading.flight_terms import AvoidanceConfig
from navigation_core.tasks.leading.path_follower import PathFollower
from navigation_core.tasks.leading.path_search import Evasion
from navigation_core.tasks.observation import Observation
from navigation_core.tasks.traits import Traits

# A long path is extended while it is flown. Time between two attempts; time to the next point below
# which the vehicle is too near to it; and how long a better moment is waited for.
_EXTEND_RETRY_S, _NEXT_POINT_NEAR_S, _EXTEND_PATIENCE_S = 1.0, 2.5, 6.0
# Of two motions among what moves, one is better with this much more room.
_BETTER_M = 0.2
# A setpoint with more acceleration than this is in a corner, or speeds up.
_IN_CORNER_M_S2 = 0.05


class Avoider:
    """Keeps the path to one goal away from obstacles."""

    def __init__(self, config: AvoidanceConfig, traits: Traits, follower: PathFollower) -> None:
        """Prepare.

        Args:
            config: how to keep away.
            traits: what the vehicle can do.
            follower: of the path; it must have been made with the same.
        """
        self._config = config
        self._drives = not traits.flies
        self._traits = traits
        self._follower = follower
        self._braking_limits = braking_limits(traits, follower.limits)
        self._replanner = Replanner(
            ReplanRules(
                config.conflict_clearance_m,
                config.blocked_timeout_s,
                config.retry_s,
                config.elective_s,
                config.elective_gain,
            )
        )
        self._is_silent = False
        self._gave_way_s = -math.inf
        # Why there is no path; empty while one is flown, or searched for for the first time.
        self.reason = ""

    @property
    def replans(self) -> int:
        """The number of replans because of obstacles."""
        return self._replanner.replans

    def may_begin(self, observation: Observation, now: float) -> bool:
        """Record a flight that was planned just now.

        Returns:
            Whether it may be flown; if not, the vehicle is to be stopped.
        """
        if self._follower.carrot is None:
            return True
        here = measured_state(observation).position_enu_m
        if self._hears_nothing(observation):
            self._stop(observation, now, self.reason)
            return False
        if self._follower.undecided:
            self._replanner.no_flight(here, now, is_undecided=True)
            return False
        if self._follower.no_path:
            self.reason = self._follower.no_path
            self._replanner.no_flight(here, now)
            return False
        self.reason = ""
        self._replanner.found(here, now)
        return True

    def keeps_going(self, observation: Observation, now: float) -> bool:
        """Look whether the path may be flown on.

        Returns:
            Whether the flight continues; if not, the vehicle is being stopped.
        """
        if self._replanner.state is State.BLOCKED:
            return False
        here = measured_state(observation).position_enu_m
        self._replanner.moved_on(here)
        if self._hears_nothing(observation):
            self._stop(observation, now, self.reason)
            return False
        if self._must_brake(observation) and not self._passes(observation):
            limit_m = self._config.brake_clearance_m
            text = f"An obstacle would come within {limit_m:g} m before the vehicle could stop."
            self._stop(observation, now, text)
            return False
        return True

    def replan(self, observation: Observation, now: float) -> None:
        """Look for another path if need be, and go over to it; without one, stop.

        While a search continues, the old path is flown, and the brake watches.
        """
        path, carrot = self._follower.path, self._follower.carrot
        if self._replanner.state is State.BLOCKED or path is None or carrot is None:
            return
        decision = self._check(path, carrot, observation, now)
        if decision is Decision.REPLAN:
            self._replan(observation, now)
        elif decision is Decision.COMPARE:
            self._compare(carrot, observation, now)
        else:
            self._plan_on(path, carrot, observation, now)

    def has_ended_short(self, observation: Observation, now: float) -> bool:
        """Stop at the end of a path, if that ends before its points do; return whether it does."""
        path = self._follower.path
        if path is None or not path.ends_short:
            return False
        self._stop(observation, now, path.ends_short)
        return True

    def wait(self, observation: Observation, now: float, may_plan: bool) -> Decision:
        """Decide what to do while there is no path, which may be looked for or not."""
        may_plan = not self._hears_nothing(observation) and may_plan
        return self._replanner.wait(now, may_plan and not self._must_brake(observation))

    def failure(self) -> tuple[OutcomeCode, str]:
        """Return how a goal ends whose path has been blocked for too long."""
        waited_s = self._config.blocked_timeout_s
        if self._is_silent:
            text = f"There was no obstacle data for {waited_s:g} s. {self.reason}"
            return OutcomeCode.NO_OBSTACLE_DATA, text
        reason = self.reason or "No search for one has ended."
        return OutcomeCode.NO_PATH, f"There was no path for {waited_s:g} s. {reason}"

    def restart_clock(self) -> None:
        """Count the time without a path from now on: the vehicle was to stand meanwhile."""
        self._replanner.restart_clock()

    def is_too_near(self, observation: Observation, now: float) -> bool:
        """Whether an obstacle has come too near to the position at which the vehicle is to stay."""
        limit_m = self._config.conflict_clearance_m
        here = measured_state(observation).position_enu_m
        near_m = clearance_at_m(here, observation.obstacles, limit_m)
        if near_m >= limit_m:
            return False
        text = f"An obstacle is {near_m:.2f} m away; the required clearance is {limit_m:g} m."
        self._stop(observation, now, text)
        return True

    def give_way(self, observation: Observation, now: float) -> None:
        """While the vehicle stands, go out of the way of what comes near."""
        follower, limit_m = self._follower, self._config.conflict_clearance_m
        carrot = follower.carrot
        if carrot is None:
            return
        if follower.path is not None and not carrot.ended:
            conflict = self._is_in_conflict(follower.path, carrot, observation)
            leads_away = bool(follower.path.passed_s)
            # A rover or boat begins each plan at its present speed: a brake that is under way
            # would never get slower if it were replanned in every step.
            brakes = not leads_away and self._drives
            too_near = (conflict and not brakes) or (leads_away and self._must_brake(observation))
            if too_near and not self._passes(observation):
                follower.plan_stop(observation)
            return
        here = measured_state(observation).position_enu_m
        if clearance_at_m(here, observation.obstacles, limit_m) >= limit_m:
            return
        if now - self._gave_way_s < self._config.retry_s:
            return
        self._gave_way_s = now
        away = follower.path_away(observation)
        if away is not None:
            follower.take(away, leads_to_goal=False)

    # --- what it looks at ----------------------------------------------------------------

    def _hears_nothing(self, observation: Observation) -> bool:
        age_s = observation.obstacles_age_s
        self._is_silent = not age_s <= self._config.sensor_timeout_s
        if self._is_silent:
            since = f"been silent for {age_s:.1f} s" if math.isfinite(age_s) else "not reported yet"
            self.reason = f"The obstacle sensor has {since}."
        return self._is_silent

    def _must_brake(self, observation: Observation) -> bool:
        """Ask the layer that knows nothing of paths.

        It is asked about the vehicle, and about the setpoint that leads an aircraft: one that is
        slow may be behind it, and comes to rest where the setpoint does.
        """
        here, commanded = measured_state(observation), self._follower.sent.commanded
        if commanded is not None:
            here = replace(here, acceleration_enu_m_s2=commanded.state.acceleration_enu_m_s2)
        # A rover or boat cannot back away from an obstacle that it stops too near to.
        late_s = observation.late_s if self._drives else 0.0
        if self._leads_too_near(here, observation, self._config.reaction_s + late_s):
            return True
        if commanded is None or self._drives:
            return False
        return self._leads_too_near(commanded.state, observation, 0.0)

    def _leads_too_near(
        self, state: KinematicState, observation: Observation, reaction_s: float
    ) -> bool:
        return bool(
            must_brake(
                MotionSamples.at(state),
                observation.obstacles,
                self._braking_limits,
                self._config.brake_clearance_m,
                reaction_s,
            )[0]
        )

    def _passes(self, observation: Observation) -> bool:
        """Whether the path that is flown passes what moves better than any stop."""
        path, carrot, sent = self._follower.path, self._follower.carrot, self._follower.sent
        if not observation.moving or self._drives or path is None or carrot is None:
            return False
        here = sent.commanded.state if sent.commanded is not None else measured_state(observation)
        evasion = Evasion(self._config, self._traits, self._follower.limits)
        stop = evasion.stop(here, observation)
        stops_m = evasion.room_m(stop.samples, 0.0, observation)
        passes_m = evasion.room_m(path.samples, carrot.time_s, observation)
        # A stop that has begun is flown on unless another is clearly better.
        return passes_m > stops_m + (_BETTER_M if path.passed_s else -_BETTER_M)

    def _is_in_conflict(self, path: CheckedPath, carrot: Carrot, observation: Observation) -> bool:
        rest = path.samples.ahead(carrot.time_s, carrot.state.position_enu_m)
        limit_m = self._config.conflict_clearance_m
        return first_conflict(rest, observation.obstacles, limit_m) is not None

    def _check(
        self, path: CheckedPath, carrot: Carrot, observation: Observation, now: float
    ) -> Decision:
        place = carrot.state.position_enu_m
        return self._replanner.check(
            path.samples,
            carrot.time_s,
            place,
            self._least_m(place),
            carrot.distance_remaining_m,
            observation.obstacles,
            now,
        )

    def _plan_on(
        self, path: CheckedPath, carrot: Carrot, observation: Observation, now: float
    ) -> None:
        """Plan the rest of a path before it gets there, or stop where its plan ends."""
        if carrot.time_s < path.extend_s:
            return
        # In a corner, or right before one, it could not be done without a stop.
        next_m = distance(carrot.state.position_enu_m, self._follower.points[0].position_enu_m)
        turns = norm(carrot.state.acceleration_enu_m_s2) > _IN_CORNER_M_S2
        near = next_m < _NEXT_POINT_NEAR_S * norm(carrot.state.velocity_enu_m_s)
        if (turns or near) and carrot.time_s < path.extend_s + _EXTEND_PATIENCE_S:
            return
        last_moment = carrot.time_s > float(path.samples.times_s[-1]) - _EXTEND_RETRY_S
        onward = self._follower.find_path(observation, under_way=True)
        if isinstance(onward, CheckedPath):
            self._follower.take(onward)
        elif last_moment and isinstance(onward, NoPath):
            self._stop(observation, now, onward.reason)
        elif onward is not None:
            self._follower.extend_at(carrot.time_s + _EXTEND_RETRY_S)

    def _least_m(self, place_enu_m: Vector3) -> float:
        """Return the length of the straight path through what is left of the points."""
        length_m = 0.0
        for point in self._follower.points:
            length_m += distance(place_enu_m, point.position_enu_m)
            place_enu_m = point.position_enu_m
        return length_m

    # --- what it does --------------------------------------------------------------------

    def _stop(self, observation: Observation, now: float, reason: str) -> None:
        self.reason = reason
        self._follower.plan_stop(observation)
        self._replanner.stop(measured_state(observation).position_enu_m, now)

    def _replan(self, observation: Observation, now: float) -> None:
        place = measured_state(observation).position_enu_m
        path = self._follower.find_path(observation, under_way=True)
        if path is None:
            return
        if isinstance(path, NoPath):
            self.reason = path.reason
            self._follower.plan_stop(observation)
            self._replanner.not_found(place, now)
        else:
            self._follower.take(path)
            self._replanner.found(place, now)

    def _compare(self, carrot: Carrot, observation: Observation, now: float) -> None:
        """Go over to a path that is clearly shorter, if there is one."""
        place = measured_state(observation).position_enu_m
        path = self._follower.find_path(observation, under_way=True)
        if path is None:
            return
        left_m = carrot.distance_remaining_m
        if isinstance(path, CheckedPath) and self._replanner.is_clearly_shorter(
            path.length_m, left_m
        ):
            self._follower.take(path)
            self._replanner.found(place, now)
        else:
            self._replanner.not_found(place, now)
