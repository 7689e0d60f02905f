"""Joins a ROS domain and reports, as JSON, when all servers are found: ``NAME SECONDS ...``.

Prints ``{"found_s": ...}``, then stays SECONDS, then prints what endpoints the servers have.
"""

from __future__ import annotations

import json
import sys
import time
from collections import Counter

import rclpy
from rclpy.action import ActionClient
from rclpy.node import Node

from custom_interfaces.action import Navigate
from navigation_bridge.names import ACTION_NAME, SERVER_NODE_NAME

_TIMEOUT_S = 60.0


def main() -> int:
    """Find the servers of the names that are given."""
    stay_s, names = float(sys.argv[1]), sys.argv[2:]
    started_s = time.monotonic()
    rclpy.init()
    node = Node("discovery_prober")
    clients = [ActionClient(node, Navigate, f"/{name}/{ACTION_NAME}") for name in names]
    while not all(client.server_is_ready() for client in clients):
        if time.monotonic() > started_s + _TIMEOUT_S:
            return 1
        rclpy.spin_once(node, timeout_sec=0.01)
    print(json.dumps({"found_s": time.monotonic() - started_s}), flush=True)
    until_s = time.monotonic() + stay_s
    while time.monotonic() < until_s:
        rclpy.spin_once(node, timeout_sec=0.1)
    print(json.dumps({"endpoints": _endpoints(node)}), flush=True)
    for client in clients:
        client.destroy()
    node.destroy_node()
    rclpy.shutdown()
    return 0


def _endpoints(node: Node) -> dict[str, int]:
    """Return how many writers and readers each server has, all kinds of topics counted."""
    counts: Counter[str] = Counter()
    for topic, _types in node.get_topic_names_and_types(no_demangle=True):
        for info in (
            *node.get_publishers_info_by_topic(topic, no_mangle=True),
            *node.get_subscriptions_info_by_topic(topic, no_mangle=True),
        ):
            if info.node_name == SERVER_NODE_NAME:
                counts[info.node_namespace] += 1
    return dict(counts)


if __name__ == "__main__":
    sys.exit(main())
