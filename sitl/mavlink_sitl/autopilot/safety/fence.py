"""The fence: two altitudes, a circle around home, and the uploaded areas.

As seen in `copter_fence` and in the observations: a position setpoint outside is ignored in
silence; with AVOID_ENABLE a velocity towards the fence ends inside it; a breach is said,
answered by FENCE_ACTION, and does not lock the mode.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from mavlink_sitl.autopilot.plans.plan_commands import CIRCLES, POLYGONS
from mavlink_sitl.autopilot.plans.plans import Cmd, PlanItem
from mavlink_sitl.autopilot.state.setpoint import Setpoint, SetpointFrame
from mavlink_sitl.exchange import Severity, Vector
from mavlink_sitl.geodesy import LocalFrame

if TYPE_CHECKING:
    from mavlink_sitl.autopilot.common.commander import Commander

HEIGHT, CIRCLE, POLYGON, FLOOR = 1, 2, 4, 8
"""Bits of FENCE_TYPE"""
NAMES = {HEIGHT: "Max Alt", CIRCLE: "Circle", POLYGON: "Polygon", FLOOR: "Min Alt"}
_MODE_RTL, _MODE_LAND, _MODE_BRAKE = 6, 9, 17
_ACTIONS = {
    1: (_MODE_RTL, _MODE_LAND),
    2: (_MODE_LAND,),
    3: (_MODE_RTL, _MODE_LAND),
    4: (_MODE_BRAKE, _MODE_LAND),
}
"""FENCE_ACTION: the modes that are tried; 0 only says it"""
HIGHER_M = 20.0
"""So much higher a breach of the ceiling counts again (`copter_fence3`)"""
AVOID_FENCE = 1
"""Bit of AVOID_ENABLE"""
Point = tuple[float, float]


@dataclass(frozen=True)
class Area:
    """A part of the plane, North and East metres in the local frame.

    Attributes:
        inclusion: the vehicle must be inside, else outside.
        corners: of a polygon; empty for a circle.
        centre: of a circle.
        radius_m: of a circle.
    """

    inclusion: bool
    corners: tuple[Point, ...] = ()
    centre: Point = (0.0, 0.0)
    radius_m: float = 0.0

    def allows(self, point: Point) -> bool:
        """Whether the vehicle may be there."""
        if not self.corners:
            return (math.dist(point, self.centre) <= self.radius_m) is self.inclusion
        inside = False
        for (n0, e0), (n1, e1) in zip(
            self.corners, self.corners[1:] + self.corners[:1], strict=True
        ):
            crosses = (e0 > point[1]) != (e1 > point[1])
            if crosses and point[0] < n0 + (n1 - n0) * (point[1] - e0) / (e1 - e0):
                inside = not inside
        return inside is self.inclusion


def areas_of(items: list[PlanItem], frame: LocalFrame) -> list[Area]:
    """The areas of an uploaded fence; its items were checked when they came."""
    areas = []
    place = 0
    while place < len(items):
        item = items[place]
        inclusion = item.command in (Cmd.POLYGON_INCLUSION, Cmd.CIRCLE_INCLUSION)
        if item.command in POLYGONS:
            corners = max(int(item.params[0]), 1)
            group = items[place : place + corners]
            areas.append(Area(inclusion, tuple(i.level_m(frame) for i in group)))
            place += corners
            continue
        if item.command in CIRCLES:
            areas.append(Area(inclusion, centre=item.level_m(frame), radius_m=item.params[0]))
        place += 1
    return areas


def _names(kinds: int) -> str:
    """The kinds in words, as in "Max Alt and Circle fences"."""
    names = [name for kind, name in NAMES.items() if kinds & kind]
    several = ", ".join(names[:-1]) + " and " if len(names) > 1 else ""
    return f"{several}{names[-1]} fence" + ("s" if len(names) > 1 else "")


class Fence:
    """The fence of one vehicle; of a copter, where subclasses do not say otherwise.

    Attributes:
        again_m: distance further out at which a breach counts again.
        breached: the bits of FENCE_TYPE that are broken now.
        last_breached: the latest that were broken; 0 for never.
        count: how often.
        breached_at_s: simulated time of the latest time.
    """

    again_m = 20.0

    def __init__(self, vehicle: Commander) -> None:
        self._vehicle = vehicle
        self.breached = 0
        self.last_breached = 0
        self.count = 0
        self.breached_at_s = 0.0
        self._areas: list[Area] = []
        self._areas_of = -1
        self._acted_at: Point = (0.0, 0.0)
        self._acted_height_m = 0.0
        self._above_floor = False

    @property
    def enabled(self) -> bool:
        """FENCE_ENABLE, where the firmware has it."""
        parameters = self._vehicle.parameters
        return "FENCE_ENABLE" in parameters and bool(parameters["FENCE_ENABLE"])

    def enable(self, on: bool) -> None:
        """DO_FENCE_ENABLE; unlike the parameter it takes back a breach, too (AC_Fence::enable)."""
        self._vehicle.parameters.set("FENCE_ENABLE", float(on))
        if not on:
            self.breached = 0

    def reasons(self) -> list[str]:
        """The reasons for which the fence prevents arming."""
        if not self.enabled:
            return []
        if not self.present:
            return ["Fences enabled, but none selected"]
        if not self._vehicle.estimator.position_ok:
            return ["Fence enabled, need position estimate"]
        broken = self._broken(self._vehicle.motion[:3]) & ~FLOOR
        return [f"Vehicle breaching {_names(broken)}"] if broken else []

    @property
    def present(self) -> bool:
        """Whether there is any fence that could be enabled."""
        kinds = int(self._vehicle.parameters["FENCE_TYPE"])
        return bool(kinds & ~POLYGON or (kinds & POLYGON and self._vehicle.plans.fence.items))

    def _heights_broken(self, height_m: float, kinds: int) -> int:
        p = self._vehicle.parameters
        if "FENCE_ALT_MAX" not in p:
            return 0
        broken = HEIGHT if kinds & HEIGHT and height_m > p["FENCE_ALT_MAX"] else 0
        return broken | (FLOOR if kinds & FLOOR and height_m < p["FENCE_ALT_MIN"] else 0)

    def _broken(self, position: tuple[float, ...]) -> int:
        """The bits of FENCE_TYPE that a position (NED metres) breaks."""
        vehicle = self._vehicle
        north, east, down = position
        home = vehicle.navigator.home_ned_m()
        kinds = int(vehicle.parameters["FENCE_TYPE"])
        broken = self._heights_broken(home[2] - down, kinds)
        if (
            kinds & CIRCLE
            and math.dist((north, east), home[:2]) > vehicle.parameters["FENCE_RADIUS"]
        ):
            broken |= CIRCLE
        if kinds & POLYGON:
            plan = vehicle.plans.fence
            if plan.changes != self._areas_of:
                self._areas_of = plan.changes
                self._areas = areas_of(plan.items, vehicle.navigator.frame)
            if not all(area.allows((north, east)) for area in self._areas):
                broken |= POLYGON
        return broken

    def allows(self, position: tuple[float, ...]) -> bool:
        """Whether the vehicle may be sent to a place, NED metres."""
        return not self.enabled or not self._broken(position)

    def blocks(self, setpoint: Setpoint) -> bool:
        """Whether a setpoint for GUIDED leads out, so that it is ignored."""
        if not self.enabled:
            return False
        place = setpoint.place_ned_m(self._vehicle.motion)
        if place is not None:
            return bool(self._broken(place))
        if setpoint.velocity_m_s is None or setpoint.frame is SetpointFrame.BODY:
            return False
        return self._leads_out(setpoint.velocity_m_s)

    def _leads_out(self, velocity_m_s: Vector) -> bool:
        """Whether braking now, the vehicle would still come too close to the fence."""
        vehicle = self._vehicle
        if not int(vehicle.parameters["AVOID_ENABLE"]) & AVOID_FENCE:
            return False
        motion, limits = vehicle.motion, vehicle.navigator.limits()
        wanted = math.hypot(*velocity_m_s)
        if wanted < 1e-3:
            return False
        speed = math.hypot(*motion[3:6])
        # Half of the limit, since the deceleration must first build up.
        ahead = vehicle.parameters["FENCE_MARGIN"] + speed * speed / limits.acceleration_xy_m_s2
        point = tuple(x + v / wanted * ahead for x, v in zip(motion[:3], velocity_m_s, strict=True))
        return bool(self._broken(point))

    def update(self) -> None:
        """Look where the vehicle is, and act."""
        vehicle = self._vehicle
        if not self.enabled:
            # AC_Fence::check returns before it looks: what was breached stays so in SYS_STATUS.
            self._above_floor = False
            return
        if not vehicle.armed or vehicle.landed:
            self.breached = 0
            self._above_floor = False
            return
        velocity = vehicle.mode.wanted_velocity_m_s
        if velocity is not None and self._leads_out(velocity):
            vehicle.mode.enter()
        broken = self._broken(vehicle.motion[:3])
        if not self._counts_floor():
            broken &= ~FLOOR
        new = broken & ~self.breached
        home = vehicle.navigator.home_ned_m()
        here = vehicle.motion[:2]
        height_m = vehicle.navigator.height_above_home_m()
        higher = bool(broken & HEIGHT) and height_m > self._acted_height_m + HIGHER_M
        acted_m = math.dist(self._acted_at, home[:2])
        further = higher or math.dist(here, home[:2]) > acted_m + self.again_m
        self.breached = broken
        if not broken or not (new or further) or self._ignores_breaches():
            return
        self._acted_at = here
        self._acted_height_m = height_m
        self.count += 1
        self.breached_at_s = vehicle.now_s
        self.last_breached = new or broken
        vehicle.say(Severity.NOTICE, f"{_names(self.last_breached)} breached")
        self._act(int(vehicle.parameters["FENCE_ACTION"]))

    def _counts_floor(self) -> bool:
        """Whether the lowest height counts: once it was well above it, and not for a landing."""
        vehicle, p = self._vehicle, self._vehicle.parameters
        if "FENCE_ALT_MIN" not in p or vehicle.mode.landing:
            self._above_floor = False
        elif not self._above_floor and int(p["FENCE_TYPE"]) & FLOOR:
            least = p["FENCE_ALT_MIN"] + p["FENCE_MARGIN"]
            self._above_floor = vehicle.navigator.height_above_home_m() >= least
            if self._above_floor:
                vehicle.say(Severity.NOTICE, "Min Alt fence enabled (auto enable)")
        return self._above_floor

    def _ignores_breaches(self) -> bool:
        """Whether something has been done already."""
        return False

    def _act(self, action: int) -> None:
        """Do what FENCE_ACTION says."""
        self._vehicle.enter_first(_ACTIONS.get(action, ()))
