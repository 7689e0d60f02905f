"""ORBIT of PX4's multicopters: round a centre with a radius, a speed and a rule for the nose.

Read in the firmware (FlightTaskOrbit): it flies straight to the nearest point of the circle, at the
circle's height, with the nose to the centre; then along it with a speed that keeps the centripetal
acceleration. A radius outside the limits is rejected by a text, and the vehicle stays in the mode
and holds.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

from mavlink_sitl.autopilot.px4.multicopter.copter_modes import REACHED_M, CopterMode
from mavlink_sitl.exchange import Guidance, Motors, Severity, Vector, YawMode

if TYPE_CHECKING:
    from mavlink_sitl.geodesy import GeoPoint

LEAST_RADIUS_M = 1.0
MOST_SPEED_M_S = 10.0
MOST_INWARD_M_S2 = 2.0
ON_CIRCLE_M = 2.0
"""So near to the circle it is on it"""
FIRST_SPEED_M_S = 1.0
CENTRE_M = 0.01
"""Nearer to the centre, there is no nearest point"""

TO_CENTRE, INITIAL_HEADING, UNCONTROLLED, ALONG, BY_STICKS, UNCHANGED = range(6)
"""ORBIT_YAW_BEHAVIOUR"""


class OrbitRequest(NamedTuple):
    """DO_ORBIT; None where the sender leaves it as it is.

    Attributes:
        radius_m: negative is counter-clockwise.
        speed_m_s: along the circle.
        yaw_behaviour: ORBIT_YAW_BEHAVIOUR.
        centre: the altitude does not count.
        altitude_amsl_m: of the circle.
    """

    radius_m: float | None
    speed_m_s: float | None
    yaw_behaviour: int | None
    centre: GeoPoint | None
    altitude_amsl_m: float | None


class Orbit(CopterMode):
    """Round a centre, until another mode is chosen.

    Attributes:
        centre: NED metres, at the height of the circle; None while there is no circle.
        radius_m: of the circle.
        speed_m_s: along it; negative is counter-clockwise.
        yaw_behaviour: ORBIT_YAW_BEHAVIOUR.
    """

    centre: Vector | None = None
    radius_m = LEAST_RADIUS_M
    speed_m_s = FIRST_SPEED_M_S
    yaw_behaviour = TO_CENTRE
    _approaching = True

    def enter(self) -> None:
        """A small circle round where it is, until DO_ORBIT says which."""
        self.centre = self.here()
        self.radius_m, self.speed_m_s = LEAST_RADIUS_M, FIRST_SPEED_M_S
        self.yaw_behaviour = int(self.vehicle.parameters["MC_ORBIT_YAW_MOD"])
        self._initial_yaw_rad = self.vehicle.motion.yaw_rad
        self.guide(self.brake_guidance())
        self._approaching = False

    def request(self, wanted: OrbitRequest) -> None:
        """DO_ORBIT, in the mode."""
        navigator, motion = self.vehicle.navigator, self.vehicle.motion
        clockwise = self.speed_m_s > 0.0
        radius, speed = self.radius_m, abs(self.speed_m_s)
        if wanted.radius_m is not None:
            clockwise, radius = wanted.radius_m > 0.0, abs(wanted.radius_m)
        if wanted.speed_m_s is not None:
            speed = abs(wanted.speed_m_s)
        if not LEAST_RADIUS_M <= radius <= self.vehicle.parameters["MC_ORBIT_RAD_MAX"]:
            self.vehicle.say(Severity.CRITICAL, "Orbit radius limit exceeded")
            self.centre = None
            self.guide(self.brake_guidance())
            return
        speed = min(speed, MOST_SPEED_M_S, math.sqrt(MOST_INWARD_M_S2 * radius))
        self.radius_m, self.speed_m_s = radius, speed if clockwise else -speed
        if wanted.yaw_behaviour is not None and wanted.yaw_behaviour != UNCHANGED:
            self.yaw_behaviour = wanted.yaw_behaviour
        self._initial_yaw_rad = motion.yaw_rad
        north, east, down = self.centre or self.here()
        if wanted.centre is not None:
            north, east, _ = navigator.place_ned_m(wanted.centre)
        if wanted.altitude_amsl_m is not None:
            down = navigator.down_of_amsl(wanted.altitude_amsl_m)
        self.centre = (north, east, down)
        self._approaching = not self._on_circle(self.centre)
        if self._approaching:
            self._approach(self.centre)

    def update(self) -> None:
        """Fly along the circle, once there."""
        if self.centre is None or self.vehicle.landed:
            return
        if self._approaching:
            self._approaching = not self._on_circle(self.centre)
        if not self._approaching:
            self._circle(self.centre)

    def _outwards(self, centre: Vector) -> tuple[float, float, float]:
        """North and east of the direction from the centre, and how far it is."""
        motion = self.vehicle.motion
        north, east = motion.north_m - centre[0], motion.east_m - centre[1]
        away_m = math.hypot(north, east)
        if away_m < CENTRE_M:
            return math.cos(motion.yaw_rad), math.sin(motion.yaw_rad), away_m
        return north / away_m, east / away_m, away_m

    def _on_circle(self, centre: Vector) -> bool:
        away_m = self._outwards(centre)[2]
        near = abs(away_m - self.radius_m) < ON_CIRCLE_M
        return near and abs(self.vehicle.motion.down_m - centre[2]) < REACHED_M

    def _approach(self, centre: Vector) -> None:
        north, east, _ = self._outwards(centre)
        target = (centre[0] + self.radius_m * north, centre[1] + self.radius_m * east, centre[2])
        limits = self.vehicle.navigator.line_limits(self.here(), target)
        yaw_rad = math.atan2(-east, -north)
        self.guide(replace(self.hold_at(target, yaw_rad), limits=limits))

    def _circle(self, centre: Vector) -> None:
        north, east, away_m = self._outwards(centre)
        speed, inward = self.speed_m_s, self.speed_m_s**2 / self.radius_m
        correction = self.radius_m - away_m
        velocity = (
            -east * speed + north * correction,
            north * speed + east * correction,
            0.0,
        )
        guidance = Guidance(
            motors=Motors.FLY,
            track_position_z=1.0,
            down_m=centre[2],
            limits=self.vehicle.navigator.direct_limits(),
        ).moving(velocity, (-north * inward, -east * inward, 0.0))
        yaw_rad = self._yaw_rad(north, east)
        if yaw_rad is not None:
            guidance = replace(guidance, yaw_mode=YawMode.ANGLE, yaw_rad=yaw_rad)
        self.drive(guidance)

    def _yaw_rad(self, north: float, east: float) -> float | None:
        """Where the nose points; None leaves it, as the sticks do that nobody moves."""
        if self.yaw_behaviour in (UNCONTROLLED, BY_STICKS):
            return None
        if self.yaw_behaviour == INITIAL_HEADING:
            return self._initial_yaw_rad
        if self.yaw_behaviour == ALONG:
            turn = math.copysign(1.0, self.speed_m_s)
            return math.atan2(turn * north, -turn * east)
        return math.atan2(-east, -north)
