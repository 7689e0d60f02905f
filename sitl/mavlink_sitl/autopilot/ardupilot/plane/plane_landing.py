"""NAV_LAND of planes: slope, flare, roll-out and go-around.

After ArduPlane's documentation of automatic landing: the slope aims at a point above and before
the place, so that the flare, which begins LAND_FLARE_SEC before the ground, ends there.
"""

from __future__ import annotations

import math

from mavlink_sitl.autopilot.ardupilot.plane.plane_modes import level_limit_rad
from mavlink_sitl.autopilot.ardupilot.plane.plane_tasks import Climb, FlyLine, ItemAuto
from mavlink_sitl.autopilot.plans.plans import PlanItem
from mavlink_sitl.exchange import Motors, Severity, Vector
from mavlink_sitl.guidance import GlideGuidance

FLARE_1_S = 0.5
"""In the flare it sinks by this share of its height a second"""
STEEPEST_FLARE_M_S = 3.0


class Approach(FlyLine):
    """NAV_LAND: down a slope to the place, flare, roll out. It never ends by itself.

    Args:
        item: the item: param1 how high a go-around climbs.
        start: where the slope begins, NED metres.
        target: where to touch the ground.
    """

    def __init__(self, auto: ItemAuto, item: PlanItem, start: Vector, target: Vector) -> None:
        super().__init__(auto, item, start, target)
        self.flaring = False
        self._said_place = False
        self.go_around: Climb | None = None
        plane = self.vehicle
        height = plane.navigator.height_above_home_m()
        plane.say(Severity.INFO, f"Landing approach start at {height:.1f}m")
        self._set_slope()
        plane.say(
            Severity.INFO, f"Landing glide slope {math.degrees(math.atan(self._slope)):.1f} degrees"
        )

    @property
    def landing(self) -> bool:
        """Unless it goes around."""
        return self.go_around is None

    @property
    def height_m(self) -> float:
        """Above where it is to land."""
        return self.target[2] - self.vehicle.motion.down_m

    def _set_slope(self) -> None:
        """The slope ends above and before the place, where the flare begins."""
        p, m = self.vehicle.parameters, self.vehicle.motion
        length = max(self.length_m, 1.0)
        speed = max(m.speed_m_s, 0.5)
        sink_m = self.target[2] - self.start[2]
        sink_m_s = sink_m * speed / length
        aim_m = p["LAND_FLARE_SEC"] * sink_m_s
        if aim_m <= 0.0:
            aim_m = p["LAND_FLARE_ALT"]
        if p["LAND_FLARE_ALT"] > 0.0:
            aim_m = min(aim_m, 2.0 * p["LAND_FLARE_ALT"])
        mean_m_s = max((p["TECS_LAND_SINK"] + sink_m_s) / 2.0, 0.1)
        flare_m = min(speed * aim_m / mean_m_s, length / 2.0)
        self._slope = (sink_m - aim_m) / (length - flare_m)

    def down_m(self) -> float:
        """On the slope, which continues beyond the place."""
        along = max(self.share(), 0.0) * self.length_m
        return self.start[2] + self._slope * along

    def update(self) -> None:
        """Run one step of the descent, or of the go-around."""
        plane, mode = self.vehicle, self.auto
        if self.go_around is not None:
            self.go_around.update()
            if plane.navigator.height_above_home_m() >= self.go_around.height_m:
                mode.restart_landing()
            return
        limit = level_limit_rad(plane) if self.flaring else None
        bank = mode.bank_along(self.start[:2], self.target, limit)
        if not self.flaring:
            self._look_for_the_ground()
        if self.flaring:
            self._flare(bank)
            return
        p = plane.parameters
        airspeed = p["TECS_LAND_ARSPD"]
        if airspeed < 0.0:
            airspeed = (p["AIRSPEED_MIN"] + p["AIRSPEED_CRUISE"]) / 2.0
        mode.fly(bank, mode.climb_to(self.down_m()), airspeed_m_s=airspeed)

    def _look_for_the_ground(self) -> None:
        plane, p, m = self.vehicle, self.vehicle.parameters, self.vehicle.motion
        sink_m_s = m.velocity_down_m_s
        soon = self.height_m <= sink_m_s * p["LAND_FLARE_SEC"] and self.share() > 0.5
        if not (self.height_m <= p["LAND_FLARE_ALT"] or soon or self.share() >= 1.0):
            return
        self.flaring = True
        speed = m.speed_m_s
        distance = math.dist(self.here, self.target[:2])
        plane.say(
            Severity.INFO,
            f"Flare {self.height_m:.1f}m sink={sink_m_s:.2f} speed={speed:.1f} dist={distance:.1f}",
        )

    def _flare(self, bank_rad: float) -> None:
        """Throttle closed, nose up; on the ground it rolls out."""
        plane = self.vehicle
        if not plane.armed and not self._said_place:
            self._said_place = True
            distance = math.dist(self.here, self.target[:2])
            plane.say(Severity.INFO, f"Distance from LAND point={distance:.2f}m")
        sink = min(
            max(plane.parameters["TECS_LAND_SINK"], FLARE_1_S * self.height_m), STEEPEST_FLARE_M_S
        )
        self.auto.guide(
            GlideGuidance(
                motors=Motors.MANUAL,
                north_m=self.target[0],
                east_m=self.target[1],
                down_m=self.target[2],
                bank_rad=bank_rad,
                climb_m_s=-sink,
            )
        )

    def abort(self, height_m: float) -> None:
        """Go around: climb, then come again."""
        self.go_around = Climb(
            self.auto, self.item, self.vehicle.navigator.home_ned_m()[2] - height_m
        )

    def finished(self) -> bool:
        """Never."""
        return False
