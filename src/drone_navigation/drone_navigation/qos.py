"""QoS profiles of publishers and subscriptions, and how long action servers keep results."""

from __future__ import annotations

from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy

# For state, which late subscribers need as well.
LATCHED_QOS = QoSProfile(
    history=HistoryPolicy.KEEP_LAST,
    depth=1,
    reliability=ReliabilityPolicy.RELIABLE,
    durability=DurabilityPolicy.TRANSIENT_LOCAL,
)
# For what comes again and again. Reliable, because it also serves those who ask for best
# effort, and those who ask for reliable get nothing else.
STREAM_QOS = QoSProfile(
    history=HistoryPolicy.KEEP_LAST, depth=10, reliability=ReliabilityPolicy.RELIABLE
)
# For requests about goals and their answers. With ROS's own depth of 10 those of a program that
# sends more at once would be lost, without a word.
REQUEST_QOS = QoSProfile(
    history=HistoryPolicy.KEEP_LAST, depth=100, reliability=ReliabilityPolicy.RELIABLE
)

RESULT_TIMEOUT_S = 300
"""How long an action server keeps the result of an ended goal, for clients that ask late.

A client may have been suspended, or its host cut off. rcl's own default of 900 s grows memory
(ros2/rclpy issue 1300).
"""
