"""RTL: stop, climb, fly home, wait, land. Recorded in `copter_gcsloss` and `copter_lowbatt`."""

from __future__ import annotations

import math
from dataclasses import replace
from enum import Enum
from typing import TYPE_CHECKING

from mavlink_sitl.autopilot.ardupilot.copter.copter_modes import landing_speed_m_s
from mavlink_sitl.autopilot.control.straight_profile import LineProfile
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
OVERLAP_S = 1.8
"""The way home begins this much before the climb ends, in the recordings"""


class ReturnStage(Enum):
    """The stage of the return."""

    CLIMB = 1
    RETURN = 2
    WAIT = 3
    LAND = 4


class Leg:
    """A way along one direction, from rest to rest.

    Args:
        start: where it begins, metres.
        end: where it ends, metres; as many coordinates as start.
        profile: how it is flown; its length is the distance from start to end.
        began_s: when it begins.
    """

    def __init__(
        self, start: tuple[float, ...], end: tuple[float, ...], profile: LineProfile, began_s: float
    ) -> None:
        self._start = start
        length = math.dist(start, end)
        self._direction = tuple(
            (b - a) / length if length > 0.0 else 0.0 for a, b in zip(start, end, strict=True)
        )
        self._profile = profile
        self._began_s = began_s

    def remaining_s(self, now_s: float) -> float:
        """Time until it ends."""
        return self._began_s + self._profile.duration_s - now_s

    def at(self, now_s: float) -> list[Vector]:
        """Position, speed and acceleration of each coordinate."""
        s, v, a = self._profile.at(now_s - self._began_s)
        return [
            (x + d * s, d * v, d * a) for x, d in zip(self._start, self._direction, strict=True)
        ]


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
        self._home = (*rally[:2], home[2])
        north, east, down = stopping_point(self.vehicle)
        distance = math.dist((north, east), self._home[:2])
        cone = max(distance * CONE_SLOPE, LEAST_HEIGHT_M)
        wanted = max(self.vehicle.parameters["RTL_ALT"] / 100.0, home[2] - rally[2])
        height = max(home[2] - down, min(wanted, cone))
        self._down_m = self._home[2] - height
        self._stop = (north, east)
        limits = self.vehicle.navigator.limits()
        self._climb = self._leg(
            (down,), (self._down_m,), limits.speed_up_m_s, limits.acceleration_z_m_s2
        )
        self._base = self.hold_guidance().at((north, east, down))
        self.guide(self._base)
        self._base = replace(self._base, restart_xy=False, restart_z=False)

    def _leg(
        self,
        start: tuple[float, ...],
        end: tuple[float, ...],
        speed_m_s: float,
        acceleration_m_s2: float,
    ) -> Leg:
        jerk = max(self.vehicle.parameters["WPNAV_JERK"], 0.1)
        profile = LineProfile(math.dist(start, end), speed_m_s, acceleration_m_s2, jerk)
        return Leg(start, end, profile, self.vehicle.now_s)

    def update(self) -> None:
        """Run one step of the stage, or advance to the next."""
        copter = self.vehicle
        if copter.landed or not copter.armed:
            return
        if self.stage is ReturnStage.CLIMB:
            self.guide(self._climbing(self._base))
            if self._climb.remaining_s(copter.now_s) <= OVERLAP_S:
                self._begin_return()
        elif self.stage is ReturnStage.RETURN:
            self._update_return()
        elif self.stage is ReturnStage.WAIT:
            self._update_wait()
        if self.stage is ReturnStage.LAND:
            north, east, _ = self._home
            self.descend(replace(self._base, north_m=north, east_m=east))

    def _climbing(self, guidance: Guidance) -> Guidance:
        """Add the climb, which continues into the next stage."""
        ((down, speed, acceleration),) = self._climb.at(self.vehicle.now_s)
        return replace(
            guidance,
            down_m=down,
            velocity_down_m_s=speed,
            acceleration_down_m_s2=acceleration,
        )

    def _begin_return(self) -> None:
        parameters = self.vehicle.parameters
        limits = self.vehicle.navigator.limits()
        speed = parameters["RTL_SPEED"] / 100.0 or limits.speed_xy_m_s
        self._return = self._leg(
            self._stop, self._home[:2], max(speed, 0.1), limits.acceleration_xy_m_s2
        )
        self.stage = ReturnStage.RETURN

    def _update_return(self) -> None:
        now_s = self.vehicle.now_s
        north, east = self._return.at(now_s)
        guidance = replace(
            self._base,
            north_m=north[0],
            east_m=east[0],
            velocity_north_m_s=north[1],
            velocity_east_m_s=east[1],
            acceleration_north_m_s2=north[2],
            acceleration_east_m_s2=east[2],
        )
        self.guide(self._climbing(guidance))
        if self._return.remaining_s(now_s) <= 0.0 and self._climb.remaining_s(now_s) <= 0.0:
            self.stage = ReturnStage.WAIT
            self._arrived_s = now_s

    def _update_wait(self) -> None:
        waited_s = self.vehicle.now_s - self._arrived_s
        if waited_s >= self.vehicle.parameters["RTL_LOIT_TIME"] / 1000.0:
            self.stage = ReturnStage.LAND
            self._speed_m_s = 0.0
