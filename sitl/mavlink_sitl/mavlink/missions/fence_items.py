"""The checks of a whole fence, as ArduPilot makes them once all of it is there."""

from __future__ import annotations

import math

from mavlink_sitl.autopilot.plans.plan_commands import CIRCLES, POLYGONS
from mavlink_sitl.autopilot.plans.plans import Cmd, PlanItem

LEAST_CORNERS = 3
_TYPES: dict[int, int] = {
    Cmd.POLYGON_INCLUSION: 98,
    Cmd.POLYGON_EXCLUSION: 97,
    Cmd.FENCE_RETURN_POINT: 95,
    Cmd.CIRCLE_EXCLUSION: 93,
    Cmd.CIRCLE_INCLUSION: 92,
}
"""The firmware's numbers for them, in its texts"""


class _Checker:
    """Goes through a fence: corners of a polygon are alike, and one after the other."""

    def __init__(self) -> None:
        self.left = 0
        self._polygon = (0, 0)
        self._seen_return_point = False

    def fault(self, item: PlanItem) -> str | None:
        """The fault of the next item in the firmware's words; None for a valid one."""
        fault = self._corner(item) if item.command in POLYGONS else self._other(item)
        if fault is None and (abs(item.x) > 900_000_000 or abs(item.y) > 1_800_000_000):
            return "Bad lat or lon"
        return fault

    def _corner(self, item: PlanItem) -> str | None:
        kind, said = _TYPES[item.command], item.params[0]
        corners = int(said) & 0xFF if math.isfinite(said) else 0
        if corners < LEAST_CORNERS:
            return f"Invalid vertex count ({corners})"
        if self.left == 0:
            self._polygon, self.left = (kind, corners), corners
        wanted, count = self._polygon
        if wanted != kind:
            return f"Received incorrect vertex type (want={wanted} got={kind})"
        if count != corners:
            return f"Unexpected vertex count want={count} got={corners}\n"
        self.left -= 1
        return None

    def _other(self, item: PlanItem) -> str | None:
        if self.left:
            wanted, kind = self._polygon[0], _TYPES[item.command]
            return f"Received incorrect type (want={wanted} got={kind})"
        if item.command in CIRCLES:
            return None if item.params[0] > 0.0 else "Non-positive circle radius"
        if self._seen_return_point:
            return "Multiple return points"
        self._seen_return_point = True
        return None


def fence_fault(items: list[PlanItem]) -> str | None:
    """The first fault of a fence in the firmware's words; None for a valid one."""
    checker = _Checker()
    for item in items:
        fault = checker.fault(item)
        if fault is not None:
            return fault
    return "Incorrect item count" if checker.left else None


def fence_total(items: list[PlanItem]) -> int:
    """FENCE_TOTAL: corners and circles, and two for the older protocol's return point and end."""
    lines = sum(item.command in POLYGONS | CIRCLES for item in items)
    return 0 if lines < LEAST_CORNERS else lines + 2
