"""The quick proof that no path exists, checked against an independent grid."""

from __future__ import annotations

import math

import numpy as np
import pytest

from navigation_core.mapping.obstacles import Box, Cylinder, Obstacles
from navigation_core.planning.enclosure_proof import is_walled_in
from tests.support.worlds.random_worlds import CLEARANCE_M, random_world

START, GOAL = np.array([-30.0, 0.0, 3.0]), np.array([0.0, 0.0, 3.0])


def ring(radius_m: float, step_m: float, top_m: float = math.inf) -> Obstacles:
    """Thin posts in a circle, as a scanner's columns show a wall."""
    angles = np.arange(0.0, math.tau, step_m / radius_m)
    return Obstacles.of(
        tuple(
            Cylinder(f"{k}", (radius_m * math.cos(a), radius_m * math.sin(a)), 0.2, -1.0, top_m)
            for k, a in enumerate(angles)
        )
    )


@pytest.mark.parametrize("seed", range(21))
def test_what_is_said_to_be_walled_in_has_no_path(seed: int) -> None:
    world = random_world(seed, 6, top_m=20.0)
    start, goal = np.array(world.start_enu_m), np.array(world.goal_enu_m)
    proof = is_walled_in(start, goal, world.obstacles, CLEARANCE_M, (3.0, 3.0))
    assert not (proof and world.solvable)
    assert proof == (world.kind == "closed")


@pytest.mark.parametrize("ends", [(START, GOAL), (GOAL, START)], ids=["goal", "start"])
def test_an_end_within_a_closed_ring_is_enclosed(ends: tuple[np.ndarray, np.ndarray]) -> None:
    assert is_walled_in(*ends, ring(6.0, 0.5), 1.5, (3.0, 10.0))
    assert is_walled_in(*ends, ring(6.0, 2.0), 1.5, (3.0, 10.0))


@pytest.mark.parametrize(
    ("obstacles", "goal", "heights_m", "why"),
    [
        (ring(6.0, 3.5), GOAL, (3.0, 10.0), "there are gaps"),
        (ring(6.0, 0.5), np.add(START, (1.0, 1.0, 0.0)), (3.0, 3.0), "both are outside"),
        (ring(6.0, 0.5, 5.0), GOAL, (3.0, 10.0), "it is open above"),
        (ring(30.0, 0.5), GOAL, (3.0, 3.0), "it is closed farther away than is looked"),
        (Obstacles(), GOAL, (3.0, 3.0), "nothing is there"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_nothing_is_said_where_there_may_be_a_path(
    obstacles: Obstacles, goal: np.ndarray, heights_m: tuple[float, float], why: str
) -> None:
    assert not is_walled_in(np.add(START, (-20.0, 0.0, 0.0)), goal, obstacles, 1.5, heights_m), why


def test_walls_enclose_as_posts_do_and_who_is_inside_with_the_goal_is_free() -> None:
    walls = Obstacles.of(
        tuple(
            Box(f"{x} {y}", (7.0 * x, 7.0 * y), (14.0, 0.3), 0.0 if y else math.pi / 2.0)
            for x, y in ((1, 0), (-1, 0), (0, 1), (0, -1))
        )
    )
    assert is_walled_in(START, GOAL, walls, 1.5, (0.0, 50.0))
    assert not is_walled_in(np.add(GOAL, (2.0, 2.0, 0.0)), GOAL, walls, 1.5, (0.0, 50.0))
