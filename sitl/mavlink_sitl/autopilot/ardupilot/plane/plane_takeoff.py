"""Take-off of planes, in TAKEOFF and in a mission. Recorded in `plane_guided`."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from mavlink_sitl.autopilot.ardupilot.plane.plane_modes import (
    TAKEOFF_CLIMB_SINE,
    PlaneMode,
    Throttle,
    level_limit_rad,
    throttle_limits,
)
from mavlink_sitl.exchange import Motors, Severity
from mavlink_sitl.guidance import GlideGuidance

if TYPE_CHECKING:
    from mavlink_sitl.autopilot.ardupilot.plane.plane import Plane

BANKS_FROM = 1.35
"""Times TKOFF_LVL_ALT: from here on it banks more than LEVEL_ROLL_LIMIT"""
BANKS_MORE_DEG = 26.0
"""For every TKOFF_LVL_ALT higher"""
THROTTLE_RANGE = 1
"""TKOFF_OPTIONS"""
LEVELLED_OFF_M = 1.2
LEVEL_OFF_FROM_M = 20.0
OPENS_AFTER_S = 0.2
"""From arming until the throttle opens"""


class Launch:
    """From arming into the air: what is said meanwhile, and how steeply it climbs.

    Args:
        height_m: where it is to level off, above home.
        texts: what is said, and how many seconds after arming; besides what is always said.
    """

    def __init__(
        self, plane: Plane, height_m: float, texts: Sequence[tuple[float, str]] = ()
    ) -> None:
        self._vehicle = plane
        self._height_m = height_m
        self._began_s = plane.now_s
        self.heading_rad = plane.motion.yaw_rad
        self._texts = [
            (0.0, "Armed AUTO, xaccel = 0.0 m/s/s, waiting 0.2 sec"),
            (OPENS_AFTER_S, "Triggered AUTO. GPS speed = 0.0"),
            *texts,
            (1.4, f"Autoland direction= {int(math.degrees(self.heading_rad) % 360.0 - 0.1)}"),
        ]
        self._levelling = False

    def rolling(self) -> bool:
        """Return what is due; whether the throttle is open."""
        plane = self._vehicle
        since_s = plane.now_s - self._began_s
        while self._texts and since_s >= self._texts[0][0]:
            plane.say(Severity.INFO, self._texts.pop(0)[1])
        left_m = self._height_m - plane.navigator.height_above_home_m()
        if not self._texts and not self._levelling and left_m <= LEVEL_OFF_FROM_M:
            self._levelling = True
            text = f"Takeoff level-off starting at {int(LEVEL_OFF_FROM_M - 0.1)}m"
            plane.say(Severity.INFO, text)
        return since_s >= OPENS_AFTER_S

    def throttle(self) -> Throttle:
        """Least and most: as much as it may, or as its airspeed needs (TKOFF_OPTIONS)."""
        plane, p = self._vehicle, self._vehicle.parameters
        most = min(max(p["TKOFF_THR_MAX"] / 100.0, 0.0), 1.0) or throttle_limits(plane)[1]
        ranges = int(p["TKOFF_OPTIONS"]) & THROTTLE_RANGE and p["ARSPD_USE"]
        since_s = plane.now_s - self._began_s - OPENS_AFTER_S
        high = plane.navigator.height_above_home_m() >= p["TKOFF_LVL_ALT"]
        if not ranges or not high or since_s < p["TKOFF_THR_MAX_T"]:
            return most, most
        least = p["TKOFF_THR_MIN"] or p["TRIM_THROTTLE"]
        return min(max(least / 100.0, 0.0), most), most

    def climb_m_s(self) -> float:
        """As steep as it can."""
        plane = self._vehicle
        return TAKEOFF_CLIMB_SINE * plane.airspeed_m_s * plane.true_over_indicated


class TakeOff(PlaneMode):
    """Armed, it takes off by itself, climbs, and circles TKOFF_DIST ahead of where it began.

    In the air it circles where it is.
    """

    def enter(self) -> None:
        """Wait for arming on the ground."""
        self._launch: Launch | None = None
        self._began_at_m = 0.0
        self.climbing = True
        self.target = None
        self.guide(GlideGuidance())
        if not self.vehicle.landed:
            m = self.vehicle.motion
            self.begin_level()
            self.climbing = False
            self.vehicle.say(Severity.INFO, "Takeoff skipped - circling")
            self.circle((m.north_m, m.east_m, m.down_m))

    @property
    def taking_off(self) -> bool:
        """Until it has levelled off."""
        return self.climbing

    def ground_motors(self) -> Motors:
        """It rolls before it flies."""
        return Motors.FLY

    def update(self) -> None:
        """Run one step."""
        plane = self.vehicle
        if not plane.armed:
            return
        if self.climbing and self._launch is None:
            self._begin()
        assert self.target is not None
        if not self.climbing:
            self.circle(self.target)
            return
        assert self._launch is not None
        if not self._launch.rolling():
            return
        height = plane.navigator.height_above_home_m() - self._began_at_m
        if height >= plane.parameters["TKOFF_ALT"] - LEVELLED_OFF_M:
            self.climbing = False
            self.level_off()
        climb = self._launch.climb_m_s()
        throttle, level_m = self._launch.throttle(), max(plane.parameters["TKOFF_LVL_ALT"], 1.0)
        if height < level_m:
            self.fly(0.0, climb, throttle)
            return
        # Close to the ground it banks only a little.
        more_deg = BANKS_MORE_DEG * max(height / level_m - BANKS_FROM, 0.0)
        limit = level_limit_rad(plane) + math.radians(more_deg)
        self.circle(self.target, limit)
        wanted = self.vehicle.wanted
        bank = wanted.bank_rad if isinstance(wanted, GlideGuidance) else 0.0
        self.fly(bank, climb, throttle)

    def _begin(self) -> None:
        plane, m, p = self.vehicle, self.vehicle.motion, self.vehicle.parameters
        ahead, height = p["TKOFF_DIST"], p["TKOFF_ALT"]
        self._climb_m_s = 0.0
        # mode_takeoff.cpp: all heights count from where it began, not from home.
        self._began_at_m = plane.navigator.height_above_home_m()
        self.target = (
            m.north_m + ahead * math.cos(m.yaw_rad),
            m.east_m + ahead * math.sin(m.yaw_rad),
            m.down_m - height,
        )
        heading = math.degrees(m.yaw_rad) % 360.0
        text = f"Takeoff to {height:.0f}m for {ahead:.1f}m heading {heading:.1f} deg"
        self._launch = Launch(plane, self._began_at_m + height, [(1.2, text)])
