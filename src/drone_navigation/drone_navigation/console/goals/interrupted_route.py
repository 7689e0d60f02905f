"""The route that a page sent last, and its rest once it was interrupted. One thread only."""

from __future__ import annotations

from collections.abc import Sequence

from rclpy.task import Future

from custom_interfaces.action import NavigateWaypoints
from drone_navigation.console.messages import PageWaypoint
from drone_navigation.console.page_types import InterruptedValue

__all__ = ["InterruptedRoute"]


class InterruptedRoute:
    """A route that was accepted, and how far it came."""

    def __init__(self) -> None:
        """Start without one."""
        self._goal = NavigateWaypoints.Goal()
        self._waypoints: Sequence[PageWaypoint] = ()
        self._future: Future | None = None
        self._first = self._route_id = 0
        self._is_interrupted = False

    def begin(
        self, goal: NavigateWaypoints.Goal, waypoints: Sequence[PageWaypoint], result: Future
    ) -> None:
        """Note that a route is accepted; its result comes later."""
        self._goal, self._waypoints, self._future = goal, waypoints, result
        self._is_interrupted = False

    def value(self) -> InterruptedValue | None:
        """Return where the route continues, None if it is not interrupted."""
        if self._future is not None and self._future.done():
            answer: NavigateWaypoints.Impl.GetResultService.Response = self._future.result()
            self._future = None
            if answer is not None:
                self._end(answer.result)
        if not self._is_interrupted:
            return None
        return {"next": self._first + 1, "waypoints": self._total}

    def rest(self) -> tuple[NavigateWaypoints.Goal, Sequence[PageWaypoint]] | None:
        """Return the goal that continues the route, and its waypoints; None without one."""
        if not self._is_interrupted:
            return None
        goal = NavigateWaypoints.Goal(
            execution=self._goal.execution,
            waypoints=self._goal.waypoints,
            laps=self._goal.laps,
            max_speed=self._goal.max_speed,
            avoid_obstacles=self._goal.avoid_obstacles,
            yaw_rate=self._goal.yaw_rate,
            first=self._first,
            interrupted_id=self._route_id,
        )
        return goal, self._waypoints

    @property
    def _total(self) -> int:
        return len(self._goal.waypoints) * max(int(self._goal.laps), 1)

    def _end(self, result: NavigateWaypoints.Result) -> None:
        # Without an id it was not the server that ended it.
        self._is_interrupted = bool(result.route_id) and result.next_index < self._total
        # The leg on which it was interrupted is flown again: a survey would lack the rest of it.
        self._first = max(result.next_index - 1, 0)
        self._route_id = result.route_id
