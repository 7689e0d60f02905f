"""The obstacle map: evidence accumulates, fades, and moves with the vehicle."""

from __future__ import annotations

import math
import tracemalloc
from dataclasses import replace

import numpy as np
import pytest

from navigation_core.geometry import Vector3
from navigation_core.mapping.evidence_columns import Columns
from navigation_core.mapping.obstacle_map import ObstacleMap, RayScan
from navigation_core.mapping.obstacles import (
    NOTHING,
    Array,
    Box,
    Cylinder,
    KnownObstacle,
    Obstacles,
)
from tests.support.worlds.range_scanner import level_ring, pitched, ranges_m, sectors

UP: Vector3 = (0.0, 0.0, 5.0)
POST = Cylinder("post", (10.0, 0.0), 0.3)
THIN_POST = Cylinder("thin post", (20.0, 1.0), 0.1)
HOUSE = Box("house", (15.0, 0.0), (4.0, 10.0), 0.0, 0.0, 8.0)


def look(
    world: KnownObstacle | Obstacles,
    origin: Vector3 = UP,
    times: int = 3,
    into: ObstacleMap | None = None,
    nose_up_rad: float = 0.0,
) -> ObstacleMap:
    """Scan a world some times, from one place."""
    seen = into or ObstacleMap()
    known = world if isinstance(world, Obstacles) else Obstacles.of((world,))
    scan = sectors(known, origin, nose_up_rad=nose_up_rad)
    for _ in range(times):
        seen.integrate(scan, 0.0, 0.0)
    return seen


def clearance(obstacles: Obstacles, *point: float) -> float:
    return float(obstacles.clearance_m(np.array([point]))[0])


def beam(
    direction: Vector3, range_m: float, origin: Vector3 = UP, half_angle_rad: float = 0.02
) -> RayScan:
    return RayScan(origin, np.array([direction]), np.array([range_m]), 0.2, 40.0, half_angle_rad)


def test_a_single_hit_is_no_obstacle_a_second_one_is() -> None:
    assert len(look(POST, times=1).obstacles()) == 0
    assert clearance(look(POST, times=2).obstacles(), 9.7, 0.0, 5.0) == 0.0


def test_what_was_hit_is_found_where_it_is() -> None:
    obstacles = look(HOUSE).obstacles()
    assert clearance(obstacles, 13.0, 0.0, 5.0) < 0.3
    assert clearance(obstacles, 13.0, 4.5, 5.0) < 0.3
    assert clearance(obstacles, 11.5, 0.0, 5.0) > 1.0
    # The space behind its front is unknown, and so are places to which nobody looked.
    assert clearance(obstacles, 17.0, 0.0, 5.0) > 1.0
    assert clearance(obstacles, -10.0, 0.0, 5.0) > 20.0


def test_a_front_has_no_holes_at_a_distance_either() -> None:
    wall = Box("wall", (25.0, 0.0), (0.5, 16.0))
    obstacles = look(wall).obstacles()
    along = np.array([(24.75, y, 5.0) for y in np.arange(-7.0, 7.0, 0.1)])
    assert obstacles.clearance_m(along).max() < 0.4


def test_sectors_that_are_wide_at_their_distance_do_not_fill_the_place_between_two_hits() -> None:
    bearings = np.radians([-2.5, 2.5])
    directions = np.stack([np.cos(bearings), np.sin(bearings), 0.0 * bearings], axis=1)
    for away_m, fills in ((20.0, True), (38.0, False)):
        seen = ObstacleMap()
        scan = RayScan(UP, directions, np.full(2, away_m), 0.1, 40.0, math.radians(2.5))
        for number in range(5):
            seen.integrate(scan, 0.0, 0.1 * number)
        assert (clearance(seen.obstacles(), away_m, 0.0, 5.0) < 0.3) == fills


def test_a_thin_post_at_20_m_is_kept() -> None:
    seen = look(THIN_POST, times=2)
    for scans in (1, 10, 30):
        look(THIN_POST, times=scans, into=seen)
        assert clearance(seen.obstacles(), 20.0, 1.0, 5.0) < 1.0


def test_a_gap_of_3_m_between_two_walls_at_15_m_stays_open() -> None:
    walls = Obstacles.of(
        (Box("left", (15.0, 11.5), (0.5, 20.0)), Box("right", (15.0, -11.5), (0.5, 20.0)))
    )
    seen = ObstacleMap()
    for scan in range(25):
        yaw = math.radians(10.0) * math.sin(0.3 * scan)
        seen.integrate(sectors(walls, UP, yaw), 0.0, 0.0)
    assert seen.obstacles().is_clear((0.0, 0.0, 5.0), (20.0, 0.0, 5.0), 0.6)
    assert not seen.obstacles().is_clear((0.0, 3.0, 5.0), (20.0, 3.0, 5.0), 0.5)
    for east_m in np.arange(0.0, 10.0, 0.5):
        seen.integrate(sectors(walls, (float(east_m), 0.0, 5.0)), 0.0, 0.0)
    assert seen.obstacles().is_clear((0.0, 0.0, 5.0), (20.0, 0.0, 5.0), 0.8)


def test_what_has_moved_frees_its_place_within_six_scans_and_not_within_two() -> None:
    seen = look(POST, times=20)
    look(NOTHING, times=2, into=seen)
    assert clearance(seen.obstacles(), 9.7, 0.0, 5.0) == 0.0
    look(NOTHING, times=4, into=seen)
    assert len(seen.obstacles()) == 0


def test_it_frees_its_place_however_the_vehicle_pitches() -> None:
    seen = ObstacleMap()
    for pitch in (-0.05, 0.0, 0.03):
        look(POST, into=seen, nose_up_rad=pitch)
    for pitch in (0.06, -0.02, 0.08, 0.02, -0.07, 0.0, 0.05):
        look(NOTHING, times=1, into=seen, nose_up_rad=pitch)
    assert len(seen.obstacles()) == 0


def test_an_obstacle_that_walks_leaves_no_trail() -> None:
    seen = ObstacleMap()
    for step in range(60):
        walker = Cylinder("walker", (12.0, -6.0 + 0.2 * step), 0.4)
        look(walker, times=1, into=seen)
    obstacles = seen.obstacles()
    assert clearance(obstacles, 11.6, 5.8, 5.0) < 0.5
    assert clearance(obstacles, 11.6, 2.0, 5.0) > 1.0


def test_stray_beams_delete_no_wall_and_build_none() -> None:
    seen = look(HOUSE, times=5)
    before = seen.obstacles()
    rng = np.random.default_rng(3)
    scan = sectors(Obstacles.of((HOUSE,)), UP)
    for _ in range(100):
        ranges = scan.ranges_m.copy()
        ranges[rng.integers(72)] = np.inf
        ranges[rng.integers(72)] = rng.uniform(1.0, 40.0)
        seen.integrate(replace(scan, ranges_m=ranges), 0.0, 0.0)
        front = clearance(seen.obstacles(), 13.0, 0.0, 5.0)
        assert front < 0.3
    assert abs(len(seen.obstacles()) - len(before)) <= 5


def test_the_same_object_is_returned_until_something_has_changed() -> None:
    seen = look(HOUSE, times=5)
    before = seen.obstacles()
    look(HOUSE, times=5, into=seen)
    assert seen.obstacles() is before
    look(POST, times=2, into=seen)
    assert seen.obstacles() is not before


def test_noise_in_the_ranges_moves_no_more_than_an_edge_now_and_then() -> None:
    seen, rng, changes = ObstacleMap(), np.random.default_rng(5), 0
    still = sectors(Obstacles.of((HOUSE, THIN_POST, POST)), UP)
    for scan in range(200):
        noisy = replace(still, ranges_m=still.ranges_m + rng.normal(0.0, 0.05, 72))
        before = seen.obstacles()
        seen.integrate(noisy, 0.0, 0.0)
        if scan >= 100:
            changes += seen.obstacles() is not before
            assert abs(len(seen.obstacles()) - len(before)) <= 2
    assert changes <= 20


def test_a_scanner_knows_nothing_of_heights() -> None:
    obstacles = look(HOUSE).obstacles()
    assert np.isneginf(obstacles.posts[:, 3]).all()
    assert np.isposinf(obstacles.posts[:, 4]).all()


def test_rays_that_go_over_bring_the_top_down_to_them() -> None:
    seen = look(HOUSE)
    look(HOUSE, (0.0, 0.0, 9.0), times=1, into=seen)
    assert np.isposinf(seen.obstacles().posts[:, 4]).all(), "one ray may be a stray one"
    look(HOUSE, (0.0, 0.0, 9.0), times=1, into=seen)
    np.testing.assert_allclose(seen.obstacles().posts[:, 4], 9.0)
    assert np.isneginf(seen.obstacles().posts[:, 3]).all()
    look(HOUSE, (0.0, 0.0, 8.6), times=2, into=seen)
    np.testing.assert_allclose(seen.obstacles().posts[:, 4], 8.75)


def test_a_hit_above_the_top_makes_it_endless_again() -> None:
    tower = Box("tower", (15.0, 0.0), (4.0, 10.0), 0.0, 0.0, 30.0)
    seen = look(HOUSE)
    look(HOUSE, (0.0, 0.0, 9.0), times=2, into=seen)
    look(tower, (0.0, 0.0, 12.0), times=2, into=seen)
    assert np.isposinf(seen.obstacles().posts[:, 4]).any()


def test_what_rays_go_under_begins_just_below_where_it_was_hit() -> None:
    bridge = Box("bridge", (15.0, 0.0), (4.0, 30.0), 0.0, 6.0, 8.0)
    seen = look(bridge, (0.0, 0.0, 7.0))
    look(bridge, (0.0, 0.0, 3.0), times=2, into=seen)
    posts = seen.obstacles().posts
    ahead = posts[np.abs(posts[:, 1]) < 4.0]
    np.testing.assert_allclose(ahead[:, 3], 6.5)
    assert np.isposinf(ahead[:, 4]).all()
    assert seen.obstacles().is_clear((0.0, 0.0, 3.0), (30.0, 0.0, 3.0), 1.5)


@pytest.mark.parametrize("pitch", [-0.3, -0.15])
def test_the_ground_that_a_pitched_scanner_meets_is_no_obstacle(pitch: float) -> None:
    ground = Obstacles.of((Box("ground", (0.0, 0.0), (400.0, 400.0), 0.0, -9.0, 0.0),))
    assert np.isfinite(sectors(ground, UP, nose_up_rad=pitch).ranges_m).any()
    assert len(look(ground, nose_up_rad=pitch).obstacles()) == 0


def test_a_scanner_near_the_ground_sees_what_is_near_the_ground() -> None:
    kerb = Box("kerb", (6.0, 0.0), (0.5, 4.0), 0.0, 0.0, 0.4)
    assert clearance(look(kerb, (0.0, 0.0, 0.2)).obstacles(), 5.75, 0.0, 0.2) < 0.3


def test_a_beam_that_looks_down_finds_no_obstacles() -> None:
    seen = ObstacleMap()
    for height_m in np.arange(0.5, 12.0, 0.25):
        for tilt in (0.0, 0.2, 0.4):
            down = (math.sin(tilt), 0.0, -math.cos(tilt))
            origin = (0.0, 0.0, float(height_m))
            seen.integrate(beam(down, float(height_m) / math.cos(tilt), origin), None, 0.0)
    assert len(seen.obstacles()) == 0


def test_a_single_beam_is_a_scan() -> None:
    seen = ObstacleMap()
    for _ in range(2):
        seen.integrate(beam((0.0, 1.0, 0.0), 6.0), 0.0, 0.0)
    assert clearance(seen.obstacles(), 0.0, 6.0, 5.0) == 0.0
    for _ in range(5):
        seen.integrate(beam((0.0, 1.0, 0.0), math.inf), 0.0, 0.0)
    assert len(seen.obstacles()) == 0


@pytest.mark.parametrize("tells_nothing", [math.nan, 0.1, 0.0, -1.0, -math.inf])
def test_a_reading_without_information_changes_nothing(tells_nothing: float) -> None:
    seen = look(POST)
    before = seen.obstacles()
    for _ in range(10):
        seen.integrate(beam((1.0, 0.0, 0.0), tells_nothing), 0.0, 0.0)
    assert seen.obstacles() is before


def test_more_than_the_reach_is_free_as_far_as_the_reach() -> None:
    seen = look(Obstacles.of((POST, Cylinder("far", (30.0, 0.0), 0.3), THIN_POST)))
    look(Obstacles.of((Cylinder("far", (30.0, 0.0), 0.3),)), times=3, into=seen)
    for _ in range(6):
        seen.integrate(
            replace(beam((1.0, 0.0, 0.0), 99.0, half_angle_rad=0.08), range_max_m=15.0), 0.0, 0.0
        )
    assert clearance(seen.obstacles(), 9.7, 0.0, 5.0) > 5.0
    assert clearance(seen.obstacles(), 29.7, 0.0, 5.0) < 0.3


def test_the_vehicle_itself_is_no_obstacle() -> None:
    seen = ObstacleMap(own_radius_m=0.6)
    for _ in range(5):
        seen.integrate(beam((1.0, 0.0, 0.0), 0.55), 0.0, 0.0)
        seen.integrate_points(UP, np.array([[0.3, 0.2, 5.1], [0.0, 0.0, 5.0]]), 0.0, 0.0)
    assert len(seen.obstacles()) == 0


def test_a_turned_sensor_finds_the_same_place() -> None:
    turned = ObstacleMap()
    for yaw in (0.3, 0.3, 0.3):
        turned.integrate(sectors(Obstacles.of((POST,)), UP, yaw), 0.0, 0.0)
    assert clearance(turned.obstacles(), 9.7, 0.0, 5.0) < 0.3


def test_the_window_rolls_and_keeps_what_is_in_it_in_its_place() -> None:
    seen = look(POST)
    before = seen.obstacles().posts
    for east_m in np.arange(0.0, 49.0, 0.3):
        seen.recentre((float(east_m), -20.0, 5.0))
    order = np.lexsort(before.T)
    after = seen.obstacles().posts
    np.testing.assert_allclose(after[np.lexsort(after.T)], before[order])
    seen.recentre((51.0, -20.0, 5.0))
    assert len(seen.obstacles()) == 0
    seen.recentre((0.0, 0.0, 5.0))
    assert len(seen.obstacles()) == 0, "what has left is forgotten"


def test_a_jump_forgets_everything() -> None:
    seen = look(POST)
    seen.recentre((5000.0, -7000.0, 0.0))
    assert len(seen.obstacles()) == 0
    seen.integrate(
        replace(beam((1.0, 0.0, 0.0), 6.0), origin_enu_m=(5000.0, -7000.0, 5.0)), 0.0, 0.0
    )
    seen.integrate(
        replace(beam((1.0, 0.0, 0.0), 6.0), origin_enu_m=(5000.0, -7000.0, 5.0)), 0.0, 0.0
    )
    assert clearance(seen.obstacles(), 5006.0, -7000.0, 5.0) == 0.0


def test_what_is_outside_the_window_is_not_kept() -> None:
    seen = ObstacleMap(size_m=15.0)
    look(POST, into=seen)
    assert len(seen.obstacles()) == 0


def test_clear_forgets_everything() -> None:
    seen = look(POST)
    seen.clear()
    assert len(seen.obstacles()) == 0


def cloud(world: KnownObstacle, origin: Vector3 = UP) -> Array:
    """Return what a sensor with 31 layers hits."""
    rays = np.concatenate([pitched(level_ring(180), float(a)) for a in np.linspace(-0.5, 0.5, 31)])
    ranges = ranges_m(Obstacles.of((world,)), origin, rays, 40.0)
    hits = np.isfinite(ranges)
    return np.asarray(np.array(origin) + ranges[hits, None] * rays[hits])


def test_a_cloud_knows_heights() -> None:
    low = Box("low", (8.0, 0.0), (1.0, 6.0), 0.0, 1.5, 4.0)
    seen = ObstacleMap()
    points = cloud(low)
    for _ in range(2):
        seen.integrate_points(UP, points, 0.0, 0.0)
    assert seen.obstacles().posts[:, 4].max() <= 4.5
    assert seen.obstacles().posts[:, 3].min() >= 0.75
    assert clearance(seen.obstacles(), 7.5, 0.0, 3.0) < 0.3
    assert clearance(seen.obstacles(), 7.5, 0.0, 6.0) > 1.0


def test_a_cloud_that_goes_through_frees_the_place() -> None:
    seen = ObstacleMap()
    post, back = cloud(POST), cloud(Box("back", (20.0, 0.0), (1.0, 30.0)))
    for _ in range(5):
        seen.integrate_points(UP, post, 0.0, 0.0)
    assert clearance(seen.obstacles(), 9.7, 0.0, 5.0) < 0.3
    for _ in range(6):
        seen.integrate_points(UP, back, 0.0, 0.0)
    assert clearance(seen.obstacles(), 9.7, 0.0, 5.0) > 5.0


def test_the_ground_in_a_cloud_is_no_obstacle() -> None:
    seen = ObstacleMap()
    ground = Box("ground", (0.0, 0.0), (400.0, 400.0), 0.0, -9.0, 0.0)
    points = cloud(ground)
    assert len(points) > 1000
    for _ in range(5):
        seen.integrate_points(UP, points, 0.0, 0.0)
    assert len(seen.obstacles()) == 0


def test_points_that_are_not_numbers_are_left_out() -> None:
    seen = ObstacleMap()
    points = np.array([[math.nan, 1.0, 5.0], [3.0, math.inf, 5.0], [6.0, 0.0, 5.0]])
    for _ in range(2):
        seen.integrate_points(UP, points, 0.0, 0.0)
        seen.integrate_points(UP, np.empty((0, 3)), 0.0, 0.0)
    assert clearance(seen.obstacles(), 6.0, 0.0, 5.0) == 0.0
    assert clearance(seen.obstacles(), 3.0, 0.0, 5.0) > 2.0


def test_only_what_was_hit_takes_memory_however_large_the_window_is() -> None:
    tracemalloc.start()
    try:
        look(POST, into=ObstacleMap(size_m=1000.0))
        _, most = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert most < 4_000_000  # a flag for each of its columns is 16 MB


def test_a_column_without_a_hit_has_no_known_ends() -> None:
    columns = Columns(20.0, 0.5)
    numbers, _ = columns.find(np.array([1.0, 3.0]), np.array([2.0, 4.0]))
    columns.hit(numbers[1:], np.array([5.0]), np.ones(1), 0.5)
    bottoms, tops = columns.ends_m(numbers)
    assert bottoms.tolist() == [-math.inf, 4.5]
    assert tops.tolist() == [math.inf, 5.5]


@pytest.mark.parametrize(
    ("nose_up_deg", "height_m", "course_rad", "sees_m"),
    [
        (0.0, 3.0, 0.0, 20.0),
        (-25.0, 3.0, 0.0, 3.0 / math.tan(math.radians(25.0))),
        (-25.0, 3.0, math.pi, 20.0 * math.cos(math.radians(25.0))),
        (25.0, 3.0, 0.0, 20.0 * math.cos(math.radians(25.0))),
        (-25.0, 30.0, 0.0, 20.0 * math.cos(math.radians(25.0))),
    ],
)
def test_a_tilted_scanner_sees_as_far_as_the_ground_ahead(
    nose_up_deg: float, height_m: float, course_rad: float, sees_m: float
) -> None:
    directions = pitched(level_ring(72), math.radians(nose_up_deg))
    scan = RayScan((0.0, 0.0, height_m), directions, np.full(72, 99.0), 0.2, 20.0, 0.04)
    assert scan.sight_m(course_rad, 0.0) == pytest.approx(sees_m, rel=0.03)
    assert scan.sight_m(course_rad, None) == 20.0
