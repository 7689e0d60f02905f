"""A return or a landing that makes room while it waits for others, or may not land where it is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from navigation_core.geometry import KinematicState, Vector3
from navigation_core.outcomes import Rejection
from navigation_core.tasks.conditions import is_located, measured_state
from navigation_core.tasks.flying.flight import SetpointFlight
from navigation_core.tasks.flying.goto import GotoGoal, fly_to
from navigation_core.tasks.inputs.waypoint_acts import ActOrder
from navigation_core.tasks.intents import Intent, Outcome
from navigation_core.tasks.leading.flight_terms import FlightTerms
from navigation_core.tasks.observation import Observation, VehicleMode
from navigation_core.tasks.progress import Progress
from navigation_core.tasks.task import Task
from navigation_core.tasks.traffic.detours import DetourSearch
from navigation_core.tasks.traffic.flight_detours import NO_DETOUR_RETRY_S, IsFree
from navigation_core.tasks.traffic.traffic_view import TrafficView

__all__ = ["RoomMaking"]

# How long it waits before it makes room, and how often it looks for a position.
_WAITS_S, _RETRY_S = 2.0, 2.0
# Maximum number of times it flies aside.
_ASIDES_MAX = 5


class RoomMaking:
    """Flies aside if its vehicle is the last of those that wait for each other in a circle.

    A flight by the autopilot itself needs its whole volume at once, with the column below, so
    vehicles above each other's launch points would wait for ever, and so would one above a vehicle
    that is parked. See :class:`navigation_core.tasks.task.Task`.
    """

    def __init__(
        self, make_task: Callable[[], Task], terms: FlightTerms, leaves_parked: bool
    ) -> None:
        """Prepare.

        Args:
            make_task: makes what is asked of the autopilot; made again after each flight aside.
            terms: of a flight aside.
            leaves_parked: whether it also leaves the column above one that will not go away, as a
                landing must not, which is to be where the vehicle is.
        """
        self._make_task, self._terms, self._leaves_parked = make_task, terms, leaves_parked
        self._task = make_task()
        self._aside: SetpointFlight | None = None
        self._waits_since_s: float | None = None
        self._looked_s = 0.0
        self._asides = 0
        self._cancel_asked = False

    @property
    def _current(self) -> Task:
        return self._task if self._aside is None else self._aside

    @property
    def commanded(self) -> KinematicState | None:
        """State of the setpoint sent last, while it flies aside."""
        return self._current.commanded

    @property
    def commanded_yaw_enu_rad(self) -> float | None:
        """Yaw of that setpoint."""
        return self._current.commanded_yaw_enu_rad

    @property
    def path_enu_m(self) -> tuple[Vector3, ...]:
        """The path aside."""
        return self._current.path_enu_m

    @property
    def act(self) -> ActOrder | None:
        """The act of the task that flies."""
        return self._current.act

    def start(self, observation: Observation, now: float) -> None:
        """Begin."""
        self._task.start(observation, now)

    def step(self, observation: Observation, now: float) -> Intent | Outcome:
        """Return what to do now, or how it ended."""
        if self._aside is not None:
            answer = self._aside.step(observation, now)
            if not isinstance(answer, Outcome) or self._cancel_asked:
                return answer
            self._aside = None
            self._task = self._make_task()
            self._task.start(observation, now)
        if self._may_look(observation, now) and self._begin(observation, now):
            return self.step(observation, now)
        return self._task.step(observation, now)

    @property
    def may_replan(self) -> bool:
        """Whether the task that flies may replan."""
        return self._current.may_replan

    def replan(self, observation: Observation, now: float) -> None:
        """Search for another path."""
        self._current.replan(observation, now)

    def cancel(self, now: float) -> None:
        """Ask for an early end."""
        self._cancel_asked = True
        self._current.cancel(now)

    def pause(self, now: float) -> Rejection | None:
        """Reject, as the autopilot's flight does."""
        return self._task.pause(now)

    def unpause(self, now: float) -> None:
        """Nothing to continue with."""

    def resume_control(self, now: float) -> None:
        """Resume with a vehicle that another station had stopped in another mode."""
        self._current.resume_control(now)

    def postpone(self, now: float) -> None:
        """Count the time of what was asked for last from now on; it waits."""
        if self._aside is None and self._waits_since_s is None:
            self._waits_since_s = now
        self._current.postpone(now)

    def accepts_mode(self, mode: VehicleMode) -> bool:
        """Whether the vehicle may get into this mode by itself now."""
        return self._current.accepts_mode(mode)

    def progress(self, observation: Observation, now: float) -> Progress:
        """Return the progress of what is asked of the autopilot, with the status of now."""
        progress = self._task.progress(observation, now)
        if self._aside is None:
            return progress
        aside = self._aside.progress(observation, now)
        return replace(progress, status=aside.status, blocked=aside.blocked)

    def _may_look(self, observation: Observation, now: float) -> bool:
        """Whether it has waited for long enough to look for a position to fly to."""
        view, since_s = TrafficView.of(observation), self._waits_since_s
        if view is None or since_s is None or self._cancel_asked or self._asides >= _ASIDES_MAX:
            return False
        if view.waiting is None:
            self._waits_since_s = None
            return False
        if now - since_s < _WAITS_S or now - self._looked_s < _RETRY_S:
            return False
        self._looked_s = now
        return True

    def _begin(self, observation: Observation, now: float) -> bool:
        """Begin a flight aside; False if it is no help, or there is no position to fly to."""
        view, config = TrafficView.of(observation), self._terms.config
        if view is None or not is_located(observation, config.position_stale_s):
            return False
        here = np.array(measured_state(observation).position_enu_m)
        is_free = IsFree(observation, _clearance_m(self._terms), self._terms.avoidance is not None)
        limits = config.limits
        frozen = replace(view, reservations=view.reservations.snapshot())
        search, ground_m = DetourSearch(frozen, limits, is_free, now), observation.ground_enu_m
        must_leave = self._leaves_parked and not search.may_land(here, ground_m)
        if not must_leave and not view.reservations.is_last_of_circle(view.name, now):
            return False
        found = search.aside(here, ground_m)
        if found is None:
            view.reservations.entry(view.name).stuck_until_s = now + NO_DETOUR_RETRY_S
            return False
        self._asides += 1
        view.reservations.entry(view.name).give_up_wish()
        self._waits_since_s = None
        self._aside = fly_to(GotoGoal(found.points_enu_m[-1]), self._terms)
        self._aside.start(observation, now)
        return True


def _clearance_m(terms: FlightTerms) -> float:
    return 0.0 if terms.avoidance is None else terms.avoidance.plan_clearance_m
