"""The bag that is made of a recording has what a subscriber saw while it was recorded."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import pytest
from action_msgs.msg import GoalStatusArray
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Odometry, Path
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import BatteryState, NavSatFix

from custom_interfaces.msg import GoalEvent, VehicleStatus
from drone_navigation.tlog2mcap import convert
from navigation_bridge.names import ACTION_NAME, SERVER_NODE_NAME
from tests.support.logs.bags import ReadBag, missing_in_order, plain, read_bag
from tests.support.ros.ros_flight import Flight, GoalRecord, navigate_goal

pytestmark = [pytest.mark.wide, pytest.mark.xdist_group("ros_tlog2mcap")]

ALL_QOS = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)
TOPICS = {
    f"/{SERVER_NODE_NAME}/pose": (PoseStamped, 10),
    f"/{SERVER_NODE_NAME}/odometry": (Odometry, 10),
    f"/{SERVER_NODE_NAME}/fix": (NavSatFix, 10),
    f"/{SERVER_NODE_NAME}/battery": (BatteryState, 10),
    f"/{SERVER_NODE_NAME}/plan": (Path, ALL_QOS),
    f"/{SERVER_NODE_NAME}/vehicle_status": (VehicleStatus, ALL_QOS),
    f"/{SERVER_NODE_NAME}/goal_events": (GoalEvent, 10),
    f"/{ACTION_NAME}/_action/status": (GoalStatusArray, ALL_QOS),
    "/diagnostics": (DiagnosticArray, 10),
}


class Flown:
    """A flight with a goal that is reached and one that is cancelled: heard, and as a bag."""

    def __init__(self, flight: Flight) -> None:
        self.live: dict[str, list[Any]] = {topic: [] for topic in TOPICS}
        for topic, (kind, qos) in TOPICS.items():
            flight.subscribe(kind, topic, self.live[topic].append, qos)
        reached = flight.send(navigate_goal(4.0, 2.0, 3.0))
        flight.wait_for_result(reached)
        cancelled = flight.send(navigate_goal(30.0, 2.0, 3.0))
        flight.wait_for_status(cancelled, "NAVIGATING")
        flight.spin_for(1.5)
        flight.cancel(cancelled)
        flight.wait_for_result(cancelled)
        flight.spin_for(1.5)
        self.goals: list[GoalRecord] = [reached, cancelled]
        (log,) = flight.folder.glob("*.tlog")
        convert(log, log.with_suffix(".mcap"))
        self.bag: ReadBag = read_bag(log.with_suffix(".mcap"))


@pytest.fixture(scope="module")
def flown(flight: Flight) -> Flown:
    return Flown(flight)


@pytest.mark.parametrize("name", ["fix", "battery"])
def test_what_is_published_again_and_again_is_in_the_bag(flown: Flown, name: str) -> None:
    topic = f"/{SERVER_NODE_NAME}/{name}"
    live = [plain(message) for message in flown.live[topic]]
    assert len(live) > 2
    # The last may have been heard before the recorder had its packet on the disk. A slow machine's
    # subscriber misses some.
    assert missing_in_order(flown.bag.topics[topic].plain, live[:-1]) is None


@pytest.mark.parametrize("name", ["pose", "odometry"])
def test_where_the_vehicle_was_is_in_the_bag(flown: Flown, name: str) -> None:
    topic = f"/{SERVER_NODE_NAME}/{name}"
    live = [place_of(plain(message)) for message in flown.live[topic]]
    assert len(live) > 2
    # Only the places: packets that a late machine reads together are published with the latest
    # attitude of all, and recorded one after the other.
    bag = [place_of(message) for message in flown.bag.topics[topic].plain]
    assert missing_in_order(bag, live[:-1]) is None


def place_of(message: dict[str, Any]) -> dict[str, Any]:
    """The position in a pose or an odometry."""
    pose = message["pose"]
    place: dict[str, Any] = pose.get("pose", pose)["position"]
    return place


def test_what_happens_to_goals_is_in_the_bag_word_for_word(flown: Flown) -> None:
    topic = f"/{SERVER_NODE_NAME}/goal_events"
    live = [plain(message) for message in flown.live[topic]]
    assert [event["event"] for event in live].count("ENDED") == 2
    assert flown.bag.topics[topic].plain == live


def test_paths_are_in_the_bag_as_they_were_planned(flown: Flown) -> None:
    topic = f"/{SERVER_NODE_NAME}/plan"
    live = [points(message) for message in flown.live[topic]]
    bag = [points(message) for _, message in flown.bag.topics[topic].messages]
    assert [len(way) for way in bag] == [len(way) for way in live]
    for found, wanted in zip(bag, live, strict=True):
        assert found == pytest.approx(wanted, abs=1e-4)  # noted as float32


def points(path: Any) -> list[float]:
    places = [pose.pose.position for pose in path.poses]
    return [value for place in places for value in (place.x, place.y, place.z)]


def test_feedback_is_in_the_bag_with_the_id_of_its_goal(flown: Flown) -> None:
    topic = flown.bag.topics[f"/{ACTION_NAME}/_action/feedback"]
    assert topic.schema.name == "custom_interfaces/action/Navigate_FeedbackMessage"
    for goal in flown.goals:
        uuid = list(goal.handle.goal_id.uuid)
        messages = [message for _, message in topic.messages]
        bag = [m.feedback for m in messages if list(m.goal_id.uuid) == uuid]
        assert len(bag) == len(goal.feedback) > 5
        for found, live in zip(bag, goal.feedback, strict=True):
            assert found.current_status == live.current_status
            assert found.distance_remaining == live.distance_remaining
            assert found.estimated_time_remaining == live.estimated_time_remaining
            assert found.replans == live.replans
            # Packets that came together are recorded before what the first of them brought about.
            places = [pose.pose.position for pose in (found.current_pose, live.current_pose)]
            assert math.dist(*[(place.x, place.y, place.z) for place in places]) < 0.5
            if not math.isnan(live.battery_percentage):
                assert found.battery_percentage == pytest.approx(live.battery_percentage, abs=1.0)


def test_the_states_of_goals_are_in_the_bag_as_the_action_told_them(flown: Flown) -> None:
    topic = f"/{ACTION_NAME}/_action/status"
    live = [states(message) for message in flown.live[topic]]
    bag = [states(message) for _, message in flown.bag.topics[topic].messages]
    assert bag == live


def states(message: Any) -> list[tuple[list[int], int]]:
    listed = message.status_list
    return [(plain(item.goal_info.goal_id)["uuid"], item.status) for item in listed]


def test_the_vehicles_state_changes_as_it_did(flown: Flown) -> None:
    topic = f"/{SERVER_NODE_NAME}/vehicle_status"
    live = [plain(message) for message in flown.live[topic]]
    bag = flown.bag.topics[topic].plain
    assert {status["active_goal"] for status in bag} == {status["active_goal"] for status in live}
    seen = ("connected", "autopilot", "mode", "armed", "landed_state", "position_valid", "failsafe")
    changes = [list(states_of(listed, seen)) for listed in (bag, live)]
    assert changes[0][-len(changes[1]) :] == changes[1]


def states_of(listed: list[dict[str, Any]], names: tuple[str, ...]) -> Iterator[tuple[Any, ...]]:
    before = None
    for status in listed:
        state = tuple(status[name] for name in names)
        if state != before:
            yield state
        before = state


def test_diagnostics_are_in_the_bag_and_well(flown: Flown) -> None:
    live = plain(flown.live["/diagnostics"][-1])["status"]
    bag = flown.bag.topics["/diagnostics"].plain[-1]["status"]
    for found, wanted in zip(bag, live, strict=True):
        assert (found["name"], found["hardware_id"]) == (wanted["name"], wanted["hardware_id"])
        assert (found["level"], found["message"]) == (wanted["level"], wanted["message"])
        assert [item["key"] for item in found["values"]] == [
            item["key"] for item in wanted["values"]
        ]


def test_messages_bear_the_time_at_which_they_were_heard(flown: Flown) -> None:
    live = flown.live[f"/{SERVER_NODE_NAME}/goal_events"]
    bag = flown.bag.topics[f"/{SERVER_NODE_NAME}/goal_events"].messages
    for (time_ns, message), heard in zip(bag, live, strict=True):
        stamp = message.header.stamp
        assert time_ns == stamp.sec * 10**9 + stamp.nanosec
        wanted_s = heard.header.stamp.sec + 1e-9 * heard.header.stamp.nanosec
        assert math.isclose(time_ns * 1e-9, wanted_s, abs_tol=5.0)
