"""The motion of a target that is followed: a filter over samples that may be wrong.

A sample that cannot be true is rejected, and the target is where it was expected. Between samples
it moves on at a constant velocity, for a bounded time.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from navigation_core.geometry import (
    ZERO,
    Vector3,
    add,
    distance,
    is_finite,
    norm,
    scale,
    subtract,
    wrap_angle,
)

__all__ = ["PREDICTED_S", "TargetFilter", "TargetSample", "TrackedTarget"]

PREDICTED_S = 1.5
"""A target that was not measured for longer is lost: a sample each second is enough to follow."""

# A sample that took longer is of no use, and clocks that agree differ by less than the second.
_AGE_MAX_S, _FUTURE_MAX_S = 2.0, 0.2
# Nothing that this follows is faster; the second is what a position may be wrong by.
_SPEED_MAX_M_S, _NOISE_M = 50.0, 3.0
# A target farther from the vehicle is an error of a frame or of a datum.
_FAR_M = 5000.0
# Time constant with which samples correct the motion.
_SMOOTHING_S = 0.25
# Below this speed a motion has no course.
_COURSE_M_S = 0.5


@dataclass(frozen=True)
class TargetSample:
    """One measurement of a target. Its numbers need not be finite.

    Attributes:
        measured_s: when it was measured, on the steady clock.
        position_enu_m: position in the map frame.
        velocity_enu_m_s: velocity in the map frame; None where the source measures none.
        yaw_enu_rad: yaw in the map frame; None where the source has none.
    """

    measured_s: float
    position_enu_m: Vector3
    velocity_enu_m_s: Vector3 | None = None
    yaw_enu_rad: float | None = None


@dataclass(frozen=True)
class TrackedTarget:
    """A target as its samples show it.

    Attributes:
        measured_s: when it was measured last, on the steady clock; minus infinity before that.
        position_enu_m: filtered position then, in the map frame.
        velocity_enu_m_s: filtered velocity then.
        yaw_enu_rad: its yaw, or the course of its motion; None while neither is known.
        rejected: number of samples that were rejected.
        fault: why the last sample was rejected; empty if it was not.
    """

    measured_s: float = -math.inf
    position_enu_m: Vector3 = ZERO
    velocity_enu_m_s: Vector3 = ZERO
    yaw_enu_rad: float | None = None
    rejected: int = 0
    fault: str = ""

    @property
    def is_known(self) -> bool:
        """Whether it was ever measured."""
        return self.measured_s > -math.inf

    def age_s(self, now: float) -> float:
        """Return the time since it was measured; infinite before that."""
        return max(now - self.measured_s, 0.0)

    def is_lost(self, now: float) -> bool:
        """Whether it is not known any more where it is, or not yet."""
        return self.age_s(now) > PREDICTED_S

    def position_at(self, now: float) -> Vector3:
        """Return where it is expected, in the map frame."""
        ahead_s = min(self.age_s(now), PREDICTED_S)
        return add(self.position_enu_m, scale(self.velocity_enu_m_s, ahead_s))


class TargetFilter:
    """Filters the samples of one target.

    Attributes:
        tracked: what is known; another object after each sample.
    """

    def __init__(self) -> None:
        """Begin without a sample."""
        self.tracked = TrackedTarget()

    def take(self, sample: TargetSample, vehicle_enu_m: Vector3, now: float) -> str:
        """Process a sample; return why it is rejected, as a sentence, or an empty text.

        Args:
            sample: the sample.
            vehicle_enu_m: position of the vehicle that follows.
            now: when it was received, on the steady clock.
        """
        fault = self._fault(sample, vehicle_enu_m, now)
        if fault:
            return self.reject(fault)
        before = self.tracked
        passed_s = sample.measured_s - before.measured_s
        velocity, position = sample.velocity_enu_m_s or ZERO, sample.position_enu_m
        if passed_s <= PREDICTED_S:
            position, velocity = _corrected(before, sample, passed_s)
        yaw = sample.yaw_enu_rad
        if yaw is None:
            yaw = before.yaw_enu_rad
            if math.hypot(velocity[0], velocity[1]) > _COURSE_M_S:
                yaw = math.atan2(velocity[1], velocity[0])
        self.tracked = TrackedTarget(
            sample.measured_s,
            position,
            velocity,
            None if yaw is None else wrap_angle(yaw),
            before.rejected,
        )
        return ""

    def reject(self, fault: str) -> str:
        """Count a sample that cannot be used; return why."""
        known = self.tracked
        self.tracked = TrackedTarget(
            known.measured_s,
            known.position_enu_m,
            known.velocity_enu_m_s,
            known.yaw_enu_rad,
            known.rejected + 1,
            fault,
        )
        return fault

    def _fault(self, sample: TargetSample, vehicle_enu_m: Vector3, now: float) -> str:
        """Return why a sample cannot be true, or an empty text."""
        velocity, yaw = sample.velocity_enu_m_s or ZERO, sample.yaw_enu_rad or 0.0
        numbers = (sample.measured_s, *sample.position_enu_m, *velocity, yaw)
        if not all(math.isfinite(number) for number in numbers):
            return "It has a number that is not finite."
        age_s, known = now - sample.measured_s, self.tracked
        if age_s > _AGE_MAX_S:
            return f"It was measured {age_s:.1f} s ago; at most {_AGE_MAX_S:g} s are accepted."
        if age_s < -_FUTURE_MAX_S:
            return f"Its stamp is {-age_s:.1f} s in the future; check the clocks."
        if sample.measured_s <= known.measured_s:
            return "It is not newer than the sample before."
        far_m = distance(sample.position_enu_m, vehicle_enu_m)
        if far_m > _FAR_M:
            return (
                f"It is {far_m / 1000.0:.0f} km away; at most {_FAR_M / 1000.0:g} km are accepted."
            )
        speed_m_s = norm(velocity)
        if known.is_known:
            moved_m = distance(sample.position_enu_m, known.position_enu_m) - _NOISE_M
            passed_s = sample.measured_s - known.measured_s
            speed_m_s = max(speed_m_s, moved_m / passed_s)
        if speed_m_s > _SPEED_MAX_M_S:
            return f"It moves at {speed_m_s:.0f} m/s; at most {_SPEED_MAX_M_S:g} m/s are accepted."
        return ""


def _corrected(
    known: TrackedTarget, sample: TargetSample, passed_s: float
) -> tuple[Vector3, Vector3]:
    """Return the position and velocity after a sample: a critically damped filter's."""
    forgets = math.exp(-passed_s / _SMOOTHING_S)
    expected = add(known.position_enu_m, scale(known.velocity_enu_m_s, passed_s))
    error = subtract(sample.position_enu_m, expected)
    position = add(expected, scale(error, 1.0 - forgets * forgets))
    if sample.velocity_enu_m_s is not None:
        change = subtract(sample.velocity_enu_m_s, known.velocity_enu_m_s)
        return position, add(known.velocity_enu_m_s, scale(change, 1.0 - forgets))
    gain_1_s = (1.0 - forgets) ** 2 / passed_s
    velocity = add(known.velocity_enu_m_s, scale(error, gain_1_s))
    return position, velocity if is_finite(velocity) else ZERO
