"""Progress of a mission, as reported by the vehicle and as measured beside it."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

from navigation_core.geometry import Vector3, distance
from navigation_core.tasks.observation import MissionReport, Observation
from navigation_core.tasks.progress import RouteProgress
from navigation_core.tasks.waypoint import Route, RouteWaypoint


class MissionTally:
    """Ticks off the waypoints of all laps."""

    def __init__(self, route: Route, speed_m_s: float, passing_m: float = 0.0) -> None:
        """Begin before the first.

        Args:
            route: where the vehicle flies.
            speed_m_s: ground speed where a waypoint has none, for the estimate of time.
            passing_m: how near the vehicle comes to a waypoint that it passes by its own rules,
                whatever radius was asked for.
        """
        self.current = 0
        self._route = route
        self._finished = False
        self._waypoints = route.flown
        self._reached: set[int] = set()
        self._nearest_m = [math.inf] * len(self._waypoints)
        self._passing_m = passing_m
        self._speed_m_s = speed_m_s

    @property
    def target(self) -> RouteWaypoint:
        """The waypoint that the vehicle is on its way to."""
        return self._route.at(self.current)

    def note(self, report: MissionReport | None, observation: Observation) -> None:
        """Process what the vehicle says and where it is.

        A report of a waypoint may be lost, so one that the vehicle is measured to be at counts
        as well.
        """
        if report is not None:
            self.current = max(self.current, min(report.current, len(self._waypoints) - 1))
            self._reached |= {i for i in report.reached if i <= self.current}
        position = observation.position_enu_m
        if position is not None and not observation.position_doubt:
            # The vehicle may head for the next one before it is nearest to the one that it passes.
            for index in range(max(self.current - 1, 0), self.current + 1):
                away_m = distance(position, self._waypoints[index].position_enu_m)
                self._nearest_m[index] = min(self._nearest_m[index], away_m)
                radius_m = max(self._waypoints[index].acceptance_radius_m, self._passing_m)
                if self._nearest_m[index] <= radius_m and index < self.current:
                    self._reached.add(index)
            if self._nearest_m[self.current] <= self.target.acceptance_radius_m:
                self._reached.add(self.current)

    @property
    def missed(self) -> tuple[int, ...]:
        """The waypoints before the current one that were skipped, or passed far outside."""
        return tuple(i for i in range(self.current) if i not in self._reached)

    def finish(self) -> str:
        """Take the last waypoint as reached; returns what was flown, as a sentence."""
        self.current, self._finished = len(self._waypoints) - 1, True
        self._reached.add(self.current)
        text = f"Flew {len(self._reached)} of {len(self._waypoints)} waypoints."
        if self.missed:
            names = self._route.numbers(self.missed)
            text += f" Skipped or passed outside their radius: {names} (counted over all laps)."
        return text

    def route(self, over: bool) -> RouteProgress:
        """Return the counts for the feedback."""
        progress = self._route.progress(self.current, len(self._reached), self.missed)
        if self._finished:
            progress = replace(progress, next_index=progress.next_index + progress.remaining)
        return replace(progress, remaining=0) if over else progress

    def left(self, position_enu_m: Vector3 | None) -> tuple[float, float]:
        """Return path and time from a position to the end."""
        ahead = self._waypoints[self.current :]
        places = [waypoint.position_enu_m for waypoint in ahead]
        start = places[0] if position_enu_m is None else position_enu_m
        legs = [distance(a, b) for a, b in itertools.pairwise([start, *places])]
        time_s = math.fsum(
            leg_m / (waypoint.max_speed_m_s or self._speed_m_s) + waypoint.stay_s
            for leg_m, waypoint in zip(legs, ahead, strict=True)
        )
        return math.fsum(legs), time_s
