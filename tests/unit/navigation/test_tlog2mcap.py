"""A bag of a recording has what the server put out, at the recorder's time, or is not there."""

from __future__ import annotations

import random
import re
from itertools import pairwise
from pathlib import Path

import pytest
import yaml

from drone_navigation.bag.mcap_bag import qos_text
from drone_navigation.qos import LATCHED_QOS
from drone_navigation.tlog2mcap import convert, main
from mavlink_sitl import Obstacle, RangeSensor, VehicleConfig, World
from mavlink_vehicle.io.tlog import TlogReader, TlogWriter
from navigation_bridge.goals.goal import GoalFeedback, GoalHappened
from navigation_bridge.goals.requests import (
    LandRequest,
    WaypointRequest,
    WaypointsRequest,
)
from tests.support.flights.recorded_flight import EPOCH_S, Recorder
from tests.support.flights.simulated_flight import SimulatedFlight
from tests.support.logs.bags import ReadBag, read_bag
from tests.support.logs.recordings import SMALL

pytestmark = pytest.mark.wide


SERVER = "/navigation_server"
SEVERAL = SMALL / "multi_udp.tlog"
ALL_TOPICS = {
    f"{SERVER}/last_rejection", f"{SERVER}/pose", f"{SERVER}/odometry", f"{SERVER}/fix",
    f"{SERVER}/battery", f"{SERVER}/plan", f"{SERVER}/vehicle_status", f"{SERVER}/goal_events",
    f"{SERVER}/obstacles", f"{SERVER}/home", f"{SERVER}/goal_rejected", "/diagnostics", "/tf",
    f"{SERVER}/geo_pose", f"{SERVER}/obstacle_grid", "/tf_static",
    f"{SERVER}/fence", f"{SERVER}/flight_volume", f"{SERVER}/mission", f"{SERVER}/rally_points",
}  # fmt: skip


class Flown:
    """A flight with a rejected goal, a goal, a route that is cancelled, and a landing."""

    def __init__(self, folder: Path) -> None:
        self.log = folder / "flown.tlog"
        self.flight = flight = SimulatedFlight()
        recorder = Recorder(flight, self.log)
        flight.ready()
        flight.bridge.goals.check(flight.request(9e5, 0.0, 3.0), flight.now)
        self.goal = flight.send(4.0, 0.0, 3.0)
        flight.run_to_end(self.goal)
        self.route = flight.start(route((8.0, 0.0, 3.0), (8.0, 30.0, 3.0)))
        flight.run_for(4.0)
        flight.bridge.goals.cancel(self.route, flight.now)
        flight.run_to_end(self.route)
        self.landing = flight.start(LandRequest())
        flight.run_to_end(self.landing)
        recorder.close()
        out = folder / "flown.mcap"
        self.counts = convert(self.log, out).counts
        self.bag: ReadBag = read_bag(out)


def route(*places: tuple[float, float, float]) -> WaypointsRequest:
    return WaypointsRequest(tuple(WaypointRequest(place) for place in places))


@pytest.fixture(scope="module")
def flown(tmp_path_factory: pytest.TempPathFactory) -> Flown:
    return Flown(tmp_path_factory.mktemp("flown"))


def test_every_topic_exists_with_the_reported_number_of_messages(flown: Flown) -> None:
    topics = flown.bag.topics
    assert flown.bag.profile == "ros2"
    assert {name: len(topic.messages) for name, topic in topics.items()} == flown.counts
    actions = {name for name in topics if "/_action/" in name}
    assert topics.keys() - actions == ALL_TOPICS
    assert actions == {
        f"/{name}/_action/{kind}"
        for name in ("navigate_to_waypoint", "navigate_waypoints", "land")
        for kind in ("feedback", "status")
    }
    for name in ("pose", "odometry", "fix", "battery", "plan", "vehicle_status"):
        assert len(topics[f"{SERVER}/{name}"].messages) > 2, name


def test_events_and_rejections_are_those_of_the_flight(flown: Flown) -> None:
    told = [output for _, output in flown.flight.outputs if isinstance(output, GoalHappened)]
    events = flown.bag.topics[f"{SERVER}/goal_events"].messages
    assert [(m.goal_id, m.event, m.what, m.message) for _, m in events] == [
        (event.goal_id, event.event, event.what, event.message) for event in told
    ]
    ((_, refusal),) = flown.bag.topics[f"{SERVER}/last_rejection"].messages
    assert refusal.data.startswith("OUTSIDE_VOLUME: ")


@pytest.mark.parametrize(
    ("action", "goal"),
    [("navigate_to_waypoint", "goal"), ("navigate_waypoints", "route"), ("land", "landing")],
)
def test_feedback_is_that_of_the_flight(flown: Flown, action: str, goal: str) -> None:
    goal_id = getattr(flown, goal)
    live: list[GoalFeedback] = flown.flight.feedback(goal_id)
    messages = flown.bag.topics[f"/{action}/_action/feedback"].messages
    assert len(messages) == len(live) > 3
    for (_, message), told in zip(messages, live, strict=True):
        assert bytes(message.goal_id.uuid).hex() == goal_id
        feedback = message.feedback
        assert feedback.current_status == told.status.value
        assert feedback.distance_remaining == pytest.approx(told.distance_remaining_m)
        if told.route is not None:
            assert feedback.current_waypoint == told.route.current
            assert feedback.waypoints_remaining == told.route.remaining
        if goal == "landing" and told.height_m is not None:
            assert feedback.height == pytest.approx(told.height_m, abs=0.1)


def test_a_cancelled_goal_goes_through_its_states(flown: Flown) -> None:
    messages = flown.bag.topics["/navigate_waypoints/_action/status"].messages
    assert [[item.status for item in m.status_list] for _, m in messages] == [[1], [2], [3], [5]]
    messages = flown.bag.topics["/navigate_to_waypoint/_action/status"].messages
    assert [[item.status for item in m.status_list] for _, m in messages] == [[1], [2], [4]]


def test_times_are_those_of_the_recorder_and_monotonic(flown: Flown) -> None:
    times_ns = flown.bag.log_times_ns
    assert all(earlier <= later for earlier, later in pairwise(times_ns))
    assert EPOCH_S <= times_ns[0] * 1e-9 <= times_ns[-1] * 1e-9 <= EPOCH_S + flown.flight.now + 1e-3
    for time_ns, pose in flown.bag.topics[f"{SERVER}/pose"].messages:
        # A stamp is the time of the measurement; this link delays nothing.
        late_ns = time_ns - pose.header.stamp.sec * 10**9 - pose.header.stamp.nanosec
        assert 0 <= late_ns < 2_000_000


def test_the_same_recording_gives_the_same_bag(flown: Flown, tmp_path: Path) -> None:
    # Not byte by byte: what ROS serializes has anything between the fields.
    convert(flown.log, tmp_path / "again.mcap")
    again = read_bag(tmp_path / "again.mcap")
    assert again.log_times_ns == flown.bag.log_times_ns
    for name, topic in flown.bag.topics.items():
        assert again.topics[name].plain == topic.plain, name


def test_latched_topics_are_recorded_as_such(flown: Flown) -> None:
    for name, depth, durability in (("plan", 1, 1), ("vehicle_status", 1, 1), ("pose", 10, 2)):
        metadata = flown.bag.topics[f"{SERVER}/{name}"].channel.metadata
        (profile,) = yaml.safe_load(metadata["offered_qos_profiles"])
        assert (profile["depth"], profile["durability"]) == (depth, durability)
        assert (profile["history"], profile["reliability"]) == (1, 1)


def test_a_profile_has_all_that_rosbag2_reads() -> None:
    (profile,) = yaml.safe_load(qos_text(LATCHED_QOS))
    forever = {"sec": 9223372036, "nsec": 854775807}
    assert profile == {
        "history": 1, "depth": 1, "reliability": 1, "durability": 1, "deadline": forever,
        "lifespan": forever, "liveliness": 1, "liveliness_lease_duration": forever,
        "avoid_ros_namespace_conventions": False,
    }  # fmt: skip


def test_the_page_shows_how_python_reads_it(
    flown: Flown, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    page = (Path(__file__).parents[3] / "docs/logs.md").read_text("utf-8")
    (code,) = [
        block for block in re.findall(r"```python\n(.*?)```", page, re.DOTALL) if "mcap" in block
    ]
    out = flown.log.with_name("flight.mcap")
    out.write_bytes(flown.log.with_suffix(".mcap").read_bytes())
    monkeypatch.chdir(out.parent)
    exec(code, {})
    assert capsys.readouterr().out.count("\n") == sum(flown.counts.values())


def test_readings_of_range_sensors_are_shown(tmp_path: Path) -> None:
    wall = Obstacle("wall", at_m=(8.0, 0.0), size_m=(1.0, 6.0))
    world = World(obstacles=(wall,), range_sensor=RangeSensor(reach_m=20.0))
    flight = SimulatedFlight(world=world)
    recorder = Recorder(flight, tmp_path / "wall.tlog")
    flight.ready()
    flight.run_to_end(flight.send(0.0, 2.0, 4.0))  # nothing is seen from the ground
    recorder.close()
    convert(tmp_path / "wall.tlog", tmp_path / "wall.mcap")
    (_, markers) = read_bag(tmp_path / "wall.mcap").topics[f"{SERVER}/obstacles"].messages[-1]
    points = [point for marker in markers.markers for point in marker.points]
    assert any(abs(point.y - 7.5) < 1.0 and abs(point.x) < 4.0 for point in points)


def test_several_vehicles_have_a_namespace_each(tmp_path: Path) -> None:
    convert(SEVERAL, tmp_path / "all.mcap")
    topics = read_bag(tmp_path / "all.mcap").topics
    for system in (1, 2, 3):
        name = f"/system_{system}/navigation_server/vehicle_status"
        assert any(status.connected for _, status in topics[name].messages)
    hardware = {
        status.hardware_id for _, m in topics["/diagnostics"].messages for status in m.status
    }
    assert {"system 1", "system 2", "system 3"} <= hardware


def test_notes_belong_to_the_vehicle_of_their_system_id(tmp_path: Path) -> None:
    goals, records = {}, []
    for system in (1, 2):
        vehicle = VehicleConfig(ready_after_s=1.0, system_id=system)
        flight = SimulatedFlight(simulated=vehicle, target_system=system)
        recorder = Recorder(flight, tmp_path / f"{system}.tlog")
        flight.ready()
        flight.run_for(float(system))
        # Ids of goals are counted: the second vehicle's are others.
        goals[system] = [flight.send(3.0, 0.0, 3.0) for _ in range(system)][-1]
        flight.run_to_end(goals[system])
        recorder.close()
        records += list(TlogReader(tmp_path / f"{system}.tlog"))
    both = TlogWriter(tmp_path / "both.tlog")
    for time_s, packet in sorted(records):
        both.write(packet, time_s)
    both.close()
    options = ["--system", "1", "--vehicle-name", "a", "--system", "2", "--vehicle-name", "b"]
    assert main([str(tmp_path / "both.tlog"), *options]) == 0
    topics = read_bag(tmp_path / "both.mcap").topics
    for name, goal_id in (("a", goals[1]), ("b", goals[2])):
        feedback = topics[f"/{name}/navigate_to_waypoint/_action/feedback"].messages
        assert goal_id in {bytes(message.goal_id.uuid).hex() for _, message in feedback}
        assert {m.feedback.current_pose.header.frame_id for _, m in feedback} == {f"{name}/map"}
        events = [event for _, event in topics[f"/{name}/navigation_server/goal_events"].messages]
        assert (events[-1].event, events[-1].goal_id) == ("ENDED", goal_id)
    assert goals[2] not in {
        event.goal_id for _, event in topics["/a/navigation_server/goal_events"].messages
    }


def test_vehicles_are_selected_and_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "some.mcap"
    options = ["--system", "3", "--vehicle-name", "c", "--system", "1", "--vehicle-name", "a"]
    assert main([str(SEVERAL), "--out", str(out), *options]) == 0
    assert "The log contains no goals of navigation_server." in capsys.readouterr().out
    topics = read_bag(out).topics
    spaces = {name.split("/")[1] for name in topics if name.endswith("/fix")}
    assert spaces == {"a", "c"}
    (_, fix), *_ = topics["/c/navigation_server/fix"].messages
    assert fix.header.frame_id == "c/gps"
    assert main([str(SEVERAL), "--out", str(out), "--system", "2"]) == 0
    assert "/navigation_server/fix" in read_bag(out).topics


def test_a_log_that_ends_within_a_packet_gives_what_comes_before(
    flown: Flown, tmp_path: Path
) -> None:
    log = tmp_path / "cut.tlog"
    log.write_bytes(flown.log.read_bytes()[: flown.log.stat().st_size // 2 + 5])
    counts = convert(log, tmp_path / "cut.mcap").counts
    assert 0 < counts[f"{SERVER}/pose"] < flown.counts[f"{SERVER}/pose"]
    assert len(read_bag(tmp_path / "cut.mcap").log_times_ns) == sum(counts.values())


@pytest.mark.parametrize("seed", range(4))
def test_a_damaged_log_is_converted_as_far_as_it_goes(
    flown: Flown, seed: int, tmp_path: Path
) -> None:
    source, data = random.Random(seed), bytearray(flown.log.read_bytes())
    for _ in range(40):
        place, size = source.randrange(len(data)), source.randrange(1, 400)
        match source.randrange(3):
            case 0:
                del data[place : place + size]
            case 1:
                data[place:place] = source.randbytes(size)
            case _:
                data[place : place + 8] = source.randbytes(8)
    log = tmp_path / "damaged.tlog"
    log.write_bytes(data)
    counts = convert(log, tmp_path / "damaged.mcap").counts
    assert counts[f"{SERVER}/pose"] > 100
    assert len(read_bag(tmp_path / "damaged.mcap").log_times_ns) == sum(counts.values())
