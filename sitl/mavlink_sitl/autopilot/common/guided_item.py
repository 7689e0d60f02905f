"""NAV_GUIDED_ENABLE: a part of a mission in which a companion has the vehicle, as in GUIDED."""

from __future__ import annotations

import math
from typing import Generic, NamedTuple, TypeVar

from mavlink_sitl.autopilot.common.auto import Auto
from mavlink_sitl.autopilot.common.auto_tasks import AutoTask
from mavlink_sitl.autopilot.plans.plans import PlanItem
from mavlink_sitl.autopilot.state.mode import Mode

GuidedMode = TypeVar("GuidedMode", bound=Mode)


class Bounds(NamedTuple):
    """DO_GUIDED_LIMITS: what ends it; 0 for no limit.

    Attributes:
        time_s: from its beginning.
        least_height_m: above the origin.
        most_height_m: above the origin.
        most_distance_m: over ground, from where it began.
    """

    time_s: float = 0.0
    least_height_m: float = 0.0
    most_height_m: float = 0.0
    most_distance_m: float = 0.0


class Obey(AutoTask, Generic[GuidedMode]):
    """Follows setpoints until a bound is reached; without one it continues.

    Args:
        item: param1 above 0 begins it, else it is over at once.
        guided: the mode that knows how.
        bounds: what ends it.
    """

    def __init__(self, auto: Auto, item: PlanItem, guided: GuidedMode, bounds: Bounds) -> None:
        super().__init__(auto, item)
        self.guided = guided
        self._bounds = bounds
        self._began_s = self.vehicle.now_s
        self._began_at = self.vehicle.motion[:2]
        self.begins = item.params[0] > 0.0
        if self.begins:
            guided.enter()

    def update(self) -> None:
        """Run one step of GUIDED."""
        if self.begins:
            self.guided.update()

    def finished(self) -> bool:
        """At a bound, or at once."""
        bounds, motion = self._bounds, self.vehicle.motion
        height_m = -motion.down_m
        return (
            not self.begins
            or 0.0 < bounds.time_s <= self.vehicle.now_s - self._began_s
            or (bounds.least_height_m > 0.0 and height_m < bounds.least_height_m)
            or 0.0 < bounds.most_height_m < height_m
            or 0.0 < bounds.most_distance_m < math.dist(self._began_at, motion[:2])
        )
