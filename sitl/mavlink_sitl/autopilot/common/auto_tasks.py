"""Tasks of AUTO for all vehicle types: one class per type of movement item."""

from __future__ import annotations

from mavlink_sitl.autopilot.common.auto import Auto
from mavlink_sitl.autopilot.plans.plans import PlanItem


class AutoTask:
    """An item in flight."""

    def __init__(self, auto: Auto, item: PlanItem) -> None:
        self.auto = auto
        self.vehicle = auto.vehicle
        self.item = item

    @property
    def landing(self) -> bool:
        """Whether it sinks to land."""
        return False

    def update(self) -> None:
        """Run one step; called at the autopilot's rate."""

    def finished(self) -> bool:
        """Whether the next item's turn has come."""
        return False


class Delay(AutoTask):
    """Stay for param1 seconds."""

    def __init__(self, auto: Auto, item: PlanItem) -> None:
        super().__init__(auto, item)
        self._until_s = self.vehicle.now_s + max(item.params[0], 0.0)
        auto.guide(auto.hold_guidance())

    def finished(self) -> bool:
        """When it ends."""
        return self.vehicle.now_s >= self._until_s
