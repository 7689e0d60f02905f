"""The itinerary of a flight: sections that each end in a stop, and the distance and time to it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

from navigation_core.geometry import KinematicState, Vector3
from navigation_core.limits import Limits
from navigation_core.outcomes import OutcomeCode
from navigation_core.planning.planner import NoPath
from navigation_core.searches import Search
from navigation_core.tasks.conditions import is_airborne
from navigation_core.tasks.goto_config import GotoConfig, GotoGoal
from navigation_core.tasks.intents import Outcome
from navigation_core.tasks.leading.carrot import Carrot
from navigation_core.tasks.leading.checked_path import CheckedPath
from navigation_core.tasks.leading.path_follower import PathFollower
from navigation_core.tasks.leading.ring_path import RingPart
from navigation_core.tasks.observation import Observation
from navigation_core.tasks.phases import BEFORE_FLIGHT, STATUS, Phase
from navigation_core.tasks.progress import Progress, Status
from navigation_core.tasks.traits import Traits
from navigation_core.trajectories.route_trajectory import RoutePoint
from navigation_core.trajectories.trajectory import TrajectoryError, plan_to


@dataclass(frozen=True)
class Section:
    """The part of a flight up to its next stop.

    Attributes:
        goal: the stop.
        points: the points on the way, the stop as the last; empty for the straight path.
        yaws_enu_rad: for each point the yaw on the way to it, None for the direction of travel.
        radius_m: how near to the stop is near enough; None for the configured radius.
        hold_time_s: how long to stay there.
        part: the part of a circle that leads there, instead of points; None for points.
        settles: whether the vehicle has to be still there; otherwise the next section begins as
            soon as the setpoint stands.
    """

    goal: GotoGoal
    points: tuple[RoutePoint, ...] = ()
    yaws_enu_rad: tuple[float | None, ...] = ()
    radius_m: float | None = None
    hold_time_s: float = 0.0
    part: RingPart | None = None
    settles: bool = True


class Itinerary(Protocol):
    """The sections of a flight, and how far they are flown."""

    def begin_section(self, observation: Observation | None = None) -> Section:
        """Return what is to be flown from now on, up to the next stop.

        Args:
            observation: what is known; None before the flight.
        """

    def note_place(self, position_enu_m: Vector3 | None, passed: int, leaves: bool) -> bool:
        """Record where the vehicle is, and return whether to replan from there.

        Args:
            position_enu_m: its position in the map frame.
            passed: the points of the section that the setpoint has passed.
            leaves: whether it drives away from its path, to come back to it.
        """

    def point_to_meet(self) -> int | None:
        """Return the point of the section beyond which a vehicle that drives must not look yet."""

    def arrive(self, error_m: float) -> Outcome | None:
        """Record the stop as reached; returns how the flight ends, or None if it continues.

        Args:
            error_m: how far from the stop the vehicle is.
        """

    def total(
        self, progress: Progress, position_enu_m: Vector3 | None, is_straight: bool
    ) -> Progress:
        """Return the progress of the whole flight.

        Args:
            progress: that of the section.
            position_enu_m: where the vehicle is, in the map frame.
            is_straight: whether the section was taken for a straight line to its stop.
        """


class SingleStop:
    """The itinerary of a flight to one point."""

    def __init__(self, goal: GotoGoal) -> None:
        """Go there."""
        self._section = Section(goal)

    def begin_section(self, observation: Observation | None = None) -> Section:
        """Return the only section."""
        return self._section

    def note_place(self, position_enu_m: Vector3 | None, passed: int, leaves: bool) -> bool:
        """Nothing is to be met on the way."""
        return False

    def point_to_meet(self) -> int | None:
        """Nothing is to be met on the way."""
        return None

    def arrive(self, error_m: float) -> Outcome | None:
        """End with success."""
        return Outcome(OutcomeCode.SUCCESS, f"Arrived, {error_m:.2f} m from the target.", error_m)

    def total(
        self, progress: Progress, position_enu_m: Vector3 | None, is_straight: bool
    ) -> Progress:
        """Return that of the section."""
        return progress


# Assumed time of a mode change, and of the motors' run-up before a climb.
_CONTROL_S = 1.0
_RUN_UP_S = 2.0
_DISARM_S = 1.0


class GotoEstimator:
    """Estimates what is left from the phases ahead and the trajectory that is flown."""

    def __init__(self, goal: GotoGoal, config: GotoConfig, limits: Limits, traits: Traits) -> None:
        """Prepare; nothing is known before :meth:`start`."""
        self._traits = traits
        self._goal_enu_m = goal.position_enu_m
        self._config = config
        self._limits = limits
        self._needs_arming = False
        self._takeoff_m = 0.0
        self._leg = (0.0, 0.0)
        self._preview: Search[CheckedPath | NoPath] | None = None
        # Whether the leg before the flight goes through all points of a route.
        self._follows_route = False
        # Whether the distance that was estimated last is that of a straight line to the goal.
        self.is_straight = True
        self._last = Progress(Status.PREPARING, 0.0, 0.0)
        self._position_enu_m: Vector3 | None = None

    def set_goal(self, goal_enu_m: Vector3) -> None:
        """Estimate the path to another point from now on."""
        self._goal_enu_m = goal_enu_m

    def takeoff_height_m(self, ground_enu_m: float) -> float:
        """Return the height above the ground to climb to before the flight."""
        height_m = self._goal_enu_m[2] - ground_enu_m
        return min(max(height_m, self._config.takeoff_height_min_m), self._config.takeoff_height_m)

    def start(self, observation: Observation, follower: PathFollower) -> None:
        """Plan the leg that is flown after the take-off, for its length and duration.

        Args:
            observation: what is known.
            follower: plans the path around obstacles, if it is to.
        """
        position = observation.position_enu_m
        if position is None or not all(map(math.isfinite, position)):
            return
        self._position_enu_m = position
        self._needs_arming = not observation.armed
        ground_m = observation.ground_enu_m
        airborne = is_airborne(observation, self._config.airborne_height_m)
        if self._traits.flies and not (observation.armed and airborne):
            self._takeoff_m = self.takeoff_height_m(ground_m)
            position = (position[0], position[1], ground_m + self._takeoff_m)
        try:
            self._preview = follower.preview(position, observation)
            self._look_at_preview()
            if self._follows_route:
                return
            leg = plan_to(KinematicState(position), self._goal_enu_m, self._limits)
        except TrajectoryError:
            return
        self._leg = (math.dist(position, self._goal_enu_m), leg.duration_s)

    def progress(
        self, phase: Phase, elapsed_s: float, carrot: Carrot | None, observation: Observation
    ) -> Progress:
        """Estimate what is left.

        Args:
            phase: what the task is about.
            elapsed_s: time since that phase began.
            carrot: the setpoint that is flown, or None.
            observation: what is known about the vehicle.
        """
        position = observation.position_enu_m
        if position is not None and all(map(math.isfinite, position)):
            self._position_enu_m = position
        if phase is Phase.ENDED:
            return Progress(self._last.status, 0.0, 0.0)
        self.is_straight = False
        if phase in BEFORE_FLIGHT:
            self._look_at_preview()
            left = self._before_flight(phase, elapsed_s, observation.ground_enu_m)
            self.is_straight = not self._follows_route
        elif phase in (Phase.STOPPING, Phase.DISARMING):
            left = self._while_stopping(phase, carrot)
        elif carrot is None:
            left = (self._to_goal_m(), self._last.time_remaining_s)
        else:
            left = self._in_flight(phase, elapsed_s, carrot)
        self._last = Progress(STATUS[phase], left[0], left[1])
        return self._last

    def _look_at_preview(self) -> None:
        """Take the path around obstacles for the estimate, once it has been found."""
        preview = self._preview
        if preview is None:
            return
        try:
            path = preview.result()
        except TrajectoryError:
            self._preview = None
            return
        if path is not None:
            self._preview = None
        if isinstance(path, CheckedPath):
            self._leg = (path.length_m, path.trajectory.duration_s)
            self._follows_route = True

    def _to_goal_m(self) -> float:
        self.is_straight = True
        if self._position_enu_m is None:
            return 0.0
        return math.dist(self._position_enu_m, self._goal_enu_m)

    def _before_flight(
        self, phase: Phase, elapsed_s: float, ground_m: float
    ) -> tuple[float, float]:
        height_m = 0.0 if self._position_enu_m is None else self._position_enu_m[2] - ground_m
        climb_m = max(self._takeoff_m - height_m, 0.0)
        time_s = climb_m / self._config.takeoff_climb_rate_m_s
        if phase is Phase.TAKING_OFF:
            time_s += max(_RUN_UP_S - elapsed_s, 0.0)
        elif self._takeoff_m > 0.0:
            time_s += _RUN_UP_S
        if phase is Phase.ARMING:
            time_s += max(self._config.arming_time_s - elapsed_s, 0.0)
        elif phase is Phase.PREPARING:
            time_s += max(_CONTROL_S - elapsed_s, 0.0)
            time_s += self._config.arming_time_s if self._needs_arming else 0.0
        leg_m, leg_s = self._leg
        return climb_m + leg_m, time_s + leg_s + self._config.arrival_dwell_s

    def _in_flight(self, phase: Phase, elapsed_s: float, carrot: Carrot) -> tuple[float, float]:
        dwell_s = self._config.arrival_dwell_s
        if phase in (Phase.HOLDING, Phase.PAUSED, Phase.BLOCKED):
            leg_s = self._last.time_remaining_s
            return self._to_goal_m(), max(leg_s, carrot.time_remaining_s)
        position = self._position_enu_m
        setpoint = carrot.state.position_enu_m
        lag_m = 0.0 if position is None else math.dist(setpoint, position)
        lag_s = max(lag_m - self._config.arrival_radius_m, 0.0)
        lag_s /= self._limits.speed_horizontal_m_s
        if phase is Phase.SETTLING:
            return lag_m, max(dwell_s - elapsed_s, 0.0) + lag_s
        return (
            carrot.distance_remaining_m + lag_m,
            carrot.time_remaining_s + lag_s + dwell_s,
        )

    def _while_stopping(self, phase: Phase, carrot: Carrot | None) -> tuple[float, float]:
        if phase is Phase.DISARMING or carrot is None:
            return 0.0, _DISARM_S
        return carrot.distance_remaining_m, carrot.time_remaining_s + self._config.stop_dwell_s
