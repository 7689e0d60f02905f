"""Obstacles as the bridge learns of them, against the simulator's truth."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from mavlink_sitl import Obstacle, PlanItem, RangeSensor, Shapes, VehicleConfig, World
from navigation_bridge.goals.goal import GoalFinished, GoalHappened, LogLine
from navigation_bridge.goals.requests import WaypointRequest, WaypointsRequest
from navigation_bridge.obstacles.obstacle_feed import SensorScan
from navigation_core.outcomes import OutcomeCode
from tests.support.flights.simulated_flight import SimulatedFlight
from tests.support.messages.autopilot_messages import AutopilotMessages
from tests.support.stations.missions import position_1e7

pytestmark = pytest.mark.wide_but_first


REACH_M = 10.0
THINGS = (
    Obstacle("oak", (10.0, 6.0), radius_m=0.6, top_m=14.0),
    Obstacle("pine", (18.0, -5.0), radius_m=0.4, top_m=20.0),
    Obstacle("shed", (22.0, 7.0), size_m=(6.0, 4.0), yaw_rad=0.5, top_m=9.0),
    Obstacle("wall", (32.0, 0.0), size_m=(0.3, 20.0), top_m=9.0),
)
NO_SENSOR = "No obstacle sensor reports; only the known obstacles are avoided."
TREE = "{kind: cylinder, name: tree, at_m: [10, 0], radius_m: 1, height_m: 30}"


def kind_of(vehicle: str, autopilot: str = "ardupilot") -> VehicleConfig:
    return VehicleConfig(ready_after_s=1.0, vehicle=vehicle, autopilot=autopilot)


def knowing(folder: Path, obstacles: str, vehicle: str = "copter") -> SimulatedFlight:
    """A vehicle in an empty world whose server gets messages about obstacles."""
    path = folder / "obstacles.yaml"
    path.write_text(f"obstacles: [{obstacles}]", encoding="utf-8")
    return SimulatedFlight(simulated=kind_of(vehicle), obstacles_file=str(path)).ready()


def log(flight: SimulatedFlight) -> str:
    return "\n".join(line.text for line in flight.all(LogLine))


@pytest.mark.night_but_first
@pytest.mark.wide
@pytest.mark.parametrize(
    ("vehicle", "autopilot"), [("copter", "ardupilot"), ("copter", "px4"), ("rover", "ardupilot")]
)
def test_the_map_shows_obstacles_where_they_truly_are_while_the_vehicle_flies_and_turns(
    vehicle: str, autopilot: str
) -> None:
    world = World(obstacles=THINGS, range_sensor=RangeSensor(reach_m=REACH_M, noise_m=0.03))
    flight = SimulatedFlight(simulated=kind_of(vehicle, autopilot), world=world).ready()
    shapes = Shapes(THINGS)
    height_m = 4.0 if vehicle == "copter" else 0.0
    turned = (0.0, 0.0, math.sin(1.25), math.cos(1.25))
    goal = flight.start(flight.request(0.0, 24.0, height_m, 3.0, orientation=turned))
    seen: set[str] = set()
    wrong_m: list[float] = []
    while not flight.ends(goal):
        flight.run_for(1.0)
        posts = flight.bridge.obstacles.look().sensed.posts
        if not len(posts):
            continue
        level = np.column_stack([posts[:, 1], posts[:, 0], np.full(len(posts), -height_m)])
        gaps = shapes.gaps(level)
        wrong_m += gaps.min(axis=1).tolist()
        seen |= {
            name for name, gap in zip(shapes.names, gaps.min(axis=0), strict=True) if gap < 0.5
        }
    assert seen == {thing.name for thing in THINGS}
    assert np.percentile(wrong_m, 95) < 0.5
    # A sector reports the nearest in 5 degrees: at 10 m that may be half a metre aside.
    assert max(wrong_m) < 0.5 + REACH_M * math.radians(2.5)


def test_a_goal_flies_around_what_only_the_sensor_knows() -> None:
    world = World(obstacles=THINGS, range_sensor=RangeSensor(reach_m=20.0, noise_m=0.03))
    flight = SimulatedFlight(world=world).ready()
    flight.run_for(1.0)
    goal = flight.start(flight.request(9.0, 16.0, 4.0, avoid=True))  # the oak is in the way
    end = flight.run_to_end(goal)
    assert end.code is OutcomeCode.SUCCESS, end.message
    assert NO_SENSOR not in end.message
    assert not flight.ground_truth.collided
    assert not flight.ground_truth.hits


def past_tree(flight: SimulatedFlight, goal: str) -> tuple[GoalFinished, float]:
    """Continue to a goal's end; return it, and how near to the tree the vehicle came."""
    nearest_m = math.inf
    while not flight.ends(goal):
        flight.run_for(0.1)
        (x, y, _), _ = flight.truth()
        nearest_m = min(nearest_m, math.hypot(x - 10.0, y) - 1.0)
    (end,) = flight.ends(goal)
    return end, nearest_m


def test_a_goal_flies_around_what_is_known_and_says_that_no_sensor_is_heard(
    tmp_path: Path,
) -> None:
    flight = knowing(tmp_path, TREE)
    flight.fly_up()
    goal = flight.start(flight.request(20.0, 0.0, 3.0, avoid=True))
    end, nearest_m = past_tree(flight, goal)
    assert end.code is OutcomeCode.SUCCESS, end.message
    assert NO_SENSOR in end.message
    assert NO_SENSOR in log(flight)
    assert nearest_m > 0.5


def test_without_avoidance_it_flies_straight_and_says_what_that_hits(tmp_path: Path) -> None:
    flight = knowing(tmp_path, TREE)
    flight.fly_up()
    words = "straight legs hit known ones: 'tree' at (10.0, 0.0) m"
    goal = flight.start(flight.request(20.0, 0.0, 3.0))
    aside_m = 0.0
    while not flight.ends(goal):
        flight.run_for(0.1)
        aside_m = max(aside_m, abs(flight.truth()[0][1]))
    (end,) = flight.ends(goal)
    assert end.code is OutcomeCode.SUCCESS
    assert words in end.message
    assert words in log(flight)
    assert aside_m < 0.5


def test_a_route_that_hits_obstacles_says_so_in_one_sentence(tmp_path: Path) -> None:
    """However many legs and laps there are, and each obstacle and target once."""
    poles = ", ".join(
        f"{{name: pole{i}, kind: cylinder, at_m: [10, {5 * i}], radius_m: 1, height_m: 30}}"
        for i in range(6)
    )
    flight = knowing(tmp_path, poles)
    ways = (
        (0, 0),
        (20, 0),
        (20, 25),
        (0, 25),
        (0, 5),
        (20, 5),
        (20, 10),
        (0, 10),
        (0, 20),
        (20, 20),
    )
    legs = tuple(WaypointRequest((float(x), float(y), 3.0)) for x, y in ways)
    goal = flight.start(WaypointsRequest(legs, laps=3))
    (goal_line,) = [line for line in log(flight).splitlines() if "hit known ones" in line]
    assert goal_line.count("pole0") == 1
    assert goal_line.count("Obstacles are not avoided") == 1
    assert goal_line.count("pole") == 4
    assert goal_line.endswith("and 1 more.")
    assert len(goal_line) < 600
    flight.bridge.goals.cancel(goal, flight.now)
    end = flight.run_to_end(goal)
    assert end.message.count("hit known ones") == 1


def remarks(flight: SimulatedFlight) -> list[str]:
    """Return the messages that went to the clients at once, as the status of a goal."""
    return [each.message for each in flight.all(GoalHappened) if each.event == "STATUS"]


def test_a_straight_path_too_near_to_a_known_obstacle_is_reported_at_once(tmp_path: Path) -> None:
    flight = knowing(tmp_path, TREE)
    flight.fly_up()
    goal = flight.start(flight.request(20.0, 4.0, 3.0))
    words = (
        "straight legs pass nearer than 1.50 m (vehicle_radius_m + obstacle_margin_m) to: 'tree'"
    )
    assert any(words in text for text in remarks(flight))
    assert words in log(flight)
    flight.bridge.goals.cancel(goal, flight.now)
    assert words in flight.run_to_end(goal).message
    flight.start(flight.request(20.0, 8.0, 3.0))
    assert sum(words in text for text in remarks(flight)) == 1


@pytest.mark.night
def test_a_straight_path_through_what_a_sensor_sees_is_reported_at_once_and_its_crash_quoted() -> (
    None
):
    world = World(obstacles=THINGS, range_sensor=RangeSensor(reach_m=20.0, noise_m=0.03))
    flight = SimulatedFlight(world=world).ready()
    flight.run_for(1.0)
    goal = flight.start(flight.request(9.0, 16.0, 4.0))
    (words,) = [text for text in remarks(flight) if "straight legs hit" in text]
    assert "straight legs hit sensed ones: at (5." in words
    end = flight.run_to_end(goal)
    assert end.code is OutcomeCode.DISARMED
    assert "The autopilot reported: 'Crash: hit oak at" in end.message


def test_a_path_above_a_known_obstacle_hits_nothing(tmp_path: Path) -> None:
    flight = knowing(tmp_path, "{kind: cylinder, at_m: [10, 0], radius_m: 1, height_m: 2}")
    flight.fly_up()
    end = flight.run_to_end(flight.send(20.0, 0.0, 3.0))
    assert "hits" not in end.message


@pytest.mark.parametrize(
    ("target", "where"), [((10.0, 0.0, 3.0), "inside"), ((12.0, 0.0, 3.0), "1.00 m from")]
)
def test_a_target_within_the_clearance_of_something_known_is_rejected(
    tmp_path: Path, target: tuple[float, float, float], where: str
) -> None:
    flight = knowing(tmp_path, TREE)
    refused = flight.check(flight.request(*target, avoid=True))
    assert refused is not None
    assert refused.code is OutcomeCode.NO_PATH
    assert f"is {where} the known obstacle 'tree' at (10.0, 0.0) m" in refused.message
    assert flight.check(flight.request(*target)) is None
    waypoints = (WaypointRequest((0.0, 5.0, 3.0)), WaypointRequest(target))
    refused = flight.check(WaypointsRequest(waypoints, avoid_obstacles=True))
    assert refused is not None
    assert refused.code is OutcomeCode.NO_PATH


def test_a_target_where_only_a_sensor_has_seen_something_is_accepted() -> None:
    world = World(obstacles=THINGS, range_sensor=RangeSensor())
    flight = SimulatedFlight(world=world).ready()
    flight.run_for(2.0)
    assert flight.bridge.obstacles.look().sensed.clearance_m(np.array([[6.0, 10.0, 3.0]]))[0] < 1.0
    assert flight.check(flight.request(6.0, 10.0, 3.0, avoid=True)) is None


@pytest.mark.parametrize(
    ("vehicle", "by_mission", "words"),
    [
        ("plane", False, "plane is guided by its own autopilot"),
        ("copter", True, "flies the mission itself"),
    ],
)
def test_what_the_autopilot_flies_by_itself_avoids_nothing_and_says_so(
    tmp_path: Path, vehicle: str, by_mission: bool, words: str
) -> None:
    flight = knowing(tmp_path, TREE, vehicle)
    waypoints = (WaypointRequest((0.0, 50.0, 29.0)), WaypointRequest((20.0, -50.0, 29.0)))
    flight.start(WaypointsRequest(waypoints, by_mission=by_mission, avoid_obstacles=True))
    flight.run_for(0.5)
    assert words in log(flight)
    assert "hit known ones: 'tree'" in log(flight)


@pytest.mark.night
def test_a_rover_drives_around_what_is_known_however_high_its_gps_puts_it(tmp_path: Path) -> None:
    flight = knowing(tmp_path, TREE.replace("height_m: 30", "height_m: 0.5"), "rover")
    goal = flight.start(flight.request(20.0, 0.0, 0.0, avoid=True))
    end, nearest_m = past_tree(flight, goal)
    assert end.code is OutcomeCode.SUCCESS, end.message
    assert nearest_m > 0.5


@pytest.mark.night
def test_a_path_that_is_found_stays_inside_of_the_fence() -> None:
    flight = SimulatedFlight(simulated=kind_of("copter"))
    vehicle = flight.simulation.vehicles[0]
    vehicle.parameters.set("FENCE_ENABLE", 1.0)
    vehicle.parameters.set("FENCE_TYPE", 4.0)
    # An L about the start: its inner corner is at (10, 10), north and east.
    corners = [
        (-10.0, -10.0),
        (-10.0, 40.0),
        (10.0, 40.0),
        (10.0, 10.0),
        (40.0, 10.0),
        (40.0, -10.0),
    ]
    places = [position_1e7(n, e) for n, e in corners]
    fence = [PlanItem(5001, 0, (float(len(places)), 0.0, 0.0, 0.0), *place) for place in places]
    vehicle.firmware.plans.fence.replace(fence)
    flight.ready()
    flight.run_until(lambda: flight.vehicle.stored_lists.fence is not None, 20.0)
    first = flight.run_to_end(flight.send(0.0, 30.0, 5.0))
    assert first.code is OutcomeCode.SUCCESS, first.message
    across = flight.request(30.0, 0.0, 5.0)
    refused = flight.check(across)
    assert refused is not None
    assert refused.code is OutcomeCode.OUTSIDE_FENCE
    goal = flight.start(flight.request(30.0, 0.0, 5.0, avoid=True))
    while not flight.ends(goal):
        flight.run_for(0.1)
        (east, north, _), _ = flight.truth()
        assert not (east > 10.0 and north > 10.0), "outside of the fence"
    (end,) = flight.ends(goal)
    assert end.code is OutcomeCode.SUCCESS, end.message


def test_a_message_that_makes_no_sense_is_reported_once() -> None:
    flight = SimulatedFlight(world=World(obstacles=THINGS)).ready()
    companion = AutopilotMessages(component_id=195)
    for _ in range(3):
        message = companion("OBSTACLE_DISTANCE", frame=4, distances=[500] * 72, increment=5)
        flight.bridge.receive(message, flight.now)
    flight.tick()
    assert log(flight).count("OBSTACLE_DISTANCE of component 195 is ignored: its frame 4") == 1


@pytest.mark.night
def test_a_scanner_that_falls_silent_stops_the_vehicle_until_it_is_back_or_the_goal_ends() -> None:
    flight = SimulatedFlight(scan_topic="/scan", blocked_timeout_s=5.0).ready()
    angles = np.radians(np.arange(0.0, 360.0, 5.0))
    clear = SensorScan(
        False,
        np.column_stack([np.cos(angles), np.sin(angles), np.zeros(72)]),
        np.full(72, math.inf), 0.1, 20.0, math.radians(2.5),
    )  # fmt: skip

    def see(seconds: float) -> None:
        for _ in range(round(10 * seconds)):
            flight.bridge.obstacles.take_scan(clear, flight.now)
            flight.run_for(0.1)

    see(1.0)
    goal = flight.start(flight.request(60.0, 0.0, 4.0, avoid=True))
    while flight.status(goal) != "NAVIGATING":
        see(0.5)
    see(3.0)
    assert flight.truth()[1] > 1.0
    flight.run_to_status(goal, "BLOCKED")
    flight.run_for(3.0)
    assert flight.truth()[1] < 0.3
    see(4.0)
    assert flight.status(goal) == "NAVIGATING"
    assert flight.truth()[1] > 1.0
    end = flight.run_to_end(goal)
    assert end.code is OutcomeCode.NO_OBSTACLE_DATA, end.message
    assert flight.truth()[1] < 0.3
