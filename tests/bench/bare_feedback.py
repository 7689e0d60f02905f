"""The reference of bench_feedback: recv, pymavlink, publish, and nothing else.

Listens on the UDP port given, parses each datagram with pymavlink and publishes a feedback
message for each GLOBAL_POSITION_INT, where bare_subscriber.py listens. Waits for somebody who
subscribes. Prints {time_boot_ms: seconds of the monotonic clock after the publish} as JSON the
number of seconds given after the first one.
"""

from __future__ import annotations

import json
import math
import socket
import sys
import time

import rclpy
from pymavlink.dialects.v20 import all as mavlink
from rclpy.node import Node

from custom_interfaces.action import Navigate
from navigation_bridge.names import ACTION_NAME
from tests.bench.fleet_client import name


def main() -> None:
    """Serve one port for a while."""
    port, seconds = int(sys.argv[1]), float(sys.argv[2])
    rclpy.init()
    node = Node("bare_feedback")
    topic = f"/{name(0)}/{ACTION_NAME}/_action/feedback"
    publisher = node.create_publisher(Navigate.Impl.FeedbackMessage, topic, 10)
    while not publisher.get_subscription_count():
        time.sleep(0.05)
    parser = mavlink.MAVLink(None, srcSystem=1, srcComponent=191)
    parser.robust_parsing = True
    left_s: dict[int, float] = {}
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as link:
        link.bind(("127.0.0.1", port))
        link.settimeout(0.5)
        print("ready", flush=True)
        end_s = math.inf
        while time.monotonic() < end_s:
            try:
                data, peer = link.recvfrom(65535)
            except TimeoutError:
                continue
            for message in parser.parse_buffer(data) or []:
                if message.get_type() == "HEARTBEAT":
                    request = mavlink.MAVLink_command_long_message(
                        1, 1, 511, 0, 33.0, 20000.0, 0.0, 0.0, 0.0, 0.0, 0.0
                    )
                    link.sendto(request.pack(parser), peer)
                if message.get_type() != "GLOBAL_POSITION_INT":
                    continue
                feedback = Navigate.Impl.FeedbackMessage()
                feedback.feedback.current_pose.pose.position.x = message.lat * 1e-7
                feedback.feedback.current_pose.pose.position.y = message.lon * 1e-7
                publisher.publish(feedback)
                left_s[message.time_boot_ms] = time.monotonic()
                if math.isinf(end_s):
                    end_s = time.monotonic() + seconds
    print(json.dumps(left_s), flush=True)
    node.destroy_node()
    rclpy.shutdown()


if __name__ == "__main__":
    main()
