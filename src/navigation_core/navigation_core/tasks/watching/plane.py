"""Flies a plane: takes off, sends it from target to target, and circles the last.

To give way to traffic it is sent to another height, or to another place, for a time.
"""

from __future__ import annotations

from navigation_core.geometry import Vector3, distance
from navigation_core.outcomes import OutcomeCode
from navigation_core.tasks.act_queue import time_for
from navigation_core.tasks.conditions import (
    Dwell,
    located,
    measured_speed,
)
from navigation_core.tasks.goto_config import GotoConfig
from navigation_core.tasks.intents import Outcome, Wait
from navigation_core.tasks.observation import Observation, VehicleMode
from navigation_core.tasks.phased_task import Answer
from navigation_core.tasks.phases import BEFORE_FLIGHT, STOPPING, Phase
from navigation_core.tasks.progress import Progress, Status
from navigation_core.tasks.traffic.traffic_view import TrafficView
from navigation_core.tasks.traits import Traits
from navigation_core.tasks.watching.plane_route import Circling, PlaneRoute
from navigation_core.tasks.watching.sent_plane import IN_FLIGHT, SentPlane
from navigation_core.tasks.waypoint import Route

# Usual speeds of small planes, for estimates before it flies: ArduPlane's AIRSPEED_CRUISE is
# 12 to 22 m/s by frame, PX4's FW_AIRSPD_TRIM 15 m/s; both climb at 3 to 5 m/s.
_CRUISE_M_S, _CLIMB_M_S = 15.0, 3.0
_RUN_UP_S = 5.0
# A plane that gets no nearer by this much, in distance and height, within this time, will not get
# there. A circle of 80 m at 15 m/s takes half of it.
_STUCK_AFTER_S, _PROGRESS_MIN_M = 90.0, 2.0
# Faster up or down than this, it only passes the height.
_LEVEL_CLIMB_MAX_M_S = 1.5
# A metre of height takes a plane about as long as five on its way.
_HEIGHT_WEIGHT = 5.0


class FlyPlane(SentPlane):
    """The task of a plane's goal or route. See :class:`navigation_core.tasks.task.Task`."""

    def __init__(
        self,
        route: Route,
        config: GotoConfig,
        traits: Traits,
        takeoff_height_m: float,
        circle_m: float | None = None,
    ) -> None:
        """Prepare.

        Args:
            route: where to fly; the yaw of each waypoint is ignored, as a plane circles.
            config: tolerances and limits of time; its speeds and radii are for others.
            traits: what the plane can do.
            takeoff_height_m: height above the ground that a take-off is asked for.
            circle_m: radius of its circles about targets, negative clockwise; None: its usual one.
        """
        super().__init__(config, traits)
        self._circle_m = circle_m
        self._circle_size_m = abs(circle_m or traits.circle_radius_m)
        self._takeoff_height_m = takeoff_height_m
        # One lap; how it flies between them is the plane's own matter.
        self._path_enu_m = tuple(waypoint.position_enu_m for waypoint in route.waypoints)
        self._route = PlaneRoute(route, self._circle_size_m)
        self._last_enu_m: Vector3 | None = None
        self._circling = Circling(self._circle_size_m)
        self._circled = Dwell(config.arrival_dwell_s)
        self._nearest_m, self._nearest_s = float("inf"), 0.0
        self._acts_of: int | None = None  # the waypoint whose acts have begun
        self._handlers = {
            Phase.PREPARING: self._prepare,
            Phase.ARMING: self._arm,
            Phase.TAKING_OFF: self._take_off,
            Phase.NAVIGATING: self._fly,
            Phase.SETTLING: self._circle,
        }

    # --- the task protocol -----------------------------------------------------------

    def start(self, observation: Observation, now: float) -> None:
        """Begin."""
        super().start(observation, now)
        self._nearest_s = now

    def postpone(self, now: float) -> None:
        """Count the time of the request, and that without coming closer, from now on."""
        super().postpone(now)
        self._nearest_s = now

    def resume_control(self, now: float) -> None:
        """Send it on to its place, which brings the mode, or begin again on the ground."""
        super().resume_control(now)
        if self._phase in BEFORE_FLIGHT:
            self._go(Phase.PREPARING, now)

    def accepts_mode(self, mode: VehicleMode) -> bool:
        """A take-off has a mode of its own, and PX4 circles by itself after it."""
        if self._phase is Phase.DISARMING:
            # A PX4 that is disarmed leaves its take-off.
            return mode in (VehicleMode.HOLD, VehicleMode.CONTROL)
        if self._phase not in BEFORE_FLIGHT:
            return False
        if self._phase is Phase.TAKING_OFF and mode is not VehicleMode.TAKE_OFF:
            return False  # before its end, somebody else has chosen it
        return mode in (VehicleMode.TAKE_OFF, VehicleMode.HOLD, VehicleMode.CONTROL)

    def progress(self, observation: Observation, now: float) -> Progress:
        """Return the progress of the whole route."""
        position = observation.position_enu_m or self._last_enu_m
        status, route = super().progress(observation, now).status, self._route.progress()
        if position is None or self._phase is Phase.ENDED:
            return Progress(status, 0.0, 0.0, route)
        self._last_enu_m = position
        if self._phase in STOPPING:
            return Progress(status, 0.0, 1.0, route)
        if self._phase is Phase.SETTLING and self._route.current.stay_s > 0.0:
            status = Status.HOLDING
        measured_m_s = measured_speed(observation) or 0.0
        is_flying = self._phase in IN_FLIGHT
        speed_m_s = max(measured_m_s, 0.5 * _CRUISE_M_S) if is_flying else _CRUISE_M_S
        length_m, time_s = self._route.left(position, speed_m_s)
        waiting = self._giving_way.waiting if is_flying else None
        blocked = "" if waiting is None else waiting.text
        if blocked and status is not Status.PAUSED:
            status = Status.WAITING_FOR_TRAFFIC
        if self._phase is Phase.SETTLING:
            time_s -= min(now - self._phase_since_s, self._route.current.stay_s)
        if self._phase in BEFORE_FLIGHT and not observation.airborne:
            climb_m = max(self._takeoff_height_m - (position[2] - observation.ground_enu_m), 0.0)
            time_s += climb_m / _CLIMB_M_S + _RUN_UP_S
        time_s += self._config.arrival_dwell_s
        return Progress(status, length_m, time_s, route, blocked=blocked)

    # --- the state machine -----------------------------------------------------------

    def _go(self, phase: Phase, now: float) -> None:
        super()._go(phase, now)
        if phase is Phase.NAVIGATING:
            self._circling = Circling(self._circle_size_m)
        self._nearest_s = now
        self._nearest_m = float("inf")
        self._circled.reset()

    def _check(self, observation: Observation, now: float) -> Answer:
        """Look for what ends every flight, and do the acts of waypoints."""
        answer = super()._check(observation, now)
        if answer is not None or self._phase not in (Phase.NAVIGATING, Phase.SETTLING):
            return answer
        return self._acts.step(observation, now)

    def _stop(self, ending: Outcome, observation: Observation, now: float) -> Outcome | None:
        self._acts.give_up()
        return super()._stop(ending, observation, now)

    def _prepare(self, observation: Observation, now: float) -> Answer:
        rejection = self._departure.check(observation)
        if rejection is not None:
            return rejection
        if self._departure.moves(observation):
            return Phase.NAVIGATING
        return Phase.TAKING_OFF if observation.armed else Phase.ARMING

    def _arm(self, observation: Observation, now: float) -> Answer:
        return self._departure.arm(observation, now) or Phase.TAKING_OFF

    def _take_off(self, observation: Observation, now: float) -> Answer:
        height_m = self._takeoff_height_m
        return self._departure.take_off(height_m, observation, now) or Phase.NAVIGATING

    # --- the flight ------------------------------------------------------------------

    def _fly(self, observation: Observation, now: float) -> Answer:
        if self._pause_asked or observation.position_doubt:
            return self._begin_stay(observation)
        target = self._route.current.position_enu_m
        answer: Answer = self._destination.send(target, observation, now, self._circle_m)
        if answer is None:
            answer = self._leg_speed.ask(self._route.current.max_speed_m_s, observation, now)
        if answer is None:
            answer = self._check_headway(observation, now)
        if answer is not None:
            return answer
        known = located(observation, self._config.position_stale_s)
        if known is None:
            return Wait()
        position = known.state.position_enu_m
        if self._route.passed(position, known.state.velocity_enu_m_s):
            self._begin_acts(position)
            return self._next(observation, now)
        on_circle = self._circling.watch(position, target) and not self._giving_way.evades
        if self._route.stops and on_circle:
            self._giving_way.restart()
            return Phase.SETTLING
        left_m = distance(position, target) + _HEIGHT_WEIGHT * abs(position[2] - target[2])
        if left_m < self._nearest_m - _PROGRESS_MIN_M:
            self._nearest_m, self._nearest_s = left_m, now
            self._giving_way.restart()
        return Wait()

    def _check_headway(self, observation: Observation, now: float) -> Answer:
        """Look for a flight that does not get on, by itself or for traffic."""
        view, waiting = TrafficView.of(observation), self._giving_way.waiting
        if view is not None and waiting is not None:
            self._nearest_s = now
            if self._giving_way.waited_s > view.timeout_s:
                return self._over(OutcomeCode.TRAFFIC, waiting.text, observation)
        if now - self._nearest_s > _STUCK_AFTER_S:
            text = f"The vehicle has not come closer to its target for {_STUCK_AFTER_S:g} s."
            return self._over(OutcomeCode.TIMEOUT, text, observation)
        return None

    def _circle(self, observation: Observation, now: float) -> Answer:
        """Circle for the dwell, and for the hold time of the waypoint."""
        if self._pause_asked or observation.position_doubt:
            return self._begin_stay(observation)
        waypoint = self._route.current
        target = waypoint.position_enu_m
        answer = self._destination.send(target, observation, now, self._circle_m)
        if self._giving_way.evades:
            return Phase.NAVIGATING
        if answer is not None:
            return answer
        acts_s = time_for(waypoint.acts)
        if now - self._phase_since_s > _STUCK_AFTER_S + waypoint.hold_time_s + acts_s:
            text = "The vehicle did not stay on its circle around the target."
            return self._over(OutcomeCode.TIMEOUT, text, observation)
        known = located(observation, self._config.position_stale_s)
        if known is None:
            return Wait()
        here = known.state
        level = abs(here.velocity_enu_m_s[2]) <= _LEVEL_CLIMB_MAX_M_S
        on_circle = self._circling.watch(here.position_enu_m, waypoint.position_enu_m) and level
        settled = self._circled.holds(on_circle, now - observation.position_age_s)
        if not settled or now - self._phase_since_s < waypoint.hold_time_s:
            return Wait()
        self._begin_acts(here.position_enu_m)
        return Wait() if self._acts.is_busy else self._next(observation, now)

    def _begin_acts(self, position_enu_m: Vector3) -> None:
        """Begin the acts of the current waypoint, once; it is passed, or circled."""
        if self._acts_of != self._route.done:
            self._acts_of = self._route.done
            reached = self._route.is_within(position_enu_m)
            self._acts.add(self._route.number, self._route.current.acts, reached=reached)

    def _next(self, observation: Observation, now: float) -> Answer:
        """Advance to the next waypoint, or end on the circle about the last."""
        self._route.advance()
        if not self._route.over:
            return Phase.NAVIGATING
        text = "The plane circles the target"
        if self._route.total > 1:
            text = (
                f"Flew {self._route.done} of {self._route.total} waypoints, those without a hold "
                f"time within {self._route.pass_radius_m:.0f} m; the plane circles the last"
            )
        if self._acts.failed:
            text += f". Not done: {', '.join(self._acts.failed)}"
        return self._over(OutcomeCode.SUCCESS, f"{text}.", observation)

    def _error_m(self, observation: Observation) -> float | None:
        position = observation.position_enu_m
        target = self._route.current.position_enu_m
        return None if position is None else distance(position, target)
