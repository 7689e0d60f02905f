"""Messages of velocity commands."""

from __future__ import annotations

import pytest
from geometry_msgs.msg import Twist

from drone_navigation.server.subscribing.velocity_topic import command_of
from navigation_core.tasks.velocity_command import VelocityCommand, VelocityFrame


def twist() -> Twist:
    message = Twist()
    message.linear.x, message.linear.y, message.linear.z = 1.0, 2.0, 3.0
    message.angular.x, message.angular.y, message.angular.z = 7.0, 8.0, 0.5
    return message


@pytest.mark.parametrize(
    ("frame_id", "frame"),
    [("", VelocityFrame.BODY), ("base_link", VelocityFrame.BODY), ("map", VelocityFrame.MAP)],
)
def test_a_twist_becomes_a_command(frame_id: str, frame: VelocityFrame) -> None:
    expected = VelocityCommand(12.0, frame, (1.0, 2.0, 3.0), 0.5)
    assert command_of(twist(), frame_id, 12.0) == expected


@pytest.mark.parametrize("frame_id", ["odom", "Map", "base_link ", "wgs84", "drone1/map", "\n"])
def test_any_other_frame_is_rejected_by_name(frame_id: str) -> None:
    fault = command_of(twist(), frame_id, 12.0)
    assert isinstance(fault, str)
    assert f"unknown frame '{frame_id}'" in fault
    assert "'base_link' or 'map'" in fault
