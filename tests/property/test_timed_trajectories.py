"""Whatever points a program sends: a sentence, or a motion that keeps the limits."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from navigation_core.geometry import KinematicState
from navigation_core.limits import Limits
from navigation_core.trajectories.timed_point import TimedPoint
from navigation_core.trajectories.timed_trajectory import (
    TimedTrajectory,
    TrajectoryFault,
    join,
    plan_timed,
)

LIMITS = Limits(speed_horizontal_m_s=5.0)
_ROUNDING = 1.03

ANY = st.floats(width=32)
SANE = st.floats(-30.0, 30.0)
NUMBER = st.one_of(SANE, SANE, SANE, ANY)
VECTOR = st.tuples(NUMBER, NUMBER, NUMBER)
POINT = st.builds(
    TimedPoint,
    st.one_of(st.floats(0.0, 60.0), ANY),
    VECTOR,
    st.none() | VECTOR,
    st.none() | VECTOR,
    st.none() | NUMBER,
)
SLOW = st.tuples(*[st.floats(-1.0, 1.0)] * 3)


@st.composite
def uniform_points(draw: st.DrawFn) -> list[TimedPoint]:
    """Draw points that are at least alike, with rising times."""
    count = draw(st.integers(2, 8))
    steps = draw(st.lists(st.floats(0.05, 10.0), min_size=count, max_size=count))
    moves = draw(st.booleans())
    bends = moves and draw(st.booleans())
    places = draw(st.lists(st.tuples(SANE, SANE, SANE), min_size=count, max_size=count))
    return [
        TimedPoint(
            sum(steps[: i + 1]), place, draw(SLOW) if moves else None, draw(SLOW) if bends else None
        )
        for i, place in enumerate(places)
    ]


def keeps_limits(motion: tuple[np.ndarray, np.ndarray, np.ndarray], share: float) -> bool:
    _, velocities, accelerations = motion
    return bool(
        (np.hypot(velocities[:, 0], velocities[:, 1]) <= share * LIMITS.speed_horizontal_m_s).all()
        and (velocities[:, 2] <= share * LIMITS.speed_up_m_s).all()
        and (-velocities[:, 2] <= share * LIMITS.speed_down_m_s).all()
        and (
            np.hypot(accelerations[:, 0], accelerations[:, 1])
            <= share * LIMITS.acceleration_horizontal_m_s2 + 1e-6
        ).all()
        and (np.abs(accelerations[:, 2]) <= share * LIMITS.acceleration_vertical_m_s2 + 1e-6).all()
    )


REST = (0.0, 0.0, 0.0)
JUMPS_AT_THE_END = [
    *(TimedPoint(t, REST, REST, REST) for t in (1.0, 2.0, 10.125)),
    TimedPoint(10.176, (0.0, 0.0, 1.0), REST, REST),
]


@example(JUMPS_AT_THE_END, True)
@given(st.one_of(st.lists(POINT, max_size=6), uniform_points()), st.booleans())
@settings(max_examples=300, deadline=None)
def test_points_make_a_motion_within_the_limits_or_a_sentence(
    points: list[TimedPoint], slow: bool
) -> None:
    planned = plan_timed(points, LIMITS, slow)
    if isinstance(planned, TrajectoryFault):
        assert planned.text.endswith(".")
        return
    motion = planned.trajectory
    assert math.isfinite(motion.duration_s)
    samples = motion.samples(np.linspace(0.0, planned.times_s[-1], 3000))
    assert np.isfinite(np.concatenate(samples)).all()
    assert keeps_limits(samples, _ROUNDING + 0.02)
    assert planned.slower == 1.0 or slow


@pytest.mark.night
@given(
    uniform_points(),
    st.tuples(*[st.floats(-1.0, 1.0)] * 3),
    st.tuples(st.floats(-4.0, 4.0), st.floats(-2.0, 2.0), st.floats(-0.8, 0.8)),
    st.floats(0.0, 1.0),
)
@settings(max_examples=200, deadline=None)
def test_what_is_joined_is_without_a_jump_and_ends_where_it_was_planned(
    points: list[TimedPoint],
    beside: tuple[float, float, float],
    velocity: tuple[float, float, float],
    share: float,
) -> None:
    planned = plan_timed(points, LIMITS, may_slow_down=True)
    if not isinstance(planned, TimedTrajectory):
        return
    from_s = share * planned.times_s[-1]
    x, y, z = planned.trajectory.sample(from_s).position_enu_m
    start = KinematicState((x + beside[0], y + beside[1], z + beside[2]), velocity)
    joined = join(start, planned, from_s, LIMITS)
    if joined is None:
        return
    motion, _ = joined
    # One that is as good as there already is not led in.
    assert math.dist(motion.sample(0.0).position_enu_m, start.position_enu_m) < 1e-3
    times_s = np.linspace(0.0, motion.duration_s, 3000)
    positions, velocities, _ = motion.samples(times_s)
    fastest = float(np.linalg.norm(velocities, axis=1).max())
    step_m = 1.5 * (fastest + 0.1) * (times_s[1] - times_s[0]) + 1e-6
    assert float(np.linalg.norm(np.diff(positions, axis=0), axis=1).max()) <= step_m
    end = motion.sample(motion.duration_s + 1.0).position_enu_m
    assert end == planned.trajectory.end_position_enu_m
