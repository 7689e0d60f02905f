"""Flies by setpoints: takes control, arms, takes off, flies from stop to stop, reports the outcome.

The vehicle is believed, never assumed: a phase ends when the vehicle's own state shows
that it has. While a take-off is in progress or the vehicle stands on the ground no setpoint
is sent, because a real ArduCopter then stays on the ground (observed).
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial

from navigation_core.geometry import KinematicState, Vector3, distance
from navigation_core.outcomes import OutcomeCode
from navigation_core.planning.replanner import Decision
from navigation_core.tasks.act_queue import ActQueue
from navigation_core.tasks.conditions import Dwell, Located, is_located, located, stand_on_ground
from navigation_core.tasks.departure import Departure
from navigation_core.tasks.flying.arrival import Arrival
from navigation_core.tasks.flying.itinerary import GotoEstimator, Itinerary
from navigation_core.tasks.flying.launch import Launch
from navigation_core.tasks.flying.path_leader import PathLeader
from navigation_core.tasks.flying.standing import Standing
from navigation_core.tasks.flying.stopping import FLYING, FlightParts, Stopping, first_phase
from navigation_core.tasks.intents import Fly, Intent, Outcome
from navigation_core.tasks.leading.avoider import Avoider
from navigation_core.tasks.leading.flight_terms import FlightTerms
from navigation_core.tasks.leading.path_follower import PathFollower
from navigation_core.tasks.observation import Observation, VehicleMode
from navigation_core.tasks.phased_task import Answer, PhasedTask
from navigation_core.tasks.phases import FLIGHT, STOPPING, Phase
from navigation_core.tasks.progress import Progress, Status
from navigation_core.tasks.standstill import Standstill
from navigation_core.trajectories.trajectory import TrajectoryError

_PAUSABLE = frozenset({Phase.NAVIGATING, Phase.SETTLING, Phase.BLOCKED})
# The phases in which a rover or boat is led by its pursuit; in all others it is stopping or stands.
_LED = frozenset({Phase.NAVIGATING, Phase.SETTLING})
_DOUBTING = _PAUSABLE | {Phase.PAUSED}


class SetpointFlight(PhasedTask):
    """The :class:`~navigation_core.tasks.task.Task` of a flight through an itinerary's stops."""

    table = FLIGHT

    def __init__(
        self, itinerary: Itinerary, terms: FlightTerms, acts: ActQueue | None = None
    ) -> None:
        """Prepare; the itinerary is expected to have passed ``safety.check_target``."""
        config, traits = terms.config, terms.traits
        super().__init__(config, Phase.PREPARING)
        section = itinerary.begin_section()
        self._itinerary = itinerary
        self._acts = acts or self._acts
        self._traits = traits
        self._follower = PathFollower(section.goal, terms)
        self._follower.lead_to(section.goal, section.points, section.yaws_enu_rad, section.part)
        self._avoider = None
        self.may_replan = terms.avoidance is not None
        if terms.avoidance is not None:
            self._avoider = Avoider(terms.avoidance, traits, self._follower)
        self._leader = PathLeader(terms, self._follower)
        self._in_traffic = self._leader.in_traffic
        self._estimator = GotoEstimator(section.goal, config, self._follower.limits, traits)
        self._arrival = Arrival(section, config, traits)
        still, landed = Standstill.of_stop(config, traits), Dwell(config.landed_timeout_s)
        self._parts = FlightParts(
            config, traits, self._requests, self._follower, self._arrival, still, landed
        )
        self._departure = Departure(config, traits, self._requests, self._arrival.error_m)
        self._standing = Standing(
            self._parts, self._in_traffic, self._avoider, lambda: self._pause_asked
        )
        self._stopping: Stopping | None = None
        self._by_itself = terms.handover.by_itself  # until the first change of phase
        self._replan_failed: TrajectoryError | None = None
        launch = Launch(self._parts, self._departure, self._estimator)
        self._handlers = {
            Phase.PREPARING: launch.prepare,
            Phase.ARMING: launch.arm,
            Phase.TAKING_OFF: launch.take_off,
            Phase.NAVIGATING: self._navigate,
            Phase.SETTLING: self._settle,
            Phase.HOLDING: self._standing.hold,
            Phase.PAUSED: self._standing.pause,
        }
        if self._avoider is not None:
            self._handlers[Phase.BLOCKED] = partial(self._wait_for_path, self._avoider)

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
        if not self._traits.flies:
            observation = self._arrival.level(observation)
        self._estimator.start(observation, self._follower)

    def replan(self, observation: Observation, now: float) -> None:
        """Search for another path around obstacles, if need be."""
        if self._avoider is None or self._phase is not Phase.NAVIGATING or self._cancel_asked:
            return
        is_known = is_located(observation, self._config.position_stale_s)
        if not is_known or self._follower.sent.is_stale:
            return
        if not self._traits.flies:
            observation = self._arrival.level(observation)
        try:
            self._avoider.replan(observation, now)
        except TrajectoryError as error:
            self._replan_failed = error

    def resume_control(self, now: float) -> None:
        """Take control again, and plan from where the vehicle is then."""
        if self._phase is Phase.PREPARING or self._phase in STOPPING:
            return
        self._follower.forget_commanded()
        if self._avoider is not None:
            self._avoider.restart_clock()
        self._parts.forget()
        self._go(Phase.PREPARING, now)

    def accepts_mode(self, mode: VehicleMode) -> bool:
        """Some autopilots take off in a mode of their own, and leave it when they are disarmed."""
        if self._traits.control_before_takeoff or self._phase in FLYING:
            return False
        left = mode is VehicleMode.HOLD and self._phase is Phase.DISARMING
        return left or mode is VehicleMode.TAKE_OFF

    def progress(self, observation: Observation, now: float) -> Progress:
        """Return the progress of all sections."""
        if not self._traits.flies:
            observation = self._arrival.level(observation)
        carrot, elapsed_s = self._follower.carrot, now - self._phase_since_s
        progress = self._estimator.progress(self._phase, elapsed_s, carrot, observation)
        if self._avoider is not None:
            progress = replace(progress, replans=self._avoider.replans)
            if self._phase is Phase.BLOCKED and self._avoider.reason:
                progress = replace(progress, blocked=self._avoider.reason)
            elif self._phase is Phase.BLOCKED:
                # The first search, for a fraction of a second: no obstacle is known.
                progress = replace(progress, status=Status.NAVIGATING)
        waiting = self._in_traffic.last.waiting
        if waiting is not None and self._phase is Phase.NAVIGATING:
            status = Status.WAITING_FOR_TRAFFIC
            progress = replace(progress, status=status, blocked=waiting.text)
        position = observation.position_enu_m
        return self._itinerary.total(progress, position, self._estimator.is_straight)

    def step(self, observation: Observation, now: float) -> Intent | Outcome:
        """Return what to do now, or how it ended; a setpoint is safe if no other follows."""
        if self._outcome is not None:
            return self._outcome
        if not self._traits.flies:
            observation = self._arrival.level(observation)
        if self._follower.sent.step_begins(now):
            self._parts.forget()
        try:
            if self._replan_failed is not None:
                raise self._replan_failed
            if (observation.position_doubt or self._pause_asked) and not self._cancel_asked:
                self._interrupt(observation, now)
            answer = super().step(observation, now)
        except TrajectoryError as error:
            ending = self._over(OutcomeCode.INTERNAL_ERROR, str(error), observation)
            return self._finish(ending, now)
        if not isinstance(answer, Fly):
            return answer
        if observation.position_doubt or self._phase is Phase.STOPPING:
            answer = self._standing.held(answer, observation)
        return self._leader.limited(answer, observation, self._phase is Phase.NAVIGATING)

    # --- the state machine -----------------------------------------------------------

    def _begin_phase(self, phase: Phase, observation: Observation, now: float) -> None:
        if phase is Phase.NAVIGATING:
            self._begin_flight(observation, now)
        else:
            self._go(phase, now)

    def _interrupt(self, observation: Observation, now: float) -> None:
        """Stand still for a position that is in doubt, or for a pause."""
        if observation.position_doubt and self._phase in _DOUBTING:
            self._go(self._standing.lose_position(observation), now)
        elif self._pause_asked and self._phase in _PAUSABLE:
            self._follower.plan_stop(observation)
            self._go(Phase.PAUSED, now)

    def _go(self, phase: Phase, now: float) -> None:
        super()._go(phase, now)
        self._by_itself = False
        self._arrival.restart()
        self._standing.begin(now)

    def _stop(self, ending: Outcome, observation: Observation, now: float) -> Outcome | None:
        self._acts.give_up()
        first = first_phase(self._parts, self._departure, self._phase, self._by_itself, observation)
        if first is None:
            return ending
        stopping = Stopping(self._parts, ending, self._departure, observation, now)
        self._stopping = stopping
        self._handlers[Phase.STOPPING] = stopping.brake
        self._handlers[Phase.DISARMING] = stopping.disarm
        if first is Phase.STOPPING:
            self._follower.plan_stop(observation)
        self._go(first, now)
        return None

    def _check(self, observation: Observation, now: float) -> Answer:
        """Look for what ends or suspends every flight."""
        if self._phase not in FLYING:
            return None
        if not observation.armed:
            text = "The vehicle was disarmed during the goal."
            return self._over(OutcomeCode.DISARMED, text, observation)
        if not observation.in_control:
            text = "The vehicle left the mode in which it follows setpoints."
            return self._over(OutcomeCode.PILOT_OVERRIDE, text, observation)
        on_ground = observation.airborne is False and self._traits.flies
        if self._parts.landed.holds(on_ground, now):
            if self._stopping is not None:
                return self._stopping.ended("The vehicle is on the ground.", observation)
            text = f"The vehicle has been on the ground for {self._config.landed_timeout_s:g} s."
            return self._over(OutcomeCode.LANDED, text, observation)
        if on_ground:
            return stand_on_ground(observation)
        return self._acts.step(observation, now) if self._phase in _PAUSABLE else None

    def _over(self, code: OutcomeCode, text: str, observation: Observation) -> Outcome:
        return Outcome(code, text, self._arrival.error_m(observation))

    # --- the flight ------------------------------------------------------------------

    def _begin_flight(self, observation: Observation, now: float) -> None:
        """Plan the flight, and begin it or wait for a path."""
        section = self._itinerary.begin_section(observation)
        self._follower.lead_to(section.goal, section.points, section.yaws_enu_rad, section.part)
        self._estimator.set_goal(section.goal.position_enu_m)
        self._arrival.expect(section)
        if self._phase not in _LED:
            self._leader.restart()
        self._follower.plan_to_goal(observation)
        may_begin = self._avoider is None or self._avoider.may_begin(observation, now)
        self._go(Phase.NAVIGATING if may_begin else Phase.BLOCKED, now)

    def _navigate(self, observation: Observation, now: float) -> Answer:
        here = located(observation, self._config.position_stale_s)
        if here is None:
            return self._standing.lose_position(observation)
        traffic = self._leader.among_others(observation, now)
        if self._follower.sent.is_stale or self._follower.carrot is None:
            self._begin_flight(observation, now)
            traffic = self._leader.among_others(observation, now)
        elif self._avoider is not None and not self._avoider.keeps_going(observation, now):
            return Phase.BLOCKED
        carrot = self._follower.carrot
        if carrot is None or self._phase is not Phase.NAVIGATING:
            return None
        if traffic.waiting is not None and traffic.is_over:
            return self._over(OutcomeCode.TRAFFIC, traffic.waiting.text, observation)
        path = self._leader.walk(carrot, here, self._itinerary, observation, traffic.share)
        radius_m = self._arrival.radius_m
        if not traffic.leads_elsewhere:
            if carrot.arrived if path is None else path.left_m <= radius_m:
                if self._avoider is not None and self._avoider.has_ended_short(observation, now):
                    return Phase.BLOCKED
                carrot.finish()
                return Phase.SETTLING if self._arrival.settles else self._arrived(here)
            if carrot.stalled_s > self._arrival.patience_s:
                return self._arrival.timeout("The vehicle made no progress", observation)
            self._standing.note_left(carrot.distance_remaining_m)
        return Fly(self._leader.setpoint(carrot, here, radius_m, observation, path))

    def _settle(self, observation: Observation, now: float) -> Answer:
        here, carrot = located(observation, self._config.position_stale_s), self._follower.carrot
        if here is None:
            return self._standing.lose_position(observation)
        if self._follower.sent.is_stale or carrot is None:
            return Phase.NAVIGATING
        if self._avoider is not None and self._avoider.is_too_near(observation, now):
            return Phase.BLOCKED
        if self._in_traffic.gives_way(observation, now):
            # The follower has the path of the evasion; to begin the flight would plan another.
            self._go(Phase.NAVIGATING, now)
            return None
        arrival = self._arrival
        is_there = arrival.holds(observation, now, arrival.is_turned(observation))
        if is_there and not self._acts.holds_at_stop():
            return self._arrived(here)
        stay_s = arrival.hold_time_s + self._acts.stop_s
        if now - self._phase_since_s > arrival.patience_s + stay_s:
            return arrival.timeout("The vehicle did not settle", observation)
        return Fly(self._leader.setpoint(carrot, here, arrival.radius_m, observation))

    def _arrived(self, here: Located) -> Answer:
        """End, or continue; the vehicle has been near, turned and slow for its time."""
        error_m = distance(here.position_enu_m, self._arrival.goal.position_enu_m)
        ending = self._itinerary.arrive(error_m)
        if ending is not None:
            return ending
        self._standing.restart()
        return Phase.NAVIGATING

    def _wait_for_path(self, avoider: Avoider, observation: Observation, now: float) -> Answer:
        """Stand still until obstacles leave a path, or it has taken too long."""
        here = located(observation, self._config.position_stale_s)
        if here is None:
            return self._standing.lose_position(observation)
        # A vehicle that is at its target already only waits to be slow; but the first search,
        # without a reason yet, is no obstacle to a goal that is close by, or a turn.
        is_blocked = bool(avoider.reason)
        if is_blocked and self._arrival.holds(observation, now) and not self._acts.holds_at_stop():
            return self._arrived(here)
        is_there = is_blocked and self._arrival.is_near(observation)
        decision = avoider.wait(observation, now, may_plan=not is_there)
        if decision is Decision.GIVE_UP:
            return self._over(*avoider.failure(), observation)
        if decision is Decision.REPLAN:
            self._begin_flight(observation, now)
            if self._phase is not Phase.BLOCKED:
                return None
        return self._standing.stand(observation, now)
