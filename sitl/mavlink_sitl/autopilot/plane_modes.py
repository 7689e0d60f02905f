"""The modes of ArduPlane. Observed in `plane_guided`."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from mavlink_sitl.autopilot import l1
from mavlink_sitl.autopilot.guided import Frame, Setpoint
from mavlink_sitl.autopilot.modes import Mode
from mavlink_sitl.exchange import ItemReached, Motors, Severity
from mavlink_sitl.guidance import GlideGuidance

if TYPE_CHECKING:
    from mavlink_sitl.autopilot.personality import ModeSpec
    from mavlink_sitl.autopilot.plane import Plane

HEIGHT_TIME_S = 3.2
"""From an error of the height to a climb rate"""
CLIMB_RATE_CHANGE_M_S2 = 1.0
TAKEOFF_CLIMB_SINE = 0.32
LEVEL_WINGS_M = 10.0
"""TKOFF_LVL_ALT's place: below it a take-off flies straight"""
LEVELLED_OFF_M = 1.2
STALL_MARGIN_BANK_RAD = math.radians(25.0)
"""It may always bank so much"""


class PlaneMode(Mode):
    """A mode of one plane.

    Args:
        plane: the aircraft.
        spec: number, name and rules.
    """

    def __init__(self, plane: Plane, spec: ModeSpec) -> None:
        """See the class."""
        super().__init__(plane, spec)
        self.plane = plane
        self.centre: tuple[float, float, float] | None = None
        """What it circles and how high, NED metres"""
        self.outside_m = 0.0
        self.on_circle = False
        self._climb_m_s = 0.0

    def ground_motors(self) -> Motors:
        """It rolls before it flies."""
        return Motors.FLY

    def bank_limit_rad(self) -> float:
        """ROLL_LIMIT_DEG, less when it is slow: the load of the turn must stay below the stall."""
        plane = self.plane
        p = plane.parameters
        limit = math.radians(min(max(p["ROLL_LIMIT_DEG"], 1.0), 80.0))
        load = (plane.airspeed_m_s / max(p["AIRSPEED_MIN"], 1.0)) ** 2
        carried = math.acos(1.0 / load) if load > 1.0 else 0.0
        return min(limit, max(carried, STALL_MARGIN_BANK_RAD))

    def climb_to(self, down_m: float) -> float:
        """The climb rate towards a height; it changes slowly and keeps the limits."""
        p = self.plane.parameters
        error = self.plane.motion.down_m - down_m
        most, least = max(p["TECS_CLMB_MAX"], 0.1), max(p["TECS_SINK_MAX"], 0.1)
        wanted = min(max(error / HEIGHT_TIME_S, -least), most)
        change = CLIMB_RATE_CHANGE_M_S2 * self.plane.step_s
        change = max(change, 0.0) * (3.0 if abs(wanted) < abs(self._climb_m_s) else 1.0)
        self._climb_m_s += min(max(wanted - self._climb_m_s, -change), change)
        return self._climb_m_s

    def circle(self, centre: tuple[float, float, float], limit_rad: float | None = None) -> None:
        """Fly round a point at a height."""
        plane, m = self.plane, self.plane.motion
        radius = plane.parameters["WP_LOITER_RAD"]
        law = l1.circle(
            (m.north_m, m.east_m),
            (m.velocity_north_m_s, m.velocity_east_m_s),
            m.yaw_rad,
            centre[:2],
            max(abs(radius) * plane.true_over_indicated, 1.0),
            -1 if radius < 0.0 else 1,
            max(plane.parameters["NAVL1_PERIOD"], 1.0),
            max(plane.parameters["NAVL1_DAMPING"], 0.1),
        )
        self.centre = centre
        self.outside_m, self.on_circle = law.outside_m, law.on_circle
        limit = self.bank_limit_rad()
        limit = limit if limit_rad is None else min(limit, limit_rad)
        self.fly(l1.bank_rad(law.sideways_m_s2, limit), self.climb_to(centre[2]))

    def fly(self, bank_rad: float, climb_m_s: float, full_throttle: bool = False) -> None:
        """Hand new guidance to the controllers."""
        centre = self.centre or (0.0, 0.0, 0.0)
        self.guide(
            GlideGuidance(
                motors=Motors.FLY,
                north_m=centre[0],
                east_m=centre[1],
                down_m=centre[2],
                bank_rad=bank_rad,
                climb_m_s=climb_m_s,
                airspeed_m_s=self.plane.cruise_m_s() * self.plane.true_over_indicated,
                full_throttle=full_throttle,
            )
        )

    def begin_level(self) -> None:
        """The climb rate starts from what it is."""
        self._climb_m_s = -self.plane.motion.velocity_down_m_s


class Stick(PlaneMode):
    """MANUAL, STABILIZE, ACRO and FBWA: the pilot's bank, climb and throttle."""

    def enter(self) -> None:
        """Take the sticks."""
        self.update()

    def update(self) -> None:
        """Follow the sticks."""
        roll, pitch, throttle = self.plane.sticks()
        self.guide(
            GlideGuidance(
                motors=Motors.MANUAL,
                throttle=throttle,
                bank_rad=roll * self.bank_limit_rad(),
                climb_m_s=pitch * TAKEOFF_CLIMB_SINE * max(self.plane.airspeed_m_s, 5.0),
            )
        )


class Cruise(PlaneMode):
    """FBWB and CRUISE: airspeed and height are held; the sticks bank and climb."""

    def enter(self) -> None:
        """Keep the height."""
        self._down_m = self.plane.motion.down_m
        self.begin_level()
        self.update()

    def update(self) -> None:
        """Follow the sticks."""
        roll, pitch, _ = self.plane.sticks()
        self._down_m -= 2.0 * pitch * self.plane.step_s
        self.fly(roll * self.bank_limit_rad(), self.climb_to(self._down_m))


class Circle(PlaneMode):
    """CIRCLE: a steady gentle turn at this height, without a place to keep."""

    def enter(self) -> None:
        """Keep the height."""
        self._down_m = self.plane.motion.down_m
        self.begin_level()
        self.update()

    def update(self) -> None:
        """Turn."""
        limit = math.radians(self.plane.parameters["ROLL_LIMIT_DEG"]) / 3.0
        self.fly(min(limit, self.bank_limit_rad()), self.climb_to(self._down_m))


class Loiter(PlaneMode):
    """Round the point where it was chosen."""

    def enter(self) -> None:
        """Choose the centre."""
        m = self.plane.motion
        self.begin_level()
        self.circle((m.north_m, m.east_m, m.down_m))

    def update(self) -> None:
        """Go round."""
        assert self.centre is not None
        self.circle(self.centre)


class ReturnToLaunch(Loiter):
    """Round home, RTL_ALTITUDE above it; it does not land."""

    def enter(self) -> None:
        """Home is the centre."""
        north, east, down = self.plane.navigator.home_ned_m()
        self.begin_level()
        height = self.plane.parameters["RTL_ALTITUDE"]
        if height < 0.0:
            down = self.plane.motion.down_m
        else:
            down -= height
        self.circle((north, east, down))


class Guided(Loiter):
    """Round a point: first the one where it was chosen, then that of DO_REPOSITION.

    Of setpoints only the height of SET_POSITION_TARGET_GLOBAL_INT and of an offset in NED is
    taken; everything else has no effect and gets no word.
    """

    def enter(self) -> None:
        """Round this point."""
        self._told = False
        super().enter()

    def update(self) -> None:
        """Go round; tell when the circle is reached."""
        super().update()
        if self.on_circle and not self._told:
            self._told = True
            self.plane.events.append(ItemReached(0))

    def reposition(self, place: tuple[float, float, float]) -> None:
        """Another point."""
        self._told = False
        self.circle(place)

    def setpoint(self, setpoint: Setpoint) -> None:
        """Take the height of a setpoint, when it is of a kind whose height counts."""
        assert self.centre is not None
        if setpoint.position_m is None:
            return
        if setpoint.frame is Frame.OFFSET:
            down = self.plane.motion.down_m + setpoint.position_m[2]
        elif setpoint.is_global:
            down = setpoint.position_m[2]
        else:
            return
        self.circle((self.centre[0], self.centre[1], down))


class TakeOff(PlaneMode):
    """Armed, it takes off by itself, climbs, and circles TKOFF_DIST ahead of where it began."""

    def enter(self) -> None:
        """Wait for arming on the ground; in the air climb on."""
        self._began_s: float | None = None
        self._steps = 0
        self.climbing = True
        self.centre = None
        self._climb_m_s = 0.0
        self.guide(GlideGuidance())

    @property
    def taking_off(self) -> bool:
        """Until it has levelled off."""
        return self.climbing

    def update(self) -> None:
        """Go on."""
        plane = self.plane
        if not plane.armed:
            return
        if self._began_s is None:
            self._begin()
        assert self._began_s is not None
        assert self.centre is not None
        since_s = plane.now_s - self._began_s
        height = plane.navigator.height_above_home_m()
        self._announce(since_s, height)
        if not self.climbing:
            self.circle(self.centre)
            return
        if since_s < 0.2:
            return
        climb = TAKEOFF_CLIMB_SINE * plane.airspeed_m_s * plane.true_over_indicated
        if height >= plane.parameters["TKOFF_ALT"] - LEVELLED_OFF_M:
            self.climbing = False
            self._climb_m_s = 0.0
        if height < LEVEL_WINGS_M:
            self.fly(0.0, climb, full_throttle=True)
            return
        # Close to the ground it banks only a little.
        limit = math.radians(5.0 + 2.6 * max(height - 13.5, 0.0))
        self.circle(self.centre, limit)
        wanted = self.plane.wanted
        bank = wanted.bank_rad if isinstance(wanted, GlideGuidance) else 0.0
        self.fly(bank, climb, full_throttle=True)

    def _begin(self) -> None:
        plane, m = self.plane, self.plane.motion
        self._began_s = plane.now_s
        p = plane.parameters
        ahead = p["TKOFF_DIST"]
        self.centre = (
            m.north_m + ahead * math.cos(m.yaw_rad),
            m.east_m + ahead * math.sin(m.yaw_rad),
            plane.navigator.home_ned_m()[2] - p["TKOFF_ALT"],
        )
        self._heading_deg = math.degrees(m.yaw_rad) % 360.0

    def _announce(self, since_s: float, height_m: float) -> None:
        p, plane = self.plane.parameters, self.plane
        where = f"{p['TKOFF_ALT']:.0f}m for {p['TKOFF_DIST']:.1f}m"
        steps = (
            (0.0, "Armed AUTO, xaccel = 0.0 m/s/s, waiting 0.2 sec"),
            (0.2, "Triggered AUTO. GPS speed = 0.0"),
            (1.2, f"Takeoff to {where} heading {self._heading_deg:.1f} deg"),
            (1.4, f"Autoland direction= {int(self._heading_deg - 0.1)}"),
        )
        while self._steps < len(steps) and since_s >= steps[self._steps][0]:
            plane.say(Severity.INFO, steps[self._steps][1])
            self._steps += 1
        if self._steps == len(steps) and height_m >= p["TKOFF_ALT"] - 20.0:
            self._steps += 1
            plane.say(Severity.INFO, "Takeoff level-off starting at 19m")
