"""A corner that hides something is passed slowly; one that hides nothing is no reason to."""

from __future__ import annotations

import math

import pytest

from navigation_core.geometry import Vector3
from navigation_core.limits import stopping_speed_m_s
from navigation_core.mapping.obstacle_map import ObstacleMap
from navigation_core.mapping.obstacles import Box, Cylinder, KnownObstacle, Obstacles
from navigation_core.safety.hidden_corners import speed_past_corners_m_s
from tests.support.worlds.range_scanner import sectors

HEIGHT_M, REACTION_S, BRAKING_M_S2 = 5.0, 0.3, 2.5
# Across the way on its south side, and another one behind it.
WALL = Box("wall", (8.0, -7.0), (1.0, 10.0), 0.0)


def corners_seen(
    *obstacles: KnownObstacle, origin: Vector3 = (0.0, 0.0, HEIGHT_M)
) -> list[Vector3]:
    seen = ObstacleMap()
    seen.integrate(sectors(Obstacles.of(obstacles), origin), 0.0, 0.0)
    return [(east, north, HEIGHT_M) for east, north in seen.corners_enu_m]


def speed_m_s(
    corners: tuple[tuple[float, float], ...], place: Vector3, velocity: Vector3 = (5.0, 0.0, 0.0)
) -> float:
    return speed_past_corners_m_s(place, velocity, corners, REACTION_S, BRAKING_M_S2)


def test_the_end_of_a_wall_hides_something() -> None:
    places = corners_seen(WALL)
    assert any(math.dist(one, (7.5, -2.0, HEIGHT_M)) < 0.8 for one in places), places


def test_a_thin_post_and_what_is_open_hide_nothing() -> None:
    assert corners_seen(Cylinder("post", (6.0, 2.0), 0.2)) == []
    assert corners_seen() == []


def test_a_wall_right_behind_leaves_no_room_to_hide() -> None:
    behind = Box("behind", (9.5, 0.0), (1.0, 60.0), 0.0)
    places = corners_seen(WALL, behind)
    assert not any(math.dist(one, (7.5, -2.0, HEIGHT_M)) < 0.8 for one in places), places


@pytest.mark.parametrize(("east_m", "room_m"), [(0.0, math.hypot(7.5, 2.0)), (6.5, math.sqrt(5.0))])
def test_the_vehicle_could_stop_within_the_distance_to_it(east_m: float, room_m: float) -> None:
    allowed_m_s = speed_m_s(((7.5, -2.0),), (east_m, 0.0, HEIGHT_M))
    assert allowed_m_s == pytest.approx(stopping_speed_m_s(room_m, REACTION_S, BRAKING_M_S2))


@pytest.mark.parametrize(
    ("corner", "velocity"),
    [
        ((-0.5, -2.0), (5.0, 0.0, 0.0)),  # behind
        ((7.5, -5.0), (5.0, 0.0, 0.0)),  # far aside
        ((7.5, -2.0), (0.0, 0.0, 1.0)),  # straight up
    ],
)
def test_any_speed_is_right_elsewhere(corner: tuple[float, float], velocity: Vector3) -> None:
    assert speed_m_s((corner,), (0.0, 0.0, HEIGHT_M), velocity) == math.inf
    assert speed_m_s((), (0.0, 0.0, HEIGHT_M), velocity) == math.inf
