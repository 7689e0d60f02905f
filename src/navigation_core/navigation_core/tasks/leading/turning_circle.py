"""Estimates the turning radius of a ground vehicle and handles targets within its turning circle.

Its parameters may not say, or be wrong: ArduRover's TURN_RADIUS is a default that few change,
PX4's wheel base and steering angle know nothing of sliding tyres. So what is known of it to begin
with only grows, as its turns show.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from navigation_core.geometry import Vector3, horizontal_norm, subtract, wrap_angle

# A point this deep in the circle could only be circled; it is driven away from until it is this
# far outside. Without the difference, straight on and turning would take turns forever.
_INSIDE_SHARE, _OUTSIDE_SHARE = 0.95, 1.25
# Straight ahead and straight behind, inside and outside say nothing.
_ASIDE_SHARE = 0.2
# A vehicle that turns towards a point more than this aside has its wheels at the stop, and after
# this time they are there.
_HARD_RAD, _SETTLED_S = math.radians(60.0), 1.0
# The radius is measured over this angle of a turn, or in this time. One that is wider by less than
# this factor is the same.
_MEASURED_RAD, _MEASURED_S, _SAME_SHARE = math.radians(45.0), 2.0, 1.1
# Slower than this it does not turn at all.
_STILL_M_S = 0.2
# A measured circle of more than this many times the known one is an error.
_MOST_TIMES = 8.0


@dataclass(frozen=True)
class Pursuer:
    """The steered vehicle.

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
        """Its heading as a unit vector."""
        return (math.cos(self.yaw_enu_rad), math.sin(self.yaw_enu_rad), 0.0)

    @property
    def speed_m_s(self) -> float:
        """Its speed over ground."""
        return horizontal_norm(self.velocity_enu_m_s)


@dataclass(frozen=True)
class _Turn:
    """A turn with the wheels at their stop.

    Attributes:
        from_s: from when on it is measured.
        from_: where and how the vehicle was then.
        left: whether it turns to the left.
    """

    from_s: float
    from_: Pursuer
    left: bool


class TurningCircle:
    """The circle of one vehicle's tightest turn, to either side.

    Attributes:
        radius_m: as known by now; 0 for what turns on the spot.
        leaves: whether a point is being driven away from.
    """

    def __init__(self, radius_m: float, turn_rate_rad_s: float) -> None:
        """Begin with what is known.

        Args:
            radius_m: at low speed.
            turn_rate_rad_s: fastest turn at any speed.
        """
        self.radius_m = radius_m
        self._most_m = _MOST_TIMES * radius_m
        self._turn_rate_rad_s = turn_rate_rad_s
        self._turn: _Turn | None = None
        self.leaves = False

    def forget(self) -> None:
        """Forget the turn that was under way; the measured radius stays."""
        self._turn = None
        self.leaves = False

    def holds(self, point_enu_m: Vector3, pursuer: Pursuer, share: float = _INSIDE_SHARE) -> bool:
        """Whether a point lies within the circle of the tightest turn, to either side.

        Args:
            point_enu_m: the point.
            pursuer: the vehicle.
            share: of the radius that counts as within.
        """
        east, north, _ = subtract(point_enu_m, pursuer.position_enu_m)
        heading = pursuer.heading
        radius_m = max(self.radius_m, pursuer.speed_m_s / self._turn_rate_rad_s)
        ahead_m = east * heading[0] + north * heading[1]
        aside_m = abs(-east * heading[1] + north * heading[0])
        inside = math.hypot(ahead_m, aside_m - radius_m) < share * radius_m
        return inside and aside_m > _ASIDE_SHARE * radius_m

    def must_leave(self, point_enu_m: Vector3, pursuer: Pursuer) -> bool:
        """Whether a point must be driven away from before it can be turned to."""
        if self.radius_m <= 0.0:
            return False
        share = _OUTSIDE_SHARE if self.leaves else _INSIDE_SHARE
        self.leaves = self.holds(point_enu_m, pursuer, share)
        return self.leaves

    def observe(self, away_rad: float, pursuer: Pursuer, now: float) -> None:
        """Learn from how the vehicle turns.

        Args:
            away_rad: how far aside of its nose is the point that it was commanded to head for.
            pursuer: the vehicle.
            now: time in seconds.
        """
        slow = pursuer.speed_m_s <= 1.5 * self._turn_rate_rad_s * max(self.radius_m, 1.0)
        if abs(away_rad) < _HARD_RAD or pursuer.speed_m_s < _STILL_M_S or not slow:
            self._turn = None
            return
        turn, left = self._turn, away_rad > 0.0
        if turn is None or turn.left is not left:
            self._turn = _Turn(now + _SETTLED_S, pursuer, left)
            return
        if now <= turn.from_s:
            self._turn = _Turn(turn.from_s, pursuer, left)
            return
        turned_rad = abs(wrap_angle(pursuer.yaw_enu_rad - turn.from_.yaw_enu_rad))
        if turned_rad < _MEASURED_RAD and now - turn.from_s < _MEASURED_S:
            return
        chord_m = horizontal_norm(subtract(pursuer.position_enu_m, turn.from_.position_enu_m))
        radius_m = chord_m / max(2.0 * math.sin(0.5 * turned_rad), 1e-3)
        if _SAME_SHARE * self.radius_m < radius_m < self._most_m:
            self.radius_m = radius_m
        self._turn = _Turn(now, pursuer, left)
