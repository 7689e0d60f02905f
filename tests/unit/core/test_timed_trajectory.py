"""Trajectories of other programs: checked, slowed down, joined."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from navigation_core.geometry import KinematicState, Vector3, distance
from navigation_core.limits import Limits
from navigation_core.trajectories.timed_point import TimedPoint
from navigation_core.trajectories.timed_trajectory import (
    TimedTrajectory,
    TrajectoryFault,
    join,
    plan_timed,
)

LIMITS = Limits(speed_horizontal_m_s=5.0)


def on_circle(t: float) -> TimedPoint:
    """Return a point at 2 m/s on a circle of 4 m."""
    a = 0.5 * t
    cosine, sine = math.cos(a), math.sin(a)
    return TimedPoint(
        t,
        (4.0 * cosine, 4.0 * sine, 5.0),
        (-2.0 * sine, 2.0 * cosine, 0.0),
        (-cosine, -sine, 0.0),
        math.remainder(a + 0.5 * math.pi, math.tau),
    )


CIRCLE = tuple(on_circle(0.5 * i) for i in range(21))


def sound(points: tuple[TimedPoint, ...], slow: bool = False) -> TimedTrajectory:
    planned = plan_timed(points, LIMITS, slow)
    assert isinstance(planned, TimedTrajectory), planned
    return planned


def off_m(timed: TimedTrajectory, times_s: list[float]) -> float:
    return max(
        distance(timed.trajectory.sample(t).position_enu_m, on_circle(t).position_enu_m)
        for t in times_s
    )


def without(points: tuple[TimedPoint, ...], *names: str) -> tuple[TimedPoint, ...]:
    given: dict[str, Any] = dict.fromkeys(names)
    return tuple(replace(point, **given) for point in points)


def test_what_is_given_decides_the_degree_between_points() -> None:
    times_s = [0.1 * i for i in range(100)]
    quintic = sound(CIRCLE)
    cubic = sound(without(CIRCLE, "acceleration_enu_m_s2"))
    spline = sound(without(CIRCLE, "acceleration_enu_m_s2", "velocity_enu_m_s"), slow=True)
    assert off_m(quintic, times_s) < 1e-4
    assert off_m(cubic, times_s) < 1e-3
    assert not quintic.ends_at_rest
    assert spline.ends_at_rest
    for point in CIRCLE:
        here = spline.trajectory.sample(point.time_s * spline.slower).position_enu_m
        assert distance(here, point.position_enu_m) < 1e-6
    # Its acceleration is continuous.
    times = np.linspace(0.0, spline.trajectory.duration_s, 2000)
    accelerations = spline.trajectory.samples(times[:-1])[2]
    assert float(np.abs(np.diff(accelerations, axis=0)).max()) < 0.2


def test_a_trajectory_that_ends_in_motion_is_followed_by_a_brake() -> None:
    timed = sound(CIRCLE)
    motion = timed.trajectory
    assert motion.duration_s > CIRCLE[-1].time_s + 0.5
    assert motion.sample(motion.duration_s - 1e-6).velocity_enu_m_s == pytest.approx(
        (0.0, 0.0, 0.0), abs=1e-3
    )


FAULTS: dict[str, tuple[tuple[TimedPoint, ...], str]] = {
    "one point": (CIRCLE[:1], "It has 1 points"),
    "too many": (tuple(on_circle(0.01 * i) for i in range(2001)), "It has 2001 points"),
    "not finite": (
        (*CIRCLE[:2], replace(CIRCLE[2], velocity_enu_m_s=(math.inf, 0.0, 0.0))),
        "Point 2 has a number",
    ),
    "absurd": (
        (*CIRCLE[:2], replace(CIRCLE[2], position_enu_m=(1e300, 0.0, 0.0))),
        "Point 2 has a number",
    ),
    "same time": ((CIRCLE[0], CIRCLE[1], replace(CIRCLE[2], time_s=0.5)), "Point 2 comes 0 s"),
    "before the start": ((replace(CIRCLE[0], time_s=-1.0), *CIRCLE[1:]), "Point 0 has the time"),
    "mixed": ((*CIRCLE[:3], *without(CIRCLE[3:], "yaw_enu_rad")), "Point 3 differs"),
    "no velocities": (without(CIRCLE, "velocity_enu_m_s"), "Point 0 has an acceleration"),
    "too long": ((CIRCLE[0], replace(CIRCLE[1], time_s=4000.0)), "lasts longer than"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_is_a_sentence_that_names_the_point(fault: str) -> None:
    points, words = FAULTS[fault]
    planned = plan_timed(points, LIMITS, may_slow_down=True)
    assert isinstance(planned, TrajectoryFault)
    assert words in planned.text


@pytest.mark.parametrize(
    ("limits", "words", "slower"),
    [
        (replace(LIMITS, speed_horizontal_m_s=1.0), "2.00 m/s over ground", 2.0),
        (replace(LIMITS, acceleration_horizontal_m_s2=0.25), "1.00 m/s2 over ground", 2.0),
        (replace(LIMITS, yaw_rate_rad_s=0.25), "turns with 29 degrees/s", 2.0),
    ],
)
def test_a_limit_rejects_a_trajectory_or_slows_the_whole_of_it_down(
    limits: Limits, words: str, slower: float
) -> None:
    rejected = plan_timed(CIRCLE, limits, may_slow_down=False)
    assert isinstance(rejected, TrajectoryFault)
    assert words in rejected.text
    slowed = plan_timed(CIRCLE, limits, may_slow_down=True)
    assert isinstance(slowed, TimedTrajectory)
    assert slowed.slower == pytest.approx(slower, rel=0.02)
    assert words in slowed.why_slower
    here = slowed.trajectory.sample(slower * 4.0).position_enu_m
    assert distance(here, on_circle(4.0).position_enu_m) < 0.1


def test_yaws_turn_the_shorter_way() -> None:
    timed = sound(CIRCLE)
    for t in (0.25, 4.9, 7.3):
        yaw = timed.yaw_at(t)
        assert yaw is not None
        assert abs(math.remainder(yaw - (0.5 * t + 0.5 * math.pi), math.tau)) < 1e-6
    assert sound(without(CIRCLE, "yaw_enu_rad")).yaw_at(1.0) is None


def test_yaw_rates_that_are_given_are_met_at_the_points_and_kept_within_the_limit() -> None:
    few = CIRCLE[::4]  # 2 s apart, in which a steady turn would be wrong by degrees

    def turned(t: float) -> float:
        return 0.5 * math.pi + 0.4 * math.sin(0.9 * t)

    given = tuple(
        replace(p, yaw_enu_rad=turned(p.time_s), yaw_rate_rad_s=0.36 * math.cos(0.9 * p.time_s))
        for p in few
    )
    timed = sound(given)
    for t in (0.0, 0.7, 2.0, 5.1, 6.0, 9.9):
        assert timed.yaw_at(t) == pytest.approx(turned(t), abs=math.radians(1.5))
    steady = sound(tuple(replace(p, yaw_enu_rad=turned(p.time_s)) for p in few))
    off_deg = [
        math.degrees(abs((steady.yaw_at(t) or 0.0) - turned(t))) for t in (1.0, 2.9, 4.9, 8.8)
    ]
    assert max(off_deg) > 5.0
    # The same yaws, at rates that only a detour between them has.
    wild = tuple(replace(p, yaw_rate_rad_s=1.0) for p in given)
    rejected = plan_timed(wild, replace(LIMITS, yaw_rate_rad_s=0.9), False)
    assert isinstance(rejected, TrajectoryFault)
    assert "It turns with" in rejected.text
    slowed = plan_timed(wild, replace(LIMITS, yaw_rate_rad_s=0.5), True)
    assert isinstance(slowed, TimedTrajectory)
    assert slowed.yaw is not None
    assert max(slowed.yaw.greatest_rates()) == pytest.approx(0.5, rel=0.01)


STARTS: list[tuple[Vector3, Vector3]] = [
    ((4.0, 0.0, 5.0), (0.0, 0.0, 0.0)),
    ((4.3, -0.2, 5.1), (0.0, 2.0, 0.0)),
    ((3.8, 0.3, 4.9), (0.5, 1.2, 0.1)),
]


@pytest.mark.parametrize("start", STARTS)
def test_a_trajectory_is_joined_without_a_jump_and_within_the_limits(
    start: tuple[Vector3, Vector3],
) -> None:
    timed, state = sound(CIRCLE), KinematicState(*start)
    joined = join(state, timed, 0.0, LIMITS)
    assert joined is not None
    motion, ahead_s = joined
    assert motion.sample(0.0) == state
    times = np.linspace(0.0, motion.duration_s, 4000)
    positions, velocities, accelerations = motion.samples(times)
    assert float(np.linalg.norm(np.diff(positions, axis=0), axis=1).max()) < 0.02
    assert float(np.linalg.norm(np.diff(velocities, axis=0), axis=1).max()) < 0.02
    level = np.hypot(accelerations[:, 0], accelerations[:, 1])
    assert float(level.max()) <= 1.1 * LIMITS.acceleration_horizontal_m_s2 + 1e-6
    late_s = 8.0 - ahead_s
    assert distance(motion.sample(late_s).position_enu_m, on_circle(8.0).position_enu_m) < 1e-4


def test_a_trajectory_that_cannot_be_joined_within_the_limits_is_not() -> None:
    timed = sound(CIRCLE[:3])
    assert join(KinematicState((4.0, 0.0, 5.0), (0.0, -5.0, 0.0)), timed, 0.0, LIMITS) is None
