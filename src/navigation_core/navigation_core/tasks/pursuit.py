"""Steer a ground vehicle after its carrot: pure pursuit, as a velocity.

A rover or a boat moves along its nose only. It is told a velocity: its direction is where to
head for, its length how fast. The carrot is the point that pure pursuit looks ahead to; the
trajectory tells how fast it goes there. A vehicle that is told velocities stops by itself
when they stop coming (ArduRover after 3 s, PX4 by its OFFBOARD failsafe), which one that is
told a position does not.

R. C. Coulter, "Implementation of the Pure Pursuit Path Tracking Algorithm", 1992.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from navigation_core.geometry import (
    ZERO,
    KinematicState,
    Vector3,
    add,
    dot,
    horizontal_norm,
    scale,
    subtract,
    unit_between,
    wrap_angle,
)
from navigation_core.limits import Limits
from navigation_core.tasks.base import Setpoint, Traits

# Speed at which a metre of lag is made up.
_GAIN_1_S = 0.8
# Slower than this a car hardly steers; it is used while there is still a way to go.
_CRAWL_M_S = 0.4
# Fastest while the nose points more than a right angle away from where to go.
_TURNING_M_S = 1.0
# A curve is looked ahead into by so many turning radii.
_LOOK_AHEAD_RADII = 1.5
# The speed is raised towards the one that is wanted at this rate, and by no more than this.
# The speed controllers of ground vehicles are slow integrators: ArduRover's overshoots a ramp
# that ends abruptly by 0.3 s times its slope (recorded set-up), and hardly one that eases in.
_EASE_1_S = 0.7
_SPEED_UP_M_S2 = 0.6
# What is too fast over ground is taken off the told speed so many times, up to half of it.
_EXCESS_GAIN = 2.0
# Told to stand when this near, in arrival radii; not told to go again before it has drifted
# this far.
_STAND_SHARE, _RESTART_SHARE = 0.6, 0.95


@dataclass(frozen=True)
class Pursuer:
    """What chases the carrot.

    Attributes:
        position_enu_m: where it is.
        velocity_enu_m_s: how it moves.
        yaw_enu_rad: where its nose points.
    """

    position_enu_m: Vector3
    velocity_enu_m_s: Vector3
    yaw_enu_rad: float

    @property
    def heading(self) -> Vector3:
        """Where its nose points, as a unit vector."""
        return (math.cos(self.yaw_enu_rad), math.sin(self.yaw_enu_rad), 0.0)


@dataclass(frozen=True)
class Way:
    """How a trajectory goes on from the carrot.

    Attributes:
        course_enu: its direction there, as a unit vector; None at its beginning.
        left_m: its length from there.
    """

    course_enu: Vector3 | None
    left_m: float


class Pursuit:
    """Leads one vehicle along; remembers what it told last, so that speeds change gently."""

    def __init__(self, traits: Traits) -> None:
        """Begin with nothing told.

        Args:
            traits: what the vehicle can do; its ``turning_radius_m`` and ``braking_m_s2``.
        """
        self._traits = traits
        self._speed_m_s: float | None = None
        self._told_s = 0.0
        self._stands = False

    def forget(self) -> None:
        """Begin anew at the speed that is measured then: somebody else has led meanwhile."""
        self._speed_m_s = None
        self._stands = False

    def follow(
        self,
        carrot: KinematicState,
        way: Way | None,
        pursuer: Pursuer,
        limits: Limits,
        arrival_radius_m: float,
        now: float,
    ) -> Setpoint:
        """Return the velocity that leads after the carrot.

        Args:
            carrot: the point on the trajectory, with its velocity.
            way: how the trajectory goes on from the carrot; None once that stands at the end.
            pursuer: the vehicle.
            limits: the speed is kept to theirs.
            arrival_radius_m: how near to the end counts as arrived.
            now: time in seconds.
        """
        lag_m = horizontal_norm(subtract(carrot.position_enu_m, pursuer.position_enu_m))
        if way is None and self._stand(carrot, lag_m, pursuer, arrival_radius_m):
            self._speed_m_s, self._told_s = 0.0, now
            return Setpoint(carrot.position_enu_m, ZERO, ZERO, pursuer.yaw_enu_rad)
        direction = self._direction(carrot, way, pursuer)
        course = math.atan2(direction[1], direction[0])
        wanted_m_s = limits.speed_horizontal_m_s
        if way is not None:
            # A carrot at full speed runs ahead; one that has slowed for a corner is caught up.
            wanted_m_s = min(
                wanted_m_s, max(_GAIN_1_S * lag_m, horizontal_norm(carrot.velocity_enu_m_s))
            )
        wanted_m_s = min(wanted_m_s, self._approach_m_s(lag_m + (way.left_m if way else 0.0)))
        away = abs(wrap_angle(course - pursuer.yaw_enu_rad))
        turning_m_s = min(_TURNING_M_S, limits.speed_horizontal_m_s)
        wanted_m_s = min(wanted_m_s, max(wanted_m_s * math.cos(away), turning_m_s))
        wanted_m_s = max(wanted_m_s, min(_CRAWL_M_S, limits.speed_horizontal_m_s))
        speed_m_s = self._ease(wanted_m_s, pursuer, now)
        # A boat slides outwards in a turn, and so gets faster over ground than it is told.
        excess_m_s = horizontal_norm(pursuer.velocity_enu_m_s) - limits.speed_horizontal_m_s
        speed_m_s = max(speed_m_s - _EXCESS_GAIN * max(excess_m_s, 0.0), 0.5 * speed_m_s)
        return Setpoint(carrot.position_enu_m, scale(direction, speed_m_s), ZERO, course)

    def _stand(
        self, end: KinematicState, lag_m: float, pursuer: Pursuer, arrival_radius_m: float
    ) -> bool:
        """Whether the vehicle is to stand here: near enough, or past the nearest point to it."""
        share = lag_m / arrival_radius_m
        behind = dot(subtract(end.position_enu_m, pursuer.position_enu_m), pursuer.heading) < 0.0
        near = share <= _STAND_SHARE or (behind and share <= _RESTART_SHARE)
        self._stands = near or (self._stands and share <= _RESTART_SHARE)
        return self._stands

    def _approach_m_s(self, left_m: float) -> float:
        """Return a speed from which the vehicle comes to rest in this distance."""
        # Beyond this distance at constant braking, nearer in proportion: no jerk at the end.
        linear_m = self._traits.braking_m_s2 / _GAIN_1_S**2
        if left_m <= linear_m:
            return _GAIN_1_S * left_m
        return math.sqrt(self._traits.braking_m_s2 * (2.0 * left_m - linear_m))

    def _ease(self, wanted_m_s: float, pursuer: Pursuer, now: float) -> float:
        """Return the speed to tell: less at once, more by and by."""
        told_m_s, told_s = self._speed_m_s, self._told_s
        if told_m_s is None:
            told_m_s, told_s = max(dot(pursuer.velocity_enu_m_s, pursuer.heading), 0.0), now
        up_m_s2 = min(_EASE_1_S * (wanted_m_s - told_m_s), _SPEED_UP_M_S2)
        speed_m_s = min(wanted_m_s, told_m_s + up_m_s2 * max(now - told_s, 0.0))
        self._speed_m_s, self._told_s = speed_m_s, now
        return speed_m_s

    def _direction(self, carrot: KinematicState, way: Way | None, pursuer: Pursuer) -> Vector3:
        """Return the unit vector to head for: to the carrot, or to a point ahead of both."""
        aim = carrot.position_enu_m
        if way is not None and way.course_enu is not None:
            overtaken_m = dot(subtract(pursuer.position_enu_m, aim), way.course_enu)
            ahead_m = _LOOK_AHEAD_RADII * self._traits.turning_radius_m + max(overtaken_m, 0.0)
            aim = add(aim, scale(way.course_enu, min(ahead_m, way.left_m)))
        if self._inside_turn(aim, pursuer):
            return pursuer.heading  # it would be circled for ever; first get away from it
        level = (aim[0], aim[1], pursuer.position_enu_m[2])
        return unit_between(pursuer.position_enu_m, level) or pursuer.heading

    def _inside_turn(self, aim: Vector3, pursuer: Pursuer) -> bool:
        """Whether a point lies within the circle of the tightest turn, to either side."""
        east, north, _ = subtract(aim, pursuer.position_enu_m)
        heading, radius_m = pursuer.heading, self._traits.turning_radius_m
        ahead_m = east * heading[0] + north * heading[1]
        aside_m = abs(-east * heading[1] + north * heading[0])
        return math.hypot(ahead_m, aside_m - radius_m) < 0.9 * radius_m and aside_m > 0.2 * radius_m
