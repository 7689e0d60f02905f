"""Land and return to launch: the vehicle flies them, the task monitors it.

Both are modes of the autopilot. The task asks for the mode, follows what the vehicle says
and measures, and judges the end by that: on the ground with the motors off, or at the launch
point. A cancel has the vehicle hold where it is.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial

from navigation_core.geometry import Vector3, horizontal_norm, subtract
from navigation_core.outcomes import OutcomeCode, Rejection
from navigation_core.tasks.conditions import Dwell, measured_speed
from navigation_core.tasks.goto_config import GotoConfig
from navigation_core.tasks.intents import Outcome, Perform, Wait
from navigation_core.tasks.observation import Observation, TaskOperation, VehicleMode
from navigation_core.tasks.phased_task import Answer, PhasedTask
from navigation_core.tasks.phases import LED, Phase
from navigation_core.tasks.progress import Progress, Status
from navigation_core.tasks.standstill import Standstill
from navigation_core.tasks.traits import Traits
from navigation_core.tasks.watching.led_measures import LedMeasures
from navigation_core.tasks.watching.motion_watch import MotionWatch
from navigation_core.tasks.watching.plane_route import Circling

# A vehicle that has not moved for this long is stuck. ArduCopter waits 5 s above the launch
# point before it lands (RTL_LOIT_TIME), PX4 up to 5 s (RTL_LAND_DELAY).
_STUCK_AFTER_S = 60.0
# One that moves, but comes neither nearer to the launch point nor lower, nor climbs to return,
# is astray after this; an approach to a landing may lead away from it for a while.
_ASTRAY_AFTER_S = 300.0
# RTL_ALT of ArduCopter is at most 3000 m.
_RETURN_HEIGHT_MAX_M = 3000.0
_DEPTH_MAX_M = 1000.0
# A plane circles the launch point, wider than its own parameter says: ArduPlane's standard
# simulated plane at 96 m, where that says 80 m.
_CIRCLE_SHARE = 1.5
# One that only passes is out of the circle again sooner than this.
_CIRCLING_MIN_S = 12.0
# A landing this near to where the return began is no return, unless that is home.
_NOT_RETURNED_WITHIN_M = 3.0
# Both firmwares descend slower than this at last, and disarm a second or more after the touchdown.
# A vehicle that was faster than this a moment before its disarming has crashed, or its motors were
# stopped in the air; a PX4 without motors reports that it is on the ground. The moment is that of
# a HEARTBEAT.
_CRASH_SPEED_MIN_M_S, _CRASH_WITHIN_S = 2.0, 1.5
# A landing has succeeded once two HEARTBEATs, which come each second, have had time to deny it.
_SURE_S = 2.2


@dataclass(frozen=True)
class VehicleLedGoal:
    """The goal that the vehicle carries out by itself.

    Attributes:
        operation: how it is asked.
        mode: the mode that this leads to.
        name: for sentences: "landing".
    """

    operation: TaskOperation
    mode: VehicleMode
    name: str


LAND = VehicleLedGoal(TaskOperation.LAND, VehicleMode.LAND, "landing")
LAND_ON_TARGET = VehicleLedGoal(TaskOperation.LAND_ON_TARGET, VehicleMode.LAND, "landing")
RETURN_TO_LAUNCH = VehicleLedGoal(TaskOperation.RETURN, VehicleMode.RETURN, "return")


class VehicleLed(PhasedTask):
    """Landing or return. See :class:`navigation_core.tasks.task.Task`."""

    table = LED

    def __init__(self, goal: VehicleLedGoal, config: GotoConfig, traits: Traits) -> None:
        """Prepare.

        Args:
            goal: :data:`LAND` or :data:`RETURN_TO_LAUNCH`.
            config: tolerances and limits of time.
            traits: what the vehicle can do.
        """
        super().__init__(config, Phase.STARTING)
        self._goal = goal
        self._traits = traits
        self._landing_seen = False
        self._measures = LedMeasures(config, traits)
        self._begun_at: Vector3 | None = None
        self._disarmed_s: float | None = None
        self._fast: tuple[float, float] = (-math.inf, 0.0)
        self._motion = MotionWatch(_ASTRAY_AFTER_S if traits.flies else _STUCK_AFTER_S)
        self._circling = Circling(traits.circle_radius_m)
        self._arrived = Dwell(config.arrival_dwell_s if traits.hovers else _CIRCLING_MIN_S)
        self._landed = Dwell(_SURE_S)
        self._stopped = Standstill.of_stop(config, traits)
        self._handlers = {Phase.STARTING: self._begin, Phase.NAVIGATING: self._watch}

    # --- the task protocol -----------------------------------------------------------

    def start(self, observation: Observation, now: float) -> None:
        """Begin."""
        super().start(observation, now)
        self._begun_at = self._measures.position(observation)

    def pause(self, now: float) -> Rejection | None:
        """Reject: the vehicle flies by itself."""
        return Rejection(
            OutcomeCode.UNSUPPORTED_VEHICLE,
            f"A {self._goal.name} cannot be paused; cancel it to make the vehicle hold.",
        )

    def unpause(self, now: float) -> None:
        """Nothing to continue with."""

    def accepts_mode(self, mode: VehicleMode) -> bool:
        """PX4 changes from its return mode to its landing mode, and to another on the ground."""
        if self._phase is not Phase.NAVIGATING:
            return False
        if mode is VehicleMode.MISSION:
            # A plane's return may go over to the landing that its mission holds (ArduPlane's
            # RTL_AUTOLAND, observed: mode AUTO, without having been asked).
            return self._goal is RETURN_TO_LAUNCH and not self._traits.hovers
        return mode in (self._goal.mode, VehicleMode.LAND)

    def progress(self, observation: Observation, now: float) -> Progress:
        """Return the progress."""
        if self._phase is Phase.ENDED:
            return Progress(self._status(observation), 0.0, 0.0)
        left_m, left_s = self._measures.landing(observation)
        if self._phase is Phase.STOPPING:
            return Progress(Status.CANCELLING, 0.0, self._config.stop_dwell_s)
        home_m = self._measures.home_m(observation)
        if self._goal is RETURN_TO_LAUNCH and home_m is not None:
            speed_m_s = max(
                self._measures.speed_m_s(observation), self._config.limits.speed_horizontal_m_s
            )
            left_m, left_s = left_m + home_m, left_s + home_m / speed_m_s
        return Progress(self._status(observation), left_m, left_s)

    # --- the state machine -----------------------------------------------------------

    def _check(self, observation: Observation, now: float) -> Answer:
        speed_m_s = self._measures.speed_m_s(observation)
        if observation.armed and speed_m_s > _CRASH_SPEED_MIN_M_S:
            self._fast = (now, speed_m_s)
        landed = self._measures.is_on_ground(observation) and self._traits.flies
        is_sure = self._landed.holds(landed, now)
        if not landed:
            return None
        outcome = self._on_the_ground(observation, now)
        is_success = isinstance(outcome, Outcome) and outcome.code is OutcomeCode.SUCCESS
        return Wait() if is_success and not is_sure else outcome

    def _begin(self, observation: Observation, now: float) -> Answer:
        grounded = observation.airborne is False and self._traits.flies
        if grounded and self._requests.current is None:
            # Its mode for a return might begin with a climb.
            text = f"The vehicle is on the ground; no {self._goal.name} is needed."
            return Outcome(OutcomeCode.NOT_FLYING, text, None)
        self._motion.restart(now)
        return self._ask(self._goal.operation, observation, now) or Phase.NAVIGATING

    def _ask(self, kind: TaskOperation, observation: Observation, now: float) -> Answer:
        return self._requests.perform(Perform(kind), OutcomeCode.MODE_REFUSED, observation, now)

    def _watch(self, observation: Observation, now: float) -> Answer:
        if not observation.armed and not self._traits.flies:
            return self._disarmed(observation, now)
        if self._arrived.holds(self._at_launch(observation), now):
            text = (
                "The vehicle circles the launch point."
                if not self._traits.hovers
                else "The vehicle is at the launch point."
            )
            return Outcome(OutcomeCode.SUCCESS, text, self._measures.home_m(observation))
        position = self._measures.position(observation)
        # Without a position it may be on its way all the same.
        located = position is not None
        stuck_s = _STUCK_AFTER_S if located else _ASTRAY_AFTER_S
        if self._motion.is_stuck(position, now, stuck_s):
            what = "has not moved" if located else "has not been seen to move, without a position,"
            text = f"The vehicle {what} for {stuck_s:g} s in its {self._goal.name}."
            return Outcome(OutcomeCode.TIMEOUT, text, None)
        longer_s = _ASTRAY_AFTER_S if observation.home_enu_m is None or not located else 0.0
        if self._motion.is_astray(self._lengths_m(observation), now, longer_s):
            text = f"The vehicle moves but makes no progress in its {self._goal.name}."
            return Outcome(OutcomeCode.TIMEOUT, text, self._measures.home_m(observation))
        return Wait()

    def _disarmed(self, observation: Observation, now: float) -> Wait | Outcome:
        """A PX4 rover disarms at the end, and nearer than RTL_MIN_DIST without having moved."""
        if self._waits_for_position(observation, now):
            return Wait()
        home_m = self._measures.home_m(observation)
        if home_m is None:
            return Outcome(
                OutcomeCode.DISARMED, "The vehicle was disarmed during its return.", None
            )
        if home_m <= self._measures.arrival_m:
            text = "The vehicle is at the launch point with its motors off."
            return Outcome(OutcomeCode.SUCCESS, text, home_m)
        text = f"The vehicle was disarmed {home_m:.1f} m from the launch point."
        return Outcome(OutcomeCode.DISARMED, text, home_m)

    def _lengths_m(self, observation: Observation) -> tuple[float, ...]:
        """Return what shrinks with progress: the path home, the height, and what it may climb."""
        if self._measures.position(observation) is None:
            return ()
        home_m = self._measures.home_m(observation)
        way_m = math.inf if home_m is None else home_m
        if not self._traits.flies:
            return (way_m,)
        height_m = max(self._measures.height_m(observation), -_DEPTH_MAX_M)
        if self._goal is not RETURN_TO_LAUNCH:
            return (height_m,)
        return (way_m, height_m, max(_RETURN_HEIGHT_MAX_M - height_m, 0.0))

    def _stop(self, ending: Outcome, observation: Observation, now: float) -> None:
        self._handlers[Phase.STOPPING] = partial(self._hold, ending)
        self._go(Phase.STOPPING, now)

    def _hold(self, ending: Outcome, observation: Observation, now: float) -> Answer:
        answer = self._ask(TaskOperation.HOLD, observation, now)
        still = self._stopped.holds(observation, self._config.position_stale_s)
        if isinstance(answer, Outcome):
            text = answer.message
        elif answer is None and not self._traits.hovers:
            text = "It circles."
        elif answer is None and still:
            text = "The vehicle has stopped."
        elif now - self._phase_since_s > self._config.cancel_timeout_s:
            text = self._stopped.failure(self._config.cancel_timeout_s)
        else:
            return answer or Wait()
        return ending.after(text)

    def _on_the_ground(self, observation: Observation, now: float) -> Wait | Outcome:
        fast_s, speed_m_s = self._fast
        if now - fast_s < _CRASH_WITHIN_S:
            text = f"The vehicle was disarmed while it moved at {speed_m_s:.1f} m/s."
            return Outcome(OutcomeCode.DISARMED, text, None)
        if self._cancel_asked:
            text = "The goal was cancelled. The vehicle is on the ground with its motors off."
            return Outcome(OutcomeCode.CANCELED, text, None)
        home_m = self._measures.home_m(observation) if self._goal is RETURN_TO_LAUNCH else None
        if self._goal is RETURN_TO_LAUNCH and self._measures.position(observation) is None:
            if self._waits_for_position(observation, now):
                return Wait()
            text = "The vehicle is on the ground with its motors off; where it is is unknown."
            return Outcome(OutcomeCode.LANDED, text, None)
        if (
            home_m is not None
            and home_m > self._measures.arrival_m
            and self._is_where_it_began(observation)
        ):
            text = f"The vehicle landed where it was, {home_m:.1f} m from the launch point."
            return Outcome(OutcomeCode.LANDED, text, home_m)
        text = "The vehicle is on the ground with its motors off."
        return Outcome(OutcomeCode.SUCCESS, text, home_m)

    def _waits_for_position(self, observation: Observation, now: float) -> bool:
        """Whether the position of a disarmed vehicle, which stands, may still come."""
        self._disarmed_s = now if self._disarmed_s is None else self._disarmed_s
        lacks = self._measures.position(observation) is None
        return lacks and now - self._disarmed_s <= self._config.position_timeout_s

    # --- what is measured ------------------------------------------------------------

    def _is_where_it_began(self, observation: Observation) -> bool:
        """Whether it has not flown anywhere: a rally point may be far from the launch point."""
        position, begun = self._measures.position(observation), self._begun_at
        if position is None or begun is None:
            return False
        return horizontal_norm(subtract(position, begun)) < _NOT_RETURNED_WITHIN_M

    def _at_launch(self, observation: Observation) -> bool:
        """Whether a vehicle that does not land is where it was to return to."""
        if self._goal is not RETURN_TO_LAUNCH or observation.mode is not VehicleMode.RETURN:
            return False
        position, home = self._measures.position(observation), observation.home_enu_m
        if position is None or home is None:
            return False
        home_m = horizontal_norm(subtract(position, home))
        if not self._traits.hovers:
            # It circles at the height of its return, whatever that is, perhaps further off.
            rounds = self._circling.watch(position, (home[0], home[1], position[2]))
            return rounds or home_m <= _CIRCLE_SHARE * self._traits.circle_radius_m
        if self._traits.flies:
            return False  # it lands there
        speed_m_s = measured_speed(observation)
        slow = speed_m_s is not None and speed_m_s <= self._config.arrival_speed_m_s
        return slow and home_m <= self._measures.arrival_m

    def _status(self, observation: Observation) -> Status:
        if self._phase is Phase.STARTING:
            return Status.PREPARING
        # PX4 says ON_GROUND for two seconds before it disarms.
        self._landing_seen = self._landing_seen or (
            observation.mode is VehicleMode.LAND or observation.landing
        )
        # A PX4 rover says that it lands when it has come home.
        landing = self._goal is LAND or (self._landing_seen and self._traits.flies)
        return Status.LANDING if landing else Status.RETURNING
