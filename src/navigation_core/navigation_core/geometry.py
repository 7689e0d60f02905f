"""Vectors, angles and the kinematic state, all in the ENU map frame.

The map frame follows ROS REP-103: x east, y north, z up, in metres; yaw is zero towards
east and grows counter-clockwise, in radians.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

# Tuples rather than arrays: for three numbers they are several times faster than NumPy,
# they are immutable, and they compare by value.
Vector3 = tuple[float, float, float]

ZERO: Vector3 = (0.0, 0.0, 0.0)
# Points closer than this are the same: far under what any estimator resolves.
_SAME_M = 1e-6


@dataclass(frozen=True)
class KinematicState:
    """Position and its first two derivatives at one moment.

    Attributes:
        position_enu_m: position in the map frame.
        velocity_enu_m_s: velocity in the map frame.
        acceleration_enu_m_s2: acceleration in the map frame, gravity not included.
    """

    position_enu_m: Vector3
    velocity_enu_m_s: Vector3 = ZERO
    acceleration_enu_m_s2: Vector3 = ZERO

    @property
    def is_finite(self) -> bool:
        """Whether all nine numbers are finite."""
        return (
            is_finite(self.position_enu_m)
            and is_finite(self.velocity_enu_m_s)
            and is_finite(self.acceleration_enu_m_s2)
        )


def add(a: Vector3, b: Vector3) -> Vector3:
    """Return ``a + b``."""
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


def subtract(a: Vector3, b: Vector3) -> Vector3:
    """Return ``a - b``."""
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def scale(a: Vector3, factor: float) -> Vector3:
    """Return ``a`` times ``factor``."""
    return (a[0] * factor, a[1] * factor, a[2] * factor)


def dot(a: Vector3, b: Vector3) -> float:
    """Return the scalar product of ``a`` and ``b``."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def norm(a: Vector3) -> float:
    """Return the length of ``a``."""
    return math.sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2])


def horizontal_norm(a: Vector3) -> float:
    """Return the length of the east and north components of ``a``."""
    return math.hypot(a[0], a[1])


def distance(a: Vector3, b: Vector3) -> float:
    """Return the distance between the points ``a`` and ``b``."""
    x, y, z = a[0] - b[0], a[1] - b[1], a[2] - b[2]
    return math.sqrt(x * x + y * y + z * z)


def across(a: Vector3, direction: Vector3) -> Vector3:
    """Return the part of ``a`` that is perpendicular to the unit vector ``direction``."""
    along = a[0] * direction[0] + a[1] * direction[1] + a[2] * direction[2]
    return (a[0] - direction[0] * along, a[1] - direction[1] * along, a[2] - direction[2] * along)


def unit_between(origin: Vector3, target: Vector3) -> Vector3 | None:
    """Return the unit vector between two points; None if they are the same."""
    return unit(subtract(target, origin))


def unit(a: Vector3) -> Vector3 | None:
    """Return the unit vector along ``a``; None if that has no length."""
    x, y, z = a
    length = math.sqrt(x * x + y * y + z * z)
    if length < _SAME_M:
        return None
    factor = 1.0 / length
    return (x * factor, y * factor, z * factor)


def is_finite(a: Vector3) -> bool:
    """Whether no component is NaN or infinite."""
    return math.isfinite(a[0]) and math.isfinite(a[1]) and math.isfinite(a[2])


def limit_norm(a: Vector3, norm_max: float) -> Vector3:
    """Return ``a``, shortened to ``norm_max`` if it is longer."""
    length = math.hypot(*a)
    return a if length <= norm_max else scale(a, norm_max / length)


def wrap_angle(angle_rad: float) -> float:
    """Return the same angle within (-pi, pi]."""
    wrapped = math.remainder(angle_rad, math.tau)
    return math.pi if wrapped <= -math.pi else wrapped


def slew_angle(angle_rad: float, target_rad: float, step_max_rad: float) -> float:
    """Turn ``angle_rad`` towards ``target_rad`` the shorter way, by ``step_max_rad`` at most.

    Returns:
        The new angle within (-pi, pi]; exactly the wrapped target once it is reached.
    """
    error = wrap_angle(target_rad - angle_rad)
    if abs(error) <= step_max_rad:
        return wrap_angle(target_rad)
    return wrap_angle(angle_rad + math.copysign(step_max_rad, error))
