"""The ground truth of flights among obstacles: the same world, and hits that are counted."""

from __future__ import annotations

import numpy as np
import pytest

from mavlink_sitl import MoverPath, Obstacle, Shapes, World
from navigation_bridge.goals.goal import GoalFinished
from tests.support.flights.simulated_flight import SimulatedFlight
from tests.support.flights.world_flights import simulated
from tests.support.worlds.random_worlds import KINDS, random_world

pytestmark = pytest.mark.wide_but_first


@pytest.mark.parametrize("kind", KINDS)
def test_a_random_world_is_the_same_in_the_simulator(kind: str) -> None:
    world = random_world(3, 30, kind, movers=2)
    shapes = Shapes(simulated(world).obstacles)
    points = np.random.default_rng(1).uniform(-30.0, 30.0, (200, 3))
    start = np.array(world.start_enu_m)
    from_start = np.column_stack([points[:, 1] - start[1], points[:, 0] - start[0], -points[:, 2]])
    for time_s in (0.0, 12.3):
        shapes.move_to(time_s)
        apart = np.maximum(shapes.gaps(from_start), shapes.heights_apart(from_start[:, 2]))
        stands = [not moves for moves in shapes.moves]
        assert apart[:, stands].min(axis=1) == pytest.approx(world.obstacles.clearance_m(points))
        for mover in world.movers:
            column = shapes.names.index(mover.cylinder.name)
            shape = mover.at(time_s)
            far = np.hypot(*(points[:, :2] - shape.centre_enu_m).T) - shape.radius_m
            far = np.maximum(far, np.maximum(-1.0 - points[:, 2], 0.0))
            assert apart[:, column] == pytest.approx(np.maximum(far, 0.0))


def test_flying_into_a_wall_is_a_hit_that_could_have_been_avoided() -> None:
    wall = Obstacle("wall", (10.0, 0.0), size_m=(1.0, 20.0))
    flight = SimulatedFlight(world=World(obstacles=(wall,))).ready()
    goal_id = flight.send(0.0, 20.0, 3.0)
    flight.run_until(lambda: bool(flight.ends(goal_id)))
    truth = flight.ground_truth
    assert flight.all(GoalFinished)[-1].code.value != "SUCCESS"
    assert truth.collided
    (hit,) = truth.hits
    assert (hit.obstacle, hit.moves) == ("wall", False)
    assert hit.was_avoidable
    assert hit.speed_m_s > 1.0
    assert truth.nearest is not None
    assert truth.nearest.distance_m < 0.3


@pytest.mark.parametrize("caged", [False, True], ids=["in the open", "in a cage"])
def test_only_who_stands_and_can_go_nowhere_is_hit_without_fault(caged: bool) -> None:
    train = Obstacle(
        "train", (0.0, -30.0), size_m=(4.0, 4.0), path=MoverPath(((0.0, -30.0), (0.0, 30.0)), 2.0)
    )
    cage = [Obstacle("bars", (s * 1.2, 0.0), size_m=(0.2, 8.0)) for s in (-1, 1)]
    cage.append(Obstacle("back", (0.0, 1.2), size_m=(3.0, 0.2)))
    obstacles = (train, *(cage if caged else ()))
    flight = SimulatedFlight(world=World(obstacles=obstacles)).ready()
    flight.run_until(lambda: bool(flight.ground_truth.hits), 30.0)
    (hit,) = flight.ground_truth.hits
    assert (hit.obstacle, hit.moves) == ("train", True)
    assert hit.stood_s > 5.0
    assert hit.was_avoidable == (not caged)
