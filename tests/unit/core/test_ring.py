"""Motions along a circle: where they lead, how fast they may be, and that they fit together."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from navigation_core.geometry import KinematicState, Vector3, distance
from navigation_core.limits import Limits
from navigation_core.mapping.obstacle_shapes import Cylinder
from navigation_core.mapping.obstacles import NOTHING, Obstacles
from navigation_core.tasks.leading.ring_path import free_turn_rad
from navigation_core.trajectories.ring import Ring, plan_ring, ring_speed_m_s
from navigation_core.trajectories.trajectory import plan_to

CENTRE: Vector3 = (5.0, -3.0, 12.0)
LIMITS = Limits()


@pytest.mark.parametrize("radius_m", [2.0, 20.0, 300.0])
@pytest.mark.parametrize("anticlockwise", [True, False])
@pytest.mark.parametrize("laps", [0.01, 0.5, 1.0, 2.75])
def test_it_goes_round_from_rest_to_rest_within_its_limits(
    radius_m: float, anticlockwise: bool, laps: float
) -> None:
    ring = Ring(CENTRE, radius_m, anticlockwise)
    speed_m_s = min(ring_speed_m_s(LIMITS, radius_m, turns=True), LIMITS.speed_horizontal_m_s)
    limits = Limits(speed_horizontal_m_s=speed_m_s)
    motion = plan_ring(ring, 1.0, math.tau * laps, limits)
    end_rad = 1.0 + ring.sign * math.tau * (laps - motion.windings)
    assert motion.trajectory.end_position_enu_m == pytest.approx(ring.point(end_rad), abs=1e-6)
    times_s = np.linspace(0.0, motion.trajectory.duration_s, 2000)
    places, velocities, accelerations = motion.trajectory.samples(times_s)
    assert np.abs(np.hypot(*(places - CENTRE).T[:2]) - radius_m).max() < 1e-9
    assert np.abs(velocities[[0, -1]]).max() < 1e-6
    assert np.linalg.norm(velocities, axis=1).max() <= speed_m_s + 1e-9
    assert np.linalg.norm(accelerations, axis=1).max() <= LIMITS.acceleration_horizontal_m_s2 + 1e-6
    # The velocity is the derivative of the position, and the acceleration that of the velocity.
    step_s = times_s[1] - times_s[0]
    coarse = LIMITS.jerk_m_s3 * step_s
    off = np.abs(np.gradient(places, step_s, axis=0) - velocities)[1:-1]
    assert off.max() < coarse * step_s + 1e-3
    off = np.abs(np.gradient(velocities, step_s, axis=0) - accelerations)[1:-1]
    assert off.max() < coarse + 1e-2
    for time_s in times_s[::100]:
        state = motion.trajectory.sample(float(time_s))
        row = int(np.searchsorted(times_s, time_s))
        assert state.velocity_enu_m_s == pytest.approx(tuple(velocities[row]), abs=1e-9)
        turned = np.cross(places[row] - CENTRE, velocities[row])[2]
        assert turned * ring.sign >= -1e-9


@pytest.mark.parametrize("laps", [7.5, math.inf])
def test_a_motion_of_many_laps_is_in_the_same_state_a_lap_later(laps: float) -> None:
    motion = plan_ring(Ring(CENTRE, 10.0), 0.3, math.tau * laps, LIMITS)
    assert motion.windings == (5.0 if math.isfinite(laps) else math.inf)
    for time_s in np.linspace(motion.steady_s, motion.steady_s + motion.lap_s, 20):
        now = motion.trajectory.sample(float(time_s))
        later = motion.trajectory.sample(float(time_s) + motion.lap_s)
        assert distance(now.position_enu_m, later.position_enu_m) < 1e-6
        assert distance(now.velocity_enu_m_s, later.velocity_enu_m_s) < 1e-6
        assert distance(now.acceleration_enu_m_s2, later.acceleration_enu_m_s2) < 1e-6
    # At least a lap and the brake are left to look at when it is wound back.
    assert motion.trajectory.duration_s >= motion.steady_s + 2.0 * motion.lap_s


def test_after_another_motion_it_begins_where_that_ends() -> None:
    ring = Ring(CENTRE, 10.0)
    before = plan_to(KinematicState((0.0, 0.0, 12.0)), ring.point(0.0), LIMITS)
    motion = plan_ring(ring, 0.0, math.tau, LIMITS)
    both = motion.after(before)
    assert both.trajectory.duration_s == before.duration_s + motion.trajectory.duration_s
    assert both.steady_s == before.duration_s + motion.steady_s
    joint = both.trajectory.sample(before.duration_s)
    assert distance(joint.position_enu_m, ring.point(0.0)) < 1e-6


@pytest.mark.parametrize("anticlockwise", [True, False])
@pytest.mark.parametrize("place", [(40.0, 0.0, 0.0), (-20.0, 30.0, 0.0), (5.0, -14.0, 0.0)])
def test_it_is_entered_along_its_tangent_from_outside(place: Vector3, anticlockwise: bool) -> None:
    ring = Ring(CENTRE, 10.0, anticlockwise)
    angle = ring.entry_rad(place)
    east, north, _ = (a - b for a, b in zip(ring.point(angle), place, strict=True))
    heading = math.atan2(north, east)
    assert abs(math.remainder(heading - ring.tangent_rad(angle), math.tau)) < 1e-6


@pytest.mark.parametrize("place", [(8.0, -3.0, 0.0), CENTRE])
def test_from_inside_it_is_entered_where_it_is_nearest(place: Vector3) -> None:
    ring = Ring(CENTRE, 10.0)
    entry = ring.point(ring.entry_rad(place))
    away_m = math.hypot(place[0] - CENTRE[0], place[1] - CENTRE[1])
    assert math.dist(entry[:2], place[:2]) == pytest.approx(10.0 - away_m)


def test_the_acceleration_and_the_yaw_rate_bound_the_speed() -> None:
    slow = ring_speed_m_s(LIMITS, 5.0, turns=False)
    assert slow**2 / 5.0 == pytest.approx(0.8 * LIMITS.acceleration_horizontal_m_s2)
    lazy = Limits(yaw_rate_rad_s=0.1)
    assert ring_speed_m_s(lazy, 5.0, turns=True) == pytest.approx(0.5)
    assert ring_speed_m_s(lazy, 5.0, turns=False) == pytest.approx(slow)


def test_it_is_free_up_to_the_obstacle_that_stands_on_it() -> None:
    ring = Ring((0.0, 0.0, 5.0), 20.0)
    post = Obstacles.of((Cylinder("post", (0.0, 20.0), 0.5),))
    assert free_turn_rad(ring, 0.0, math.tau, NOTHING, 1.0) == math.tau
    free_rad = free_turn_rad(ring, 0.0, math.tau, post, 1.0)
    gap_m = math.dist(ring.point(free_rad)[:2], (0.0, 20.0)) - 0.5
    assert 1.0 <= gap_m < 2.5
    back = Ring((0.0, 0.0, 5.0), 20.0, anticlockwise=False)
    assert free_turn_rad(back, 0.0, math.pi, post, 1.0) == math.pi
    ends = [free_turn_rad(ring, start, math.tau, post, 1.0) for start in (0.0, 0.5, 1.0)]
    assert free_turn_rad(ring, 0.5 * math.pi, 1.0, post, 1.0) == 0.0
    assert all(later < earlier for earlier, later in itertools.pairwise(ends))


def test_its_error_is_positive_outside() -> None:
    ring = Ring(CENTRE, 10.0)
    assert ring.error_m((5.0, 9.0, 0.0)) == pytest.approx(2.0)
    assert ring.error_m(CENTRE) == pytest.approx(-10.0)
