"""Trajectories of a topic that replace the one that is flown. No ROS."""

from __future__ import annotations

import math

from navigation_bridge.goals.active_goal import ActiveGoal
from navigation_bridge.goals.goal import LogLevel
from navigation_bridge.goals.requests import TrajectoryRequest
from navigation_bridge.names import TRAJECTORY_ACTION_NAME
from navigation_bridge.requests.feature import Feature, FeatureParts
from navigation_bridge.requests.trajectory_requests import resolve_trajectory
from navigation_bridge.snapshot import LocatedSnapshot
from navigation_core.geometry import KinematicState, distance
from navigation_core.outcomes import OutcomeCode, Rejection
from navigation_core.trajectories.timed_trajectory import TimedTrajectory

__all__ = ["TrajectoryCommands"]

# Least time between two log lines about trajectories that are not flown.
_LOG_PERIOD_S = 5.0


class TrajectoryCommands(Feature):
    """Keeps the last trajectory of a vehicle's clients that its goal may fly."""

    def __init__(self, parts: FeatureParts) -> None:
        """Begin without a trajectory."""
        super().__init__(parts)
        self._current: TimedTrajectory | None = None
        self._logged_s = -math.inf

    @property
    def trajectory(self) -> TimedTrajectory | None:
        """The last trajectory of the topic that was accepted for the active goal."""
        return self._current

    def goal_began(self) -> None:
        """Forget what came before the goal."""
        self._current = None

    def goal_ended(self, goal: ActiveGoal, code: OutcomeCode) -> None:
        """Forget what came for the goal."""
        self._current = None

    def replace(self, request: TrajectoryRequest, now: float) -> None:
        """Process a trajectory of a client: it replaces the one that is flown, if it is sound.

        Otherwise the one that is flown continues.

        Args:
            request: the trajectory.
            now: time in seconds.
        """
        goal = self.parts.goals().active
        if goal is None or goal.kind != TRAJECTORY_ACTION_NAME or goal.ending:
            self._warn("A trajectory is ignored: no follow_trajectory goal is active.", now)
            return
        resolved = self._resolved(goal, request, now)
        if isinstance(resolved, TimedTrajectory):
            self._current = resolved
        elif self._warn(f"{resolved.code.value}: {resolved.message}", now):
            self.parts.report.remark(goal, f"{resolved.code.value}: {resolved.message}")

    def _resolved(
        self, goal: ActiveGoal, request: TrajectoryRequest, now: float
    ) -> TimedTrajectory | Rejection:
        snapshot = self.parts.look(now)
        if not isinstance(snapshot, LocatedSnapshot):
            text = "The vehicle has no position; a trajectory cannot be joined."
            return Rejection(OutcomeCode.NO_POSITION, text)
        start = KinematicState(snapshot.position_enu_m, snapshot.velocity_enu_m_s)
        sent, far_m = goal.task.commanded, snapshot.goto.tracking_error_max_m
        if sent is not None and distance(sent.position_enu_m, start.position_enu_m) <= far_m:
            start = sent
        return resolve_trajectory(request, snapshot, start)

    def _warn(self, text: str, now: float) -> bool:
        """Log a line, and return True, unless one was logged a moment ago."""
        if now - self._logged_s < _LOG_PERIOD_S:
            return False
        self._logged_s = now
        self.parts.report.log(LogLevel.WARN, text)
        return True
