"""Straight legs of a goal flown by the server, for the fence and battery checks."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

from navigation_core.geometry import Vector3, distance


@dataclass(frozen=True)
class FlightPlan:
    """Targets of a goal and the straight legs between them.

    Attributes:
        targets_enu_m: targets in the map frame, in order; none for a goal without one, which a
            client steers.
        speeds_m_s: ground speed on the leg to each.
        laps: number of laps.
        hold_s: hold time in one lap.
        straight: whether it is flown in straight lines; otherwise around obstacles and along the
            fence.
        margin_m: least distance of the targets to a bound of the flight volume or the fence.
    """

    targets_enu_m: tuple[Vector3, ...]
    speeds_m_s: tuple[float, ...]
    laps: int = 1
    hold_s: float = 0.0
    straight: bool = True
    margin_m: float = 0.0

    def duration_s(self, start_enu_m: Vector3) -> float:
        """Return the flight time from a position, without starting and stopping."""
        targets, speeds = self.targets_enu_m, self.speeds_m_s
        if not targets:
            return self.hold_s
        approach_s = distance(start_enu_m, targets[0]) / speeds[0]
        lap_s = math.fsum(
            distance(a, b) / speed
            for (a, b), speed in zip(itertools.pairwise(targets), speeds[1:], strict=True)
        )
        again_s = distance(targets[-1], targets[0]) / speeds[0]
        return approach_s + self.laps * (lap_s + self.hold_s) + (self.laps - 1) * again_s
