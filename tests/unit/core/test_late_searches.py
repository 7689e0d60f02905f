"""Path searches beside the flight that end late, or never."""

from __future__ import annotations

import dataclasses
import itertools
import math

import pytest

from navigation_core.geometry import distance, norm, subtract
from navigation_core.mapping.obstacle_shapes import Box, Cylinder
from navigation_core.mapping.obstacles import Obstacles
from navigation_core.outcomes import OutcomeCode
from navigation_core.tasks.flying.goto import GotoConfig, GotoGoal, fly_to
from navigation_core.tasks.leading.flight_terms import AvoidanceConfig, FlightTerms
from navigation_core.tasks.progress import Progress, Status
from tests.support.flights.late_searches import LateSearcher
from tests.support.models.point_mass import Flight, PointMass, fly

pytestmark = pytest.mark.wide_but_first


CONFIG = GotoConfig(may_arm=True)
AVOIDANCE = AvoidanceConfig(heights_m=(1.0, 20.0), blocked_timeout_s=10.0)
PERIOD_S = 0.05
FAR = GotoGoal((40.0, 0.0, 5.0))
WALL = Obstacles.of((Box("wall", (22.0, 1.0), (1.0, 12.0)),))


class Searched:
    """A flight whose searches take their time."""

    def __init__(self, takes_s: float, lead_s: float, goal: GotoGoal = FAR) -> None:
        """Prepare a copter in the air."""
        self.vehicle = PointMass(
            position=(0.0, 0.0, 5.0), armed=True, in_control=True, airborne=True
        )
        self.searcher = LateSearcher(lambda: self.vehicle.now, takes_s, lead_s)
        avoidance = dataclasses.replace(AVOIDANCE, searcher=self.searcher)
        self.task = fly_to(goal, FlightTerms(CONFIG, avoidance=avoidance))
        self.told: list[Progress] = []
        self.nearest_m = math.inf

    def fly(self, appears_s: float, obstacles: Obstacles) -> Flight:
        """Fly to the end; the obstacles appear at a time."""

        def each_step(elapsed_s: float) -> None:
            if elapsed_s >= appears_s:
                self.vehicle.obstacles = obstacles
            self.told.append(self.task.progress(self.vehicle.observe(), self.vehicle.now))
            place = self.vehicle.position
            clearance_m = float(self.vehicle.obstacles.clearance_m(place)[0])  # type: ignore[arg-type]
            self.nearest_m = min(self.nearest_m, clearance_m)

        return fly(self.task, self.vehicle, each_step, dt_s=PERIOD_S)


@pytest.mark.parametrize("takes_s", [0.05, 0.2, 0.5, 1.2])
@pytest.mark.parametrize("lead_s", [0.0, 0.1, 0.6])
def test_a_path_that_is_found_late_is_joined_without_a_jump(takes_s: float, lead_s: float) -> None:
    searched = Searched(takes_s, lead_s)
    flight = searched.fly(2.0, WALL)
    assert flight.outcome.code is OutcomeCode.SUCCESS
    assert searched.nearest_m > AVOIDANCE.vehicle_radius_m
    assert searched.told[-1].replans >= 1
    for (before_s, before), (now_s, now) in itertools.pairwise(flight.setpoints):
        a, b = before.setpoint, now.setpoint
        walked_m = norm(a.velocity_enu_m_s) * (now_s - before_s)
        assert distance(a.position_enu_m, b.position_enu_m) <= walked_m + 0.25
        assert norm(subtract(b.velocity_enu_m_s, a.velocity_enu_m_s)) <= 0.5


def test_the_first_search_is_not_reported_as_a_blocked_path() -> None:
    searched = Searched(0.3, 0.1)
    assert searched.fly(0.0, WALL).outcome.code is OutcomeCode.SUCCESS
    assert Status.BLOCKED not in {progress.status for progress in searched.told}


def test_a_goal_close_by_is_flown_to_and_turned_to_whenever_its_path_is_found() -> None:
    goal = GotoGoal((0.3, 0.0, 5.0), yaw_enu_rad=2.0)
    searched = Searched(0.3, 0.1, goal)
    assert CONFIG.arrival_radius_m > 0.3
    flight = searched.fly(math.inf, Obstacles())
    assert flight.outcome.code is OutcomeCode.SUCCESS
    assert abs(searched.vehicle.yaw - 2.0) <= CONFIG.arrival_yaw_rad
    assert distance(searched.vehicle.position, goal.position_enu_m) < 0.05


def test_a_setpoint_goes_out_in_every_step_of_a_search() -> None:
    searched = Searched(0.5, 0.6)
    flight = searched.fly(2.0, WALL)
    times = [time_s for time_s, _ in flight.setpoints]
    assert max(b - a for a, b in itertools.pairwise(times)) < 1.5 * PERIOD_S


def test_a_search_that_never_ends_stops_the_vehicle_and_ends_the_goal_with_its_reason() -> None:
    searched = Searched(math.inf, 0.1)
    flight = searched.fly(0.0, WALL)
    assert flight.outcome.code is OutcomeCode.NO_PATH
    assert "took longer than 2 s" in flight.outcome.message
    assert norm(searched.vehicle.velocity) < 0.1


def test_a_search_that_hangs_in_flight_is_given_up_before_the_wall() -> None:
    searched = Searched(0.0, 0.0)

    def hang() -> None:
        searched.searcher.takes_s = math.inf

    searched.vehicle.now = 100.0
    task = searched.task
    original = task.progress

    def progress(observation: object, now: float) -> Progress:
        if now > 101.0:
            hang()
        return original(observation, now)  # type: ignore[arg-type]

    task.progress = progress  # type: ignore[method-assign]
    flight = searched.fly(2.0, WALL)
    assert flight.outcome.code is OutcomeCode.NO_PATH
    assert searched.nearest_m > AVOIDANCE.vehicle_radius_m


@pytest.mark.parametrize("takes_s", [0.3, 1.2])
def test_a_flight_that_restarts_during_a_search_for_a_shorter_path_continues(
    takes_s: float,
) -> None:
    searched = Searched(takes_s, 0.1)
    vehicle = searched.vehicle
    vehicle.obstacles = Obstacles.of((Box("wide", (25.0, 0.0), (0.2, 30.0)),))
    restarted: list[float] = []

    def each_step(elapsed_s: float) -> None:
        if elapsed_s >= 6.0:
            vehicle.obstacles = Obstacles()  # so a shorter path is looked for
        vehicle.connected = not 6.2 <= elapsed_s < 7.0
        if not vehicle.connected:
            restarted.append(elapsed_s)

    assert fly(searched.task, vehicle, each_step).outcome.code is OutcomeCode.SUCCESS
    assert restarted


def test_a_new_obstacle_during_a_search_for_a_shorter_path_is_avoided() -> None:
    searched = Searched(0.3, 0.4)
    vehicle = searched.vehicle
    wide = Obstacles.of((Box("wide", (25.0, 0.0), (0.2, 30.0)),))
    vehicle.obstacles = wide
    seen: list[float] = []

    def each_step(elapsed_s: float) -> None:
        if elapsed_s >= 4.0:
            # The wall has gone, and a post stands on the path round it.
            x, y, _ = vehicle.position
            if not seen:
                seen.extend((x + 7.0, y + 4.0))
            vehicle.obstacles = Obstacles.of((Cylinder("post", (seen[0], seen[1]), 1.0),))
        clearance_m = float(vehicle.obstacles.clearance_m(vehicle.position)[0])  # type: ignore[arg-type]
        searched.nearest_m = min(searched.nearest_m, clearance_m)

    flight = fly(searched.task, vehicle, each_step)
    assert flight.outcome.code is OutcomeCode.SUCCESS
    assert searched.nearest_m > AVOIDANCE.vehicle_radius_m
