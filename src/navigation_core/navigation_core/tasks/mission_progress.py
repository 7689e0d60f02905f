"""How far a mission is flown: what the vehicle says, and what is measured beside it."""

from __future__ import annotations

import itertools

from navigation_core.geometry import Vector3, distance
from navigation_core.tasks.base import MissionReport, Observation, RouteProgress
from navigation_core.tasks.waypoint import RouteWaypoint


class MissionProgress:
    """Ticks off the waypoints of all laps."""

    def __init__(self, waypoints: tuple[RouteWaypoint, ...], laps: int, speed_m_s: float) -> None:
        """Begin before the first.

        Args:
            waypoints: those of one lap.
            laps: how often they are flown.
            speed_m_s: ground speed where a waypoint has none, for the estimate of time.
        """
        self.current = 0
        self._lap_length = len(waypoints)
        self._waypoints = waypoints * laps
        self._reached: set[int] = set()
        self._speed_m_s = speed_m_s

    @property
    def target(self) -> RouteWaypoint:
        """The waypoint that the vehicle is on its way to."""
        return self._waypoints[min(self.current, len(self._waypoints) - 1)]

    def note(self, report: MissionReport | None, observation: Observation) -> None:
        """Take in what the vehicle says and where it is.

        A report of a waypoint may be lost, so one that the vehicle is measured to be at counts
        as well. Waypoints from before the current one that neither shows were skipped.
        """
        if report is not None:
            self.current = max(self.current, min(report.current, len(self._waypoints) - 1))
            self._reached |= {i for i in report.reached if i <= self.current}
        position = observation.position_enu_m
        if position is not None:
            target = self.target
            if distance(position, target.position_enu_m) <= target.acceptance_radius_m:
                self._reached.add(self.current)

    def finish(self) -> str:
        """Take the last waypoint as reached; returns what was flown, as a sentence."""
        self._reached.add(len(self._waypoints) - 1)
        text = f"Flew {len(self._reached)} of {len(self._waypoints)} waypoints."
        missed = [i for i in range(len(self._waypoints)) if i not in self._reached]
        if missed:
            names = ", ".join(str(index) for index in missed)
            text += f" Skipped or passed outside their radius: {names} (from 0, over all laps)."
        return text

    def route(self, over: bool) -> RouteProgress:
        """Return the counts for the feedback."""
        return RouteProgress(
            current=self.current % self._lap_length,
            lap=self.current // self._lap_length,
            remaining=0 if over else len(self._waypoints) - self.current,
            reached=len(self._reached),
        )

    def left(self, position_enu_m: Vector3 | None) -> tuple[float, float]:
        """Return way and time from a position to the end."""
        ahead = self._waypoints[self.current :]
        places = [waypoint.position_enu_m for waypoint in ahead]
        start = places[0] if position_enu_m is None else position_enu_m
        legs = [distance(a, b) for a, b in itertools.pairwise([start, *places])]
        time_s = sum(
            leg_m / (waypoint.max_speed_m_s or self._speed_m_s) + waypoint.hold_time_s
            for leg_m, waypoint in zip(legs, ahead, strict=True)
        )
        return sum(legs), time_s
