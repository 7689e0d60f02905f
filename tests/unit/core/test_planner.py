"""Paths around obstacles: each rule in a world made for it."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from navigation_core.geometry import Vector3
from navigation_core.mapping.obstacles import NOTHING, Box, Cylinder, KnownObstacle, Obstacles
from navigation_core.planning.planner import NoPath, Path, PlanLimits, plan
from tests.support.worlds.random_worlds import random_world

CLEARANCE_M = 1.5
IN_AIR = PlanLimits(CLEARANCE_M, (1.0, 30.0))
ON_GROUND = PlanLimits(CLEARANCE_M)
START, GOAL = (0.0, 0.0, 3.0), (20.0, 0.0, 3.0)
POST = Cylinder("post", (10.0, 0.0), 1.0)


def planned(
    *known: KnownObstacle,
    start: Vector3 = START,
    goal: Vector3 = GOAL,
    limits: PlanLimits = IN_AIR,
) -> Path:
    """Plan, and check what holds for every path."""
    obstacles = Obstacles.of(known)
    path = plan(start, goal, obstacles, limits)
    assert isinstance(path, Path), path
    assert path.points_enu_m[0] == start
    assert path.points_enu_m[-1] == goal
    has_m = float(obstacles.clearance_m(np.array([start]))[0])
    for k, (a, b) in enumerate(itertools.pairwise(path.points_enu_m)):
        least = min(limits.clearance_m, has_m) - 1e-6 if k == 0 else limits.clearance_m
        assert obstacles.is_clear(a, b, least)
    return path


def reason(
    *known: KnownObstacle,
    start: Vector3 = START,
    goal: Vector3 = GOAL,
    limits: PlanLimits = IN_AIR,
) -> str:
    answer = plan(start, goal, Obstacles.of(known), limits)
    assert isinstance(answer, NoPath)
    return answer.reason


def wall(east: float, low: float, high: float, top: float = math.inf) -> Box:
    return Box(f"wall {east} {low}", (east, 0.5 * (low + high)), (0.3, high - low), 0.0, -1.0, top)


# --- in the plane -----------------------------------------------------------------------


def test_without_obstacles_the_path_is_straight() -> None:
    assert plan(START, GOAL, NOTHING, IN_AIR) == Path((START, GOAL))


def test_what_is_not_in_the_way_changes_nothing() -> None:
    assert planned(Cylinder("aside", (10.0, 9.0), 1.0)) == Path((START, GOAL))


def test_a_post_is_passed_by_little_more_than_the_clearance() -> None:
    # Two tangents of sqrt(10^2 - 2.5^2) m and an arc between them.
    shortest_m = 2.0 * math.sqrt(93.75) + 2.5 * (math.pi - 2.0 * math.acos(0.25))
    assert planned(POST).length_m == pytest.approx(shortest_m, rel=0.01)


def test_a_wall_is_passed_at_its_nearer_end() -> None:
    path = planned(wall(10.0, -30.0, 8.0))
    assert max(point[1] for point in path.points_enu_m) == pytest.approx(9.5, abs=0.3)


def test_a_gap_little_wider_than_twice_the_clearance_is_found() -> None:
    path = planned(wall(10.0, -200.0, 5.0), wall(10.0, 8.05, 200.0))
    assert path.length_m < 27.0


def test_a_long_corridor_little_wider_than_twice_the_clearance_is_found() -> None:
    sides = [Box(f"{y}", (30.0, y), (40.0, 0.2)) for y in (7.0 - 1.65, 7.0 + 1.65)]
    ends = [wall(10.0, -200.0, 5.35), wall(10.0, 8.65, 200.0)]
    assert planned(*sides, *ends, goal=(60.0, 0.0, 3.0)).length_m < 65.0


def test_a_gap_narrower_than_twice_the_clearance_is_not_taken() -> None:
    assert planned(wall(10.0, -30.0, 5.0), wall(10.0, 7.95, 30.0)).length_m > 40.0


def test_a_dead_end_is_left_behind() -> None:
    sides = [Box(f"{y}", (10.0, y), (20.0, 0.3)) for y in (15.0, -15.0)]
    path = planned(wall(20.0, -15.0, 15.0), *sides, start=(5.0, 0.0, 3.0), goal=(30.0, 0.0, 3.0))
    assert min(point[0] for point in path.points_enu_m) < -1.0
    assert path.length_m < 60.0


def test_a_world_of_a_kilometre_is_as_easy_as_a_small_one() -> None:
    walls = [Box(str(k), (100.0 * k + 50.0, (-1.0) ** k * 100.0), (1.0, 500.0)) for k in range(9)]
    # Along the ends of the walls: by hand 1415.7 m.
    assert planned(*walls, goal=(1000.0, 0.0, 3.0)).length_m == pytest.approx(1415.7, rel=0.01)


def test_places_far_from_the_origin_make_no_difference() -> None:
    far = 1e6
    path = planned(
        Cylinder("post", (far + 10.0, far), 1.0),
        start=(far, far, 3.0),
        goal=(far + 20.0, far, 3.0),
    )
    assert path.length_m == pytest.approx(planned(POST).length_m, rel=0.001)


def test_obstacles_over_each_other_are_no_trouble() -> None:
    path = planned(POST, POST, Box("box", (10.0, 0.0), (1.0, 1.0)), Cylinder("c", (10.0, 0.0), 0.5))
    assert path.length_m == pytest.approx(planned(POST).length_m, rel=0.02)


def test_a_wall_seen_as_two_hundred_cells_is_passed_about_as_shortly_as_the_wall() -> None:
    cells = [Cylinder(f"{k}", (10.0, 0.25 * k), 0.18) for k in range(-60, 61)]
    assert planned(*cells).length_m == pytest.approx(
        planned(Box("wall", (10.0, 0.0), (0.36, 30.36))).length_m, rel=0.03
    )


def test_the_same_input_gives_the_same_path() -> None:
    world = random_world(7, 120)
    paths = [
        plan(world.start_enu_m, world.goal_enu_m, Obstacles.of(world.fixed), ON_GROUND)
        for _ in range(2)
    ]
    assert paths[0] == paths[1]


# --- no path ----------------------------------------------------------------------------


def test_a_goal_inside_an_obstacle_is_reported_with_how_far() -> None:
    assert "inside an obstacle, by 0.60 m" in reason(POST, goal=(10.4, 0.0, 3.0))
    assert "inside an obstacle, by 0.10 m" in reason(wall(20.05, -9.0, 9.0))


def test_a_goal_too_near_to_an_obstacle_is_reported_with_both_distances() -> None:
    told = reason(POST, goal=(12.0, 0.0, 3.0))
    assert "1.00 m from an obstacle" in told
    assert "the required clearance is 1.50 m" in told


def test_a_goal_above_the_highest_height_is_reported_with_the_heights() -> None:
    assert "40.00 m, outside 1.00 to 30.00 m" in reason(goal=(20.0, 0.0, 40.0))


@pytest.mark.parametrize("at", [START, GOAL], ids=["start", "goal"])
def test_a_ring_of_posts_about_an_end_is_no_path(at: Vector3) -> None:
    posts = [
        Cylinder(
            f"{k}",
            (at[0] + 6.0 * math.cos(k * math.tau / 14), at[1] + 6.0 * math.sin(k * math.tau / 14)),
            0.3,
        )
        for k in range(14)
    ]
    told = reason(*posts)
    assert "enclosed" in told
    # A search that has reached a bound proves nothing.
    assert "was found" in told


def test_a_start_in_the_clearance_is_led_out_without_coming_nearer() -> None:
    path = planned(POST, start=(8.2, 0.0, 3.0))
    out = path.points_enu_m[1]
    assert Obstacles.of((POST,)).clearance_m(np.array([out]))[0] >= CLEARANCE_M
    assert math.dist(out, (8.2, 0.0, 3.0)) < 1.0


def test_a_start_between_two_walls_is_led_out_along_them() -> None:
    walls = [Box(f"{y}", (0.0, y), (8.0, 0.2)) for y in (-1.1, 1.1)]
    path = planned(*walls, limits=ON_GROUND)
    assert path.points_enu_m[1][0] > 4.0


def test_a_start_inside_of_a_post_is_led_out() -> None:
    assert planned(POST, start=(9.8, 0.0, 3.0)).length_m < 12.0


# --- heights ----------------------------------------------------------------------------


def test_a_low_wall_is_flown_over() -> None:
    path = planned(wall(10.0, -40.0, 40.0, top=4.0))
    assert max(point[2] for point in path.points_enu_m) == pytest.approx(5.5, abs=0.1)
    assert path.length_m < 22.0


def test_a_hanging_wall_is_flown_under() -> None:
    high = (0.0, 0.0, 8.0), (20.0, 0.0, 8.0)
    path = planned(Box("w", (10.0, 0.0), (0.3, 600.0), 0.0, 6.0, 90.0), start=high[0], goal=high[1])
    assert min(point[2] for point in path.points_enu_m) == pytest.approx(4.5, abs=0.1)


def test_a_wall_that_reaches_above_the_highest_height_is_flown_around() -> None:
    path = planned(wall(10.0, -20.0, 20.0, top=29.0))
    assert all(1.0 <= point[2] <= 30.0 for point in path.points_enu_m)
    assert path.length_m > 40.0


def test_a_climb_to_the_goal_is_spread_over_the_path() -> None:
    path = planned(POST, goal=(20.0, 0.0, 8.0))
    assert 4.0 < path.points_enu_m[1][2] < 7.0
    assert path.length_m < 21.5


def test_from_under_a_roof_it_comes_out_before_it_rises() -> None:
    roof = Box("roof", (0.0, 0.0), (10.0, 10.0), 0.0, 6.0, 7.0)
    path = planned(roof, wall(10.0, -300.0, 300.0, top=10.0))
    assert path.length_m < 40.0


def test_what_is_below_the_path_is_not_in_the_way() -> None:
    assert planned(Cylinder("low", (10.0, 0.0), 1.0, -1.0, 1.4)) == Path((START, GOAL))


def test_on_the_ground_nothing_is_driven_over() -> None:
    path = planned(wall(10.0, -10.0, 10.0, top=4.0), limits=ON_GROUND)
    assert all(point[2] == 3.0 for point in path.points_enu_m)
    assert path.length_m > 25.0


# --- turning ----------------------------------------------------------------------------


def driven(*known: KnownObstacle, heading_rad: float | None = None) -> Path:
    return planned(*known, limits=PlanLimits(CLEARANCE_M, None, 4.0, heading_rad))


def turns_rad(path: Path) -> list[float]:
    courses = [
        math.atan2(b[1] - a[1], b[0] - a[0]) for a, b in itertools.pairwise(path.points_enu_m)
    ]
    return [math.remainder(b - a, math.tau) for a, b in itertools.pairwise(courses)]


def test_what_turns_slowly_gets_lines_long_enough_for_its_arcs() -> None:
    path = driven(wall(10.0, -6.0, 6.0))
    reach = [4.0 * math.tan(0.5 * abs(turn)) for turn in turns_rad(path)]
    lines = [math.dist(a, b) for a, b in itertools.pairwise(path.points_enu_m)]
    for line, before, after in zip(lines, [0.0, *reach], [*reach, 0.0], strict=True):
        assert line > before + after - 0.01


def test_a_goal_behind_is_reached_by_a_turn_from_the_heading() -> None:
    path = driven(POST, heading_rad=math.pi)
    first, second = path.points_enu_m[:2]
    assert math.atan2(second[1] - first[1], second[0] - first[0]) == pytest.approx(math.pi)
    assert max(abs(turn) for turn in turns_rad(path)) < math.radians(60.0)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_it_turns_on_the_side_where_there_is_room(side: float) -> None:
    path = driven(Box("w", (0.0, 3.5 * side), (30.0, 0.2)), heading_rad=math.pi)
    assert all(point[1] * side < 1.0 for point in path.points_enu_m)


def test_without_room_to_turn_there_is_no_path() -> None:
    corridor = [Box(f"{y}", (0.0, y), (200.0, 0.2)) for y in (-3.0, 3.0)]
    limits = PlanLimits(CLEARANCE_M, None, 4.0, math.pi)
    assert "none leaves room to turn" in reason(*corridor, limits=limits)
    assert planned(*corridor, limits=PlanLimits(CLEARANCE_M, None, 4.0, 0.0)).length_m == 20.0
