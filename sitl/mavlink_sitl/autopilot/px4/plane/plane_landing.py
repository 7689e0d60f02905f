"""Landing and return of PX4's planes: circling or straight, flare, AUTO.LAND and AUTO.RTL."""

from __future__ import annotations

import math

from mavlink_sitl.autopilot.control.l1_guidance import bank_rad
from mavlink_sitl.autopilot.plans.plans import Cmd
from mavlink_sitl.autopilot.px4.navigation import within
from mavlink_sitl.autopilot.px4.plane import path_guidance
from mavlink_sitl.autopilot.px4.plane.path_guidance import PathPoint, Point
from mavlink_sitl.autopilot.px4.plane.plane_modes import PlaneMode
from mavlink_sitl.autopilot.px4.safe_points import destination_ned_m, return_text
from mavlink_sitl.exchange import Motors, Severity, Vector
from mavlink_sitl.guidance import GlideGuidance

FLARE_THROTTLE = 0.15
SLOPE_GAIN_1_S = 0.4
"""From the height above the glide slope to a sink rate on top of the slope's"""


class Descent:
    """The way down and the flare; a flare is not given up.

    Args:
        mode: whose landing it is.
        touchdown: where, NED metres.
        entrance: where the glide slope begins; None to circle down round the place.
    """

    def __init__(self, mode: PlaneMode, touchdown: Vector, entrance: Vector | None = None) -> None:
        self._mode = mode
        self._vehicle = mode.vehicle
        self._touchdown = touchdown
        self._entrance = entrance
        self._flare_s: float | None = None
        self._flare_climb_m_s = 0.0

    def _path(self) -> PathPoint:
        if self._entrance is None:
            return self._mode.circle_path(self._touchdown[:2], self._vehicle.loiter_radius_m())
        self._vehicle.circling = None
        return path_guidance.line(self._mode.level(), self._entrance[:2], self._touchdown[:2])

    def update(self) -> None:
        """Run one step."""
        plane, mode, p = self._vehicle, self._mode, self._vehicle.parameters
        mode.place = self._touchdown
        path = self._path()
        sink = plane.motion.velocity_down_m_s
        height = plane.height_above_ground_m()
        flare_s = within(p["FW_LND_FL_TIME"], 0.1, 10.0)
        if self._flare_s is None and height < max(flare_s * sink, p["FW_LND_FLALT"]):
            self._flare_s, self._flare_climb_m_s = plane.now_s, -sink
        if self._flare_s is None:
            mode.fly(path, self._climb_m_s(), plane.landing_m_s())
            return
        ramp = math.sqrt(min((plane.now_s - self._flare_s) / flare_s, 1.0))
        soft = within(p["FW_LND_FL_SINK"], 0.05, 2.0)
        push = path_guidance.sideways_m_s2(mode.level(), mode.course(), path, plane.law())
        mode.guide(
            GlideGuidance(
                motors=Motors.MANUAL,
                throttle=(1.0 - ramp) * FLARE_THROTTLE,
                north_m=self._touchdown[0],
                east_m=self._touchdown[1],
                down_m=self._touchdown[2],
                bank_rad=bank_rad(push, mode.bank_limit_rad()),
                climb_m_s=-ramp * soft + (1.0 - ramp) * self._flare_climb_m_s,
            )
        )

    def _climb_m_s(self) -> float:
        plane = self._vehicle
        slope = math.radians(within(plane.parameters["FW_LND_ANG"], 1.0, 15.0))
        if self._entrance is None:
            return -plane.landing_m_s() * math.sin(math.atan(slope))
        start, end, here = self._entrance, self._touchdown, plane.motion
        length = max(math.dist(start[:2], end[:2]), 1.0)
        drop = min(max(end[2] - start[2], 0.0), length * math.tan(slope))
        along = path_guidance.unit(end[0] - start[0], end[1] - start[1])
        left = (end[0] - here.north_m) * along[0] + (end[1] - here.east_m) * along[1]
        wanted = end[2] - min(left * drop / length, drop)
        above = wanted - here.down_m
        if above <= 0.0:
            return 0.0  # below the slope it flies level until it meets it
        speed = here.speed_m_s
        on_slope = speed * drop / length if left < length else 0.0
        steepest = max(on_slope, plane.parameters["FW_T_SINK_R_SP"]) + 1.0
        return -min(on_slope + SLOPE_GAIN_1_S * above, steepest)


class Land(PlaneMode):
    """AUTO.LAND: circles down round where it was chosen, whatever is below."""

    landing = True

    def enter(self) -> None:
        """Choose the place."""
        self.level_off()
        plane = self.vehicle
        ground = plane.motion.down_m + plane.height_above_ground_m()
        self._descent = Descent(self, (*self.level(), ground))
        self.update()

    def update(self) -> None:
        """Go down; on the ground rest."""
        if self.vehicle.landed:
            self.rest()
        else:
            self._descent.update()


class Return(PlaneMode):
    """AUTO.RTL: climb to RTL_RETURN_ALT, fly home, circle down to RTL_DESCEND_ALT, and stay there.

    Only an RTL_LAND_DELAY that is not negative lets it land there. With RTL_TYPE 1, 2 and 4 and
    a mission that ends in a landing, it goes to that landing's beginning instead, and lands.
    """

    def enter(self) -> None:
        """Climb where it is."""
        plane, p = self.vehicle, self.vehicle.parameters
        self.level_off()
        self._goal = destination_ned_m(plane)
        self._entrance = self._landing_entrance()
        here = plane.motion
        self._down_m = min(self._goal[2] - p["RTL_RETURN_ALT"], 1e4)
        if here.down_m <= self._down_m:
            self._stage, self._down_m = "go", here.down_m
        else:
            self._stage = "climb"
        self._centre: Point = self.level()
        self._since_s = math.inf
        self._descent: Descent | None = None
        if plane.in_flight:
            plane.say(Severity.INFO, return_text(plane, self._down_m, self._goal))
        self.update()

    def _landing_entrance(self) -> Vector | None:
        """The last place before the mission's landing, when that is where it goes."""
        plane = self.vehicle
        items, auto = plane.plans.mission.items, plane.auto
        if int(plane.parameters["RTL_TYPE"]) not in (1, 2, 4) or not auto.has_mission:
            return None
        before: Vector | None = None
        for item in items:
            if item.command == Cmd.LAND and before is not None:
                landing = auto.place_of(item, self._goal)
                return before if math.dist(landing[:2], self._goal[:2]) < 1.0 else None
            if item.command in auto.moving and item.has_place:
                before = auto.place_of(item, self._goal)
        return None

    @property
    def landing(self) -> bool:
        """In the last stage."""
        return self._stage == "land"

    def _radius_m(self) -> float:
        return within(self.vehicle.parameters["RTL_LOITER_RAD"], -1e4, 1e4)

    def update(self) -> None:
        """Run one step of the stage, or advance to the next."""
        plane = self.vehicle
        if plane.landed or not plane.armed:
            self.rest()
            return
        if self._stage == "land":
            assert self._descent is not None
            self._descent.update()
            return
        approach = self._entrance or self._goal
        if self._stage == "climb":
            self.circle((*self._centre, self._down_m), plane.loiter_radius_m())
            if self.at_height(self._down_m):
                self._stage = "go"
        elif self._stage == "go":
            self.circle((*approach[:2], self._down_m), self._radius_m())
            if self.near_circle(approach[:2], self._radius_m()):
                self._stage = "down"
        else:
            self._wait(approach)

    def _wait(self, approach: Vector) -> None:
        plane, p = self.vehicle, self.vehicle.parameters
        down = max(self._goal[2] - p["RTL_DESCEND_ALT"], self._down_m)
        if self._entrance is not None:
            down = max(self._entrance[2], self._down_m)
        self.circle((*approach[:2], down), self._radius_m())
        delay_s = 0.0 if self._entrance is not None else p["RTL_LAND_DELAY"]
        if self._stage == "down" and self.at_height(down):
            self._stage, self._since_s = "hold", plane.now_s
            if delay_s < 0.0:
                plane.say(Severity.INFO, "RTL: completed, loitering")
        if self._stage == "hold" and 0.0 <= delay_s <= plane.now_s - self._since_s:
            self._stage = "land"
            plane.say(Severity.INFO, "RTL: land at destination")
            self._descent = Descent(self, self._goal, self._entrance)
