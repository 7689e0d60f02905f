"""A landing on a target: the vehicle lands by itself where it is told that the target is.

The task watches that the target is seen. Without it, it holds and waits; once it has lost it, it
climbs to where it searches, and lands again. See :class:`navigation_core.tasks.task.Task`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum, auto

from navigation_core.geometry import KinematicState, Vector3, horizontal_norm, subtract
from navigation_core.outcomes import OutcomeCode, Rejection
from navigation_core.tasks.conditions import Requester, is_located
from navigation_core.tasks.flying.goto import GotoGoal, fly_to
from navigation_core.tasks.inputs.tracked_target import TrackedTarget
from navigation_core.tasks.inputs.waypoint_acts import ActOrder
from navigation_core.tasks.intents import Intent, Outcome, Perform, Wait
from navigation_core.tasks.leading.flight_terms import FlightTerms
from navigation_core.tasks.observation import Observation, TaskOperation, VehicleMode
from navigation_core.tasks.progress import Progress, Status
from navigation_core.tasks.task import Task
from navigation_core.tasks.watching import vehicle_led

__all__ = ["OFF_MAX_M", "TargetLanding", "TargetLandingGoal"]

OFF_MAX_M = 1.0
"""A vehicle that stands farther from the target, over ground, has not landed on it."""
# How long it waits for the target; a camera needs seconds after a climb.
_WAITS_S = 10.0
# Within this height it goes on without the target, which fills the camera's picture or is in its
# own shadow; there is no room for a climb either.
_COMMITTED_M = 1.0
# Height within which no flight to the search height is needed.
_AT_HEIGHT_M = 1.0


@dataclass(frozen=True)
class TargetLandingGoal:
    """The terms of a landing on a target.

    Attributes:
        is_required: whether the vehicle holds instead of landing without the target.
        retries: how often it climbs and searches again.
        search_up_m: map z at which it searches; None for as high as it is at the beginning.
    """

    is_required: bool
    retries: int
    search_up_m: float | None = None


class _Stage(Enum):
    CLIMB = auto()
    WAIT = auto()
    ON_TARGET = auto()
    ANYWHERE = auto()


class TargetLanding(Task):
    """Searches, lands on the target, and searches again once it has lost it."""

    def __init__(self, goal: TargetLandingGoal, terms: FlightTerms) -> None:
        """Prepare.

        Args:
            goal: what is asked for.
            terms: of a flight to where it searches.
        """
        self._goal, self._terms = goal, terms
        self._stage = _Stage.WAIT
        self._task: Task | None = None
        self._led = vehicle_led.VehicleLed(
            vehicle_led.LAND_ON_TARGET, terms.config, terms.traits
        )  # its progress counts before it begins
        self._hold = Requester(terms.config.operation_timeout_s)
        self._ending: Outcome | None = None
        self._retries_left = goal.retries
        self._search_up_m = 0.0
        self._since_s = 0.0
        self._cancel_asked = False
        self._note = ""

    # --- the task protocol -----------------------------------------------------------

    @property
    def commanded(self) -> KinematicState | None:
        """State of the setpoint sent last, while it flies to where it searches."""
        return None if self._task is None else self._task.commanded

    @property
    def commanded_yaw_enu_rad(self) -> float | None:
        """Yaw of that setpoint."""
        return None if self._task is None else self._task.commanded_yaw_enu_rad

    @property
    def path_enu_m(self) -> tuple[Vector3, ...]:
        """The path to where it searches."""
        return () if self._task is None else self._task.path_enu_m

    @property
    def act(self) -> ActOrder | None:
        """The act of the task that flies."""
        return None if self._task is None else self._task.act

    @property
    def may_replan(self) -> bool:
        """Whether the flight may replan."""
        return self._task is not None and self._task.may_replan

    def replan(self, observation: Observation, now: float) -> None:
        """Search for another path."""
        if self._task is not None:
            self._task.replan(observation, now)

    def start(self, observation: Observation, now: float) -> None:
        """Begin: at the height of the search, or by waiting for the target."""
        self._led.start(observation, now)
        here = observation.position_enu_m
        if here is None:
            self._wait(now)
            return
        wanted = self._goal.search_up_m
        self._search_up_m = here[2] if wanted is None else wanted
        if abs(self._search_up_m - here[2]) > _AT_HEIGHT_M:
            self._fly((here[0], here[1], self._search_up_m), observation, now)
        else:
            self._wait(now)

    def step(self, observation: Observation, now: float) -> Intent | Outcome:
        """Return what to do now, or how it ended."""
        if self._stage is _Stage.WAIT:
            return self._hold_and_look(observation, now)
        task = self._task
        if task is None:
            raise RuntimeError(f"{self._stage.name} has no task.")
        if self._stage is _Stage.ON_TARGET and self._has_lost(observation, now):
            self._lose(observation, now)
            return self.step(observation, now)
        answer = task.step(observation, now)
        if not isinstance(answer, Outcome):
            return answer
        arrived = answer.code is OutcomeCode.SUCCESS and not self._cancel_asked
        if self._stage is _Stage.CLIMB and arrived:
            self._wait(now)
            return self.step(observation, now)
        return self._judged(answer, observation)

    def cancel(self, now: float) -> None:
        """Ask for an early end."""
        self._cancel_asked = True
        if self._task is not None:
            self._task.cancel(now)

    def pause(self, now: float) -> Rejection | None:
        """Reject, as the autopilot's landing does."""
        return self._led.pause(now)

    def unpause(self, now: float) -> None:
        """Nothing to continue with."""

    def resume_control(self, now: float) -> None:
        """Resume with a vehicle that another station had stopped in another mode."""
        self._hold.forget()
        if self._task is not None:
            self._task.resume_control(now)

    def postpone(self, now: float) -> None:
        """Count the time of what was asked for last from now on."""
        self._hold.postpone(now)
        if self._task is not None:
            self._task.postpone(now)

    def accepts_mode(self, mode: VehicleMode) -> bool:
        """Whether the vehicle may get into this mode by itself now."""
        return self._task is not None and self._task.accepts_mode(mode)

    def progress(self, observation: Observation, now: float) -> Progress:
        """Return the progress: the landing's, with the status of now."""
        if self._task is not None and self._stage is not _Stage.CLIMB:
            return self._task.progress(observation, now)
        progress = self._led.progress(observation, now)
        if self._task is None:
            return replace(progress, status=Status.HOLDING)
        flight = self._task.progress(observation, now)
        return replace(progress, status=flight.status, blocked=flight.blocked)

    # --- its stages ------------------------------------------------------------------

    def _wait(self, now: float, ending: Outcome | None = None) -> None:
        """Hold, and look for the target; or hold for good."""
        self._stage, self._task, self._since_s, self._ending = _Stage.WAIT, None, now, ending
        self._hold.forget()

    def _fly(self, to_enu_m: Vector3, observation: Observation, now: float) -> None:
        self._stage, self._task = _Stage.CLIMB, fly_to(GotoGoal(to_enu_m), self._terms)
        self._task.start(observation, now)

    def _land(
        self, stage: _Stage, goal: vehicle_led.VehicleLedGoal, observation: Observation, now: float
    ) -> None:
        config, traits = self._terms.config, self._terms.traits
        self._stage = stage
        self._task = self._led = vehicle_led.VehicleLed(goal, config, traits)
        self._task.start(observation, now)

    def _hold_and_look(self, observation: Observation, now: float) -> Intent | Outcome:
        asked = Perform(TaskOperation.HOLD)
        answer = self._hold.perform(asked, OutcomeCode.MODE_REFUSED, observation, now)
        if answer is not None:
            return answer
        if self._cancel_asked:
            text = "The goal was cancelled. The vehicle holds."
            return Outcome(OutcomeCode.CANCELED, text, None)
        if self._ending is not None:
            return self._ending
        if _is_seen(observation.followed, now):
            goal = vehicle_led.LAND_ON_TARGET
            self._land(_Stage.ON_TARGET, goal, observation, now)
            return self.step(observation, now)
        if now - self._since_s > _WAITS_S:
            text = f"The target has not been seen for {_WAITS_S:g} s."
            if self._goal.is_required:
                text = f"{text} The vehicle holds.{_fault(observation.followed)}"
                return Outcome(OutcomeCode.NO_LANDING_TARGET, text, None)
            self._land_anywhere(text, observation, now)
            return self.step(observation, now)
        return Wait()

    def _land_anywhere(self, why: str, observation: Observation, now: float) -> None:
        self._note = f"{why} It landed where it was.{_fault(observation.followed)}"
        self._land(_Stage.ANYWHERE, vehicle_led.LAND, observation, now)

    def _has_lost(self, observation: Observation, now: float) -> bool:
        """Whether it does not see the target, and is high enough to search for it."""
        target = observation.followed
        if target is None or self._cancel_asked:
            return False
        if not observation.armed or observation.airborne is False:
            return False
        here = observation.position_enu_m
        if here is None or not is_located(observation, self._terms.config.position_stale_s):
            return False
        return target.is_lost(now) and not _is_low(here[2], target, observation.ground_enu_m)

    def _lose(self, observation: Observation, now: float) -> None:
        """Climb to search again, hold for good, or land anywhere."""
        target = observation.followed
        lost = self._goal.retries - self._retries_left + 1
        text = f"The target was lost {'once' if lost == 1 else f'{lost} times'}."
        if self._retries_left > 0 and target is not None:
            self._retries_left -= 1
            east, north, _ = target.position_enu_m
            self._fly((east, north, self._search_up_m), observation, now)
        elif self._goal.is_required:
            text = f"{text} The vehicle holds.{_fault(target)}"
            self._wait(now, Outcome(OutcomeCode.NO_LANDING_TARGET, text, None))
        else:
            self._land_anywhere(text, observation, now)

    def _judged(self, outcome: Outcome, observation: Observation) -> Outcome:
        """Return the outcome of a part as that of the whole, with the distance to the target."""
        target, here = observation.followed, observation.position_enu_m
        if outcome.code is not OutcomeCode.SUCCESS:
            return outcome
        off_m = None
        if target is not None and target.is_known and here is not None:
            off_m = horizontal_norm(subtract(here, target.position_enu_m))
        if self._stage is _Stage.ANYWHERE:
            return replace(outcome, message=f"{outcome.message} {self._note}", final_error_m=off_m)
        if off_m is None or off_m > OFF_MAX_M:
            where = "at an unknown distance from" if off_m is None else f"{off_m:.2f} m beside"
            text = f"The vehicle landed {where} the target."
            if self._goal.is_required:
                return Outcome(OutcomeCode.NO_LANDING_TARGET, text, off_m)
            return replace(outcome, message=text, final_error_m=off_m)
        text = f"The vehicle landed {off_m:.2f} m from the target. Its motors are off."
        return replace(outcome, message=text, final_error_m=off_m)


def _is_low(up_m: float, target: TrackedTarget, ground_up_m: float) -> bool:
    """Return whether there is neither a need nor room to search.

    A vehicle that is well below the target was told a wrong height of it: the ground counts then.
    """
    if not target.is_known:
        return up_m - ground_up_m <= _COMMITTED_M
    above_m = up_m - target.position_enu_m[2]
    floor_m = above_m if above_m >= -_COMMITTED_M else up_m - ground_up_m
    return abs(floor_m) <= _COMMITTED_M


def _is_seen(target: TrackedTarget | None, now: float) -> bool:
    return target is not None and not target.is_lost(now)


def _fault(target: TrackedTarget | None) -> str:
    """Return why the last sample was rejected, as a further sentence."""
    return "" if target is None or not target.fault else f" Last sample: {target.fault}"
