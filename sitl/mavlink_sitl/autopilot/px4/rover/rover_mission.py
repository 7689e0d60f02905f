"""AUTO.MISSION of PX4's rovers: corners are cut within an acceptance radius of their angle's."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from mavlink_sitl.autopilot.common.auto import AutoTask
from mavlink_sitl.autopilot.plans.plans import Cmd, PlanItem
from mavlink_sitl.autopilot.px4.mission_mode import Px4Mission
from mavlink_sitl.autopilot.px4.navigation import within
from mavlink_sitl.autopilot.px4.rover.pursuit import Point, PurePursuit
from mavlink_sitl.autopilot.px4.rover.rover_modes import DriveMode
from mavlink_sitl.exchange import Vector

if TYPE_CHECKING:
    from mavlink_sitl.autopilot.px4.rover.rover import Px4Rover

_WAITING = (Cmd.WAYPOINT, Cmd.LOITER_TIME, Cmd.DELAY)
_ENDLESS = (Cmd.LOITER_UNLIM, Cmd.LAND)
"""A car in a mission never lands, so the item after LAND never comes"""


def corner_rad(before: Point, corner: Point, after: Point) -> float:
    """The angle between two legs at their corner: pi straight on, 0 back."""
    one = math.atan2(before[1] - corner[1], before[0] - corner[0])
    other = math.atan2(after[1] - corner[1], after[0] - corner[0])
    return abs(math.remainder(one - other, math.tau))


class DriveTo(AutoTask):
    """The way to an item's place, and the time there.

    Args:
        start: where the line to it begins.
        target: its place.
        after: the place of the next item that is driven to, or None to stop here.
    """

    auto: RoverMission
    vehicle: Px4Rover

    def __init__(
        self,
        mission: RoverMission,
        item: PlanItem,
        start: Point,
        target: Point,
        after: Point | None,
    ) -> None:
        super().__init__(mission, item)
        self.target = target
        wait = item.params[0] if item.command in _WAITING else 0.0
        self._wait_s = max(wait, 0.0) if math.isfinite(wait) else 0.0
        rover, arrival, accept = self.vehicle, 0.0, self.vehicle.accept_m()
        if after is not None and self._wait_s == 0.0 and item.command not in _ENDLESS:
            angle = corner_rad(start, target, after)
            accept = corner_radius_m(rover, angle)
            arrival = min(rover.reduced_m_s(1.0 - angle / math.pi), rover.navigator.cruise_m_s())
        mission.way = PurePursuit(rover, target, start, arrival, accept)

    def update(self) -> None:
        """Drive on."""
        DriveMode.update(self.auto)

    def finished(self) -> bool:
        """There, for long enough."""
        way = self.auto.way
        if way is None or not self.vehicle.in_flight or self.item.command in _ENDLESS:
            return False
        near = math.dist(self.vehicle.motion[:2], self.target) <= way.accept_m
        return self.stayed(near, self._wait_s)


def corner_radius_m(rover: Px4Rover, angle_rad: float) -> float:
    """The acceptance radius of a corner (RA_ACC_RAD_MAX, RA_ACC_RAD_GAIN)."""
    p, least = rover.parameters, rover.accept_m()
    if p["RA_ACC_RAD_MAX"] < least:
        return least
    gain = within(p["RA_ACC_RAD_GAIN"], 0.0, 1e3)
    ideal = gain * rover.turning_radius_m() / max(math.tan(angle_rad / 2.0), 1e-3)
    return min(max(ideal, least), within(p["RA_ACC_RAD_MAX"], least, 200.0))


class RoverMission(DriveMode, Px4Mission):
    """Drives the uploaded mission."""

    def enter(self) -> None:
        """Resume the mission where it was left, or begin it."""
        self.way = None
        super().enter()

    def update(self) -> None:
        """Run one step of the current item; after the last one, stay."""
        Px4Mission.update(self)
        if self.vehicle.mode is self and self.task is None:
            DriveMode.update(self)

    @property
    def taking_off(self) -> bool:
        """While a TAKEOFF item is driven to."""
        return self.task is not None and self.task.item.command == Cmd.TAKEOFF

    @property
    def landing(self) -> bool:
        """While a LAND item is."""
        return self.task is not None and self.task.item.command == Cmd.LAND

    def last_place(self) -> Vector:
        """See `Px4Mission`."""
        if isinstance(self.task, DriveTo):
            return (*self.task.target, self.vehicle.motion.down_m)
        return self.here()

    def _place(self, item: PlanItem, instead: Point) -> Point:
        if item.command == Cmd.DELAY:
            return instead
        return self.place_of(item, (*instead, self.vehicle.motion.down_m))[:2]

    def _begin_moving(self, item: PlanItem) -> None:
        start = self.task.target if isinstance(self.task, DriveTo) else self.level()
        target = self._place(item, start)
        goes_to = self.moving - {Cmd.RTL}
        following = (i for i in self.following_items() if i.command in goes_to)
        after = next((self._place(i, target) for i in following), None)
        self.task = DriveTo(self, item, start, target, None if after == target else after)
