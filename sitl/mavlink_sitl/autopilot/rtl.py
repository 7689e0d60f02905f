"""RTL: stop, climb, fly home, wait, land. Recorded in `copter_lowbatt` and others."""

from __future__ import annotations

import math
from enum import Enum
from typing import TYPE_CHECKING

from dataclasses import replace

from mavlink_sitl.autopilot.modes import Mode, landing_speed_m_s, line_guidance
from mavlink_sitl.autopilot.profile import LineProfile

if TYPE_CHECKING:
    from mavlink_sitl.autopilot.copter import Copter
    from mavlink_sitl.autopilot.personality import ModeSpec

CONE_SLOPE = 3.0
"""RTL_CONE_SLOPE: close to home it climbs no higher than three times the distance"""


class Stage(Enum):
    """How far the return has got."""

    CLIMB = 1
    RETURN = 2
    WAIT = 3
    LAND = 4


class ReturnToLaunch(Mode):
    """Goes home by itself.

    Attributes:
        stage: how far it has got.
    """

    def __init__(self, copter: Copter, spec: ModeSpec) -> None:
        """See the class."""
        super().__init__(copter, spec)
        self.stage = Stage.CLIMB

    @property
    def landing(self) -> bool:
        """In the last stage only."""
        return self.stage is Stage.LAND

    def enter(self) -> None:
        """Brake, and climb to the height of the way home."""
        copter = self.copter
        motion = copter.motion
        self.stage = Stage.CLIMB
        self._home = copter.home_ned_m()
        distance = math.hypot(motion.north_m - self._home[0], motion.east_m - self._home[1])
        height = self._home[2] - motion.down_m
        wanted = min(copter.parameters["RTL_ALT"] / 100.0, max(distance * CONE_SLOPE, 2.0))
        self._down_m = self._home[2] - max(height, wanted)
        self._braking = replace(self.hold_guidance(), track_position_z=1.0)
        stop = self._stopping_down_m()
        self._climb = self._leg((0.0, 0.0, stop), (0.0, 0.0, self._down_m), vertical=True)
        self.update()

    def _stopping_down_m(self) -> float:
        """Where a climb or descent that is still going on would end."""
        motion = self.copter.motion
        speed = motion.velocity_down_m_s
        acceleration = self.copter.limits()["acceleration_z_m_s2"]
        return motion.down_m + speed * abs(speed) / (2.0 * acceleration)

    def _leg(
        self,
        start: tuple[float, float, float],
        end: tuple[float, float, float],
        vertical: bool = False,
    ) -> tuple[tuple[float, float, float], tuple[float, float, float], LineProfile, float]:
        """Start, direction, profile and starting time of a straight way."""
        delta = (end[0] - start[0], end[1] - start[1], end[2] - start[2])
        length = math.sqrt(sum(x * x for x in delta))
        direction = (0.0, 0.0, 0.0)
        if length > 0.0:
            direction = (delta[0] / length, delta[1] / length, delta[2] / length)
        limits = self.copter.limits()
        parameters = self.copter.parameters
        speed = (parameters["RTL_SPEED"] or parameters["WPNAV_SPEED"]) / 100.0
        acceleration = limits["acceleration_xy_m_s2"]
        if vertical:
            speed = limits["speed_up_m_s"] if delta[2] < 0.0 else limits["speed_down_m_s"]
            acceleration = limits["acceleration_z_m_s2"]
        profile = LineProfile(length, speed, acceleration, parameters["WPNAV_JERK"])
        return start, direction, profile, self.copter.now_s

    def update(self) -> None:
        """Go on with the stage, or to the next."""
        if self.copter.landed or not self.copter.armed:
            return
        if self.stage is Stage.CLIMB:
            self._update_climb()
        elif self.stage is Stage.RETURN:
            self._update_return()
        elif self.stage is Stage.WAIT:
            wait_s = self.copter.parameters["RTL_LOIT_TIME"] / 1000.0
            if self.copter.now_s - self._arrived_s >= wait_s:
                self.stage = Stage.LAND
                self._speed = 0.0
        if self.stage is Stage.LAND:
            self._update_land()

    def _update_climb(self) -> None:
        start, direction, profile, began_s = self._climb
        since_s = self.copter.now_s - began_s
        moved = line_guidance(self._braking, start, direction, profile.at(since_s))
        if since_s < profile.duration_s:
            self.guide(
                replace(
                    moved,
                    track_position_xy=0.0,
                    velocity_north_m_s=0.0,
                    velocity_east_m_s=0.0,
                    restart_xy=since_s == 0.0,
                    restart_z=since_s == 0.0,
                )
            )
            return
        motion = self.copter.motion
        here = (motion.north_m, motion.east_m, self._down_m)
        self._return = self._leg(here, (self._home[0], self._home[1], self._down_m))
        self.stage = Stage.RETURN

    def _update_return(self) -> None:
        start, direction, profile, began_s = self._return
        since_s = self.copter.now_s - began_s
        self.guide(line_guidance(self._braking, start, direction, profile.at(since_s)))
        if since_s >= profile.duration_s:
            self.stage = Stage.WAIT
            self._arrived_s = self.copter.now_s

    def _update_land(self) -> None:
        speed = landing_speed_m_s(self.copter)
        if abs(speed - self._speed) < 0.02:
            return
        first = self._speed == 0.0
        self._speed = speed
        self.guide(
            replace(
                self.hold_guidance(),
                track_position_xy=1.0,
                north_m=self._home[0],
                east_m=self._home[1],
                velocity_down_m_s=speed,
                restart_xy=False,
                restart_z=first,
            )
        )
