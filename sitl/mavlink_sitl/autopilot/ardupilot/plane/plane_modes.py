"""The modes of ArduPlane. Observed in `plane_guided`."""

from __future__ import annotations

import math

from mavlink_sitl.autopilot.ardupilot.plane.plane_view import PlaneView
from mavlink_sitl.autopilot.control import l1_guidance as l1
from mavlink_sitl.autopilot.state.mode import Mode
from mavlink_sitl.exchange import Motors, Vector
from mavlink_sitl.guidance import GlideGuidance

Point = tuple[float, float]

HEIGHT_TIME_S = 3.2
"""From an error of the height to a climb rate"""
CLIMB_RATE_CHANGE_M_S2 = 1.0
TAKEOFF_CLIMB_SINE = 0.32
THERE_M = 10.0
"""RTL has arrived on its circle, at most so far above or below it"""
RETURN_THEN_LAND, LAND_AT_ONCE = 1, 2
"""RTL_AUTOLAND"""
STALL_MARGIN_BANK_RAD = math.radians(25.0)
"""It may always bank so much"""


class PlaneMode(Mode):
    """A mode of one plane."""

    vehicle: PlaneView
    target: Vector | None = None
    """What it circles or flies to, and how high, NED metres"""
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
        size = max(abs(radius) * plane.true_over_indicated, 1.0)
        law = self._l1().circle(centre[:2], size, -1 if radius < 0.0 else 1)
        self.target = centre
        self.cross_track_m, self.on_circle = law.outside_m, law.on_circle
        limit = self.bank_limit_rad()
        limit = limit if limit_rad is None else min(limit, limit_rad)
        self.fly(l1.bank_rad(law.sideways_m_s2, limit), self.climb_to(centre[2]))

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
        full_throttle: bool = False,
        airspeed_m_s: float | None = None,
    ) -> None:
        """Hand new guidance to the controllers; the airspeed is an indicated one."""
        target = self.target or (0.0, 0.0, 0.0)
        airspeed = self.vehicle.cruise_m_s() if airspeed_m_s is None else airspeed_m_s
        self.guide(
            GlideGuidance(
                motors=Motors.FLY,
                north_m=target[0],
                east_m=target[1],
                down_m=target[2],
                bank_rad=bank_rad,
                climb_m_s=climb_m_s,
                airspeed_m_s=airspeed * self.vehicle.true_over_indicated,
                full_throttle=full_throttle,
            )
        )

    def begin_level(self) -> None:
        """The climb rate starts from what it is."""
        self._climb_m_s = -self.vehicle.motion.velocity_down_m_s


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


class ReturnToLaunch(Loiter):
    """Round home, RTL_ALTITUDE above it, or round a rally point.

    It does not land, unless RTL_AUTOLAND sends it to the mission's landing.
    """

    def enter(self) -> None:
        """Choose the place."""
        plane = self.vehicle
        self.begin_level()
        self._asked = False
        self.radius_m = plane.parameters["RTL_RADIUS"]
        self.go_round(plane.return_point_ned_m())

    def update(self) -> None:
        """Go round; once there, or at once, go and land if that is wanted."""
        super().update()
        assert self.target is not None
        wanted = int(self.vehicle.parameters["RTL_AUTOLAND"])
        there = self.on_circle and abs(self.vehicle.motion.down_m - self.target[2]) < THERE_M
        if not self._asked and (wanted == LAND_AT_ONCE or (wanted == RETURN_THEN_LAND and there)):
            self._asked = True
            self.vehicle.start_landing()
