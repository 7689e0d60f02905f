"""The path of a trajectory as a ground vehicle follows it."""

from __future__ import annotations

import math

import pytest

from navigation_core.geometry import KinematicState
from navigation_core.limits import Limits
from navigation_core.tasks.leading.driven_path import DrivenPath
from navigation_core.trajectories.route_trajectory import RoutePoint, plan_route
from navigation_core.trajectories.trajectory import plan_to

LIMITS = Limits(speed_horizontal_m_s=3.0, acceleration_horizontal_m_s2=1.0)
BRAKING_M_S2 = 0.6


def straight() -> DrivenPath:
    """Twenty metres to the east."""
    trajectory = plan_to(KinematicState((0.0, 0.0, 0.0)), (20.0, 0.0, 0.0), LIMITS)
    return DrivenPath(trajectory, BRAKING_M_S2)


def corner(back: bool = False) -> DrivenPath:
    """Twenty metres to the east, and twenty to the north, or back again."""
    end = (0.0, 0.5, 0.0) if back else (20.0, 20.0, 0.0)
    points = [RoutePoint((20.0, 0.0, 0.0), 0.25, LIMITS), RoutePoint(end, 0.0, LIMITS)]
    route = plan_route(KinematicState((0.0, 0.0, 0.0)), points)
    return DrivenPath(route.trajectory, BRAKING_M_S2)


def test_a_place_beside_the_path_counts_where_it_is_nearest() -> None:
    path = straight()
    for x, y in [(0.5, 1.0), (2.0, -1.5), (3.5, 0.0), (5.0, 2.0)]:
        path.advance((x, y, 0.0))
        assert path.left_m == pytest.approx(20.0 - x, abs=0.01)
    assert path.ahead(3.0) == pytest.approx((8.0, 0.0, 0.0), abs=0.01)


def test_it_never_goes_back() -> None:
    path = straight()
    path.advance((1.5, 0.0, 0.0))
    path.advance((-3.0, 0.0, 0.0))
    assert path.left_m == pytest.approx(18.5, abs=0.01)


def test_the_end_is_never_looked_beyond() -> None:
    path = straight()
    assert path.ahead(100.0) == pytest.approx((20.0, 0.0, 0.0))
    for step in range(200):
        path.advance((0.1 * step, 0.0, 0.0))
    path.advance((25.0, 0.0, 0.0))
    assert path.left_m == 0.0
    assert path.ahead(1.0) == pytest.approx((20.0, 0.0, 0.0))


def test_a_straight_path_limits_no_speed_wherever_its_trajectory_is_slow() -> None:
    """It begins at rest and ends at rest; how to do that is the business of who drives."""
    path = straight()
    for step in range(200):
        path.advance((0.1 * step, 0.0, 0.0))
        assert path.speed_m_s > 2.9


def test_a_corner_is_braked_for_in_time_and_left_at_once() -> None:
    path = corner()
    allowed: list[float] = []
    for step in range(200):
        path.advance((0.1 * step, 0.0, 0.0))
        allowed.append(path.speed_m_s)
    assert allowed[50] > 2.9
    slowest = min(allowed)
    assert slowest < 1.0
    braked = [slowest**2 + 2.0 * BRAKING_M_S2 * (20.0 - 0.1 * step) for step in range(200)]
    assert all(speed <= math.sqrt(most) + 0.1 for speed, most in zip(allowed, braked, strict=True))
    for step in range(10):
        path.advance((20.0, 0.2 * step, 0.0))
    assert path.speed_m_s > 2.9, "faster than the trajectory, which speeds up from the corner"


def test_a_path_that_comes_back_is_not_cut_short() -> None:
    path = corner(back=True)
    for step in range(150):
        path.advance((0.1 * step, 0.1, 0.0))
    assert path.left_m == pytest.approx(25.0, abs=0.5)


def test_it_can_be_kept_from_looking_beyond_a_moment() -> None:
    path = corner()
    path.advance((1.0, 0.0, 0.0))
    route_s = 0.5 * 40.0 / 3.0
    path.limit(route_s)
    assert path.ahead_m < 20.0
    assert path.ahead(100.0)[1] == pytest.approx(0.0, abs=0.3)
    path.limit(math.inf)
    assert path.ahead(100.0) == pytest.approx((20.0, 20.0, 0.0))


def test_beyond_where_it_may_look_that_place_is_behind_it() -> None:
    """A point beside it would be headed for, and left, for as long as it drives."""
    path = corner()
    for step in range(100):
        path.advance((0.15 * step, 0.0, 0.0))
    path.limit(0.2 * 40.0 / 3.0)
    assert path.ahead_m == 0.0
    assert path.ahead(0.0)[0] < 10.0
    assert path.ahead(5.0) == path.ahead(0.0)


def test_it_does_not_get_beyond_where_it_may_look() -> None:
    """Where the path turns back, what follows is as near as what leads there."""
    points = [RoutePoint((20.0, 0.0, 0.0), 0.25, LIMITS), RoutePoint((0.0, 0.5, 0.0), 0.0, LIMITS)]
    route = plan_route(KinematicState((0.0, 0.0, 0.0)), points)
    path = DrivenPath(route.trajectory, BRAKING_M_S2)
    path.limit(route.passed_s[0])
    for step in range(400):
        path.advance((min(0.1 * step, 18.5), 0.3, 0.0))
    assert path.time_s < route.passed_s[0], "it is not there yet"
    for step in range(20):
        path.advance((18.5 + 0.1 * step, 0.2, 0.0))
    assert path.time_s >= route.passed_s[0], "and now it is"
