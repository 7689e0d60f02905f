"""The modes of ArduPlane. Observed in `plane_guided`."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from mavlink_sitl.autopilot.control import l1_guidance as l1
from mavlink_sitl.autopilot.state.mode import Mode
from mavlink_sitl.autopilot.state.setpoint import Setpoint, SetpointFrame
from mavlink_sitl.exchange import GRAVITY_M_S2, ItemReached, Motors, Vector
from mavlink_sitl.guidance import GlideGuidance

if TYPE_CHECKING:
    from mavlink_sitl.autopilot.ardupilot.plane.plane import Plane

Point = tuple[float, float]
Throttle = tuple[float, float]
"""Least and most, 0..1"""

HEIGHT_TIME_S = 3.2
"""From an error of the height to a climb rate"""
CLIMB_RATE_CHANGE_M_S2 = 1.0
TAKEOFF_CLIMB_SINE = 0.32
THERE_M = 10.0
"""RTL has arrived on its circle, at most so far above or below it"""
CLIMB_BEFORE_TURN = 16
"""FLIGHT_OPTIONS: bit 4"""
SLOPE_MIN_M = 15.0
"""The default of ALT_SLOPE_MIN: nearer to its height than this it goes there at once"""
CLIMBS_ON_M = 10.0
"""Further than it has to, so that it gets there"""
RETURN_THEN_LAND, LAND_AT_ONCE = 1, 2
"""RTL_AUTOLAND"""
STALL_MARGIN_BANK_RAD = math.radians(25.0)
"""The bank limit for a low airspeed is never below this"""


def throttle_limits(plane: Plane) -> Throttle:
    """THR_MIN and THR_MAX. A negative least is for reverse thrust, which is not modelled."""
    p = plane.parameters
    most = min(max(p["THR_MAX"] / 100.0, 0.0), 1.0)
    return min(max(p["THR_MIN"] / 100.0, 0.0), most), most


def level_limit_rad(plane: Plane) -> float:
    """LEVEL_ROLL_LIMIT: the bank close to the ground."""
    return math.radians(min(max(plane.parameters["LEVEL_ROLL_LIMIT"], 0.0), 45.0))


class PlaneMode(Mode):
    """A mode of one plane."""

    vehicle: Plane
    target: Vector | None = None
    """The position that it circles or flies to, NED metres"""
    cross_track_m = 0.0
    on_circle = False
    _climb_m_s = 0.0

    def bank_limit_rad(self) -> float:
        """ROLL_LIMIT_DEG, less when it is slow: the load of the turn must stay below the stall."""
        plane = self.vehicle
        p = plane.parameters
        limit = math.radians(min(max(p["ROLL_LIMIT_DEG"], 1.0), 80.0))
        load = (plane.airspeed_m_s / max(p["AIRSPEED_MIN"], 1.0)) ** 2
        carried = math.acos(1.0 / load) if load > 1.0 else 0.0
        return min(limit, max(carried, STALL_MARGIN_BANK_RAD))

    def climb_to(self, down_m: float) -> float:
        """The climb rate towards a height; it changes slowly and keeps the limits."""
        p = self.vehicle.parameters
        error = self.vehicle.motion.down_m - down_m
        most, least = max(p["TECS_CLMB_MAX"], 0.1), max(p["TECS_SINK_MAX"], 0.1)
        wanted = min(max(error / HEIGHT_TIME_S, -least), most)
        change = CLIMB_RATE_CHANGE_M_S2 * self.vehicle.step_s
        change = max(change, 0.0) * (3.0 if abs(wanted) < abs(self._climb_m_s) else 1.0)
        self._climb_m_s += min(max(wanted - self._climb_m_s, -change), change)
        return self._climb_m_s

    def circle(self, centre: Vector, limit_rad: float | None = None, radius_m: float = 0.0) -> None:
        """Fly round a point at a height.

        Args:
            centre: NED metres.
            limit_rad: bank no more than that.
            radius_m: negative against the clock; 0 for WP_LOITER_RAD.
        """
        plane = self.vehicle
        radius = radius_m or plane.parameters["WP_LOITER_RAD"]
        size = self._true_radius_m(abs(radius))
        law = self._l1().circle(centre[:2], size, -1 if radius < 0.0 else 1)
        self.target = centre
        self.cross_track_m, self.on_circle = law.outside_m, law.on_circle
        limit = self.bank_limit_rad()
        limit = limit if limit_rad is None else min(limit, limit_rad)
        self.fly(l1.bank_rad(law.sideways_m_s2, limit), self.climb_to(centre[2]))

    def _true_radius_m(self, radius_m: float) -> float:
        """The radius that is flown: larger in thin air, unless NAVL1_LIM_BANK permits the one."""
        plane = self.vehicle
        thin_air = plane.true_over_indicated
        limit_rad = math.radians(min(max(plane.parameters["NAVL1_LIM_BANK"], 0.0), 89.0))
        if limit_rad > 0.0:
            least_m = plane.navigator.cruise_m_s() ** 2 / (math.tan(limit_rad) * GRAVITY_M_S2)
            if least_m <= radius_m:
                return max(least_m * thin_air, radius_m, 1.0)
        return max(radius_m * thin_air, 1.0)

    def bank_along(self, start: Point, end: Vector, limit_rad: float | None = None) -> float:
        """The bank that keeps a line from a place to another; NED metres."""
        law = self._l1().line(start, end[:2])
        self.target = end
        self.cross_track_m, self.on_circle = law.beside_m, False
        limit = self.bank_limit_rad()
        return l1.bank_rad(law.sideways_m_s2, limit if limit_rad is None else min(limit, limit_rad))

    def _l1(self) -> l1.L1:
        m, p = self.vehicle.motion, self.vehicle.parameters
        period_s, damping = max(p["NAVL1_PERIOD"], 1.0), max(p["NAVL1_DAMPING"], 0.1)
        return l1.L1(m[:2], m[3:5], m.yaw_rad, period_s, damping)

    def fly(
        self,
        bank_rad: float,
        climb_m_s: float,
        throttle: Throttle | None = None,
        airspeed_m_s: float | None = None,
    ) -> None:
        """Hand new guidance to the controllers.

        Args:
            bank_rad: right wing down.
            climb_m_s: up.
            throttle: least and most; THR_MIN and THR_MAX if left out.
            airspeed_m_s: indicated; the cruise's if left out.
        """
        target = self.target or (0.0, 0.0, 0.0)
        least, most = throttle_limits(self.vehicle) if throttle is None else throttle
        airspeed = self.vehicle.navigator.cruise_m_s() if airspeed_m_s is None else airspeed_m_s
        self.guide(
            GlideGuidance(
                motors=Motors.FLY,
                north_m=target[0],
                east_m=target[1],
                down_m=target[2],
                bank_rad=bank_rad,
                climb_m_s=climb_m_s,
                airspeed_m_s=airspeed * self.vehicle.true_over_indicated,
                least_throttle=least,
                most_throttle=most,
            )
        )

    def begin_level(self) -> None:
        """The climb rate starts from what it is."""
        self._climb_m_s = -self.vehicle.motion.velocity_down_m_s

    def level_off(self) -> None:
        """A take-off's climb ends at once: 9.9 m/s were 1.9 m/s a second later (AUTO)."""
        self._climb_m_s = 0.0


class Circle(PlaneMode):
    """CIRCLE: a steady gentle turn at this height, without a place to keep."""

    def enter(self) -> None:
        """Keep the height."""
        self._down_m = self.vehicle.motion.down_m
        self.begin_level()
        self.update()

    def update(self) -> None:
        """Turn."""
        limit = math.radians(self.vehicle.parameters["ROLL_LIMIT_DEG"]) / 3.0
        self.fly(min(limit, self.bank_limit_rad()), self.climb_to(self._down_m))


class Loiter(PlaneMode):
    """Round the point where it was chosen."""

    radius_m = 0.0
    """Negative against the clock; 0 for WP_LOITER_RAD"""
    slope_from: Vector | None = None
    """Where the slope begins on which it sinks to its target, NED metres"""

    def enter(self) -> None:
        """Choose the centre."""
        m = self.vehicle.motion
        self.begin_level()
        self.go_round((m.north_m, m.east_m, m.down_m))

    def go_round(self, centre: Vector) -> None:
        """Round a point, NED metres."""
        self.circle(centre, radius_m=self.radius_m)

    def update(self) -> None:
        """Go round."""
        assert self.target is not None
        self.go_round(self.target)

    def sloped_down_m(self, down_m: float) -> float:
        """The height to fly at: from above it sinks bit by bit on its way, as in RTL and GUIDED.

        Args:
            down_m: that of its target.
        """
        if self.slope_from is None or self.target is None or self.on_circle:
            return down_m
        above_m = down_m - self.slope_from[2]
        if above_m < SLOPE_MIN_M:
            return down_m
        way = [b - a for a, b in zip(self.slope_from[:2], self.target[:2], strict=True)]
        gone = [b - a for a, b in zip(self.slope_from[:2], self.vehicle.motion[:2], strict=True)]
        along = sum(a * b for a, b in zip(way, gone, strict=True)) / max(math.hypot(*way), 1.0) ** 2
        return down_m - above_m * (1.0 - min(max(along, 0.0), 1.0))


class ReturnToLaunch(Loiter):
    """Round home, RTL_ALTITUDE above it, or round a rally point.

    It does not land, unless RTL_AUTOLAND sends it to the mission's landing.
    """

    def enter(self) -> None:
        """Choose the place."""
        plane = self.vehicle
        self.begin_level()
        self._asked = False
        self.slope_from = plane.motion[:3]
        self.target = plane.return_point_ned_m()
        self._climbed = self._has_climbed()
        self.radius_m = plane.parameters["RTL_RADIUS"]
        self.go_round(self.target)

    def update(self) -> None:
        """Go round; once there, or at once, go and land if that is wanted."""
        if not self._climbed and self._has_climbed():
            self._climbed, self.slope_from = True, self.vehicle.motion[:3]
        super().update()
        assert self.target is not None
        wanted = int(self.vehicle.parameters["RTL_AUTOLAND"])
        there = self.on_circle and abs(self.vehicle.motion.down_m - self.target[2]) < THERE_M
        if not self._asked and (wanted == LAND_AT_ONCE or (wanted == RETURN_THEN_LAND and there)):
            self._asked = True
            self.vehicle.start_landing()

    def bank_limit_rad(self) -> float:
        """See `PlaneMode`; before it has climbed it hardly turns."""
        limit = super().bank_limit_rad()
        return limit if self._climbed else min(limit, level_limit_rad(self.vehicle))

    def climb_to(self, down_m: float) -> float:
        """See `PlaneMode`; first it climbs, and from above it sinks bit by bit on its way."""
        assert self.slope_from is not None
        if not self._climbed:
            more_m = max(self.vehicle.parameters["RTL_CLIMB_MIN"], 0.0) + CLIMBS_ON_M
            return super().climb_to(min(down_m, self.slope_from[2]) - more_m)
        return super().climb_to(self.sloped_down_m(down_m))

    def _has_climbed(self) -> bool:
        """Whether it may turn: RTL_CLIMB_MIN, or to its height (FLIGHT_OPTIONS)."""
        p, down_m = self.vehicle.parameters, self.vehicle.motion.down_m
        if int(p["FLIGHT_OPTIONS"]) & CLIMB_BEFORE_TURN:
            return self.target is not None and down_m < self.target[2]
        start = self.slope_from or self.vehicle.motion[:3]
        return p["RTL_CLIMB_MIN"] <= 0.0 or start[2] - down_m > p["RTL_CLIMB_MIN"]


class Guided(Loiter):
    """Round a point: first the one where it was chosen, then that of DO_REPOSITION.

    Of setpoints only the height of SET_POSITION_TARGET_GLOBAL_INT and of an offset in NED is
    taken; everything else has no effect and gets no word.
    """

    def enter(self) -> None:
        """Round this point."""
        self._reported = False
        self.slope_from = None
        self.radius_m = 0.0
        super().enter()

    def update(self) -> None:
        """Fly a circle; report it once, when it is reached."""
        super().update()
        if self.on_circle and not self._reported:
            self._reported = True
            self.vehicle.events.append(ItemReached(0))

    def reposition(self, place: Vector, radius_m: float, against: bool) -> None:
        """Another point; without a radius that of the last one, or WP_LOITER_RAD.

        The sign of WP_LOITER_RAD counts only where no radius is given.
        """
        self._reported = self.on_circle = False
        self.slope_from = self.vehicle.motion[:3]
        usual_m = self.vehicle.parameters["WP_LOITER_RAD"]
        left = against or (radius_m <= 0.0 and usual_m < 0.0)
        size_m = radius_m or abs(self.radius_m)
        if size_m <= 1.0:
            size_m = abs(usual_m)
        self.radius_m = -size_m if left else size_m
        self.go_round(place)

    def setpoint(self, setpoint: Setpoint) -> None:
        """Set the altitude of a setpoint, if its kind has one that counts."""
        assert self.target is not None
        if setpoint.position_m is None:
            return
        if setpoint.frame is SetpointFrame.OFFSET:
            down = self.vehicle.motion.down_m + setpoint.position_m[2]
        elif setpoint.is_global:
            down = setpoint.position_m[2]
        else:
            return
        self.slope_from = None
        self.go_round((self.target[0], self.target[1], down))

    def climb_to(self, down_m: float) -> float:
        """See `PlaneMode`; along the slope to the point."""
        return super().climb_to(self.sloped_down_m(down_m))

    def change_height(self, down_m: float) -> None:
        """Another height of the circle, NED."""
        assert self.target is not None
        self.slope_from = None
        self.target = (self.target[0], self.target[1], down_m)
