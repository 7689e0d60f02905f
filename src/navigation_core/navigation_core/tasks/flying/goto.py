"""Flies to a point: takes control, arms, takes off, flies there, settles, reports the outcome.

The vehicle is believed, never assumed: a phase ends when the vehicle's own state shows
that it has. While a take-off is under way or the vehicle stands on the ground no setpoint
is sent, because a real ArduCopter then stays on the ground (observed).
"""

from __future__ import annotations

import math

from navigation_core.geometry import KinematicState
from navigation_core.outcomes import OutcomeCode
from navigation_core.planning.replanner import Decision
from navigation_core.tasks.base import COPTER, Fly, Observation, Outcome, Setpoint, Traits
from navigation_core.tasks.flying.goto_base import PAUSABLE, Answer
from navigation_core.tasks.flying.goto_config import GotoConfig, GotoConfigError, GotoGoal
from navigation_core.tasks.flying.goto_phases import Phase, PhaseEvent
from navigation_core.tasks.flying.goto_stopping import GotoStopping
from navigation_core.tasks.leading.avoidance import AvoidanceConfig
from navigation_core.tasks.leading.carrot import Carrot
from navigation_core.tasks.leading.driven_path import DrivenPath
from navigation_core.tasks.leading.turning_circle import Pursuer
from navigation_core.tasks.measurement import is_located, measured_speed, measured_state

__all__ = ["Goto", "GotoConfig", "GotoConfigError", "GotoGoal"]

# So much nearer along the path than ever before is progress.
_NEARER_M = 1.0


class Goto(GotoStopping):
    """The task of one goal, and the base of routes. See :class:`~.base.Task`."""

    def __init__(
        self,
        goal: GotoGoal,
        config: GotoConfig,
        predecessor: KinematicState | None = None,
        predecessor_yaw: float | None = None,
        predecessor_time_s: float | None = None,
        traits: Traits = COPTER,
        avoidance: AvoidanceConfig | None = None,
    ) -> None:
        """Prepare; the arguments are those of :class:`~.goto_base.GotoBase`."""
        super().__init__(
            goal, config, predecessor, predecessor_yaw, predecessor_time_s, traits, avoidance
        )
        self._handlers = {
            Phase.PREPARING: self._prepare,
            Phase.ARMING: self._arm,
            Phase.TAKING_OFF: self._take_off,
            Phase.NAVIGATING: self._navigate,
            Phase.SETTLING: self._settle,
            Phase.BLOCKED: self._wait_for_path,
            Phase.HOLDING: self._hold,
            Phase.PAUSED: self._stay,
            Phase.BRAKING: self._brake,
            Phase.DISARMING: self._disarm,
        }

    def _begin_flight(self, event: PhaseEvent, observation: Observation, now: float) -> None:
        if self._phase not in PAUSABLE:
            self._pursuit.forget()
        self._follower.plan_to_goal(observation)
        if self._avoider is not None and not self._avoider.may_begin(observation, now):
            event = PhaseEvent.NO_WAY
        self._go(event, now)

    def _navigate(self, observation: Observation, now: float) -> Answer:
        if not is_located(observation, self._config.position_stale_s):
            return self._lose_position(observation, now)
        if self._follower.is_stale or self._follower.carrot is None:
            self._begin_flight(PhaseEvent.REPLAN, observation, now)
        elif self._avoider is not None and not self._avoider.keeps_going(observation, now):
            self._go(PhaseEvent.NO_WAY, now)
        if self._phase is not Phase.NAVIGATING:
            return None
        carrot = self._follower.carrot
        assert carrot is not None
        here_enu_m = measured_state(observation).position_enu_m
        path = None
        if self._traits.flies:
            self._follower.walk(here_enu_m, self._caution.speed_share(carrot, observation))
        else:
            path = self._follower.follow(here_enu_m, self._until_s())
        self._note_place(observation)
        if carrot.arrived if path is None else path.left_m <= self._arrival_radius_m:
            carrot.finish()
            self._go(PhaseEvent.TRAJECTORY_ENDED, now)
            return None
        if carrot.stalled_s > self._patience_s:
            return self._timeout("The vehicle made no progress", observation)
        if carrot.distance_remaining_m < self._least_left_m - _NEARER_M:
            self._least_left_m, self._held_s = carrot.distance_remaining_m, 0.0
        return Fly(self._setpoint(carrot, observation, path))

    def _note_place(self, observation: Observation) -> None:
        """Record where the vehicle has come to on its way."""

    def _until_s(self) -> float:
        """Return up to when, in the carrot's time, the path may be looked ahead to."""
        return math.inf

    def _settle(self, observation: Observation, now: float) -> Answer:
        if not is_located(observation, self._config.position_stale_s):
            return self._lose_position(observation, now)
        if self._follower.is_stale:
            self._begin_flight(PhaseEvent.REPLAN, observation, now)
            return None
        if self._avoider is not None and self._avoider.is_too_near(observation, now):
            self._go(PhaseEvent.NO_WAY, now)
            return None
        turned = self._yaw_error_rad(observation) <= self._config.arrival_yaw_rad
        if self._has_arrived(observation, now, turned):
            return self._arrived(observation, now)
        if now - self._phase_since_s > self._patience_s + self._hold_time_s:
            return self._timeout("The vehicle did not settle", observation)
        assert self._follower.carrot is not None
        return Fly(self._setpoint(self._follower.carrot, observation))

    def _setpoint(
        self, carrot: Carrot, observation: Observation, path: DrivenPath | None = None
    ) -> Setpoint:
        """Return what leads the vehicle along: the carrot, or a velocity along the path."""
        if self._traits.flies:
            return carrot.setpoint
        here, yaw = measured_state(observation), observation.yaw_enu_rad
        assert yaw is not None
        return self._pursuit.follow(
            path,
            carrot.trajectory.end_position_enu_m,
            Pursuer(here.position_enu_m, here.velocity_enu_m_s, yaw),
            self._follower.limits,
            self._arrival_radius_m,
            observation.time_s,
        )

    def _is_near(self, observation: Observation) -> bool:
        error_m = self._error_m(observation)
        return error_m is not None and error_m <= self._arrival_radius_m

    def _has_arrived(self, observation: Observation, now: float, turned: bool = True) -> bool:
        """Whether the vehicle has been near, turned and slow for its time.

        Slow is what its velocity or what its positions show: the velocity of a PX4 may be off by
        0.5 m/s for half a minute after a long flight (observed).
        """
        speed_m_s = measured_speed(observation)
        still = self._still.holds(observation, self._config.position_stale_s)
        slow = still or (speed_m_s is not None and speed_m_s <= self._config.arrival_speed_m_s)
        there = self._is_near(observation) and turned
        # A position that is only repeated adds nothing to the dwell.
        return self._arrival.holds(there and slow, now - observation.position_age_s)

    def _arrived(self, observation: Observation, now: float) -> Answer:
        """End, or go on; the vehicle has been near, turned and slow for its time."""
        error_m = self._error_m(observation)
        return Outcome(OutcomeCode.SUCCESS, f"Arrived, {error_m:.2f} m from the target.", error_m)

    def _lose_position(self, observation: Observation, now: float) -> Answer:
        """Stop the setpoint, because where the vehicle is is not known."""
        self._follower.plan_stop(observation)
        self._go(PhaseEvent.POSITION_LOST, now)
        return None

    def _hold(self, observation: Observation, now: float) -> Answer:
        located = is_located(observation, self._config.position_stale_s)
        held_s = self._held_s + now - self._phase_since_s
        if held_s > self._patience_s and not self._pause_asked:
            # Each time it comes back the flight restarts, and with it all other patience.
            text = (
                f"The vehicle's position is intermittent: the vehicle held for {held_s:.0f} s in "
                "total without getting closer."
            )
            return Outcome(OutcomeCode.NO_POSITION, text, None)
        if located and not observation.position_doubt:
            if self._doubted:
                self._doubted = False
                self._forget()
            self._held_s = 0.0 if self._pause_asked else held_s
            self._begin_flight(PhaseEvent.REPLAN, observation, now)
            return None
        if located:
            self._phase_since_s = now  # it is not lost; for how long it may be in doubt is not ours
        timeout_s = self._config.position_timeout_s
        age_s = observation.position_age_s
        too_old = math.isfinite(age_s) and age_s > timeout_s
        # The age alone is not enough: the position may be new and its heading missing.
        if too_old or now - self._phase_since_s > timeout_s:
            text = (
                f"The vehicle has reported no valid position, velocity and yaw for {timeout_s:g} s."
            )
            return Outcome(OutcomeCode.NO_POSITION, text, None)
        self._follower.walk(None)
        return self._led(observation)

    def _stay(self, observation: Observation, now: float) -> Answer:
        """Stand still where the pause came, until it is over."""
        located = is_located(observation, self._config.position_stale_s)
        if not located:
            return self._lose_position(observation, now)
        if not self._pause_asked:
            if self._avoider is not None:
                self._avoider.restart_clock()
            self._begin_flight(PhaseEvent.REPLAN, observation, now)
            return None
        return self._stand(observation, now)

    def _stand(self, observation: Observation, now: float) -> Answer:
        """Brake and stand, but give way to what comes near."""
        if self._follower.is_stale or self._follower.carrot is None:
            self._follower.plan_stop(observation)
        elif self._avoider is not None:
            self._avoider.give_way(observation, now)
        self._follower.walk(None)
        return self._led(observation)

    def _wait_for_path(self, observation: Observation, now: float) -> Answer:
        """Stand still until obstacles leave a path, or it has taken too long."""
        assert self._avoider is not None
        if not is_located(observation, self._config.position_stale_s):
            return self._lose_position(observation, now)
        if self._has_arrived(observation, now):
            return self._arrived(observation, now)
        # Who is there already only waits to be slow.
        is_there = self._is_near(observation)
        decision = self._avoider.wait(observation, now, may_plan=not is_there)
        if decision is Decision.GIVE_UP:
            return self._over(*self._avoider.failure(), observation)
        if decision is Decision.REPLAN:
            self._begin_flight(PhaseEvent.REPLAN, observation, now)
            if self._phase is not Phase.BLOCKED:
                return None
        return self._stand(observation, now)
