"""Messages of velocity commands."""

from __future__ import annotations

import pytest
from geometry_msgs.msg import Twist

from drone_navigation.server.subscribing.velocity_topic import StampDelays, command_of
from navigation_core.tasks.inputs.velocity_command import VelocityCommand, VelocityFrame


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


def test_a_delayed_command_is_older_than_the_quickest_whatever_the_clocks_show() -> None:
    for set_s in (0.0, -3600.0, 86400.0, 1.7e9):
        delays = StampDelays()
        for number in range(20):
            now = 0.1 * number
            assert delays.delay_s(now + set_s, now) == pytest.approx(0.0, abs=1e-6)
        assert delays.delay_s(2.0 + set_s, 5.0) == pytest.approx(3.0, abs=1e-6)
        assert delays.delay_s(5.1 + set_s, 5.1) == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("step_s", [-3600.0, 86400.0])
def test_a_publishers_clock_that_is_set_does_not_count_as_a_delay_for_long(step_s: float) -> None:
    delays, late = StampDelays(), []
    for number in range(600):
        now = 0.1 * number
        late.append(delays.delay_s(now + (step_s if now > 20.0 else 0.0), now) > 0.5)
    # Set back, its stamps look old until those from before the step do not count any more.
    assert sum(late) == pytest.approx(100 if step_s < 0.0 else 0, abs=1)
    assert not any(late[310:])
