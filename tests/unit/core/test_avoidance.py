"""Obstacle avoidance in flight: blocked, free again, braked, giving way."""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Callable

import numpy as np
import pytest

from navigation_core.geometry import KinematicState, Vector3, distance
from navigation_core.mapping.obstacle_shapes import Box, Cylinder
from navigation_core.mapping.obstacles import NOTHING, Obstacles
from navigation_core.outcomes import OutcomeCode
from navigation_core.tasks.flying.flight import SetpointFlight
from navigation_core.tasks.flying.goto import GotoConfig, GotoGoal, fly_to
from navigation_core.tasks.flying.route import fly_route
from navigation_core.tasks.intents import NOTHING_SENT, Fly, Handover
from navigation_core.tasks.leading.carrot import Commanded
from navigation_core.tasks.leading.flight_terms import (
    AvoidanceConfig,
    AvoidanceConfigError,
    FlightTerms,
)
from navigation_core.tasks.leading.path_follower import PathFollower
from navigation_core.tasks.phases import Phase
from navigation_core.tasks.progress import Progress, Status
from navigation_core.tasks.traits import COPTER, Traits
from navigation_core.tasks.waypoint import Route, RouteWaypoint
from tests.support.models.point_mass import Flight, PointMass, fly

CONFIG = GotoConfig(may_arm=True)
AVOIDANCE = AvoidanceConfig(heights_m=(1.0, 20.0), blocked_timeout_s=10.0)
PATIENT = dataclasses.replace(AVOIDANCE, blocked_timeout_s=60.0)
ROVER = Traits("rover", flies=False, lands_itself=False, turning_radius_m=0.9)
TARGET: Vector3 = (30.0, 0.0, 5.0)
# Nothing leads out of it; its far side is between the start and the target.
WALL = Obstacles.of(
    (
        Box("east", (15.0, 0.0), (1.0, 30.0)),
        Box("west", (-15.0, 0.0), (1.0, 30.0)),
        Box("north", (0.0, 15.0), (31.0, 1.0)),
        Box("south", (0.0, -15.0), (31.0, 1.0)),
    )
)


def hovering() -> PointMass:
    return PointMass(position=(0.0, 0.0, 5.0), armed=True, in_control=True, airborne=True)


def goto(
    target: Vector3 = TARGET,
    avoidance: AvoidanceConfig | None = AVOIDANCE,
    speed: float | None = None,
) -> SetpointFlight:
    return fly_to(GotoGoal(target, None, speed), FlightTerms(CONFIG, avoidance=avoidance))


def post(x: float, y: float, radius: float = 0.5) -> Obstacles:
    return Obstacles.of((Cylinder("post", (x, y), radius),))


def pen(east_m: float) -> Obstacles:
    """Return walls all round, the eastern one at a coordinate."""
    return Obstacles.of(
        (
            Box("east", (east_m, 0.0), (1.0, 60.0)),
            Box("west", (east_m - 40.0, 0.0), (1.0, 60.0)),
            Box("north", (east_m - 20.0, 30.0), (41.0, 1.0)),
            Box("south", (east_m - 20.0, -30.0), (41.0, 1.0)),
        )
    )


class Watched:
    """A flight, the truth about its clearance, and what its feedback said."""

    def __init__(self, task: SetpointFlight, vehicle: PointMass) -> None:
        """Prepare."""
        self.task, self.vehicle = task, vehicle
        self.told: list[Progress] = []
        self.nearest_m = math.inf

    def fly(
        self, change: Callable[[float], None] | None = None, time_max_s: float = 300.0
    ) -> Flight:
        """Fly to the end; ``change`` may change the world before each step."""

        def each_step(elapsed_s: float) -> None:
            if change is not None:
                change(elapsed_s)
            vehicle = self.vehicle
            self.told.append(self.task.progress(vehicle.observe(), vehicle.now))
            clearance_m = float(vehicle.obstacles.clearance_m(vehicle.position)[0])  # type: ignore[arg-type]
            self.nearest_m = min(self.nearest_m, clearance_m)

        return fly(self.task, self.vehicle, each_step, time_max_s)

    @property
    def statuses(self) -> list[Status]:
        """The statuses in their order, each once."""
        statuses: list[Status] = []
        for progress in self.told:
            if not statuses or statuses[-1] is not progress.status:
                statuses.append(progress.status)
        return statuses


def when(begin_s: float, vehicle: PointMass, obstacles: Obstacles) -> Callable[[float], None]:
    """Return what puts obstacles in the way from a time on."""

    def change(elapsed_s: float) -> None:
        if elapsed_s >= begin_s:
            vehicle.obstacles = obstacles

    return change


def test_a_step_flies_the_old_path_and_only_then_is_replanned() -> None:
    task, vehicle = goto(), hovering()
    task.start(vehicle.observe(), vehicle.now)
    for _ in range(40):
        asked = task.step(vehicle.observe(), vehicle.now)
        assert isinstance(asked, Fly)
        vehicle.obey(asked)
        task.replan(vehicle.observe(), vehicle.now)
        vehicle.advance(0.05)
    straight = task.path_enu_m
    vehicle.obstacles = post(15.0, 0.0)
    answer = task.step(vehicle.observe(), vehicle.now)
    assert isinstance(answer, Fly)
    assert answer.setpoint.velocity_enu_m_s[0] > 1.0
    assert task.path_enu_m is straight
    task.replan(vehicle.observe(), vehicle.now)
    assert task.path_enu_m is not straight
    assert max(abs(y) for _, y, _ in task.path_enu_m) > 1.0
    assert task.progress(vehicle.observe(), vehicle.now).replans == 1


def test_a_vehicle_that_ran_beyond_its_stop_continues_from_where_it_is() -> None:
    task, vehicle = goto(speed=5.0), hovering()
    vehicle.acceleration_max_m_s2 = 2.5  # of 4 that an emergency's brake counts on
    task.start(vehicle.observe(), vehicle.now)
    behind_m, seen, freed = [], 100, 130
    for step in range(200):
        if step == seen:
            vehicle.obstacles = pen(vehicle.position[0] + 5.5)
        if step == freed:
            vehicle.obstacles = NOTHING
        asked = task.step(vehicle.observe(), vehicle.now)
        assert isinstance(asked, Fly)
        vehicle.obey(asked)
        task.replan(vehicle.observe(), vehicle.now)
        behind_m.append(vehicle.position[0] - asked.setpoint.position_enu_m[0])
        vehicle.advance(0.05)
    assert max(behind_m[seen:freed]) > 1.0
    # Not first back to where it should have stopped.
    assert max(map(abs, behind_m[freed + 12 :])) < 0.5


# --- without obstacles ---------------------------------------------------------------------


def test_without_avoidance_obstacles_are_flown_through() -> None:
    straight, vehicle = hovering(), hovering()
    vehicle.obstacles = WALL
    expected = fly(goto(avoidance=None), straight)
    flown = fly(goto(avoidance=None), vehicle)
    assert flown.setpoints == expected.setpoints
    assert flown.outcome == expected.outcome


def test_with_nothing_in_the_way_the_flight_is_the_same() -> None:
    expected = fly(goto(avoidance=None), hovering())
    flown = fly(goto(), hovering())
    assert [fly.setpoint.position_enu_m for _, fly in flown.setpoints] == [
        fly.setpoint.position_enu_m for _, fly in expected.setpoints
    ]


def test_an_obstacle_beside_the_path_changes_nothing() -> None:
    vehicle, task = hovering(), goto()
    vehicle.obstacles = post(15.0, 4.0)
    watched = Watched(task, vehicle)
    assert watched.fly().outcome.code is OutcomeCode.SUCCESS
    assert watched.statuses == [Status.PREPARING, Status.NAVIGATING, Status.SETTLING]
    assert watched.told[-1].replans == 0


# --- blocked --------------------------------------------------------------------------------


def test_without_a_path_the_vehicle_stops_says_why_and_gives_up_after_its_time() -> None:
    vehicle, task = hovering(), goto()
    watched = Watched(task, vehicle)
    flight = watched.fly(when(1.0, vehicle, WALL))
    assert flight.outcome.code is OutcomeCode.NO_PATH
    assert "no path for 10 s" in flight.outcome.message
    assert watched.statuses == [Status.PREPARING, Status.NAVIGATING, Status.BLOCKED]
    assert watched.told[-1].blocked
    assert vehicle.speed < 0.05
    assert watched.nearest_m > AVOIDANCE.conflict_clearance_m
    ended_s = flight.steps[-1][0] - flight.steps[0][0]
    assert ended_s == pytest.approx(11.0, abs=0.5)


def test_a_path_that_opens_up_is_taken() -> None:
    vehicle, task = hovering(), goto()
    watched = Watched(task, vehicle)

    def change(elapsed_s: float) -> None:
        vehicle.obstacles = WALL if 1.0 <= elapsed_s < 9.0 else NOTHING

    flight = watched.fly(change)
    assert flight.outcome.code is OutcomeCode.SUCCESS
    assert watched.statuses[-3:] == [Status.BLOCKED, Status.NAVIGATING, Status.SETTLING]
    assert watched.told[-1].replans == 1
    assert watched.told[-1].blocked == ""


def test_a_goal_on_the_ground_takes_off_and_waits_when_there_is_no_path() -> None:
    vehicle, task = PointMass(), goto()
    vehicle.obstacles = WALL
    assert fly(task, vehicle).outcome.code is OutcomeCode.NO_PATH
    assert vehicle.position[2] > 1.0


def test_a_target_that_is_too_near_to_an_obstacle_is_approached_and_says_so() -> None:
    vehicle, task = hovering(), goto()
    vehicle.obstacles = post(30.0, 0.7)
    watched = Watched(task, vehicle)
    outcome = watched.fly().outcome
    assert outcome.code is OutcomeCode.NO_PATH
    assert "0.20 m from an obstacle" in outcome.message
    assert "1.5 m" in outcome.message
    # It waits where there is room, as near to the target as that allows.
    assert 1.0 < distance(vehicle.position, TARGET) < 2.0
    assert watched.nearest_m >= AVOIDANCE.conflict_clearance_m
    assert Status.SETTLING not in watched.statuses


def test_a_target_beside_which_there_is_room_within_its_radius_is_reached() -> None:
    vehicle, task = hovering(), goto()
    vehicle.obstacles = post(30.0, 1.7)
    outcome = fly(task, vehicle).outcome
    assert outcome.code is OutcomeCode.SUCCESS, outcome.message
    assert distance(vehicle.position, TARGET) <= CONFIG.arrival_radius_m


@pytest.mark.parametrize("free_s", [4.0, 25.0], ids=["before it is there", "while it waits"])
def test_a_target_that_seems_occupied_from_afar_is_reached_once_it_is_free(free_s: float) -> None:
    vehicle, task = hovering(), goto(avoidance=PATIENT)
    watched = Watched(task, vehicle)

    def change(elapsed_s: float) -> None:
        vehicle.obstacles = post(30.0, 0.5) if elapsed_s < free_s else NOTHING

    assert watched.fly(change).outcome.code is OutcomeCode.SUCCESS
    assert (Status.BLOCKED in watched.statuses) is (free_s > 20.0)


def test_what_drives_stops_before_a_target_that_is_occupied() -> None:
    vehicle = PointMass(armed=True, in_control=True, airborne=None, position=(0.0, 0.0, 0.0))
    vehicle.obstacles = post(30.0, 0.0)
    avoidance = dataclasses.replace(AVOIDANCE, heights_m=None, blocked_timeout_s=3.0)
    task = fly_to(
        GotoGoal((30.0, 0.0, 0.0)), FlightTerms(CONFIG, traits=ROVER, avoidance=avoidance)
    )
    watched = Watched(task, vehicle)
    assert watched.fly().outcome.code is OutcomeCode.NO_PATH
    assert 1.5 < distance(vehicle.position, (30.0, 0.0, 0.0)) < 3.5
    assert watched.nearest_m >= AVOIDANCE.brake_clearance_m


def test_who_is_blocked_where_it_was_to_go_has_arrived() -> None:
    vehicle, task = hovering(), goto()
    vehicle.obstacles = post(30.0, 1.9)
    vehicle.position = (29.9, 0.0, 5.0)
    assert fly(task, vehicle).outcome.code is OutcomeCode.SUCCESS


@pytest.mark.parametrize("after_s", [0.0, 0.3, 5.0])
def test_a_cancel_while_blocked_stops_it(after_s: float) -> None:
    vehicle, task = hovering(), goto()
    blocked_s: list[float] = []

    def change(elapsed_s: float) -> None:
        when(1.0, vehicle, WALL)(elapsed_s)
        if task.phase is Phase.BLOCKED:
            blocked_s.append(elapsed_s)
            if elapsed_s >= blocked_s[0] + after_s:
                task.cancel(vehicle.now)

    flight = fly(task, vehicle, change)
    assert flight.outcome.code is OutcomeCode.CANCELED
    assert "has stopped" in flight.outcome.message


@pytest.mark.wide
def test_a_pause_while_blocked_stops_the_clock() -> None:
    vehicle, task = hovering(), goto()
    watched = Watched(task, vehicle)

    def change(elapsed_s: float) -> None:
        when(1.0, vehicle, WALL)(elapsed_s)
        if 5.0 <= elapsed_s < 25.0:
            task.pause(vehicle.now)
        else:
            task.unpause(vehicle.now)

    flight = watched.fly(change)
    assert flight.outcome.code is OutcomeCode.NO_PATH
    assert watched.statuses[-3:] == [Status.BLOCKED, Status.PAUSED, Status.BLOCKED]
    assert flight.steps[-1][0] - flight.steps[0][0] == pytest.approx(35.0, abs=1.0)


def test_a_lost_position_while_blocked_ends_it_as_anywhere() -> None:
    vehicle, task = hovering(), goto()

    def change(elapsed_s: float) -> None:
        when(1.0, vehicle, WALL)(elapsed_s)
        vehicle.position_known = elapsed_s < 8.0

    assert fly(task, vehicle, change).outcome.code is OutcomeCode.NO_POSITION


def test_a_silent_link_while_blocked_is_survived() -> None:
    vehicle, task = hovering(), goto()

    def change(elapsed_s: float) -> None:
        vehicle.obstacles = WALL if 1.0 <= elapsed_s < 9.0 else NOTHING
        vehicle.connected = not 5.0 <= elapsed_s < 7.0

    assert fly(task, vehicle, change).outcome.code is OutcomeCode.SUCCESS


# --- a sensor that is silent ----------------------------------------------------------------


def test_without_its_sensor_the_vehicle_stands_and_continues_when_that_is_back() -> None:
    vehicle, task = hovering(), goto()
    watched = Watched(task, vehicle)

    def change(elapsed_s: float) -> None:
        vehicle.obstacles_age_s = max(elapsed_s - 1.0, 0.0) if elapsed_s < 9.0 else 0.1

    flight = watched.fly(change)
    assert flight.outcome.code is OutcomeCode.SUCCESS
    blocked = [progress for progress in watched.told if progress.status is Status.BLOCKED]
    assert "has been silent for 2." in blocked[1].blocked
    assert 5.5 < len(blocked) * 0.05 < 7.0


def test_a_sensor_that_stays_silent_ends_the_goal() -> None:
    vehicle, task = hovering(), goto()

    def change(elapsed_s: float) -> None:
        vehicle.obstacles_age_s = math.inf if elapsed_s > 1.0 else 0.1

    outcome = fly(task, vehicle, change).outcome
    assert outcome.code is OutcomeCode.NO_OBSTACLE_DATA
    assert "10 s" in outcome.message
    assert vehicle.speed < 0.05


# --- the brake and giving way ---------------------------------------------------------------


@pytest.mark.parametrize("gap_m", [9.3, 10.0, 12.0])
def test_what_appears_ahead_at_full_speed_is_not_hit(gap_m: float) -> None:
    vehicle, task = hovering(), goto((60.0, 0.0, 5.0))
    watched = Watched(task, vehicle)

    def change(_elapsed_s: float) -> None:
        if vehicle.position[0] > 15.0 and vehicle.obstacles is NOTHING:
            vehicle.obstacles = Obstacles.of(
                (Box("wall", (vehicle.position[0] + gap_m + 0.5, 0.0), (1.0, 50.0)),)
            )

    assert watched.fly(change).outcome.code is OutcomeCode.SUCCESS
    assert watched.nearest_m > AVOIDANCE.vehicle_radius_m


def test_who_holds_gives_way_to_what_comes_near_and_comes_back() -> None:
    vehicle, task = hovering(), goto((10.0, 0.0, 5.0), PATIENT)
    watched = Watched(task, vehicle)

    def change(elapsed_s: float) -> None:
        # It comes from the far side at walking speed, stays about the target and leaves again.
        x = max(10.0, 25.0 - 1.0 * elapsed_s) if elapsed_s < 30.0 else 10.0 + elapsed_s - 30.0
        vehicle.obstacles = post(x, 0.3)

    flight = watched.fly(change)
    assert flight.outcome.code is OutcomeCode.SUCCESS
    assert watched.nearest_m > AVOIDANCE.vehicle_radius_m


def test_who_is_paused_gives_way_too() -> None:
    vehicle, task = hovering(), goto((60.0, 0.0, 5.0))
    watched = Watched(task, vehicle)

    def change(elapsed_s: float) -> None:
        if elapsed_s < 40.0:
            task.pause(vehicle.now)
        else:
            task.unpause(vehicle.now)
        vehicle.obstacles = post(0.4, 20.0 - elapsed_s)

    flight = watched.fly(change)
    assert flight.outcome.code is OutcomeCode.SUCCESS
    assert watched.nearest_m > AVOIDANCE.vehicle_radius_m


# --- detours --------------------------------------------------------------------------------

# Across the straight way, with a free way round either end.
FENCE = Obstacles.of((Box("fence", (15.0, 1.0), (0.2, 16.0)),))


def test_what_is_seen_in_time_is_flown_around_without_a_stop() -> None:
    vehicle, task = hovering(), goto((40.0, 0.0, 5.0))
    watched = Watched(task, vehicle)
    flight = watched.fly(when(2.0, vehicle, post(22.0, 0.0, 2.0)))
    assert flight.outcome.code is OutcomeCode.SUCCESS
    assert watched.statuses == [Status.PREPARING, Status.NAVIGATING, Status.SETTLING]
    assert watched.told[-1].replans == 1
    assert watched.nearest_m > AVOIDANCE.conflict_clearance_m
    speeds = [math.hypot(*o.velocity_enu_m_s) for t, o, _ in flight.steps if o.velocity_enu_m_s]
    assert min(speeds[60:-60]) > 1.0


def test_distance_and_time_are_those_of_the_path_before_the_take_off_too() -> None:
    vehicle, task = PointMass(), goto()
    vehicle.obstacles = FENCE
    watched = Watched(task, vehicle)
    flight = watched.fly()
    assert flight.outcome.code is OutcomeCode.SUCCESS
    flown_m = sum(
        distance(a.position_enu_m, b.position_enu_m)
        for (_, a, _), (_, b, _) in itertools.pairwise(flight.steps)
        if a.position_enu_m and b.position_enu_m
    )
    assert watched.told[0].distance_remaining_m == pytest.approx(flown_m, rel=0.05)
    took_s = flight.steps[-1][0] - flight.steps[0][0]
    assert watched.told[0].time_remaining_s == pytest.approx(took_s, rel=0.3)


def test_a_path_that_has_become_clearly_shorter_is_taken() -> None:
    vehicle, task = hovering(), goto((60.0, 0.0, 5.0))
    vehicle.obstacles = Obstacles.of((Box("wide", (40.0, 0.0), (0.2, 60.0)),))
    watched = Watched(task, vehicle)
    flight = watched.fly(when(6.0, vehicle, NOTHING))
    assert flight.outcome.code is OutcomeCode.SUCCESS
    assert watched.told[-1].replans == 1
    assert max(abs(o.position_enu_m[1]) for _, o, _ in flight.steps if o.position_enu_m) < 28.0


def test_it_does_not_flap_between_two_sides() -> None:
    vehicle, task = hovering(), goto((50.0, 0.0, 5.0))
    watched = Watched(task, vehicle)

    def change(elapsed_s: float) -> None:
        # The sensor's view of a post moves by some centimetres with every scan.
        wobble_m = 0.1 * math.sin(7.0 * elapsed_s)
        vehicle.obstacles = post(25.0, wobble_m, 3.0)

    flight = watched.fly(change)
    assert flight.outcome.code is OutcomeCode.SUCCESS
    assert watched.told[-1].replans <= 1
    sides = {
        math.copysign(1.0, o.position_enu_m[1])
        for _, o, _ in flight.steps
        if o.position_enu_m and abs(o.position_enu_m[1]) > 0.5
    }
    assert len(sides) == 1


def test_a_car_keeps_clear_of_a_wall_that_it_drives_around() -> None:
    vehicle = PointMass(armed=True, in_control=True, airborne=None, position=(0.0, 0.0, 0.0))
    avoidance = dataclasses.replace(AVOIDANCE, heights_m=None)
    task = fly_to(
        GotoGoal((30.0, 0.0, 0.0), None, 2.0),
        FlightTerms(CONFIG, traits=ROVER, avoidance=avoidance),
    )
    watched = Watched(task, vehicle)
    assert watched.fly(when(1.0, vehicle, FENCE)).outcome.code is OutcomeCode.SUCCESS
    assert watched.nearest_m > AVOIDANCE.brake_clearance_m


@pytest.mark.parametrize(("traits", "begins_at_m"), [(COPTER, 2.0), (ROVER, 1.4)])
def test_what_drives_behind_its_setpoint_plans_and_brakes_from_where_it_is(
    traits: Traits, begins_at_m: float
) -> None:
    vehicle = PointMass(position=(1.4, 0.0, 0.0), armed=True, in_control=True)
    vehicle.velocity = (1.5, 0.0, 0.0)
    setpoint = KinematicState((2.0, 0.0, 0.0), (1.5, 0.0, 0.0))
    avoidance = dataclasses.replace(AVOIDANCE, heights_m=None)
    goal = GotoGoal((30.0, 0.0, 0.0), None, 1.5)
    follower = PathFollower(goal, FlightTerms(CONFIG, Handover(setpoint, 0.0), traits, avoidance))
    for plan in (follower.plan_to_goal, follower.plan_stop):
        plan(vehicle.observe())
        assert follower.carrot is not None
        assert follower.carrot.state.position_enu_m[0] == pytest.approx(begins_at_m, abs=0.05)
        follower.sent.commanded = Commanded(setpoint, 0.0)


def test_what_stands_blocked_does_not_pass_on_the_little_speed_that_is_measured() -> None:
    vehicle = PointMass(armed=True, in_control=True, airborne=None, position=(0.0, 0.0, 0.0))
    vehicle.velocity = (0.15, 0.0, 0.0)
    avoidance = dataclasses.replace(AVOIDANCE, heights_m=None)
    follower = PathFollower(
        GotoGoal((30.0, 0.0, 0.0)), FlightTerms(CONFIG, NOTHING_SENT, ROVER, avoidance)
    )
    follower.plan_stop(vehicle.observe())
    assert follower.carrot is not None
    assert follower.carrot.state.velocity_enu_m_s == (0.0, 0.0, 0.0)


@pytest.mark.parametrize("speed_m_s", [0.1, 1.0])
def test_what_drives_comes_to_rest_beside_what_crowds_it(speed_m_s: float) -> None:
    """Nearer than what makes it give way, so that its stop is in conflict all the time."""
    vehicle = PointMass(armed=True, in_control=True, airborne=None, position=(0.0, 0.0, 0.0))
    vehicle.velocity = (speed_m_s, 0.0, 0.0)
    avoidance = dataclasses.replace(AVOIDANCE, heights_m=None, blocked_timeout_s=10.0)
    crowd_m = AVOIDANCE.conflict_clearance_m - 0.05
    ring = [
        Cylinder(f"post {i}", (3.0 * math.cos(i), 3.0 * math.sin(i)), 3.0 - crowd_m)
        for i in np.linspace(0.3, 2.0 * math.pi - 0.3, 8)
    ]
    vehicle.obstacles = Obstacles.of(tuple(ring))
    task = fly_to(
        GotoGoal((30.0, 0.0, 0.0)), FlightTerms(CONFIG, traits=ROVER, avoidance=avoidance)
    )
    watched = Watched(task, vehicle)
    watched.fly()
    assert math.hypot(*vehicle.velocity[:2]) < 0.05
    assert math.hypot(*vehicle.position[:2]) < 1.5


def test_what_cannot_turn_on_the_spot_stays_where_it_could_only_come_nearer() -> None:
    vehicle = PointMass(armed=True, in_control=True, airborne=None, position=(0.0, 0.0, 0.0))
    boat = Traits("boat", flies=False, lands_itself=False, turning_radius_m=4.0)
    avoidance = dataclasses.replace(AVOIDANCE, heights_m=None, blocked_timeout_s=3.0)
    # Its nose points at a wall.
    vehicle.obstacles = Obstacles.of((Box("quay", (1.3, 0.0), (1.0, 20.0)),))
    task = fly_to(
        GotoGoal((-30.0, 0.0, 0.0)), FlightTerms(CONFIG, traits=boat, avoidance=avoidance)
    )
    watched = Watched(task, vehicle)
    outcome = watched.fly().outcome
    assert outcome.code is OutcomeCode.NO_PATH
    assert "turn on the spot" in outcome.message
    assert watched.nearest_m > AVOIDANCE.brake_clearance_m


# --- routes ---------------------------------------------------------------------------------


def test_a_waypoint_inside_an_obstacle_blocks_until_it_is_free() -> None:
    waypoints = tuple(RouteWaypoint((x, 0.0, 5.0), 1.0) for x in (10.0, 20.0, 30.0))
    vehicle, task = (
        hovering(),
        fly_route(Route(waypoints, 1), FlightTerms(CONFIG, avoidance=AVOIDANCE)),
    )
    watched = Watched(task, vehicle)

    def change(elapsed_s: float) -> None:
        vehicle.obstacles = post(20.0, 0.0) if elapsed_s < 15.0 else NOTHING

    flight = watched.fly(change)
    assert flight.outcome.code is OutcomeCode.SUCCESS
    assert flight.outcome.message == "Flew 3 of 3 waypoints."
    assert Status.BLOCKED in watched.statuses


def test_the_waypoints_of_a_route_are_reached_around_obstacles() -> None:
    waypoints = tuple(
        RouteWaypoint(place, 1.0)
        for place in ((20.0, 0.0, 5.0), (20.0, 20.0, 5.0), (0.0, 20.0, 5.0))
    )
    vehicle, task = (
        hovering(),
        fly_route(Route(waypoints, 2), FlightTerms(CONFIG, avoidance=AVOIDANCE)),
    )
    watched = Watched(task, vehicle)

    def change(elapsed_s: float) -> None:
        known = [(10.0, 0.5), (20.5, 10.0)] + [(10.0, 20.0)] * (elapsed_s > 8.0)
        if len(known) != len(vehicle.obstacles):
            vehicle.obstacles = Obstacles.of(
                tuple(Cylinder(f"post {k}", place, 1.0) for k, place in enumerate(known))
            )

    flight = watched.fly(change)
    assert flight.outcome.code is OutcomeCode.SUCCESS
    assert flight.outcome.message == "Flew 6 of 6 waypoints."
    assert watched.nearest_m > AVOIDANCE.conflict_clearance_m
    routes = [progress.route for progress in watched.told if progress.route]
    reached = [route.reached for route in routes]
    assert reached == sorted(reached)


def test_a_vehicle_that_is_held_up_in_a_route_does_not_return_to_what_it_has_passed() -> None:
    places = ((20.0, 0.0, 5.0), (20.0, 30.0, 5.0), (0.0, 30.0, 5.0))
    waypoints = tuple(RouteWaypoint(place, 1.0) for place in places)
    task = fly_route(Route(waypoints, 1), FlightTerms(CONFIG, avoidance=AVOIDANCE))
    vehicle, held_s = hovering(), math.inf
    watched = Watched(task, vehicle)
    returned = []

    def change(elapsed_s: float) -> None:
        nonlocal held_s
        if vehicle.position[1] > 8.0:
            held_s = min(held_s, elapsed_s)
        vehicle.obeys = not held_s <= elapsed_s < held_s + 6.0
        if elapsed_s >= held_s + 5.0:
            vehicle.obstacles = post(20.0, 20.0)
            returned.append(vehicle.position[1] < 6.0)

    assert watched.fly(change).outcome.code is OutcomeCode.SUCCESS
    assert watched.told[-1].replans > 0
    assert returned
    assert not any(returned)


@pytest.mark.wide
def test_a_long_route_that_cannot_be_planned_on_stops_where_its_plan_ends() -> None:
    vehicle = hovering()
    vehicle.obstacles = Obstacles.of(
        (
            Box("east", (150.0, 0.0), (1.0, 80.0)),
            Box("west", (-20.0, 0.0), (1.0, 80.0)),
            Box("north", (65.0, 40.0), (171.0, 1.0)),
            Box("south", (65.0, -40.0), (171.0, 1.0)),
        )
    )
    points = tuple(RouteWaypoint((20.0 * k, 0.0, 5.0), 2.0) for k in range(1, 11))
    watched = Watched(
        fly_route(Route(points, 1), FlightTerms(CONFIG, avoidance=AVOIDANCE)), vehicle
    )
    outcome = watched.fly().outcome
    assert outcome.code is OutcomeCode.NO_PATH
    assert watched.nearest_m > 15.0
    assert Status.BLOCKED in watched.statuses


def test_a_long_route_is_planned_on_in_flight_without_a_stop() -> None:
    waypoints = tuple(RouteWaypoint((20.0 * k, 5.0 * (k % 2), 5.0), 2.0) for k in range(1, 16))
    vehicle, task = (
        hovering(),
        fly_route(Route(waypoints, 1), FlightTerms(CONFIG, avoidance=AVOIDANCE)),
    )
    # It is beyond what is planned at first.
    vehicle.obstacles = post(250.0, 2.5, 1.0)
    watched = Watched(task, vehicle)
    flight = watched.fly()
    assert flight.outcome.message == "Flew 15 of 15 waypoints."
    assert watched.told[-1].replans == 0
    assert watched.nearest_m > AVOIDANCE.conflict_clearance_m
    speeds = [math.hypot(*o.velocity_enu_m_s) for _, o, _ in flight.steps if o.velocity_enu_m_s]
    assert min(speeds[60:-140]) > 1.0


# --- the settings ---------------------------------------------------------------------------


@pytest.mark.parametrize("field", [f.name for f in dataclasses.fields(AvoidanceConfig)])
@pytest.mark.parametrize("value", [0.0, -1.0, math.nan, math.inf])
def test_settings_that_make_no_sense_are_rejected(field: str, value: float) -> None:
    given: object = (value, value) if field == "heights_m" else value
    with pytest.raises(AvoidanceConfigError, match=field):
        dataclasses.replace(AVOIDANCE, **{field: given})  # type: ignore[arg-type]


def test_the_clearances_are_nested() -> None:
    config = AVOIDANCE
    assert (
        config.vehicle_radius_m
        < config.brake_clearance_m
        < config.conflict_clearance_m
        < config.flown_clearance_m
        < config.plan_clearance_m
    )
