"""PX4's flight modes for a multicopter: each turns its situation into `Guidance`."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

from mavlink_sitl.autopilot.px4.mode import (
    HoldMode,
    OffboardMode,
    Px4Mode,
    TakeoffMode,
    given,
    zeros,
)
from mavlink_sitl.autopilot.px4.safe_points import destination_ned_m, return_down_m
from mavlink_sitl.autopilot.state.setpoint import turned
from mavlink_sitl.exchange import ZERO, Guidance, Motors, Severity, Vector, YawMode

if TYPE_CHECKING:
    from mavlink_sitl.autopilot.px4.multicopter.copter import Px4Copter
    from mavlink_sitl.geodesy import GeoPoint

REACHED_M = 0.8
"""NAV_MC_ALT_RAD: a height counts as reached"""
STOPPED_M_S = 0.8
"""MPC_HOLD_MAX_XY: below it the vehicle holds the place where it is"""


class CopterMode(Px4Mode):
    """A flight mode of one multicopter."""

    vehicle: Px4Copter

    def hold_at(self, position: Vector, yaw_rad: float | None = None) -> Guidance:
        """Fly to a place and stay there."""
        return replace(
            self.hold_guidance().at(position),
            yaw_mode=YawMode.HOLD if yaw_rad is None else YawMode.ANGLE,
            yaw_rad=yaw_rad or 0.0,
            restart_xy=False,
            restart_z=False,
        )

    def brake_guidance(self) -> Guidance:
        """To a standstill, smoothly."""
        return replace(self.hold_guidance(), limits=self.vehicle.navigator.limits())


class Hold(CopterMode, HoldMode):
    """AUTO.LOITER: brake, stay; or go where DO_REPOSITION says."""

    def enter(self) -> None:
        """Brake."""
        self.target = None
        self.guide(self.brake_guidance())

    def go_to(
        self, point: GeoPoint | None, altitude_amsl_m: float | None, yaw_rad: float | None
    ) -> None:
        """Go somewhere; None keeps what is."""
        north, east, _ = self.target = self.other_target(point, altitude_amsl_m)
        if yaw_rad is None and point is not None:
            motion = self.vehicle.motion
            away = math.hypot(north - motion.north_m, east - motion.east_m)
            if away > 2.0:  # the nose looks where it goes
                yaw_rad = math.atan2(east - motion.east_m, north - motion.north_m)
        limits = self.vehicle.navigator.line_limits(self.here(), self.target)
        self.guide(replace(self.hold_at(self.target, yaw_rad), limits=limits))

    def limits_changed(self) -> None:
        """Another speed: continue with it."""
        if self.target is not None:
            limits = self.vehicle.navigator.line_limits(self.here(), self.target)
            self.guide(replace(self.hold_at(self.target), limits=limits))

    def stay_at(self, target: Vector) -> None:
        """Stay at a place nearby."""
        self.target = target
        self.guide(self.hold_at(target))

    def update(self) -> None:
        """Once stopped, stay at that place."""
        if self.target is not None or self.vehicle.landed:
            return
        motion = self.vehicle.motion
        speed = motion.speed_m_s
        if speed < STOPPED_M_S and abs(motion.velocity_down_m_s) < STOPPED_M_S:
            self.stay_at(self.here())


class Takeoff(CopterMode, TakeoffMode):
    """AUTO.TAKEOFF: straight up to a height above sea level, then AUTO.LOITER."""

    _by_default = False
    """The height is the default one, and no text has said so yet"""

    def enter(self) -> None:
        """Set the altitude; one below the vehicle is not flown to."""
        navigator = self.vehicle.navigator
        north, east, down = self.here()
        self._by_default = self.wanted_amsl_m is None
        if self.wanted_amsl_m is not None:
            wanted = navigator.down_of_amsl(self.wanted_amsl_m)
        else:
            wanted = down - self.vehicle.parameters["MIS_TAKEOFF_ALT"]
        self._tell_default()
        self._too_low = wanted >= down
        if self._too_low:
            self.vehicle.say(Severity.CRITICAL, "Already higher than takeoff altitude")
            wanted = down
        self.wanted_amsl_m = None
        self.target = (north, east, wanted)
        limits = navigator.takeoff_limits()
        self.guide(replace(self.hold_at(self.target), restart_z=True, limits=limits))

    def _tell_default(self) -> None:
        """Once it is armed: before, nobody looks at the height (`probe_ground`)."""
        if self._by_default and self.vehicle.armed:
            self._by_default = False
            above_m = self.vehicle.parameters["MIS_TAKEOFF_ALT"]
            self.vehicle.say(Severity.INFO, f"Using default takeoff altitude: {above_m:.1f} m")

    def wants_to_lift(self) -> bool:
        """Unless the height asked for is not above."""
        return not self._too_low

    def update(self) -> None:
        """At the height: hold."""
        self._tell_default()
        if self.vehicle.in_flight and abs(self.vehicle.motion.down_m - self.target[2]) < REACHED_M:
            self.vehicle.hold_at(self.target)


class Land(CopterMode):
    """AUTO.LAND: brake, then down, slower near the ground.

    Without a position it is the firmware's mode Descend under the same number: level, and
    EXTENDED_SYS_STATE does not say LANDING.
    """

    _descends = False

    @property
    def landing(self) -> bool:
        """See `Mode`."""
        return not self._descends

    def enter(self) -> None:
        """Brake and sink."""
        self._descends = not self.vehicle.estimator.position_ok
        self._at: tuple[float, float] | None = None
        self._speed = -1.0
        self.update()

    def update(self) -> None:
        """Follow the height; stay over the place where the braking ended."""
        motion = self.vehicle.motion
        first = self._speed < 0.0
        speed = descent_speed_m_s(self.vehicle)
        stopped = motion.speed_m_s < STOPPED_M_S
        settled = self._at is None and stopped and self.vehicle.estimator.position_ok
        if settled:
            self._at = (motion.north_m, motion.east_m)
        if not settled and abs(speed - self._speed) < 0.02:
            return
        self._speed = speed
        guidance = descending(self, self._at, speed, first)
        self.guide(replace(guidance, direct_lean=float(self._descends)))


CRAWL_SHARE, LAND_SHARE = 1.4, 1.15
"""Three recorded landings sink faster near the ground than the parameters say"""


def descent_speed_m_s(copter: Px4Copter, ground_down_m: float | None = None) -> float:
    """MPC_Z_V_AUTO_DN above MPC_LAND_ALT1, MPC_LAND_SPEED at _ALT2, MPC_LAND_CRWL below _ALT3."""
    p = copter.parameters
    heights = (p["MPC_LAND_ALT3"], p["MPC_LAND_ALT2"], p["MPC_LAND_ALT1"])
    slow, crawl = LAND_SHARE * p["MPC_LAND_SPEED"], CRAWL_SHARE * p["MPC_LAND_CRWL"]
    speeds = (crawl, slow, p["MPC_Z_V_AUTO_DN"])
    height = copter.height_above_ground_m()
    if ground_down_m is not None:
        height = ground_down_m - copter.motion.down_m
    speed = speeds[0]
    for below, above, low, high in zip(heights, heights[1:], speeds, speeds[1:], strict=False):
        if height > below:
            share = min((height - below) / max(above - below, 0.1), 1.0)
            speed = low + (high - low) * share
    return max(speed, 0.1)


def descending(
    mode: CopterMode, at: tuple[float, float] | None, speed: float, first: bool
) -> Guidance:
    """Sink at a speed, over a place or braking."""
    guidance = replace(mode.brake_guidance(), restart_xy=first, restart_z=first)
    guidance = replace(guidance, velocity_down_m_s=speed)
    if at is None:
        return guidance
    limits = mode.vehicle.navigator.limits()
    return replace(guidance, track_position_xy=1.0, north_m=at[0], east_m=at[1], limits=limits)


class Return(CopterMode):
    """AUTO.RTL: climb, fly to home or to what RTL_TYPE chooses instead, land there."""

    def enter(self) -> None:
        """Brake and climb."""
        copter = self.vehicle
        self._goal = destination_ned_m(copter)
        self._down_m = return_down_m(copter, self._goal)
        motion = copter.motion
        self._stage = "climb"
        self._speed = -1.0
        amsl = copter.navigator.origin.altitude_amsl_m - self._down_m
        above = self._goal[2] - self._down_m
        if copter.in_flight:
            copter.say(
                Severity.INFO,
                f"RTL: start return at {amsl:.0f} m ({above:.0f} m above destination)",
            )
        # Climb above the position at the start of RTL: at speed it overshoots and comes back.
        target = (motion.north_m, motion.east_m, self._down_m)
        limits = copter.navigator.climb_limits(motion, self._down_m)
        climb = self.hold_at(target)
        self.guide(replace(climb, restart_xy=True, restart_z=True, limits=limits))

    @property
    def landing(self) -> bool:
        """In the last stage."""
        return self._stage == "land"

    def update(self) -> None:
        """Run one step of the stage, or advance to the next."""
        if not self.vehicle.armed or self.vehicle.landed:
            return
        motion = self.vehicle.motion
        north, east, _ = self._goal
        if self._stage == "climb":
            self._climb()
        elif self._stage == "return":
            away_m = math.hypot(motion.north_m - north, motion.east_m - east)
            if away_m < self.vehicle.parameters["NAV_ACC_RAD"]:
                self._arrive()
        elif self._stage == "wait":
            self._wait()
        elif self._stage == "land":
            speed = descent_speed_m_s(self.vehicle, self._goal[2])
            if abs(speed - self._speed) >= 0.02:
                first, self._speed = self._speed < 0.0, speed
                guidance = descending(self, (north, east), speed, False)
                self.guide(replace(guidance, restart_z=first))

    def _climb(self) -> None:
        if abs(self.vehicle.motion.down_m - self._down_m) < CLIMBED_M:
            self._stage = "return"
            self.guide(self.hold_at((*self._goal[:2], self._down_m)))

    def _arrive(self) -> None:
        """Land, at once or after RTL_LAND_DELAY at RTL_DESCEND_ALT; never if that is negative."""
        p = self.vehicle.parameters
        self._wait_s = p["RTL_LAND_DELAY"]
        self._wait_from_s: float | None = None
        if abs(self._wait_s) < 0.01:
            self._land()
            return
        self._stage = "wait"
        self._down_m = max(self._goal[2] - p["RTL_DESCEND_ALT"], self._down_m)
        self.guide(self.hold_at((*self._goal[:2], self._down_m)))

    def _wait(self) -> None:
        now_s = self.vehicle.now_s
        if self._wait_from_s is None:
            if abs(self.vehicle.motion.down_m - self._down_m) < REACHED_M:
                self._wait_from_s = now_s
                what = f"loiter {self._wait_s:.1f}s" if self._wait_s > 0.0 else "completed, loiter"
                self.vehicle.say(Severity.INFO, f"RTL: {what}")
        elif self._wait_s > 0.0 and now_s - self._wait_from_s >= self._wait_s:
            self._land()

    def _land(self) -> None:
        self._stage = "land"
        self.vehicle.say(Severity.INFO, "RTL: land at destination")


CLIMBED_M = 0.3
"""How near to the height of the return before it begins, in the recording"""


class Manual(CopterMode):
    """MANUAL, ALTCTL and POSCTL with sticks: all three are flown as velocities."""

    def enter(self) -> None:
        """Brake."""
        self._asked: tuple[float, ...] | None = None
        self.update()

    def _stick_velocity(self) -> tuple[Vector, float]:
        sticks = self.vehicle.sticks.held()
        if sticks is None:
            return ZERO, 0.0
        p, yaw = self.vehicle.parameters, self.vehicle.motion.yaw_rad
        forward = sticks.pitch * p["MPC_VEL_MANUAL"]
        right = sticks.roll * p["MPC_VEL_MANUAL"]
        up = (sticks.throttle - 0.5) * 2.0
        up *= p["MPC_Z_VEL_MAX_UP"] if up > 0.0 else p["MPC_Z_VEL_MAX_DN"]
        return turned((forward, right, -up), yaw), sticks.yaw

    def wants_to_lift(self) -> bool:
        """With the throttle above the centre."""
        return self._stick_velocity()[0][2] < -0.3

    def update(self) -> None:
        """Follow the sticks."""
        velocity, turn = self._stick_velocity()
        asked: tuple[float, ...] = (*velocity, turn)
        if asked == self._asked:
            return
        first, self._asked = self._asked is None, asked
        self.guide(
            replace(
                self.brake_guidance().moving(velocity),
                yaw_mode=YawMode.RATE if turn else YawMode.HOLD,
                yaw_rate_rad_s=turn * math.radians(100.0),
                restart_xy=first,
                restart_z=first,
            )
        )


class Offboard(CopterMode, OffboardMode):
    """OFFBOARD of a multicopter."""

    def stop(self) -> None:
        """Brake as hard as the loops do."""
        limits = self.vehicle.navigator.direct_limits()
        self.guide(replace(self.hold_guidance(), limits=limits))

    def follow(self, fresh: bool) -> None:
        """See `OffboardMode`."""
        s = self.target
        yaw_mode = YawMode.HOLD
        if s.yaw_rad is not None:
            yaw_mode = YawMode.ANGLE
        elif s.yaw_rate_rad_s is not None:
            yaw_mode = YawMode.RATE
        position, velocity = given(s.position_m), given(s.velocity_m_s)
        acceleration = given(s.acceleration_m_s2)
        place, speed, push = (zeros(v) for v in (s.position_m, s.velocity_m_s, s.acceleration_m_s2))
        guidance = Guidance(
            motors=Motors.FLY,
            track_position_xy=float(position[0]),
            track_position_z=float(position[1]),
            # Where nothing is asked for, it brakes.
            track_velocity_xy=float(position[0] or velocity[0] or not acceleration[0]),
            track_velocity_z=float(position[1] or velocity[1] or not acceleration[1]),
            north_m=place[0],
            east_m=place[1],
            down_m=place[2],
            yaw_mode=yaw_mode,
            yaw_rad=s.yaw_rad or 0.0,
            yaw_rate_rad_s=s.yaw_rate_rad_s or 0.0,
            limits=self.vehicle.navigator.direct_limits(),
            restart_xy=fresh,
            restart_z=fresh,
        )
        self.guide(guidance.moving(speed, push))

    def wants_to_lift(self) -> bool:
        """A place above, a climb or an upward push."""
        s = self.target
        if not self.vehicle.stream_alive():
            return False
        if s.position_m is not None:
            return s.position_m[2] < self.vehicle.motion.down_m - 0.2
        if s.velocity_m_s is not None:
            return s.velocity_m_s[2] < -0.3
        return s.acceleration_m_s2 is not None and s.acceleration_m_s2[2] < -0.3
