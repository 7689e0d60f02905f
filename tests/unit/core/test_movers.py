"""Moving obstacles are detected by hits in free space and predicted for two seconds."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from navigation_core.geometry import Vector3
from navigation_core.mapping.moving_obstacles import Moving
from navigation_core.mapping.obstacle_map import ObstacleMap, RayScan
from navigation_core.mapping.obstacles import Box, Cylinder, KnownObstacle, Obstacles
from tests.support.worlds.range_scanner import sectors

pytestmark = pytest.mark.wide_but_first


PERIOD_S, NOISE_M = 0.1, 0.02
STANDING: tuple[KnownObstacle, ...] = (
    Box("wall", (20.0, 0.0), (0.3, 60.0), 0.2),
    Cylinder("post", (3.0, 8.0), 0.6),
)


def scan_of(world: Obstacles, origin: Vector3, seed: int, nose_up_rad: float = 0.0) -> RayScan:
    """Return a scan with noise by a vehicle that turns a little."""
    scan = sectors(world, origin, yaw_rad=0.02 * seed, nose_up_rad=nose_up_rad)
    noise = np.random.default_rng(seed).normal(0.0, NOISE_M, len(scan.ranges_m))
    return replace(scan, ranges_m=scan.ranges_m + noise)


def watch(
    at: Callable[[float], tuple[float, float]],
    radius_m: float,
    duration_s: float,
    own_m_s: float = 0.0,
) -> ObstacleMap:
    """Look at a cylinder that moves before a wall, from a vehicle that flies east."""
    seen = ObstacleMap()
    for k in range(round(duration_s / PERIOD_S) + 1):
        now = k * PERIOD_S
        world = Obstacles.of((*STANDING, Cylinder("mover", at(now), radius_m)))
        seen.integrate(scan_of(world, (own_m_s * now, 0.0, 3.0), k), 0.0, now)
    return seen


def the_one(moving: tuple[Moving, ...]) -> tuple[float, float]:
    assert len(moving) == 1
    return moving[0].velocity_enu_m_s


@pytest.mark.parametrize("own_m_s", [0.0, 2.0])
@pytest.mark.parametrize(
    ("begin", "velocity", "radius_m"),
    [
        ((16.0, 0.0), (-1.5, 0.0), 0.5),
        ((4.0, 6.0), (1.0, -1.0), 0.3),
        ((10.0, -6.0), (0.0, 1.5), 0.5),
    ],
)
def test_the_velocity_of_what_moves_is_found(
    begin: tuple[float, float], velocity: tuple[float, float], radius_m: float, own_m_s: float
) -> None:
    def at(time_s: float) -> tuple[float, float]:
        return begin[0] + velocity[0] * time_s, begin[1] + velocity[1] * time_s

    found = the_one(watch(at, radius_m, 3.0, own_m_s).moving)
    assert math.dist(found, velocity) < 0.35


def test_what_comes_near_is_reported_within_two_seconds() -> None:
    seen = watch(lambda t: (12.0 - 1.5 * t, 0.0), 0.5, 2.0)
    assert math.dist(the_one(seen.moving), (-1.5, 0.0)) < 0.3


def test_what_comes_near_is_found_though_the_nose_rises_to_brake() -> None:
    """A place is seen free by a ray that is lower than the one that hits something there later."""
    seen, found = ObstacleMap(), []
    for k in range(21):
        now = k * PERIOD_S
        nose_up_rad = -0.35 if now < 1.0 else min(0.7 * (now - 1.0) - 0.35, 0.0)
        world = Obstacles.of((*STANDING, Cylinder("mover", (8.0 - 1.2 * now, 0.0), 0.8)))
        seen.integrate(scan_of(world, (1.5 * now, 0.0, 10.0), k, nose_up_rad), 0.0, now)
        found.append(len(seen.moving))
    assert found[12:] == [1] * 9


def test_what_has_just_come_into_view_may_go_anywhere() -> None:
    """A sector's width makes its first second look like another motion."""

    def uncertain_m_s(seen_s: float) -> list[float]:
        def at(time_s: float) -> tuple[float, float]:
            return (60.0, 0.0) if time_s < 1.0 else (10.0, 6.0 - 1.5 * (time_s - 1.0))

        return [one.uncertain_m_s for one in watch(at, 0.6, 1.0 + seen_s, 2.0).moving]

    assert uncertain_m_s(0.1) == []
    assert all(uncertain_m_s(seen_s) == [1.5] for seen_s in (0.3, 0.6, 0.9))
    assert uncertain_m_s(1.5) == [0.0]


def test_where_something_is_about_to_be_is_an_obstacle() -> None:
    seen = watch(lambda t: (12.0 - 1.5 * t, 0.0), 0.5, 2.0)
    ahead = np.array([[8.5 - 1.5 * t, 0.0, 3.0] for t in (0.5, 1.0, 1.5, 2.0)])
    clearances_m = seen.obstacles().clearance_m(ahead)
    assert (clearances_m < 0.3).all(), clearances_m
    # Not further than it is foretold, and not beside its way.
    others = np.array([[4.0, 0.0, 3.0], [7.0, 2.0, 3.0], [7.0, -2.0, 3.0]])
    assert (seen.obstacles().clearance_m(others) > 1.0).all()


def test_what_has_stopped_is_not_foretold_for_long() -> None:
    seen = watch(lambda t: (12.0 - 1.5 * min(t, 2.0), 0.0), 0.5, 4.5)
    assert seen.moving == ()
    assert float(seen.obstacles().clearance_m(np.array([[6.5, 0.0, 3.0]]))[0]) > 1.0


def test_a_map_that_is_cleared_forgets_what_moved() -> None:
    seen = watch(lambda t: (12.0 - 1.5 * t, 0.0), 0.5, 2.0)
    seen.clear()
    assert seen.moving == ()
    assert len(seen.obstacles()) == 0


@pytest.mark.parametrize("nose_up_rad", [0.0, -0.1])
def test_flying_past_what_stands_finds_nothing_that_moves(nose_up_rad: float) -> None:
    world = Obstacles.of(
        (
            Box("wall beside", (8.0, 4.0), (16.0, 0.3), 0.1),
            Box("wall ahead", (19.0, -4.0), (0.3, 9.0), 0.3),
            Cylinder("thick", (6.0, -3.0), 1.5),
            Cylinder("thin", (9.0, -2.0), 0.1),
            Cylinder("behind the wall", (12.0, 8.0), 1.0),
        )
    )
    seen = ObstacleMap()
    for k in range(45):
        now = k * PERIOD_S
        # It pitches into the flight, and its sensor looks at another height each time.
        tilt = nose_up_rad * math.sin(3.0 * now)
        scan = scan_of(world, (3.0 * now, 0.3 * math.sin(now), 3.0), k, tilt)
        seen.integrate(scan, 0.0, now)
        assert seen.moving == (), now


def test_points_of_a_cloud_tell_what_moves_too() -> None:
    seen = ObstacleMap()
    angles = np.arange(0.0, 2.0 * math.pi, 0.02)
    for k in range(21):
        now = k * PERIOD_S
        ring = sectors(Obstacles.of((Cylinder("mover", (12.0 - 1.5 * now, 0.0), 0.5),)), (0, 0, 3))
        near = np.isfinite(ring.ranges_m)
        mover = ring.ranges_m[near, None] * ring.directions_enu[near]
        # A round wall all about it: where nothing is hit a cloud says nothing.
        wall = 20.0 * np.stack([np.cos(angles), np.sin(angles), 0.0 * angles], axis=1)
        hidden = np.abs(np.arctan2(wall[:, 1], wall[:, 0])) < math.atan2(0.5, 12.0 - 1.5 * now)
        points = np.concatenate([mover, wall[~hidden]]) + np.array((0.0, 0.0, 3.0))
        seen.integrate_points((0.0, 0.0, 3.0), points, 0.0, now)
    assert math.dist(the_one(seen.moving), (-1.5, 0.0)) < 0.3


def test_one_beam_alone_shows_no_motion() -> None:
    seen = ObstacleMap()
    for k in range(40):
        now = k * PERIOD_S
        forward = np.array([(1.0, 0.0, 0.0)])
        ranges = np.array([12.0 - 1.5 * now])
        seen.integrate(RayScan((0.0, 0.0, 3.0), forward, ranges, 0.2, 40.0, 0.05), 0.0, now)
    assert seen.moving == ()
