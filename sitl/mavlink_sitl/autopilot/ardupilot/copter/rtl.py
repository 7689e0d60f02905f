"""RTL: stop, climb, fly home, wait, land. Recorded in `copter_gcsloss` and `copter_lowbatt`."""

from __future__ import annotations

import math
from dataclasses import replace
from enum import Enum
from typing import TYPE_CHECKING

from mavlink_sitl.autopilot.ardupilot.copter.copter_modes import landing_speed_m_s
from mavlink_sitl.autopilot.control.track import LegTrack, TrackLeg
from mavlink_sitl.autopilot.safety.rally import nearest_rally_ned_m
from mavlink_sitl.autopilot.state.mode import Mode
from mavlink_sitl.exchange import Guidance, Vector

if TYPE_CHECKING:
    from mavlink_sitl.autopilot.common.commander import Commander
    from mavlink_sitl.autopilot.personality import ModeSpec

CONE_SLOPE = 3.0
"""RTL_CONE_SLOPE: close to home it climbs no higher than three times the distance"""
LEAST_HEIGHT_M = 2.0
"""RTL_ALT_MIN"""


class ReturnStage(Enum):
    """The stage of the return."""

    CLIMB = 1
    RETURN = 2
    WAIT = 3
    LAND = 4


def wpnav_jerk_m_s3(copter: Commander) -> float:
    """WPNAV_JERK, of the legs of AUTO and RTL."""
    return max(copter.parameters["WPNAV_JERK"], 0.1)


def stopping_distance(speed_m_s: float, acceleration_m_s2: float) -> float:
    """The stopping distance with the square-root controller (gain 1)."""
    speed = abs(speed_m_s)
    if speed <= acceleration_m_s2:
        return speed
    return 0.5 * acceleration_m_s2 + speed * speed / (2.0 * acceleration_m_s2)


def stopping_point(copter: Commander) -> Vector:
    """The point at which the vehicle would stop if it braked now, NED metres."""
    motion, limits = copter.motion, copter.navigator.limits()
    v_n, v_e, v_d = motion[3:6]
    speed = math.hypot(v_n, v_e)
    ahead = stopping_distance(speed, limits.acceleration_xy_m_s2) / max(speed, 1e-6)
    below = math.copysign(stopping_distance(v_d, limits.acceleration_z_m_s2), v_d)
    return motion.north_m + v_n * ahead, motion.east_m + v_e * ahead, motion.down_m + below


class LandsAtTheEnd(Mode):
    """A mode whose last stage lands."""

    _speed_m_s = 0.0

    def descend(self, guidance: Guidance) -> None:
        """Go down where the guidance leads, at the speed of LAND."""
        speed = landing_speed_m_s(self.vehicle)
        if abs(speed - self._speed_m_s) < 0.02:
            return
        first, self._speed_m_s = self._speed_m_s == 0.0, speed
        self.guide(
            replace(
                guidance,
                track_position_z=0.0,
                velocity_down_m_s=speed,
                restart_xy=False,
                restart_z=first,
            )
        )


class ReturnToLaunch(LandsAtTheEnd):
    """Goes home by itself."""

    def __init__(self, copter: Commander, spec: ModeSpec) -> None:
        super().__init__(copter, spec)
        self.stage = ReturnStage.CLIMB

    @property
    def landing(self) -> bool:
        """In the last stage only."""
        return self.stage is ReturnStage.LAND

    def enter(self) -> None:
        """Brake, and climb to the height of the way home."""
        self.stage = ReturnStage.CLIMB
        home = self.vehicle.navigator.home_ned_m()
        rally = nearest_rally_ned_m(self.vehicle) or home
        north, east, down = start = stopping_point(self.vehicle)
        distance = math.dist((north, east), rally[:2])
        cone = max(distance * CONE_SLOPE, LEAST_HEIGHT_M)
        wanted = max(self.vehicle.parameters["RTL_ALT"] / 100.0, home[2] - rally[2])
        height = max(home[2] - down, min(wanted, cone))
        self._target: Vector = (*rally[:2], home[2] - height)
        top, limits = (north, east, self._target[2]), self.vehicle.navigator.limits()
        speed = max(self.vehicle.parameters["RTL_SPEED"] / 100.0 or limits.speed_xy_m_s, 0.1)
        jerk = wpnav_jerk_m_s3(self.vehicle)
        self._track = LegTrack(TrackLeg(start, top, limits, jerk), self.vehicle.now_s)
        self._way = TrackLeg(top, self._target, replace(limits, speed_xy_m_s=speed), jerk)
        self.guide(self.hold_guidance().at(start))

    def update(self) -> None:
        """Run one step of the stage, or advance to the next."""
        copter = self.vehicle
        if copter.landed or not copter.armed:
            return
        if self.stage in (ReturnStage.CLIMB, ReturnStage.RETURN):
            self._follow_track()
        elif self.stage is ReturnStage.WAIT:
            self._update_wait()
        if self.stage is ReturnStage.LAND:
            self.descend(self.hold_guidance().at(self._target))

    def _follow_track(self) -> None:
        copter, track, now_s = self.vehicle, self._track, self.vehicle.now_s
        track.advance(now_s, False, copter.motion, wpnav_jerk_m_s3(copter))
        still = replace(self.hold_guidance(), restart_xy=False, restart_z=False)
        self.guide(still.exactly(*track.at(now_s)))
        radius_m = copter.parameters["WPNAV_RADIUS"] / 100.0
        if self.stage is ReturnStage.CLIMB:
            track.offer(self._way, radius_m, now_s)
            if track.passed(now_s):
                track.go_on(self._way, now_s)
                self.stage = ReturnStage.RETURN
        elif track.passed(now_s) and math.dist(copter.motion[:3], self._target) <= radius_m:
            self.stage = ReturnStage.WAIT
            self._arrived_s = now_s

    def _update_wait(self) -> None:
        waited_s = self.vehicle.now_s - self._arrived_s
        if waited_s >= self.vehicle.parameters["RTL_LOIT_TIME"] / 1000.0:
            self.stage = ReturnStage.LAND
            self._speed_m_s = 0.0
