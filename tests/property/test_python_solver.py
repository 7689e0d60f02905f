"""Profiles calculated without Ruckig, against Ruckig's."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from navigation_core.limits import AxisLimits
from navigation_core.trajectories import python_solver, ruckig_solver
from navigation_core.trajectories.profiles import MotionProfile
from tests.support.hidden_packages import beside, hide

ROOT = Path(__file__).resolve().parents[2]
quickly = settings(max_examples=300, deadline=None)
axis_limits = st.builds(
    AxisLimits,
    st.floats(0.2, 20.0),
    st.floats(0.2, 20.0),
    st.floats(0.2, 8.0),
    st.floats(0.5, 40.0),
)
shares = st.floats(-1.0, 1.0)
# A start may be a little beyond the limits, as after a goal with a higher speed.
beyond = st.one_of(st.just(0.0), st.floats(-1.3, 1.3))
lengths_m = st.floats(-3.0, 3.0).map(lambda exponent: 10.0**exponent)


def assert_same(ours: MotionProfile, theirs: MotionProfile) -> None:
    assert ours.duration == pytest.approx(theirs.duration, rel=1e-7, abs=1e-7)
    for k in range(11):
        t_s = theirs.duration * k / 10.0
        for our_values, their_values in zip(ours.at_time(t_s), theirs.at_time(t_s), strict=True):
            assert our_values == pytest.approx(their_values, rel=1e-6, abs=1e-5)


@pytest.mark.night
@quickly
@given(st.lists(st.tuples(axis_limits, shares, beyond, shares), min_size=1, max_size=3))
def test_a_velocity_is_reached_as_by_ruckig(
    axes: list[tuple[AxisLimits, float, float, float]],
) -> None:
    limits = [limit for limit, _, _, _ in axes]
    velocity = [share * limit.speed_forward_m_s for limit, share, _, _ in axes]
    acceleration = [share * limit.acceleration_m_s2 for limit, _, share, _ in axes]
    target = [share * limit.speed_forward_m_s for limit, _, _, share in axes]
    assert_same(
        python_solver.to_velocity(velocity, acceleration, target, limits),
        ruckig_solver.to_velocity(velocity, acceleration, target, limits),
    )


@quickly
@given(axis_limits, st.one_of(st.just(0.0), st.floats(-0.2, 1.0)), st.floats(0.0, 1.0), lengths_m)
def test_a_position_is_reached_as_by_ruckig_from_no_acceleration(
    limits: AxisLimits, share: float, end_share: float, length_m: float
) -> None:
    velocity = share * (limits.speed_forward_m_s if share > 0.0 else limits.speed_backward_m_s)
    asked = (velocity, 0.0, length_m, end_share * limits.speed_forward_m_s, limits)
    assert_same(python_solver.to_position(*asked), ruckig_solver.to_position(*asked))


@quickly
@given(axis_limits, shares, beyond, st.floats(0.0, 1.0), lengths_m)
def test_a_position_is_reached_within_the_limits_from_any_acceleration(
    limits: AxisLimits, share: float, acceleration_share: float, end_share: float, length_m: float
) -> None:
    velocity = share * (limits.speed_forward_m_s if share > 0.0 else limits.speed_backward_m_s)
    acceleration = acceleration_share * limits.acceleration_m_s2
    relaxed = velocity + 0.5 * acceleration * abs(acceleration) / limits.jerk_m_s3
    target = end_share * limits.speed_forward_m_s
    ours = python_solver.to_position(velocity, acceleration, length_m, target, limits)
    (position,), (speed,), (end_acceleration,) = ours.at_time(ours.duration)
    assert position == pytest.approx(length_m, abs=1e-6)
    assert speed == pytest.approx(target, abs=1e-6)
    assert end_acceleration == pytest.approx(0.0, abs=1e-6)
    # A start beyond the limits is brought back inside, and no further beyond them.
    fastest = max(limits.speed_forward_m_s, velocity, relaxed)
    slowest = min(-limits.speed_backward_m_s, velocity, relaxed)
    farthest = -float("inf")
    for k in range(101):
        (position,), (speed,), (here,) = ours.at_time(ours.duration * k / 100.0)
        farthest = max(farthest, position)
        assert slowest - 1e-6 <= speed <= fastest + 1e-6
        assert abs(here) <= max(limits.acceleration_m_s2, abs(acceleration)) + 1e-6
    bound = ours.position_extrema[0].max
    assert farthest <= bound + 1e-6
    assert bound <= farthest + 0.02 * ours.duration * max(fastest, -slowest)


@quickly
@given(axis_limits, st.floats(0.0, 1.0), beyond, lengths_m)
def test_both_solvers_know_whether_a_start_passes_its_target(
    limits: AxisLimits, share: float, acceleration_share: float, length_m: float
) -> None:
    start = (share * limits.speed_forward_m_s, acceleration_share * limits.acceleration_m_s2)
    for solver in (python_solver, ruckig_solver):
        profile = solver.to_position(*start, length_m, 0.0, limits)
        times_s = [profile.duration * k / 200.0 for k in range(201)]
        farthest_m = max(profile.at_time(time_s)[0][0] for time_s in times_s)
        # Ruckig 0.19's bound may be too small, but not so small as to be before the target.
        if farthest_m > length_m + 1e-3:
            assert profile.position_extrema[0].max > length_m + 1e-6


@pytest.mark.night
def test_the_core_flies_without_ruckig(tmp_path: Path) -> None:
    hidden = "navigation_core.trajectories.ruckig_solver"
    environment = beside(hide([hidden], tmp_path))
    said = "from navigation_core.trajectories import motions; print(motions._SOLVER.NOTE)"
    note = subprocess.check_output([sys.executable, "-c", said], env=environment, text=True)
    assert "without Ruckig" in note
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-m", "not night"]
    names = ("trajectory", "goto", "routes", "pursuit", "avoidance")
    tests = ["tests/unit/core", *(f"tests/property/test_core_{name}.py" for name in names)]
    done = subprocess.run(
        [*command, *tests], cwd=ROOT, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout[-3000:]
