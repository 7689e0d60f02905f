"""The velocity with which a vehicle follows a target: a law without a memory.

It leads to a position beside the target, as fast as the vehicle can stop there, and never nearer to
the target than a distance: around it if it stands on the line, away from it if it comes.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum, auto

from navigation_core.geometry import (
    ZERO,
    Vector3,
    add,
    dot,
    horizontal_norm,
    limit_norm,
    norm,
    scale,
    subtract,
    unit,
    wrap_angle,
)
from navigation_core.limits import Limits, stopping_speed_m_s
from navigation_core.tasks.inputs.tracked_target import TrackedTarget
from navigation_core.tasks.traits import Traits

__all__ = ["DISTANCE_MARGIN_M", "FollowTerms", "TargetGuide", "YawRule"]

DISTANCE_MARGIN_M = 0.5
"""Kept to the least distance on top, for the error of two positions."""

# Errors are corrected with these gains, 1/s.
_POSITION_GAIN_1_S, _YAW_GAIN_1_S = 0.8, 1.5
# Time until a changed command acts, and the share of the acceleration that is planned with.
_REACTION_S, _BRAKE_SHARE = 0.6, 0.6
# Around the target, this much more than the least distance is kept.
_AROUND_SHARE = 1.15
# A slower motion has no course, and with less room a vehicle stands.
_COURSE_M_S, _TINY_M = 0.5, 1e-3


class YawRule(Enum):
    """The yaw while a target is followed."""

    TARGET = auto()
    TANGENT = auto()
    """In the direction of travel."""
    KEEP = auto()


@dataclass(frozen=True)
class FollowTerms:
    """How to follow a target.

    Attributes:
        offset_m: from the target to the place that is kept, in metres.
        turns: whether the offset is in the target's axes, forward, left, up; else east, north, up.
        least_distance_m: least distance to the target, over ground for what drives.
        max_duration_s: time after which it ends; infinite for none.
        lost_timeout_s: time without a usable sample after which it ends.
        yaw: the yaw of what flies.
    """

    offset_m: Vector3
    turns: bool
    least_distance_m: float
    max_duration_s: float = math.inf
    lost_timeout_s: float = 10.0
    yaw: YawRule = YawRule.TARGET

    def place(self, target: TrackedTarget, position_enu_m: Vector3) -> Vector3:
        """Return the place that is kept, in the map frame.

        A target without a yaw has the axes of the map.
        """
        forward, left, up = self.offset_m
        if not self.turns:
            return add(position_enu_m, self.offset_m)
        yaw = target.yaw_enu_rad or 0.0
        cosine, sine = math.cos(yaw), math.sin(yaw)
        offset = (forward * cosine - left * sine, forward * sine + left * cosine, up)
        return add(position_enu_m, offset)


class TargetGuide:
    """Guides one vehicle."""

    def __init__(self, terms: FollowTerms, traits: Traits, limits: Limits) -> None:
        """Prepare.

        Args:
            terms: how to follow.
            traits: what the vehicle can do.
            limits: its speeds and accelerations.
        """
        self._terms = terms
        self._flies = traits.flies
        self._limits = limits
        braking_m_s2 = limits.acceleration_horizontal_m_s2
        if not traits.flies:
            braking_m_s2 = min(braking_m_s2, traits.braking_m_s2)
        self._braking_m_s2 = _BRAKE_SHARE * braking_m_s2

    def gap_m(self, here_enu_m: Vector3, target_enu_m: Vector3) -> float:
        """Return the distance that counts: in space for what flies, else over ground."""
        return norm(self._relative(here_enu_m, target_enu_m))

    def velocity(
        self, here_enu_m: Vector3, place_enu_m: Vector3, target: TrackedTarget, now: float
    ) -> Vector3:
        """Return the velocity that leads to the place beside the target, in the map frame.

        Args:
            here_enu_m: where the vehicle is.
            place_enu_m: the place that is kept.
            target: the target.
            now: time in seconds.
        """
        centre = target.position_at(now)
        way = self._around(here_enu_m, place_enu_m, centre)
        lead = target.velocity_enu_m_s
        wanted = add(lead, self._closing(way))
        if not self._flies:
            wanted = (wanted[0], wanted[1], 0.0)
        return self._limits.clip_velocity(wanted)

    def towards(self, here_enu_m: Vector3, corner_enu_m: Vector3) -> Vector3:
        """Return the velocity to a corner of a path around obstacles, at which it can turn."""
        way = subtract(corner_enu_m, here_enu_m)
        direction = unit(way)
        if direction is None:
            return ZERO
        speed_m_s = stopping_speed_m_s(norm(way), _REACTION_S, self._braking_m_s2)
        return self._limits.clip_velocity(scale(direction, max(speed_m_s, 0.5)))

    def kept_off(
        self,
        velocity_enu_m_s: Vector3,
        here_enu_m: Vector3,
        yaw_enu_rad: float,
        target: TrackedTarget,
        now: float,
    ) -> Vector3:
        """Return a velocity that does not come too near to the target.

        Args:
            velocity_enu_m_s: what is wanted.
            here_enu_m: where the vehicle is.
            yaw_enu_rad: its yaw: until it has turned, what drives moves along its nose.
            target: the target.
            now: time in seconds.
        """
        relative = self._relative(here_enu_m, target.position_at(now))
        outwards = unit(relative) or (1.0, 0.0, 0.0)
        kept_m = self._terms.least_distance_m + DISTANCE_MARGIN_M
        room_m = norm(relative) - kept_m
        closing_m_s = stopping_speed_m_s(room_m, _REACTION_S, self._braking_m_s2)
        if room_m < 0.0:
            closing_m_s = _POSITION_GAIN_1_S * room_m
        # The least speed away from it: less than nothing while there is room.
        least_m_s = dot(target.velocity_enu_m_s, outwards) - closing_m_s
        if not self._flies:
            return _slower(velocity_enu_m_s, outwards, yaw_enu_rad, least_m_s)
        missing_m_s = least_m_s - dot(velocity_enu_m_s, outwards)
        if missing_m_s <= 0.0:
            return velocity_enu_m_s
        return self._limits.clip_velocity(add(velocity_enu_m_s, scale(outwards, missing_m_s)))

    def yaw_rate_rad_s(
        self,
        here_enu_m: Vector3,
        yaw_enu_rad: float,
        velocity_enu_m_s: Vector3,
        target_enu_m: Vector3,
    ) -> float:
        """Return the turn rate of what flies.

        Args:
            here_enu_m: where the vehicle is.
            yaw_enu_rad: its yaw.
            velocity_enu_m_s: with which it moves.
            target_enu_m: where the target is.
        """
        if self._terms.yaw is YawRule.KEEP:
            return 0.0
        along = velocity_enu_m_s
        least = _COURSE_M_S
        if self._terms.yaw is YawRule.TARGET:
            along, least = subtract(target_enu_m, here_enu_m), _TINY_M
        if horizontal_norm(along) < least:
            return 0.0
        error = wrap_angle(math.atan2(along[1], along[0]) - yaw_enu_rad)
        most = self._limits.yaw_rate_rad_s
        return min(max(_YAW_GAIN_1_S * error, -most), most)

    def _relative(self, here_enu_m: Vector3, target_enu_m: Vector3) -> Vector3:
        x, y, z = subtract(here_enu_m, target_enu_m)
        return (x, y, z if self._flies else 0.0)

    def _closing(self, way: Vector3) -> Vector3:
        """Return the velocity that takes back an error, relative to the target."""
        level = (way[0], way[1], 0.0)
        far_m = norm(level)
        speed_m_s = min(
            _POSITION_GAIN_1_S * far_m, stopping_speed_m_s(far_m, _REACTION_S, self._braking_m_s2)
        )
        x, y, _ = limit_norm(level, speed_m_s)
        return (x, y, _POSITION_GAIN_1_S * way[2])

    def _around(self, here_enu_m: Vector3, place_enu_m: Vector3, centre_enu_m: Vector3) -> Vector3:
        """Return the way to the place, beside the target where that is on the straight line."""
        way = subtract(place_enu_m, here_enu_m)
        x, y, _ = subtract(here_enu_m, centre_enu_m)
        kept_m = _AROUND_SHARE * (self._terms.least_distance_m + DISTANCE_MARGIN_M)
        length_m, far_m = horizontal_norm(way), math.hypot(x, y)
        if length_m < _TINY_M or far_m < _TINY_M:
            return way
        share = -(x * way[0] + y * way[1]) / (length_m * length_m)
        if not 0.0 < share < 1.0:
            return way
        passes_m = math.hypot(x + share * way[0], y + share * way[1])
        above_m = self._relative(here_enu_m, centre_enu_m)[2] + share * way[2]
        if math.hypot(passes_m, above_m if self._flies else 0.0) >= kept_m:
            return way
        side = 1.0 if x * way[1] - y * way[0] >= 0.0 else -1.0
        aside_rad = side * math.asin(min(kept_m / far_m, 1.0))
        # Turned from the line to the target, to the side on which the place is.
        course_rad = math.atan2(-y, -x) - aside_rad
        return (length_m * math.cos(course_rad), length_m * math.sin(course_rad), way[2])


def _slower(
    velocity_enu_m_s: Vector3, outwards: Vector3, yaw_enu_rad: float, least_m_s: float
) -> Vector3:
    """Return a velocity of what drives, slow enough for the target on its way; it does not back."""
    speed_m_s = horizontal_norm(velocity_enu_m_s)
    if speed_m_s <= 0.0:
        return ZERO
    nose = (math.cos(yaw_enu_rad), math.sin(yaw_enu_rad), 0.0)
    share = 1.0
    for direction in (scale(velocity_enu_m_s, 1.0 / speed_m_s), nose):
        inwards_m_s = -speed_m_s * dot(direction, outwards)
        if inwards_m_s > 0.0 and -inwards_m_s < least_m_s:
            share = min(share, max(-least_m_s, 0.0) / inwards_m_s)
    return scale(velocity_enu_m_s, share)
