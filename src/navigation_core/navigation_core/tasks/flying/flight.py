"""Flies by setpoints: takes control, arms, takes off, flies from stop to stop, reports the outcome.

The vehicle is believed, never assumed: a phase ends when the vehicle's own state shows
that it has. While a take-off is in progress or the vehicle stands on the ground no setpoint
is sent, because a real ArduCopter then stays on the ground (observed).
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial

from navigation_core.geometry import KinematicState, Vector3, distance
from navigation_core.outcomes import OutcomeCode
from navigation_core.planning.replanner import Decision
from navigation_core.tasks.conditions import Dwell, stand_on_ground
from navigation_core.tasks.departure import Departure, is_pending
from navigation_core.tasks.flying.arrival import Arrival
from navigation_core.tasks.flying.goto_progress import GotoEstimator
from navigation_core.tasks.flying.itinerary import Itinerary, Section
from navigation_core.tasks.flying.stopping import FlightParts, Stopping, led
from navigation_core.tasks.intents import (
    Fly,
    Intent,
    Outcome,
    Setpoint,
)
from navigation_core.tasks.leading.avoider import Avoider
from navigation_core.tasks.leading.carrot import Carrot
from navigation_core.tasks.leading.driven_path import DrivenPath
from navigation_core.tasks.leading.flight_terms import FlightTerms
from navigation_core.tasks.leading.path_follower import PathFollower
from navigation_core.tasks.leading.path_in_traffic import PathInTraffic
from navigation_core.tasks.leading.pursuit import Pursuit
from navigation_core.tasks.leading.run_out_limiter import RunOutLimiter
from navigation_core.tasks.leading.turning_circle import Pursuer
from navigation_core.tasks.measurement import Located, is_located, located
from navigation_core.tasks.observation import Observation, TaskOperation, VehicleMode
from navigation_core.tasks.phased_task import Answer, PhasedTask
from navigation_core.tasks.phases import FLIGHT, STOPPING, Phase
from navigation_core.tasks.progress import Progress, Status
from navigation_core.tasks.standstill import Standstill
from navigation_core.trajectories.trajectory import TrajectoryError

_PAUSABLE = frozenset({Phase.NAVIGATING, Phase.SETTLING, Phase.BLOCKED})
# The phases in which a rover or boat is led by its pursuit; in all others it is stopping or stands.
_LED = frozenset({Phase.NAVIGATING, Phase.SETTLING})
_DOUBTING = _PAUSABLE | {Phase.PAUSED}
_FLYING = _PAUSABLE | {Phase.HOLDING, Phase.PAUSED, Phase.STOPPING}
# The remaining path must get shorter than ever before by this much to count as progress.
_PROGRESS_MIN_M = 1.0


class SetpointFlight(PhasedTask):
    """The task of a flight through the stops of an itinerary.

    See :class:`~navigation_core.tasks.task.Task`.
    """

    table = FLIGHT

    def __init__(self, itinerary: Itinerary, terms: FlightTerms) -> None:
        """Prepare; the itinerary is expected to have passed ``safety.check_target``."""
        config, traits = terms.config, terms.traits
        super().__init__(config, Phase.PREPARING)
        section = itinerary.begin_section()
        self._itinerary = itinerary
        self._traits = traits
        self._follower = PathFollower(section.goal, terms)
        self._avoider = None
        if terms.avoidance is not None:
            self._avoider = Avoider(terms.avoidance, traits, self._follower)
        self._run_out_limiter = RunOutLimiter(
            terms.avoidance, traits, self._follower.limits, terms.bounds
        )
        self._in_traffic = PathInTraffic(traits, self._follower, terms.avoidance)
        self._estimator = GotoEstimator(section.goal, config, self._follower.limits, traits)
        self._arrival = Arrival(section, config, traits)
        still = Standstill.of_stop(config, traits)
        self._parts = FlightParts(
            config, traits, self._requests, self._follower, self._arrival, still
        )
        self._departure = Departure(config, traits, self._requests, self._arrival.error_m)
        self._stopping: Stopping | None = None
        self._pursuit = Pursuit(traits)
        self._by_itself = terms.handover.by_itself  # until the first change of phase
        # Whether the vehicle was held by its velocity, so that it has drifted from its setpoint.
        self._doubted = False
        self._thought_failed: TrajectoryError | None = None
        # Time without a position since the flight last got nearer to its end.
        self._held_s = 0.0
        self._least_left_m = math.inf
        self._landed = Dwell(config.landed_timeout_s)
        self._handlers = {
            Phase.PREPARING: self._prepare,
            Phase.ARMING: self._arm,
            Phase.TAKING_OFF: self._take_off,
            Phase.NAVIGATING: self._navigate,
            Phase.SETTLING: self._settle,
            Phase.HOLDING: self._hold,
            Phase.PAUSED: self._stay,
        }
        if self._avoider is not None:
            self._handlers[Phase.BLOCKED] = partial(self._wait_for_path, self._avoider)
        self._set_section(section)

    # --- the task protocol -----------------------------------------------------------

    @property
    def commanded(self) -> KinematicState | None:
        """State of the setpoint sent last, for a successor; None before the first."""
        sent = self._follower.sent.commanded
        return None if sent is None else sent.state

    @property
    def commanded_yaw_enu_rad(self) -> float | None:
        """Yaw of the setpoint sent last; None before the first."""
        sent = self._follower.sent.commanded
        return None if sent is None else sent.yaw_enu_rad

    @property
    def path_enu_m(self) -> tuple[Vector3, ...]:
        """The path that is planned, in the map frame; the same object until it is replanned."""
        return self._follower.path_enu_m

    def start(self, observation: Observation, now: float) -> None:
        """Begin."""
        super().start(observation, now)
        self._follower.sent.start(now)
        self._estimator.start(self._level(observation), self._follower)

    def think(self, observation: Observation, now: float) -> None:
        """Look for another path around obstacles, if need be."""
        if self._avoider is None or self._phase is not Phase.NAVIGATING or self._cancel_asked:
            return
        if (
            is_located(observation, self._config.position_stale_s)
            and not self._follower.sent.is_stale
        ):
            try:
                self._avoider.think(self._level(observation), now)
            except TrajectoryError as error:
                self._thought_failed = error

    def resume_control(self, now: float) -> None:
        """Take control again, and plan from where the vehicle is then."""
        if self._phase is Phase.PREPARING or self._phase in STOPPING:
            return
        self._follower.forget_commanded()
        if self._avoider is not None:
            self._avoider.restart_clock()
        self._forget()
        self._go(Phase.PREPARING, now)

    def accepts_mode(self, mode: VehicleMode) -> bool:
        """Some autopilots leave the mode that obeys setpoints for the take-off, and hold after."""
        if self._traits.control_before_takeoff:
            return False
        before_flight = self._phase not in _FLYING
        return before_flight and mode in (VehicleMode.TAKE_OFF, VehicleMode.HOLD)

    def progress(self, observation: Observation, now: float) -> Progress:
        """Return the progress of all sections."""
        elapsed_s = now - self._phase_since_s
        observation = self._level(observation)
        progress = self._estimator.progress(
            self._phase, elapsed_s, self._follower.carrot, observation
        )
        if self._avoider is not None:
            progress = replace(progress, replans=self._avoider.replans)
            if self._phase is Phase.BLOCKED and self._avoider.reason:
                progress = replace(progress, blocked=self._avoider.reason)
            elif self._phase is Phase.BLOCKED:
                # The first search, for a fraction of a second: no obstacle is known.
                progress = replace(progress, status=Status.NAVIGATING)
        if self._phase is Phase.NAVIGATING:
            waiting = self._in_traffic.last.waiting
            if waiting is not None:
                status = Status.WAITING_FOR_TRAFFIC
                progress = replace(progress, status=status, blocked=waiting.text)
        position = observation.position_enu_m
        return self._itinerary.total(progress, position, self._estimator.is_straight)

    # --- the state machine -----------------------------------------------------------

    def _level(self, observation: Observation) -> Observation:
        """Put what drives at the height of its goal: the home that heights count from moves."""
        position = observation.position_enu_m
        if self._traits.flies or position is None:
            return observation
        height_m = self._arrival.goal.position_enu_m[2]
        return replace(observation, position_enu_m=(position[0], position[1], height_m))

    def _answer(self, observation: Observation, now: float) -> Intent | Outcome:
        observation = self._level(observation)
        if self._follower.sent.step_begins(now):
            self._forget()
        try:
            if self._thought_failed is not None:
                raise self._thought_failed
            self._interrupt(observation, now)
            answer = super()._answer(observation, now)
        except TrajectoryError as error:
            answer = self._over(OutcomeCode.INTERNAL_ERROR, str(error), observation)
        if not isinstance(answer, Fly):
            return answer
        braking = self._doubted and self._phase is Phase.STOPPING
        if observation.position_doubt or braking:
            answer = replace(answer, by_velocity=True)
            self._doubted = True
        if self._follower.carrot is not None:
            self._follower.sent.note(self._follower.carrot)
        answer = replace(
            answer, setpoint=self._run_out_limiter.limited(answer.setpoint, observation)
        )
        if self._phase is not Phase.NAVIGATING:
            self._in_traffic.forget()
            return answer
        setpoint = self._in_traffic.limited(answer.setpoint, observation)
        if setpoint is not answer.setpoint:
            self._pursuit.hold_back()
        return replace(answer, setpoint=setpoint)

    def _handle(self, observation: Observation, now: float) -> Answer:
        answer = self._check_flight(observation, now) or super()._handle(observation, now)
        if answer is not Phase.NAVIGATING:
            return answer
        self._begin_flight(observation, now)
        return None

    def _interrupt(self, observation: Observation, now: float) -> None:
        """Stand still for a position that is in doubt, or for a pause."""
        if self._cancel_asked:
            return
        if observation.position_doubt and self._phase in _DOUBTING:
            self._go(self._lose_position(observation), now)
        elif self._pause_asked and self._phase in _PAUSABLE:
            self._follower.plan_stop(observation)
            self._go(Phase.PAUSED, now)

    def _go(self, phase: Phase, now: float) -> None:
        super()._go(phase, now)
        self._by_itself = False
        self._arrival.restart()

    def _forget(self) -> None:
        """Drop what a time without steps makes worthless."""
        self._follower.sent.outdate()
        self._arrival.forget()
        self._parts.still.reset()
        self._landed.reset()

    def _stop(self, ending: Outcome, observation: Observation, now: float) -> Outcome | None:
        arming_asked = self._departure.arming_asked
        preparing = self._phase is Phase.PREPARING
        inherited = preparing and self._follower.sent.commanded is not None
        # It has come out of another mode just now, perhaps at speed.
        taken = preparing and self._requests.current is not None and self._movable(observation)
        # A replaced goal may have left something in progress.
        arming = any(
            is_pending(observation, kind) for kind in (TaskOperation.ARM, TaskOperation.DISARM)
        )
        taking_off = is_pending(observation, TaskOperation.TAKE_OFF)
        on_ground = self._phase is Phase.TAKING_OFF or arming or taking_off
        # It would get into a mode without setpoints, in which a PX4 soon returns by itself.
        taking_control = observation.airborne is True and is_pending(
            observation, TaskOperation.TAKE_CONTROL
        )
        self._stopping = stopping = Stopping(self._parts, ending, arming_asked or arming, now)
        self._handlers[Phase.STOPPING] = stopping.brake
        self._handlers[Phase.DISARMING] = stopping.disarm
        if self._phase in _FLYING or (observation.in_control and (inherited or taken)):
            self._follower.plan_stop(observation)
            self._go(Phase.STOPPING, now)
        elif (
            on_ground
            or arming_asked
            or self._departure.take_off_asked
            or taking_control
            or (self._by_itself and not observation.in_control and self._movable(observation))
        ):
            self._go(Phase.DISARMING, now)
        else:
            return ending
        return None

    def _movable(self, observation: Observation) -> bool:
        return self._departure.moves(observation)

    def _check_flight(self, observation: Observation, now: float) -> Answer:
        """Look for what ends or suspends every flight."""
        if self._phase not in _FLYING:
            return None
        if not observation.armed:
            text = "The vehicle was disarmed during the goal."
            return self._over(OutcomeCode.DISARMED, text, observation)
        if not observation.in_control:
            text = "The vehicle left the mode in which it follows setpoints."
            return self._over(OutcomeCode.PILOT_OVERRIDE, text, observation)
        on_ground = observation.airborne is False and self._traits.flies
        if self._landed.holds(on_ground, now):
            if self._stopping is not None:
                return self._stopping.ended("The vehicle is on the ground.", observation)
            text = f"The vehicle has been on the ground for {self._config.landed_timeout_s:g} s."
            return self._over(OutcomeCode.LANDED, text, observation)
        return stand_on_ground(observation) if on_ground else None

    def _over(self, code: OutcomeCode, text: str, observation: Observation) -> Outcome:
        return Outcome(code, text, self._arrival.error_m(observation))

    # --- before the flight -----------------------------------------------------------

    def _prepare(self, observation: Observation, now: float) -> Answer:
        # A take-off that a replaced goal began continues.
        taking_off = is_pending(observation, TaskOperation.TAKE_OFF)
        rejection = self._departure.check(observation)
        if rejection is not None and not taking_off:
            return rejection
        moves = self._movable(observation)
        is_needed = not taking_off and (self._traits.control_before_takeoff or moves)
        answer = self._departure.take_control(observation, now, is_needed)
        if answer is not None:
            return answer
        if moves and not taking_off:
            return Phase.NAVIGATING
        # The vehicle is on the ground: the last setpoint of an earlier flight is no start for this.
        self._follower.forget_commanded()
        return Phase.TAKING_OFF if observation.armed or taking_off else Phase.ARMING

    def _arm(self, observation: Observation, now: float) -> Answer:
        following = Phase.TAKING_OFF if self._traits.flies else Phase.PREPARING
        return self._departure.arm(observation, now) or following

    def _take_off(self, observation: Observation, now: float) -> Answer:
        height_m = self._estimator.takeoff_height_m(observation.ground_enu_m)
        following = Phase.NAVIGATING if observation.in_control else Phase.PREPARING
        return self._departure.take_off(height_m, observation, now) or following

    # --- the flight ------------------------------------------------------------------

    def _set_section(self, section: Section) -> None:
        """Pass the parts of the flight the section that is to be flown."""
        self._follower.lead_to(section.goal, section.points, section.yaws_enu_rad)
        self._estimator.set_goal(section.goal.position_enu_m)
        self._arrival.expect(section)

    def _begin_flight(self, observation: Observation, now: float) -> None:
        """Plan the flight, and begin it or wait for a path."""
        self._set_section(self._itinerary.begin_section())
        if self._phase not in _LED:
            self._pursuit.forget()
        self._follower.plan_to_goal(observation)
        avoider = self._avoider
        may_begin = avoider is None or avoider.may_begin(observation, now)
        self._go(Phase.NAVIGATING if may_begin else Phase.BLOCKED, now)

    def _navigate(self, observation: Observation, now: float) -> Answer:
        here = located(observation, self._config.position_stale_s)
        if here is None:
            return self._lose_position(observation)
        traffic = self._in_traffic.step(observation, now)
        if self._follower.sent.is_stale or self._follower.carrot is None:
            self._begin_flight(observation, now)
            traffic = self._in_traffic.step(observation, now)
        elif self._avoider is not None and not self._avoider.keeps_going(observation, now):
            return Phase.BLOCKED
        carrot = self._follower.carrot
        if carrot is None or self._phase is not Phase.NAVIGATING:
            return None
        if traffic.waiting is not None and traffic.is_over:
            return self._over(OutcomeCode.TRAFFIC, traffic.waiting.text, observation)
        path = self._walk(carrot, here, observation, traffic.share)
        if traffic.leads_elsewhere:
            return Fly(self._setpoint(carrot, here, observation, path))
        if carrot.arrived if path is None else path.left_m <= self._arrival.radius_m:
            carrot.finish()
            return Phase.SETTLING
        if carrot.stalled_s > self._arrival.patience_s:
            return self._arrival.timeout("The vehicle made no progress", observation)
        if carrot.distance_remaining_m < self._least_left_m - _PROGRESS_MIN_M:
            self._least_left_m, self._held_s = carrot.distance_remaining_m, 0.0
        return Fly(self._setpoint(carrot, here, observation, path))

    def _walk(
        self, carrot: Carrot, here: Located, observation: Observation, share: float
    ) -> DrivenPath | None:
        """Move the setpoint on at a share of its speed; return the path ahead of what drives."""
        here_enu_m = here.state.position_enu_m
        path = None
        if self._traits.flies:
            share = min(share, self._run_out_limiter.speed_share(carrot, observation))
            self._follower.walk(here_enu_m, share)
        else:
            meet = self._itinerary.point_to_meet()
            until_s = math.inf if meet is None else self._follower.passed_at_s(meet)
            path = self._follower.follow(here_enu_m, until_s)
        if self._itinerary.note_place(
            observation.position_enu_m, self._follower.passed, self._pursuit.leaves
        ):
            self._follower.sent.outdate()  # so it is replanned, from here to the same point
        return path

    def _settle(self, observation: Observation, now: float) -> Answer:
        here, carrot = located(observation, self._config.position_stale_s), self._follower.carrot
        if here is None:
            return self._lose_position(observation)
        if self._follower.sent.is_stale or carrot is None:
            return Phase.NAVIGATING
        if self._avoider is not None and self._avoider.is_too_near(observation, now):
            return Phase.BLOCKED
        if self._in_traffic.gives_way(observation, now):
            # The follower has the path of the evasion; to begin the flight would plan another.
            self._go(Phase.NAVIGATING, now)
            return None
        arrival = self._arrival
        if arrival.holds(observation, now, arrival.is_turned(observation)):
            return self._arrived(here)
        if now - self._phase_since_s > arrival.patience_s + arrival.hold_time_s:
            return arrival.timeout("The vehicle did not settle", observation)
        return Fly(self._setpoint(carrot, here, observation))

    def _setpoint(
        self,
        carrot: Carrot,
        here: Located,
        observation: Observation,
        path: DrivenPath | None = None,
    ) -> Setpoint:
        """Return what leads the vehicle along: the carrot, or a velocity along the path."""
        if self._traits.flies:
            return carrot.setpoint
        return self._pursuit.follow(
            path,
            carrot.trajectory.end_position_enu_m,
            Pursuer(here.state.position_enu_m, here.velocity_enu_m_s, here.yaw_enu_rad),
            self._follower.limits,
            self._arrival.radius_m,
            observation.time_s,
        )

    def _arrived(self, here: Located) -> Answer:
        """End, or continue; the vehicle has been near, turned and slow for its time."""
        error_m = distance(here.position_enu_m, self._arrival.goal.position_enu_m)
        ending = self._itinerary.arrive(error_m)
        if ending is not None:
            return ending
        self._held_s, self._least_left_m = 0.0, math.inf
        return Phase.NAVIGATING

    def _lose_position(self, observation: Observation) -> Phase:
        """Stop the setpoint, because where the vehicle is is not known."""
        self._follower.plan_stop(observation)
        return Phase.HOLDING

    def _hold(self, observation: Observation, now: float) -> Answer:
        is_known = is_located(observation, self._config.position_stale_s)
        held_s = self._held_s + now - self._phase_since_s
        if held_s > self._arrival.patience_s and not self._pause_asked:
            # Each time it comes back the flight restarts, and with it all other patience.
            text = (
                f"The vehicle's position is intermittent: the vehicle held for {held_s:.0f} s in "
                "total without getting closer."
            )
            return Outcome(OutcomeCode.NO_POSITION, text, None)
        if is_known and not observation.position_doubt:
            if self._doubted:
                self._doubted = False
                self._forget()
            self._held_s = 0.0 if self._pause_asked else held_s
            return Phase.NAVIGATING
        if is_known:
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
        return led(self._parts, observation)

    def _stay(self, observation: Observation, now: float) -> Answer:
        """Stand still where the pause came, until it is over."""
        if not is_located(observation, self._config.position_stale_s):
            return self._lose_position(observation)
        if self._pause_asked:
            return self._stand(observation, now)
        if self._avoider is not None:
            self._avoider.restart_clock()
        return Phase.NAVIGATING

    def _stand(self, observation: Observation, now: float) -> Answer:
        """Brake and stand, but give way to what comes near."""
        if self._follower.sent.is_stale or self._follower.carrot is None:
            self._follower.plan_stop(observation)
        elif not self._in_traffic.gives_way(observation, now) and self._avoider is not None:
            self._avoider.give_way(observation, now)
        self._follower.walk(None)
        return led(self._parts, observation)

    def _wait_for_path(self, avoider: Avoider, observation: Observation, now: float) -> Answer:
        """Stand still until obstacles leave a path, or it has taken too long."""
        here = located(observation, self._config.position_stale_s)
        if here is None:
            return self._lose_position(observation)
        # A vehicle that is at its target already only waits to be slow; but the first search,
        # without a reason yet, is no obstacle to a goal that is close by, or a turn.
        is_blocked = bool(avoider.reason)
        if is_blocked and self._arrival.holds(observation, now):
            return self._arrived(here)
        is_there = is_blocked and self._arrival.is_near(observation)
        decision = avoider.wait(observation, now, may_plan=not is_there)
        if decision is Decision.GIVE_UP:
            return self._over(*avoider.failure(), observation)
        if decision is Decision.REPLAN:
            self._begin_flight(observation, now)
            if self._phase is not Phase.BLOCKED:
                return None
        return self._stand(observation, now)
