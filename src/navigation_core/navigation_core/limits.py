"""The kinematic limits that trajectories keep, and the distance that a stop takes."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass

from navigation_core.geometry import Vector3

# Least time in which a goal's speed, and its acceleration, are reached (see with_speed).
_SPEED_UP_TIME_S = 1.5
_JERK_TIME_S = 0.4
# A direction with less than this of a component has none of it.
_NONE = 1e-9


class LimitsError(ValueError):
    """A kinematic limit is not a positive, finite number."""


@dataclass(frozen=True)
class AxisLimits:
    """Limits of a motion along one direction.

    Attributes:
        speed_forward_m_s: maximum speed along the direction.
        speed_backward_m_s: maximum speed against it, as a positive number.
        acceleration_m_s2: greatest acceleration, in either direction.
        jerk_m_s3: greatest jerk, in either direction.
    """

    speed_forward_m_s: float
    speed_backward_m_s: float
    acceleration_m_s2: float
    jerk_m_s3: float


@dataclass(frozen=True)
class Limits:
    """Kinematic limits of the vehicle.

    Attributes:
        speed_horizontal_m_s: greatest norm of the horizontal velocity.
        speed_up_m_s: greatest climb rate.
        speed_down_m_s: greatest descent rate, as a positive number.
        acceleration_horizontal_m_s2: greatest horizontal acceleration.
        acceleration_vertical_m_s2: greatest vertical acceleration.
        jerk_m_s3: greatest jerk along the path.
        yaw_rate_rad_s: greatest yaw rate.
    """

    speed_horizontal_m_s: float = 3.0
    speed_up_m_s: float = 1.5
    speed_down_m_s: float = 1.0
    acceleration_horizontal_m_s2: float = 2.0
    acceleration_vertical_m_s2: float = 1.0
    jerk_m_s3: float = 5.0
    yaw_rate_rad_s: float = math.radians(60.0)

    def __post_init__(self) -> None:
        """Reject what cannot be flown.

        Raises:
            LimitsError: a limit is NaN, infinite, zero or negative.
        """
        for field in dataclasses.fields(self):
            value = getattr(self, field.name)
            if not (math.isfinite(value) and value > 0.0):
                raise LimitsError(
                    f"The limit {field.name} is {value}; give a positive, finite number."
                )

    def with_speed(self, speed_m_s: float | None) -> Limits:
        """Return limits with another horizontal speed; None and 0 change nothing.

        The climb and descent rates come down to the same speed if they are above it: who
        asks for a slow flight does not expect a fast climb. So do acceleration and jerk: a
        vehicle overshoots a change of velocity by a share of the acceleration, which would
        be most of a slow speed.
        """
        if not speed_m_s:
            return self
        acceleration_m_s2 = min(self.acceleration_horizontal_m_s2, speed_m_s / _SPEED_UP_TIME_S)
        return dataclasses.replace(
            self,
            speed_horizontal_m_s=speed_m_s,
            acceleration_horizontal_m_s2=acceleration_m_s2,
            jerk_m_s3=min(self.jerk_m_s3, acceleration_m_s2 / _JERK_TIME_S),
            speed_up_m_s=min(self.speed_up_m_s, speed_m_s),
            speed_down_m_s=min(self.speed_down_m_s, speed_m_s),
        )

    def slowing_from(self, speed_m_s: float, usual: Limits) -> Limits:
        """Return limits that a vehicle slows down with which is faster than they allow.

        Args:
            speed_m_s: its horizontal speed.
            usual: limits without a goal's speed, whose acceleration and jerk it may have.
        """
        if speed_m_s <= self.speed_horizontal_m_s:
            return self
        faster = usual.with_speed(speed_m_s)
        return dataclasses.replace(
            self,
            acceleration_horizontal_m_s2=max(
                self.acceleration_horizontal_m_s2, faster.acceleration_horizontal_m_s2
            ),
            jerk_m_s3=max(self.jerk_m_s3, faster.jerk_m_s3),
        )

    def along(self, direction_enu: Vector3) -> AxisLimits:
        """Return the limits of a straight motion along a unit vector of the map frame."""
        east, north, up = direction_enu
        level, rise = max(math.hypot(east, north), _NONE), max(abs(up), _NONE)
        ahead, back = (
            (self.speed_up_m_s, self.speed_down_m_s)
            if up >= 0.0
            else (self.speed_down_m_s, self.speed_up_m_s)
        )
        # Each is the length at which the direction first meets one of two bounds.
        level_m_s = self.speed_horizontal_m_s / level
        level_m_s2 = self.acceleration_horizontal_m_s2 / level
        return AxisLimits(
            speed_forward_m_s=min(level_m_s, ahead / rise),
            speed_backward_m_s=min(level_m_s, back / rise),
            acceleration_m_s2=min(level_m_s2, self.acceleration_vertical_m_s2 / rise),
            jerk_m_s3=self.jerk_m_s3,
        )

    def clip_velocity(self, velocity_enu_m_s: Vector3) -> Vector3:
        """Return a velocity with its horizontal norm and its climb rate within the limits."""
        east, north, up = velocity_enu_m_s
        speed = math.hypot(east, north)
        factor = 1.0 if speed <= self.speed_horizontal_m_s else self.speed_horizontal_m_s / speed
        return (
            east * factor,
            north * factor,
            min(max(up, -self.speed_down_m_s), self.speed_up_m_s),
        )


def stopping_distance_m(speed_m_s: float, delay_s: float, braking_m_s2: float) -> float:
    """Return how far it is to a standstill.

    Args:
        speed_m_s: of the vehicle.
        delay_s: time until the brake begins.
        braking_m_s2: deceleration of the brake.
    """
    return speed_m_s * delay_s + speed_m_s * speed_m_s / (2.0 * braking_m_s2)


def stopping_speed_m_s(room_m: float, delay_s: float, braking_m_s2: float) -> float:
    """Return the speed from which a vehicle comes to rest within a distance; 0 without any.

    Args:
        room_m: the distance; infinite for any speed.
        delay_s: time until the brake begins.
        braking_m_s2: deceleration of the brake.
    """
    if room_m <= 0.0:
        return 0.0
    lag_m_s = braking_m_s2 * delay_s
    return math.sqrt(lag_m_s * lag_m_s + 2.0 * braking_m_s2 * room_m) - lag_m_s
