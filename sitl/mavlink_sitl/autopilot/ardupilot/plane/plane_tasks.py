"""Tasks of AUTO for planes: one class per type of movement item.

After ArduPlane's documentation of mission commands. Landing is `plane_landing`'s.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from typing import TYPE_CHECKING

from mavlink_sitl.autopilot.ardupilot.plane.plane_modes import PlaneMode, Point, level_limit_rad
from mavlink_sitl.autopilot.ardupilot.plane.plane_takeoff import Launch
from mavlink_sitl.autopilot.common.auto import Auto, AutoTask
from mavlink_sitl.autopilot.plans.plans import Cmd, PlanItem
from mavlink_sitl.exchange import Severity, Vector

if TYPE_CHECKING:
    from mavlink_sitl.autopilot.ardupilot.plane.plane import Plane

SLOPES_ABOVE_M = 20.0
"""Lower than that above home it climbs to a waypoint's height at once, not bit by bit"""
ALIGNED_RAD = math.radians(10.0)
"""A loiter is left when the course is within this of the next item; the limit grows per turn"""
AT_HEIGHT_M = 5.0
"""LOITER_TO_ALT ends within this of its height"""
COMPLETE_TEXTS = {
    Cmd.LOITER_TIME: "Loiter time complete",
    Cmd.LOITER_TURNS: "Loiter orbits complete",
    Cmd.LOITER_TO_ALT: "Loiter to alt complete",
}


class ItemAuto(PlaneMode, Auto):
    """AUTO of a plane, as its items see it."""

    @abstractmethod
    def restart_landing(self) -> None:
        """Begin the landing again."""


class GlideTask(AutoTask):
    """An item in flight."""

    taking_off = False
    launched = False
    """Whether a take-off rolls or flies"""

    auto: ItemAuto
    vehicle: Plane

    @property
    def here(self) -> Point:
        """North and East, metres."""
        return self.vehicle.motion.north_m, self.vehicle.motion.east_m


class Climb(GlideTask):
    """NAV_TAKEOFF: along the runway, at full throttle, until it is high enough.

    Args:
        down_m: how high, NED.
    """

    taking_off = True

    def __init__(self, auto: ItemAuto, item: PlanItem, down_m: float) -> None:
        super().__init__(auto, item)
        self.height_m = self.vehicle.navigator.home_ned_m()[2] - down_m
        self._launch: Launch | None = None
        self._start = self.here

    def update(self) -> None:
        """Run one step once armed."""
        plane, mode = self.vehicle, self.auto
        if not plane.armed:
            return
        if self._launch is None:
            self._launch = Launch(plane, self.height_m)
            self._start = self.here
        self.launched = self._launch.rolling()
        if not self.launched:
            return
        heading = self._launch.heading_rad
        ahead = (
            self._start[0] + 1000.0 * math.cos(heading),
            self._start[1] + 1000.0 * math.sin(heading),
            plane.navigator.home_ned_m()[2] - self.height_m,
        )
        bank = mode.bank_along(self._start, ahead, level_limit_rad(plane))
        mode.fly(bank, self._launch.climb_m_s(), self._launch.throttle())

    def finished(self) -> bool:
        """At its height."""
        height = self.vehicle.navigator.height_above_home_m()
        if self._launch is None or height < self.height_m:
            return False
        self.vehicle.say(Severity.INFO, f"Takeoff complete at {height:.2f}m")
        self.auto.level_off()
        return True


class FlyLine(GlideTask):
    """NAV_WAYPOINT: along the line from the last place; the corner is cut.

    Args:
        item: the item: param2 how near it counts as reached, param3 how far to fly on beyond.
        start: where the leg begins, NED metres.
        target: where it ends.
        following: where the next one ends, if there is one with a place.
    """

    def __init__(
        self,
        auto: ItemAuto,
        item: PlanItem,
        start: Vector,
        target: Vector,
        following: Vector | None = None,
    ) -> None:
        super().__init__(auto, item)
        self.start, self.following = start, following
        self.length_m = math.dist(start[:2], target[:2])
        self._beyond_m = max(item.params[2], 0.0)
        if self._beyond_m and self.length_m > 0.0:
            far = 1.0 + self._beyond_m / self.length_m
            target = (
                start[0] + far * (target[0] - start[0]),
                start[1] + far * (target[1] - start[1]),
                target[2],
            )
            self.length_m += self._beyond_m
        self.target = target

    def share(self) -> float:
        """How much of the line lies behind; more than 1 beyond its end."""
        if self.length_m < 1.0:
            return 1.0
        along = math.fsum(
            (h - s) * (t - s)
            for h, s, t in zip(self.here, self.start[:2], self.target[:2], strict=True)
        )
        return along / self.length_m**2

    def down_m(self) -> float:
        """How high it should be now: bit by bit from one height to the other."""
        high = self.vehicle.navigator.height_above_home_m() > SLOPES_ABOVE_M
        if not high and self.target[2] < self.start[2]:
            return self.target[2]
        share = min(max(self.share(), 0.0), 1.0)
        return self.start[2] + share * (self.target[2] - self.start[2])

    def update(self) -> None:
        """Follow the line."""
        bank = self.auto.bank_along(self.start[:2], self.target)
        self.auto.fly(bank, self.auto.climb_to(self.down_m()))

    def reach_m(self) -> float:
        """The acceptance radius: WP_RADIUS, less for a gentle corner."""
        if self.item.params[1] > 0.0:
            return self.item.params[1]
        if self._beyond_m:
            return 0.0
        p, m = self.vehicle.parameters, self.vehicle.motion
        speed = m.speed_m_s
        ahead = p["NAVL1_DAMPING"] * p["NAVL1_PERIOD"] * speed / math.pi
        radius = min(p["WP_RADIUS"] * self.vehicle.true_over_indicated**2, ahead)
        return radius * min(self._corner_rad() / (math.pi / 2), 1.0)

    def _corner_rad(self) -> float:
        if self.following is None:
            return math.pi / 2
        before = _course(self.start[:2], self.target[:2])
        after = _course(self.target[:2], self.following[:2])
        return abs(math.remainder(after - before, math.tau))

    def finished(self) -> bool:
        """Near enough, or past it."""
        distance = math.dist(self.here, self.target[:2])
        reached = distance <= self.reach_m()
        if not reached and self.share() < 1.0:
            return False
        word = "Reached" if reached else "Passed"
        place = self.vehicle.plans.current
        self.vehicle.say(Severity.INFO, f"{word} waypoint #{place} dist {int(distance)}m")
        return True


class GoRound(GlideTask):
    """NAV_LOITER_UNLIM, _TIME, _TURNS and _TO_ALT: round a place until something is the case.

    Then it circles on until its course points to the next item.

    Args:
        centre: NED metres.
        following: where the next item is, if it has a place.
    """

    def __init__(
        self, auto: ItemAuto, item: PlanItem, centre: Vector, following: Vector | None
    ) -> None:
        super().__init__(auto, item)
        self._centre, self._following = centre, following
        given = item.params[1] if item.command == Cmd.LOITER_TO_ALT else item.params[2]
        usual = abs(self.vehicle.parameters["WP_LOITER_RAD"])
        keeps_usual = item.command == Cmd.LOITER_TIME or abs(given) <= 1.0
        self._radius_m = math.copysign(usual if keeps_usual else abs(given), given)
        self._turned_rad = self._bearing = 0.0
        self._leaving = False

    def update(self) -> None:
        """Go round, and count how far."""
        mode, plane = self.auto, self.vehicle
        mode.circle(self._centre, radius_m=self._radius_m)
        bearing = _course(self._centre[:2], self.here)
        if self._there_s is None:
            if not mode.on_circle:
                return
            self._there_s = plane.now_s
        else:
            step = math.remainder(bearing - self._bearing, math.tau)
            self._turned_rad += math.copysign(1.0, self._radius_m) * step
        self._bearing = bearing

    def _done(self) -> bool:
        """Whether what it goes round for is the case."""
        if self._there_s is None:
            return False
        command, params = self.item.command, self.item.params
        if command == Cmd.LOITER_TIME:
            return self.vehicle.now_s - self._there_s >= params[0]
        if command == Cmd.LOITER_TURNS:
            return self._turned_rad >= params[0] * math.tau
        if command == Cmd.LOITER_TO_ALT:
            return abs(self.vehicle.motion.down_m - self._centre[2]) < AT_HEIGHT_M
        return False

    def finished(self) -> bool:
        """Whether it is done and its course points to the next item."""
        if not self._leaving:
            if not self._done():
                return False
            self._leaving, self._turned_rad = True, 0.0
        if not self._points_on():
            return False
        self.vehicle.say(Severity.INFO, COMPLETE_TEXTS[Cmd(self.item.command)])
        return True

    def _points_on(self) -> bool:
        near = 1.05 * abs(self.vehicle.parameters["WP_LOITER_RAD"])
        if self._following is None or math.dist(self._centre[:2], self._following[:2]) < near:
            return True
        m = self.vehicle.motion
        course = math.atan2(m.velocity_east_m_s, m.velocity_north_m_s)
        off = math.remainder(_course(self.here, self._following[:2]) - course, math.tau)
        return abs(off) <= ALIGNED_RAD * (1 + int(abs(self._turned_rad) / math.tau))


class GroundDelay(GlideTask):
    """NAV_DELAY: only on the ground and disarmed; in the air it has nothing to fly by."""

    def __init__(self, auto: ItemAuto, item: PlanItem) -> None:
        super().__init__(auto, item)
        self._until_s = self.vehicle.now_s + max(item.params[0], 0.0)
        self.vehicle.say(Severity.INFO, f"Delaying {int(max(item.params[0], 0.0))} sec")

    def finished(self) -> bool:
        """At once when armed."""
        return self.vehicle.armed or self.vehicle.now_s >= self._until_s


def _course(start: tuple[float, ...], end: tuple[float, ...]) -> float:
    """Radians from North, clockwise."""
    return math.atan2(end[1] - start[1], end[0] - start[0])
