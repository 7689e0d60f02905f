"""Subscriptions to the topics of vehicles, and nothing else: the reference of bench_console.

``bare_subscriber.py N`` listens to N vehicles, named as by fleet_client.py, until it is ended.
"""

from __future__ import annotations

import sys

import rclpy
from nav_msgs.msg import Odometry, Path
from sensor_msgs.msg import BatteryState, NavSatFix
from visualization_msgs.msg import MarkerArray

from custom_interfaces.action import Navigate
from custom_interfaces.msg import GoalEvent, HomePosition, VehicleStatus
from drone_navigation.qos import LATCHED_QOS, STREAM_QOS
from navigation_bridge.names import ACTION_NAME, SERVER_NODE_NAME
from tests.bench.fleet_client import name

_TOPICS = (
    (VehicleStatus, "vehicle_status", LATCHED_QOS),
    (HomePosition, "home", LATCHED_QOS),
    (Path, "plan", LATCHED_QOS),
    (MarkerArray, "obstacles", LATCHED_QOS),
    (GoalEvent, "goal_events", STREAM_QOS),
    (Odometry, "odometry", STREAM_QOS),
    (BatteryState, "battery", STREAM_QOS),
    (NavSatFix, "fix", STREAM_QOS),
)


def main() -> None:
    """Listen."""
    rclpy.init()
    node = rclpy.create_node("bare_subscriber")
    for number in range(int(sys.argv[1])):
        root = f"/{name(number)}"
        for kind, topic, qos in _TOPICS:
            node.create_subscription(kind, f"{root}/{SERVER_NODE_NAME}/{topic}", id, qos)
        feedback = Navigate.Impl.FeedbackMessage
        node.create_subscription(feedback, f"{root}/{ACTION_NAME}/_action/feedback", id, STREAM_QOS)
    print("ready", flush=True)
    rclpy.spin(node)


if __name__ == "__main__":
    main()
