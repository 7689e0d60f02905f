"""AUTO.MISSION of PX4's planes."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from mavlink_sitl.autopilot.common.auto import AutoTask
from mavlink_sitl.autopilot.plans.plans import Cmd, PlanItem
from mavlink_sitl.autopilot.px4.mission_mode import Px4Mission
from mavlink_sitl.autopilot.px4.navigation import within
from mavlink_sitl.autopilot.px4.plane import path_guidance
from mavlink_sitl.autopilot.px4.plane.plane_landing import Descent
from mavlink_sitl.autopilot.px4.plane.plane_modes import PlaneMode
from mavlink_sitl.autopilot.px4.plane.plane_takeoff import Climbout
from mavlink_sitl.exchange import Vector

if TYPE_CHECKING:
    from mavlink_sitl.autopilot.px4.plane.plane import Px4Plane

_LOITERS = (Cmd.LOITER_UNLIM, Cmd.LOITER_TIME, Cmd.LOITER_TO_ALT)


class PlaneTask(AutoTask):
    """An item in flight.

    Args:
        target: its place, NED metres.
        start: the place before it, if there is one.
    """

    auto: PlaneMission
    vehicle: Px4Plane

    def __init__(
        self, mission: PlaneMission, item: PlanItem, target: Vector, start: Vector | None
    ) -> None:
        super().__init__(mission, item)
        self.target = target
        self.start = start


class FlyOver(PlaneTask):
    """Along the line to a place; too high or too low there, round it until the height is right."""

    def update(self) -> None:
        """Run one step."""
        mission, target = self.auto, self.target
        path = path_guidance.point(mission.level(), target[:2])
        if self.start is not None and math.dist(self.start[:2], target[:2]) > 1.0:
            line = path_guidance.line(mission.level(), self.start[:2], target[:2])
            ahead = path_guidance.unit(target[0] - line.nearest[0], target[1] - line.nearest[1])
            if ahead[0] * line.tangent[0] + ahead[1] * line.tangent[1] > 0.0:
                path = line
        mission.fly_over(path, target)

    def finished(self) -> bool:
        """There, at the height."""
        near = math.dist(self.auto.level(), self.target[:2]) <= self.vehicle.accept_m()
        return self.vehicle.in_flight and near and self.auto.at_height(self.target[2])


class CircleTask(PlaneTask):
    """Round a place: forever, for a time, or until a height is reached."""

    def _radius_m(self) -> float:
        given = self.item.params[1 if self.item.command == Cmd.LOITER_TO_ALT else 2]
        usable = math.isfinite(given) and given != 0.0
        return min(max(given, -1e4), 1e4) if usable else self.vehicle.loiter_radius_m()

    def _lasts_s(self) -> float:
        command, first = self.item.command, self.item.params[0]
        if command == Cmd.LOITER_UNLIM:
            return math.inf
        waits = command in (Cmd.LOITER_TIME, Cmd.DELAY) and math.isfinite(first)
        return max(first, 0.0) if waits else 0.0

    def update(self) -> None:
        """Go round."""
        self.auto.circle(self.target, self._radius_m())

    def finished(self) -> bool:
        """There for long enough."""
        reached = self.auto.near_circle(self.target[:2], self._radius_m())
        return self.stayed(reached and self.auto.at_height(self.target[2]), self._lasts_s())


class ClimbOut(PlaneTask):
    """TAKEOFF: towards the item's place, until its height is passed."""

    def __init__(
        self, mission: PlaneMission, item: PlanItem, target: Vector, start: Vector | None
    ) -> None:
        super().__init__(mission, item, target, start)
        far = math.dist(mission.level(), target[:2]) > 10.0
        self.climbout = Climbout(mission, target[2], target[:2] if far else None)

    def update(self) -> None:
        """Run one step."""
        self.climbout.update()

    def finished(self) -> bool:
        """High enough."""
        return self.vehicle.in_flight and self.climbout.done


class LandAt(PlaneTask):
    """LAND: straight in from the place before, or circling down without one."""

    landing = True

    def __init__(
        self, mission: PlaneMission, item: PlanItem, target: Vector, start: Vector | None
    ) -> None:
        super().__init__(mission, item, target, start)
        self._descent = Descent(mission, target, start)

    def update(self) -> None:
        """Go down; on the ground rest."""
        if self.vehicle.landed:
            self.auto.rest()
        else:
            self._descent.update()

    def finished(self) -> bool:
        """On the ground."""
        return self.vehicle.landed


def approach_is_good(plane: Px4Plane, before: PlanItem, start: Vector, end: Vector) -> bool:
    """Whether a landing may follow an item: from above, and not too steep (FW_LND_ANG)."""
    high_m, far_m = end[2] - start[2], math.dist(start[:2], end[:2])
    if before.command == Cmd.LOITER_TO_ALT:
        radius_m = abs(before.params[1])
        far_m = math.sqrt(max(far_m * far_m - radius_m * radius_m, 0.0))
    elif before.command != Cmd.WAYPOINT:
        return False
    steepest_deg = within(plane.parameters["FW_LND_ANG"], 0.0, 80.0) + 0.1
    return 0.0 < high_m <= math.tan(math.radians(steepest_deg)) * far_m


class PlaneMission(PlaneMode, Px4Mission):
    """Flies the uploaded mission; after its end it circles the last place."""

    def enter(self) -> None:
        """Resume the mission where it was left, or begin it."""
        self.level_off()
        super().enter()

    def update(self) -> None:
        """Run one step of the current item; after the last one, circle."""
        Px4Mission.update(self)
        if self.vehicle.mode is self and self.task is None and self.vehicle.armed:
            if self.vehicle.landed:
                self.rest()
            else:
                self.circle(self.here())

    @property
    def taking_off(self) -> bool:
        """While it climbs out."""
        return isinstance(self.task, ClimbOut)

    def place_of(self, item: PlanItem, instead: Vector) -> Vector:
        """See `Auto`; a height of 0 is one, the ground's of most landings."""
        north, east, _ = super().place_of(item, instead)
        return north, east, self._down_m(item)

    def last_place(self) -> Vector:
        """See `Px4Mission`."""
        return self.task.target if isinstance(self.task, PlaneTask) else self.here()

    def _begin_moving(self, item: PlanItem) -> None:
        self.rising = False
        before = self.task.target if isinstance(self.task, PlaneTask) else None
        target = self.place_of(item, before or self.here())
        kinds: dict[int, type[PlaneTask]] = {Cmd.TAKEOFF: ClimbOut, Cmd.LAND: LandAt}
        kind = kinds.get(item.command, CircleTask if item.command in _LOITERS else FlyOver)
        if item.command == Cmd.DELAY:
            kind, target = CircleTask, before or self.here()
        start = None if isinstance(self.task, ClimbOut) else before
        self.task = kind(self, item, target, start)
