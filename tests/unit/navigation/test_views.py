"""The views for RViz and Foxglove name topics, fields and frames that the server publishes."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
import yaml
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

from drone_navigation.bag.message_definitions import type_name
from drone_navigation.server.frame_names import FRAME_EARTH, PLAIN
from drone_navigation.server.publishing.topics import Topics
from mavlink_vehicle.io.endpoints import LinkStatistics
from mavlink_vehicle.vehicle import Vehicle
from navigation_bridge.bridge import Bridge
from navigation_bridge.configuration.make_config import make_config
from navigation_bridge.names import SERVER_NODE_NAME

VIEWS = Path(__file__).resolve().parents[3] / "bridge_config/views"
FRAMES = {FRAME_EARTH, PLAIN.map, PLAIN.odom, PLAIN.base_link, PLAIN.gps}
GOAL_POSE = "/goal_pose"
"""Published by the viewers themselves: a PoseStamped for the clients of Nav2."""
DISPLAYS = {
    "Map": "nav_msgs/msg/OccupancyGrid",
    "MarkerArray": "visualization_msgs/msg/MarkerArray",
    "Odometry": "nav_msgs/msg/Odometry",
    "Path": "nav_msgs/msg/Path",
}
"""Type that a display of rviz_default_plugins subscribes to."""
PLACED = {*DISPLAYS.values(), "geometry_msgs/msg/PoseStamped"} - {"nav_msgs/msg/Odometry"}
"""Types that Foxglove's 3D panel draws; it has no Odometry."""


class Node:
    """Takes note of what a server advertises."""

    def __init__(self) -> None:
        self.types: dict[str, Any] = {}
        self.qos: dict[str, QoSProfile] = {}

    def create_publisher(self, kind: Any, topic: str, qos: Any) -> None:
        name = topic.replace("~", f"/{SERVER_NODE_NAME}")
        self.types[name] = kind
        self.qos[name] = QoSProfile(depth=qos) if isinstance(qos, int) else qos

    def get_fully_qualified_name(self) -> str:
        return f"/{SERVER_NODE_NAME}"


@pytest.fixture(scope="module")
def server() -> Node:
    config = make_config({})
    node = Node()
    bridge = Bridge(Vehicle(config.vehicle), config.bridge)
    Topics(node, bridge, LinkStatistics)  # type: ignore[arg-type]
    return node


def is_field(kind: Any, path: str) -> bool:
    """Return whether a message type has a number or text under a path such as "pose.x"."""
    message = kind()
    for name in path.split("."):
        if name not in getattr(message, "__slots__", ()) and not hasattr(message, name):
            return False
        message = getattr(message, name)
    return isinstance(message, (bool, int, float, str))


def test_rviz_shows_what_is_published(server: Node) -> None:
    view = yaml.safe_load((VIEWS / "mavbridge.rviz").read_text("utf-8"))["Visualization Manager"]
    assert view["Global Options"]["Fixed Frame"] in FRAMES
    assert view["Views"]["Current"]["Target Frame"] in FRAMES
    shown = set()
    for display in view["Displays"]:
        name = display["Class"].removeprefix("rviz_default_plugins/")
        if name == "TF":
            assert set(display["Frames"]) - {"All Enabled"} <= FRAMES
        elif name == "Grid":
            assert display["Reference Frame"] in FRAMES
        else:
            topic = display["Topic"]
            shown.add(topic["Value"])
            assert type_name(server.types[topic["Value"]]) == DISPLAYS[name]
            qos = server.qos[topic["Value"]]
            assert qos.reliability is ReliabilityPolicy.RELIABLE
            latched = qos.durability is DurabilityPolicy.TRANSIENT_LOCAL
            assert topic["Durability Policy"] == ("Transient Local" if latched else "Volatile")
    assert len(shown) == len(DISPLAYS)
    tools = {tool["Class"]: tool for tool in view["Tools"]}
    assert tools["rviz_default_plugins/SetGoal"]["Topic"]["Value"] == GOAL_POSE


def test_foxglove_shows_what_is_published(server: Node) -> None:
    layout = json.loads((VIEWS / "foxglove_layout.json").read_text("utf-8"))
    panels = layout["configById"]
    assert sorted(laid_out(layout["layout"])) == sorted(panels)
    for name, panel in panels.items():
        kind = name.split("!")[0]
        if kind == "3D":
            assert {panel["fixedFrame"], panel["followTf"]} <= FRAMES
            assert {one.removeprefix("frame:") for one in panel["transforms"]} <= FRAMES
            assert {layer["frameId"] for layer in panel["layers"].values()} <= FRAMES
            assert {type_name(server.types[topic]) for topic in panel["topics"]} <= PLACED
            assert panel["publish"]["poseTopic"] == GOAL_POSE
        elif kind == "map":
            for topic in (panel["followTopic"], *panel["topics"]):
                assert type_name(server.types[topic]) == "sensor_msgs/msg/NavSatFix"
        elif kind in ("Plot", "StateTransitions"):
            for path in panel["paths"]:
                topic, field = path["value"].split(".", 1)
                assert is_field(server.types[topic], field), path["value"]
                has_stamp = is_field(server.types[topic], "header.stamp.sec")
                assert has_stamp or path["timestampMethod"] == "receiveTime"
        else:
            assert kind == "DiagnosticSummary"
            type_ = type_name(server.types[panel["topicToRender"]])
            assert type_ == "diagnostic_msgs/msg/DiagnosticArray"


def test_a_field_that_does_not_exist_is_found_out(server: Node) -> None:
    odometry = server.types[f"/{SERVER_NODE_NAME}/odometry"]
    assert is_field(odometry, "pose.pose.position.z")
    assert not is_field(odometry, "pose.position.z")
    assert not is_field(odometry, "pose.pose")


def laid_out(layout: Any) -> list[str]:
    """Return the panels of a layout."""
    if isinstance(layout, str):
        return [layout]
    return [*laid_out(layout["first"]), *laid_out(layout["second"])]
