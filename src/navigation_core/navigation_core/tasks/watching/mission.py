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

from navigation_core.geometry import distance
from navigation_core.outcomes import OutcomeCode
from navigation_core.tasks.conditions import Dwell
from navigation_core.tasks.departure import Departure
from navigation_core.tasks.goto_config import GotoConfig
from navigation_core.tasks.intents import Outcome, Perform, StopFirst, Wait
from navigation_core.tasks.observation import Observation, TaskOperation, VehicleMode
from navigation_core.tasks.phased_task import Answer, PhasedTask
from navigation_core.tasks.phases import MISSION, STATUS, STOPPING, Phase
from navigation_core.tasks.progress import Progress, Status
from navigation_core.tasks.traits import Traits
from navigation_core.tasks.watching.leg_speed import LegSpeed
from navigation_core.tasks.watching.mission_end import MissionEnd
from navigation_core.tasks.watching.mission_measures import MissionMeasures
from navigation_core.tasks.watching.mission_progress import MissionTally
from navigation_core.tasks.watching.motion_watch import MotionWatch
from navigation_core.tasks.waypoint import MissionPlan, Route

# A vehicle that has not moved for this time, hold times aside, is stuck.
_STUCK_AFTER_S = 60.0
# A vehicle that moves, but comes no nearer to its waypoint, is astray after this.
_ASTRAY_AFTER_S = 300.0
# MISSION_CURRENT may come up to a second after the HEARTBEAT that belongs to it.
_REPORT_DELAY_MAX_S = 2.0
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
        self._traits, self._route = traits, route
        self._plan = MissionPlan(route.flown, speed_m_s=speed_m_s, circle_at_end=not traits.hovers)
        self._mission = MissionTally(
            route,
            speed_m_s or config.limits.speed_horizontal_m_s,
            passing_m=max(_PASSING_M, _PASSING_CIRCLES * traits.circle_radius_m),
        )
        self._measures = MissionMeasures(route.flown, config, traits)
        self._departure = Departure(config, traits, self._requests)
        self._end = MissionEnd(config, traits, self._requests)
        self._started = self._has_risen = False
        self._leg_speed = LegSpeed(self._requests)
        # The mission itself sets its speeds, until it is left.
        self._speed_is_lost = False
        self._left_s: float | None = None
        self._motion = MotionWatch(_ASTRAY_AFTER_S)
        self._headed_for = 0
        self._arrival = Dwell(config.arrival_dwell_s)
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
        self._motion.restart(now)
        self._left_s = None
        self._arrival.reset()
        self._end.begin()

    def _stop(self, ending: Outcome, observation: Observation, now: float) -> None:
        self._handlers[Phase.STOPPING] = partial(self._come_to_rest, ending)
        # A transfer that is cut off leaves neither the old mission nor ours (ArduPilot).
        if self._phase is Phase.UPLOADING and self._requests.current is not None:
            self._end.mission_stored()
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
        if isinstance(answer, Outcome) and (self._departure.arming_asked or self._end.is_stored):
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
            self._end.mission_stored()
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
        if self._pauses_now(observation) or observation.position_doubt:
            return Phase.PAUSING
        if observation.mode is not VehicleMode.MISSION:
            return self._out_of_mode(observation, now)
        self._left_s = None
        if self._speed_is_lost:
            speed_m_s = self._mission.target.max_speed_m_s or self._plan.speed_m_s
            answer = self._leg_speed.ask(speed_m_s, observation, now)
            if answer is not None:
                return answer
            self._speed_is_lost = False
        if self._pause_asked:
            self._motion.restart(now)
            return Wait()
        return self._look_for_motion(observation, now)

    def _pauses_now(self, observation: Observation) -> bool:
        """Whether a pause begins: by the service, after the take-off; by a station, at once.

        Nearer to the ground a copter that holds may touch it again, and its autopilot disarms it.
        """
        self._has_risen = self._has_risen or self._measures.has_risen(self._plan, observation)
        is_held = observation.mode is not VehicleMode.MISSION
        return self._pause_asked and (self._has_risen or is_held)

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
        position, target = observation.position_enu_m, self._mission.target
        current = self._mission.current
        if current != self._headed_for and position is not None:
            self._headed_for = current
            self._motion.has_other_lengths()
        limit_s = _STUCK_AFTER_S + target.stay_s
        if self._motion.is_stuck(position, now, limit_s):
            text = f"The vehicle has not moved for {limit_s:g} s in its mission."
            return StopFirst(Outcome(OutcomeCode.TIMEOUT, text, None))
        away_m = () if position is None else (distance(position, target.position_enu_m),)
        if self._motion.is_astray(away_m, now, target.stay_s):
            text = (
                "The vehicle moves but gets no closer to waypoint "
                f"{self._route.numbers((current,))} (counted over all laps)."
            )
            return StopFirst(Outcome(OutcomeCode.TIMEOUT, text, None))
        return Wait()

    def _stop_for_pause(self, observation: Observation, now: float) -> Answer:
        if self._end.is_held(observation):
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
        # An ArduCopter that leaves AUTO forgets the speed of its mission (Copter's mode_auto.cpp,
        # desired_speed_override).
        self._leg_speed.forget()
        self._speed_is_lost = True
        return Phase.STARTING

    # --- the end ---------------------------------------------------------------------

    def _come_to_rest(self, ending: Outcome, observation: Observation, now: float) -> Answer:
        down = self._departure.arming_asked and (
            not self._started or self._measures.on_ground(observation)
        )
        since_s = self._phase_since_s
        answer = self._end.come_to_rest(ending, down, since_s, observation, now)
        if not isinstance(answer, Outcome):
            return answer
        self._handlers[Phase.CLEARING] = partial(self._end.clear, answer)
        return Phase.CLEARING

    def _status(self, observation: Observation) -> Status:
        if self._phase is Phase.NAVIGATING:
            taking_off = self._plan.takeoff_from_enu_m is not None and self._measures.on_ground(
                observation
            )
            return Status.TAKING_OFF if taking_off else Status.NAVIGATING
        status = STATUS[self._phase]
        # Without a pause it is the position that has it stand.
        return Status.HOLDING if status is Status.PAUSED and not self._pause_asked else status
