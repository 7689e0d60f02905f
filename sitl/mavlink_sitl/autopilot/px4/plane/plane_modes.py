"""The flight modes of PX4's planes without missions, landing or take-off."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

from mavlink_sitl.autopilot.control.l1_guidance import bank_rad
from mavlink_sitl.autopilot.px4.mode import HoldMode, OffboardMode, Px4Mode
from mavlink_sitl.autopilot.px4.navigation import within
from mavlink_sitl.autopilot.px4.plane import path_guidance
from mavlink_sitl.autopilot.px4.plane.path_guidance import PathPoint, Point
from mavlink_sitl.exchange import Motors, Vector
from mavlink_sitl.guidance import GlideGuidance

if TYPE_CHECKING:
    from mavlink_sitl.autopilot.px4.plane.plane import Px4Plane
    from mavlink_sitl.geodesy import GeoPoint

CLIMB_CHANGE_M_S2 = 3.0
STEP_S = 0.05
STALL_MARGIN_BANK_RAD = math.radians(20.0)
"""The bank limit for a low airspeed is never below this"""
TRUE_OVER_INDICATED = 1.06
"""Of the simulated body; see its pipeline"""
GROUND_BANK_RAD = math.radians(2.0)


class PlaneMode(Px4Mode):
    """A mode of one plane.

    Attributes:
        place: where it is going, NED metres, for telemetry.
        path: what it follows, for telemetry.
    """

    vehicle: Px4Plane
    place: Vector = (0.0, 0.0, 0.0)
    path: PathPoint | None = None
    rising = False
    _climb_m_s = 0.0

    def ground_motors(self) -> Motors:
        """It rolls before it flies."""
        return self.vehicle.wanted.motors

    def hold_guidance(self) -> GlideGuidance:
        """Level and straight on."""
        m = self.vehicle.motion
        return GlideGuidance(
            motors=Motors.FLY,
            north_m=m.north_m,
            east_m=m.east_m,
            down_m=m.down_m,
            airspeed_m_s=self.vehicle.navigator.cruise_m_s() * TRUE_OVER_INDICATED,
        )

    def course(self) -> Point:
        """Its velocity over ground; while it hardly moves along its nose."""
        m = self.vehicle.motion
        if m.speed_m_s > 1.0:
            return m.velocity_north_m_s, m.velocity_east_m_s
        return math.cos(m.yaw_rad), math.sin(m.yaw_rad)

    def rest(self) -> None:
        """Motor off, as on the ground."""
        self.path = None
        self.drive(GlideGuidance(motors=Motors.IDLE))

    def bank_limit_rad(self) -> float:
        """FW_R_LIM; less when slow, and when a wing could touch the ground."""
        p, plane = self.vehicle.parameters, self.vehicle
        limit = math.radians(within(p["FW_R_LIM"], 1.0, 80.0))
        load = (plane.airspeed_m_s / max(p["FW_AIRSPD_MIN"], 1.0)) ** 2
        carried = math.acos(1.0 / load) if load > 1.0 else 0.0
        limit = min(limit, max(carried, STALL_MARGIN_BANK_RAD))
        room = max(plane.height_above_ground_m(), 0.0) + max(p["FW_WING_HEIGHT"], 0.0)
        wing = within(p["FW_WING_SPAN"], 0.1, 100.0) / 2.0
        return min(limit, max(math.atan(room / wing), GROUND_BANK_RAD))

    def climb_to(self, down_m: float) -> float:
        """The climb rate towards a height (FW_T_ALT_TC, FW_T_CLMB_R_SP, FW_T_SINK_R_SP)."""
        p = self.vehicle.parameters
        error = self.vehicle.motion.down_m - down_m
        most = within(p["FW_T_CLMB_R_SP"], 0.1, 20.0)
        least = within(p["FW_T_SINK_R_SP"], 0.1, 20.0)
        return min(max(error / within(p["FW_T_ALT_TC"], 0.5, 60.0), -least), most)

    def fly(
        self,
        path: PathPoint | None,
        climb_m_s: float,
        airspeed_m_s: float | None = None,
        full_throttle: bool = False,
        bank: float = 0.0,
    ) -> None:
        """Follow a path.

        Args:
            path: None to bank instead.
            climb_m_s: wanted; it changes slowly.
            airspeed_m_s: indicated; the cruise's when None.
            full_throttle: push as hard as possible.
            bank: without a path, rad.
        """
        plane = self.vehicle
        self.path = path
        if path is not None:
            push = path_guidance.sideways_m_s2(self.level(), self.course(), path, plane.law())
            bank = bank_rad(push, self.bank_limit_rad())
        change = CLIMB_CHANGE_M_S2 * STEP_S
        self._climb_m_s += min(max(climb_m_s - self._climb_m_s, -change), change)
        airspeed = plane.navigator.cruise_m_s() if airspeed_m_s is None else airspeed_m_s
        self.guide(
            replace(
                self.hold_guidance(),
                north_m=self.place[0],
                east_m=self.place[1],
                down_m=self.place[2],
                bank_rad=bank,
                climb_m_s=self._climb_m_s,
                airspeed_m_s=airspeed * TRUE_OVER_INDICATED,
                least_throttle=1.0 if full_throttle else 0.0,
            )
        )

    def circle_path(self, centre: Point, radius_m: float) -> PathPoint:
        """A circle to follow; it is remembered as the one that is flown."""
        self.vehicle.circling = (centre, radius_m)
        return path_guidance.circle(
            self.level(), centre, radius_m, path_guidance.unit(*self.course())
        )

    def circle(self, place: Vector, radius_m: float | None = None) -> None:
        """Fly round a place at its height."""
        radius = self.vehicle.loiter_radius_m() if radius_m is None else radius_m
        self.place = place
        self.fly(self.circle_path(place[:2], radius), self.climb_to(place[2]))

    def follow_path(self, path: PathPoint, place: Vector) -> None:
        """Fly along a path, at the height of a place on it."""
        self.vehicle.circling = None
        self.place = place
        self.fly(path, self.climb_to(place[2]))

    def fly_over(self, path: PathPoint, place: Vector) -> None:
        """Along a path over a place; too high or too low there, round it until the height is."""
        near = math.dist(self.level(), place[:2]) < self.vehicle.accept_m()
        self.rising = not self.at_height(place[2]) and (near or self.rising)
        if self.rising:
            self.circle(place)
        else:
            self.follow_path(path, place)

    def level_off(self) -> None:
        """The climb rate starts from what it is."""
        self._climb_m_s = -self.vehicle.motion.velocity_down_m_s

    def near_circle(self, centre: Point, radius_m: float) -> bool:
        """Whether it is on a circle, or inside, nearly."""
        return math.dist(self.level(), centre) <= self.vehicle.accept_m() + abs(radius_m)

    def at_height(self, down_m: float) -> bool:
        """Whether a height counts as reached."""
        return abs(self.vehicle.motion.down_m - down_m) <= self.vehicle.height_accept_m()


class Hold(PlaneMode, HoldMode):
    """AUTO.LOITER: round the place where it was chosen, or that of DO_REPOSITION or DO_ORBIT.

    Attributes:
        radius_m: that DO_ORBIT asked for, negative counter-clockwise; None for NAV_LOITER_RAD.
    """

    radius_m: float | None = None

    def enter(self) -> None:
        """Choose the centre: that of the circle that is flown, if one is."""
        self.target = self.radius_m = None
        self.level_off()
        self.update()

    def update(self) -> None:
        """Go round; on the ground rest."""
        if self.vehicle.landed:
            self.target = None
            self.rest()
            return
        if self.target is None:
            circling = self.vehicle.circling
            centre = self.level()
            if circling is not None and self.near_circle(*circling):
                centre = circling[0]
            self.target = (*centre, self.vehicle.motion.down_m)
        self.circle(self.target, self.radius_m)

    def go_to(
        self, point: GeoPoint | None, altitude_amsl_m: float | None, yaw_rad: float | None
    ) -> None:
        """Round another place, at another height; None keeps what is. NAV_LOITER_RAD counts."""
        self.go_round(point, altitude_amsl_m, None)

    def go_round(
        self, point: GeoPoint | None, altitude_amsl_m: float | None, radius_m: float | None
    ) -> None:
        """Round another place with a radius."""
        self.target, self.radius_m = self.other_target(point, altitude_amsl_m), radius_m


class Manual(PlaneMode):
    """MANUAL: the sticks' bank, climb and throttle."""

    def enter(self) -> None:
        """Take the sticks."""
        self.level_off()
        self.update()

    def sticks(self) -> Vector:
        """Roll and pitch (forwards positive), -1..1, throttle 0..1; 0 when nobody holds them."""
        sticks = self.vehicle.sticks.held()
        if sticks is None:
            return 0.0, 0.0, 0.0
        return sticks.roll, sticks.pitch, sticks.throttle

    def update(self) -> None:
        """Follow the sticks."""
        roll, pitch, throttle = self.sticks()
        self.drive(
            GlideGuidance(
                motors=Motors.MANUAL,
                throttle=throttle,
                bank_rad=roll * self.bank_limit_rad(),
                climb_m_s=-pitch * self.vehicle.parameters["FW_T_CLMB_MAX"],
            )
        )


class Altitude(Manual):
    """ALTCTL and POSCTL: height and airspeed are held; POSCTL without roll keeps the course."""

    def enter(self) -> None:
        """Keep the height."""
        self._down_m = self.vehicle.motion.down_m
        self._line: tuple[Point, Point] | None = None
        super().enter()

    def update(self) -> None:
        """Follow the sticks."""
        plane, p = self.vehicle, self.vehicle.parameters
        roll, pitch, throttle = self.sticks()
        if plane.landed and throttle < 0.1:
            self.rest()
            return
        climb = -pitch * (p["FW_T_SINK_R_SP"] if pitch > 0.0 else p["FW_T_CLMB_R_SP"])
        if abs(pitch) > 0.06:
            self._down_m = plane.motion.down_m
        else:
            climb = self.climb_to(self._down_m)
        lowest, trim, highest = (p[f"FW_AIRSPD_{name}"] for name in ("MIN", "TRIM", "MAX"))
        share = 2.0 * throttle - 1.0
        airspeed = trim + share * (highest - trim if share > 0.0 else trim - lowest)
        path = self._straight_on() if abs(roll) < 0.06 else None
        if path is None:
            self._line = None
        self.fly(path, climb, within(airspeed, 1.0, 100.0), bank=roll * self.bank_limit_rad())

    def _straight_on(self) -> PathPoint | None:
        if self.spec.behaviour != "px4_position":
            return None
        if self._line is None:
            (north, east), (c, s) = self.level(), path_guidance.unit(*self.course())
            self._line = ((north, east), (north + c, east + s))
        return path_guidance.line(self.level(), *self._line)


def whole(vector: Vector | None) -> bool:
    """Whether all three components are given."""
    return vector is not None and all(math.isfinite(value) for value in vector)


class PlaneOffboard(PlaneMode, OffboardMode):
    """OFFBOARD: follows the stream of setpoints.

    * A position is flown to in a straight line, and flown over again and again; far from its
      height it is circled until the height is reached.
    * A position with a velocity is a place on a path and the path's direction there.
    * A velocity, an acceleration, or a position with something missing controls nothing: it
      flies on, level.
    """

    def enter(self) -> None:
        """Follow the latest setpoint."""
        self.level_off()
        self._down_m = self.vehicle.motion.down_m
        self.rising = False
        super().enter()

    def follow(self, fresh: bool) -> None:
        """See `OffboardMode`."""
        self.update()

    def stop(self) -> None:
        """Nobody says anything: fly on, level."""
        self.vehicle.circling = None
        if self.vehicle.landed:
            self.rest()
        else:
            self.fly(None, self.climb_to(self._down_m))

    def update(self) -> None:
        """Follow the setpoint."""
        place, velocity = self.target.position_m, self.target.velocity_m_s
        if not self.vehicle.stream_alive() or place is None or not whole(place):
            self.stop()
            return
        self._down_m = place[2]
        here = self.level()
        if velocity is not None and whole(velocity):
            self.rising = False
            along = path_guidance.unit(velocity[0], velocity[1])
            end = (place[0] + along[0], place[1] + along[1])
            self.follow_path(path_guidance.line(here, place[:2], end), place)
            return
        self.fly_over(path_guidance.point(here, place[:2]), place)
