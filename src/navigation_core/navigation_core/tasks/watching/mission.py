"""Flies a route as a mission: the vehicle stores and flies it, the task monitors it.

The mission is uploaded before anything moves, or once the vehicle holds if it is moving
already. Then it is armed if need be, and the mission is started; on the ground its first item
is a take-off. A pause has the vehicle hold, and its own memory of the item under way lets it
continue. A cancel has it hold, and then removes the mission, so that nobody starts it later by
a switch of the mode.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial

from navigation_core.geometry import Vector3, distance
from navigation_core.outcomes import OutcomeCode
from navigation_core.tasks.conditions import Dwell, Headway
from navigation_core.tasks.departure import Departure
from navigation_core.tasks.goto_config import GotoConfig
from navigation_core.tasks.intents import Outcome, Perform, StopFirst, Wait
from navigation_core.tasks.observation import Observation, TaskOperation, VehicleMode
from navigation_core.tasks.phased_task import Answer, PhasedTask
from navigation_core.tasks.phases import MISSION, STATUS, STOPPING, Phase
from navigation_core.tasks.progress import Progress, Status
from navigation_core.tasks.standstill import Standstill
from navigation_core.tasks.traits import Traits
from navigation_core.tasks.watching.mission_measures import MissionMeasures
from navigation_core.tasks.watching.mission_progress import MissionTally
from navigation_core.tasks.waypoint import MissionPlan, Route

# A vehicle that has moved by less than this in this time, hold times aside, is stuck.
_MOVED_M = 0.5
_STUCK_AFTER_S = 60.0
# A vehicle that moves, but comes no nearer to its waypoint, is astray after this.
_ASTRAY_AFTER_S = 300.0
# MISSION_CURRENT may come up to a second after the HEARTBEAT that belongs to it.
_REPORT_DELAY_MAX_S = 2.0
# Time for a hold and the deletion of the mission after an end.
_CLEAR_MAX_S = 10.0
_ITEM_UPLOAD_S = 0.5
# A waypoint that is not reported as reached counts as such when it was passed this near: the
# firmwares' own radii are 2 to 3 m by default (WPNAV_RADIUS, WP_RADIUS, NAV_ACC_RAD), and a
# plane's is that of its circle.
_PASSING_M, _PASSING_CIRCLES = 4.0, 2.0


class FlyMission(PhasedTask):
    """The task of one mission. See :class:`navigation_core.tasks.task.Task`."""

    table = MISSION

    def __init__(
        self,
        route: Route,
        config: GotoConfig,
        traits: Traits,
        speed_m_s: float | None = None,
    ) -> None:
        """Prepare.

        Args:
            route: where to fly.
            config: tolerances and limits of time.
            traits: what the vehicle can do.
            speed_m_s: ground speed where a waypoint has none; None leaves it to the vehicle.
        """
        super().__init__(config, Phase.HALTING)
        self._traits = traits
        self._plan = MissionPlan(
            route.waypoints * route.laps, speed_m_s=speed_m_s, circle_at_end=not traits.hovers
        )
        self._mission = MissionTally(
            route,
            speed_m_s or config.limits.speed_horizontal_m_s,
            passing_m=max(_PASSING_M, _PASSING_CIRCLES * traits.circle_radius_m),
        )
        self._measures = MissionMeasures(route.waypoints, config, traits)
        self._departure = Departure(config, traits, self._requests)
        self._stored = False
        self._left_mode = False
        self._started = False
        self._speed_told = True
        self._left_s: float | None = None
        self._moved_s = 0.0
        self._moved_from: Vector3 | None = None
        self._headway = Headway(_ASTRAY_AFTER_S)
        self._headed_for = 0
        self._arrival = Dwell(config.arrival_dwell_s)
        self._stopped = Standstill.of_stop(config, traits)
        self._handlers = {
            Phase.HALTING: self._halt,
            Phase.UPLOADING: self._upload,
            Phase.PREPARING: self._prepare,
            Phase.ARMING: self._arm,
            Phase.STARTING: self._begin,
            Phase.NAVIGATING: self._watch,
            Phase.PAUSING: self._stop_for_pause,
            Phase.PAUSED: self._stay,
        }

    # --- the task protocol -----------------------------------------------------------

    def start(self, observation: Observation, now: float) -> None:
        """Begin."""
        super().start(observation, now)
        # Items other than waypoints are the autopilot's own business.
        self._path_enu_m = tuple(waypoint.position_enu_m for waypoint in self._plan.waypoints)
        if self._measures.on_ground(observation) and observation.position_enu_m is not None:
            self._plan = replace(
                self._plan,
                takeoff_from_enu_m=observation.position_enu_m,
                takeoff_height_m=self._measures.takeoff_height_m(observation.ground_enu_m),
            )
        if not observation.armed or self._measures.on_ground(observation):
            self._go(Phase.UPLOADING, now)

    def accepts_mode(self, mode: VehicleMode) -> bool:
        """A PX4 holds by itself at the end, and when somebody removes the mission."""
        return self._phase is Phase.NAVIGATING and mode in (
            VehicleMode.MISSION,
            VehicleMode.HOLD,
        )

    def progress(self, observation: Observation, now: float) -> Progress:
        """Return the progress."""
        route = self._mission.route(self._phase is Phase.ENDED)
        if self._phase is Phase.ENDED:
            return Progress(self._status(observation), 0.0, 0.0, route)
        if self._phase in STOPPING:
            return Progress(Status.CANCELLING, 0.0, self._config.stop_dwell_s, route)
        way_m, time_s = self._mission.left(observation.position_enu_m)
        if self._plan.takeoff_from_enu_m is not None and not self._started:
            time_s += self._plan.takeoff_height_m / self._config.takeoff_climb_rate_m_s
            time_s += self._config.arming_time_s
        return Progress(self._status(observation), way_m, time_s, route)

    # --- the state machine -----------------------------------------------------------

    def _go(self, phase: Phase, now: float) -> None:
        super()._go(phase, now)
        self._moved_s = now
        self._headway.restart()
        self._left_s = None
        self._arrival.reset()
        self._stopped.reset()

    def _stop(self, ending: Outcome, observation: Observation, now: float) -> None:
        self._handlers[Phase.STOPPING] = partial(self._come_to_rest, ending)
        # A transfer that is cut off leaves neither the old mission nor ours (ArduPilot).
        if self._phase is Phase.UPLOADING and self._requests.current is not None:
            self._stored = True
        self._go(Phase.STOPPING, now)

    def _do(
        self,
        kind: TaskOperation,
        refusal: OutcomeCode,
        following: Phase,
        observation: Observation,
        now: float,
    ) -> Answer:
        """Perform an operation, then continue; a rejection ends the task, motors off if needed."""
        answer = self._requests.perform(Perform(kind), refusal, observation, now)
        if isinstance(answer, Outcome) and (self._departure.arming_asked or self._stored):
            return StopFirst(answer)
        if answer is None:
            self._go(following, now)
        return answer

    # --- before the flight -----------------------------------------------------------

    def _halt(self, observation: Observation, now: float) -> Answer:
        """Stop what was flown before: setpoints end, and an upload takes a while."""
        if observation.mode is VehicleMode.HOLD and self._requests.current is None:
            return Phase.UPLOADING
        return self._do(
            TaskOperation.HOLD, OutcomeCode.MODE_REFUSED, Phase.UPLOADING, observation, now
        )

    def _upload(self, observation: Observation, now: float) -> Answer:
        rejection = self._departure.check(observation)
        if rejection is not None:
            return rejection
        timeout_s = self._config.operation_timeout_s + _ITEM_UPLOAD_S * len(self._plan.waypoints)
        answer = self._requests.perform(
            Perform(TaskOperation.UPLOAD_MISSION, mission=self._plan),
            OutcomeCode.MISSION_REFUSED,
            observation,
            now,
            timeout_s,
        )
        if answer is None:
            self._stored = True
            self._go(Phase.STARTING if observation.armed else Phase.PREPARING, now)
        return answer

    def _prepare(self, observation: Observation, now: float) -> Answer:
        is_needed = self._traits.control_before_takeoff
        answer = self._departure.take_control(observation, now, is_needed) or Phase.ARMING
        return StopFirst(answer) if isinstance(answer, Outcome) else answer

    def _arm(self, observation: Observation, now: float) -> Answer:
        answer = self._departure.arm(observation, now) or Phase.STARTING
        return StopFirst(answer) if isinstance(answer, Outcome) else answer

    def _begin(self, observation: Observation, now: float) -> Answer:
        # It may have landed in a pause. Once it was asked to start, it is on its way.
        rejection = self._departure.check(observation)
        if rejection is not None and self._requests.current is None:
            return StopFirst(rejection)
        answer = self._do(
            TaskOperation.START_MISSION,
            OutcomeCode.MISSION_REFUSED,
            Phase.NAVIGATING,
            observation,
            now,
        )
        self._started = self._started or self._phase is Phase.NAVIGATING
        return answer

    # --- the flight ------------------------------------------------------------------

    def _watch(self, observation: Observation, now: float) -> Answer:
        report = observation.mission
        if report is not None and report.changed:
            text = f"The vehicle no longer holds the uploaded mission: {report.changed}."
            return Outcome(OutcomeCode.MISSION_CHANGED, text, None)
        if not observation.armed:
            text = "The vehicle was disarmed during its mission."
            return Outcome(OutcomeCode.DISARMED, text, None)
        current_s = self._phase_since_s + _REPORT_DELAY_MAX_S
        fresh = report if report is not None and report.time_s >= current_s else None
        self._mission.note(fresh, observation)
        arrived = self._measures.has_arrived(fresh, observation) and not observation.position_doubt
        if self._arrival.holds(arrived, now):
            text = self._mission.finish()
            if not self._traits.hovers:
                text += " It circles the last one."
            code = OutcomeCode.WAYPOINT_MISSED if self._mission.missed else OutcomeCode.SUCCESS
            return Outcome(code, text, self._measures.error_m(observation))
        if self._pause_asked or observation.position_doubt:
            return Phase.PAUSING
        if observation.mode is not VehicleMode.MISSION:
            return self._out_of_mode(observation, now)
        self._left_s = None
        if not self._speed_told:
            answer = self._tell_speed(observation, now)
            if answer is not None:
                return answer
        return self._look_for_motion(observation, now)

    def _tell_speed(self, observation: Observation, now: float) -> Answer:
        """Ask for the leg's speed again; one that is rejected is logged, and it flies on.

        An ArduCopter forgets the speed of its mission when it leaves AUTO (Copter's mode_auto.cpp,
        desired_speed_override).
        """
        speed_m_s = self._mission.target.max_speed_m_s or self._plan.speed_m_s
        answer: Answer = None
        if speed_m_s is not None:
            intent = Perform(TaskOperation.CHANGE_SPEED, speed_m_s=speed_m_s)
            answer = self._requests.perform(intent, OutcomeCode.MISSION_REFUSED, observation, now)
        if answer is not None and not isinstance(answer, Outcome):
            return answer
        self._speed_told = True
        self._requests.forget()
        return None

    def _out_of_mode(self, observation: Observation, now: float) -> Answer:
        """The vehicle holds by itself: at the end, or because somebody is at it."""
        if self._left_s is None:
            self._left_s = now
        last_m = self._measures.error_m(observation)
        at_end = self._measures.near_end(observation)
        patience_s = self._config.settle_timeout_s if at_end else _REPORT_DELAY_MAX_S
        if now - self._left_s <= patience_s:
            return Wait()
        if at_end:
            text = f"It stopped {last_m:.2f} m from the last waypoint and reports nothing further."
            return Outcome(OutcomeCode.TIMEOUT, text, last_m)
        text = "The vehicle left the mode in which it flies the mission."
        return Outcome(OutcomeCode.PILOT_OVERRIDE, text, None)

    def _look_for_motion(self, observation: Observation, now: float) -> Answer:
        position = observation.position_enu_m
        if position is not None and (
            self._moved_from is None or distance(position, self._moved_from) > _MOVED_M
        ):
            self._moved_from, self._moved_s = position, now
        limit_s = _STUCK_AFTER_S + self._mission.target.hold_time_s
        if now - self._moved_s > limit_s:
            text = f"The vehicle has not moved for {limit_s:g} s in its mission."
            return StopFirst(Outcome(OutcomeCode.TIMEOUT, text, None))
        if self._headway.is_lost(self._lengths_m(position), now, self._mission.target.hold_time_s):
            text = (
                f"The vehicle moves but gets no closer to waypoint {self._mission.current + 1} "
                "(counted over all laps)."
            )
            return StopFirst(Outcome(OutcomeCode.TIMEOUT, text, None))
        return Wait()

    def _lengths_m(self, position: Vector3 | None) -> tuple[float, ...]:
        """Return what shrinks with progress: the way to the waypoint that it is headed for."""
        if position is None:
            return ()
        current, target = self._mission.current, self._mission.target.position_enu_m
        if current != self._headed_for:
            self._headed_for = current
            self._headway.restart()
        return (distance(position, target),)

    def _stop_for_pause(self, observation: Observation, now: float) -> Answer:
        if self._holds_already(observation):
            return Phase.PAUSED
        return self._do(
            TaskOperation.HOLD, OutcomeCode.MODE_REFUSED, Phase.PAUSED, observation, now
        )

    def _stay(self, observation: Observation, now: float) -> Answer:
        if not observation.armed:
            text = "The vehicle was disarmed while its mission was paused."
            return Outcome(OutcomeCode.DISARMED, text, None)
        if self._pause_asked or observation.position_doubt:
            return Wait()
        self._speed_told = False
        return Phase.STARTING

    # --- the end ---------------------------------------------------------------------

    def _come_to_rest(self, ending: Outcome, observation: Observation, now: float) -> Answer:
        if (
            not observation.armed
            and self._requests.current is None
            and not self._arming(observation)
        ):
            return self._begin_to_clear(ending)
        grounded = self._departure.arming_asked and not self._started
        down = grounded or (self._departure.arming_asked and self._measures.on_ground(observation))
        kind = TaskOperation.DISARM if down else TaskOperation.HOLD
        timeout_s = self._config.cancel_timeout_s
        answer = None
        if down or not self._holds_already(observation):
            answer = self._requests.perform(
                Perform(kind), OutcomeCode.MODE_REFUSED, observation, now, timeout_s
            )
        if isinstance(answer, Outcome):
            return self._begin_to_clear(ending.after(answer.message))
        if answer is not None:
            return answer
        over = now - self._phase_since_s > self._config.cancel_timeout_s
        stopped = self._stopped.holds(observation, self._config.position_stale_s)
        if stopped or not self._traits.hovers or over:
            return self._begin_to_clear(ending.after(self._how_it_stopped(stopped)))
        return Wait()

    def _how_it_stopped(self, stopped: bool) -> str:
        if not self._traits.hovers:
            return "It circles."
        if stopped:
            return "It has stopped."
        return self._stopped.failure(self._config.cancel_timeout_s)

    def _begin_to_clear(self, ending: Outcome) -> Phase:
        self._handlers[Phase.CLEARING] = partial(self._clear, ending)
        return Phase.CLEARING

    def _clear(self, ending: Outcome, observation: Observation, now: float) -> Answer:
        # A PX4 that stands in its mission mode without a mission will not arm again.
        stands_in_mode = not observation.armed and observation.mode is VehicleMode.MISSION
        if stands_in_mode and not self._left_mode:
            hold = Perform(TaskOperation.HOLD)
            answer = self._requests.perform(hold, ending.code, observation, now, _CLEAR_MAX_S)
            if answer is not None and not isinstance(answer, Outcome):
                return answer
            self._left_mode = True
        changed = observation.mission is not None and observation.mission.changed
        if not self._stored or changed:
            return ending
        answer = self._requests.perform(
            Perform(TaskOperation.CLEAR_MISSION),
            ending.code,
            observation,
            now,
            _CLEAR_MAX_S,
        )
        if isinstance(answer, Outcome):
            return ending.after(answer.message)
        return answer or ending

    def _holds_already(self, observation: Observation) -> bool:
        """Whether it is in its hold mode, and nobody here has asked for another one."""
        report = observation.operation
        starting = report is not None and report.kind is TaskOperation.START_MISSION
        return (
            self._requests.current is None and observation.mode is VehicleMode.HOLD and not starting
        )

    def _arming(self, observation: Observation) -> bool:
        report = observation.operation
        return report is not None and report.kind is TaskOperation.ARM

    def _status(self, observation: Observation) -> Status:
        if self._phase is Phase.NAVIGATING:
            taking_off = self._plan.takeoff_from_enu_m is not None and self._measures.on_ground(
                observation
            )
            return Status.TAKING_OFF if taking_off else Status.NAVIGATING
        status = STATUS[self._phase]
        # Without a pause it is the position that has it stand.
        return Status.HOLDING if status is Status.PAUSED and not self._pause_asked else status
