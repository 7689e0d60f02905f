"""A landing on a target, as a ROS 2 client and the command see it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

import pytest
from geometry_msgs.msg import PoseStamped, TransformStamped
from tf2_msgs.msg import TFMessage

from custom_interfaces.action import Land, Takeoff
from custom_interfaces.msg import GoalCode
from tests.support.processes import Process
from tests.support.ros.ros_flight import Flight

pytestmark = [pytest.mark.wide, pytest.mark.xdist_group("ros_orbit")]
CLIENT = ["python", "-m", "drone_navigation.navigation_client"]


@pytest.fixture
def flight(tmp_path: Path) -> Iterator[Flight]:
    made = Flight(tmp_path, simulator=("--autopilot", "px4"))
    yield made
    made.close()


class Target:
    """Publishes poses at 10 Hz, 2 m to the east and 1 m to the north, in a frame of its own."""

    def __init__(self, flight: Flight) -> None:
        self._clock = flight.node.get_clock()
        self._poses = flight.advertise(PoseStamped, "/target", 10)
        self._transforms = flight.advertise(TFMessage, "/tf", 10)
        self._timer = flight.node.create_timer(0.1, self._publish)
        self.is_silent = False

    def _publish(self) -> None:
        if self.is_silent:
            return
        stamp = self._clock.now().to_msg()
        pose = PoseStamped()
        pose.header.stamp, pose.header.frame_id = stamp, "field"
        pose.pose.position.x = 2.0
        self._poses.publish(pose)
        field = TransformStamped(child_frame_id="field")
        field.header.stamp, field.header.frame_id = stamp, "map"
        field.transform.translation.y = 1.0
        self._transforms.publish(TFMessage(transforms=[field]))


def test_a_client_and_the_command_land_on_a_target(flight: Flight) -> None:
    target = Target(flight)
    target.is_silent = True
    assert flight.wait_for_result(flight.send(Takeoff.Goal(height=3.0))).success
    assert not flight.send(Land.Goal(target_topic="/no name")).accepted
    result = flight.wait_for_result(
        flight.send(Land.Goal(target_topic="/target", target_required=True))
    )
    assert result.error_code == GoalCode.NO_LANDING_TARGET, result.message
    assert math.isnan(result.lateral_error)

    target.is_silent = False
    record = flight.send(Land.Goal(target_topic="/target", target_required=True))
    result = flight.wait_for_result(record)
    assert result.error_code == GoalCode.SUCCESS, result.message
    position = result.final_pose.pose.position
    assert (position.x, position.y) == pytest.approx((2.0, 1.0), abs=0.4)
    assert result.lateral_error < 0.4
    assert record.feedback[0].current_status == "HOLDING"

    assert flight.wait_for_result(flight.send(Takeoff.Goal(height=3.0))).success
    words = ["land", "--on", "/target", "--required", "--retries", "1", "--json"]
    shown = Process("client", [*CLIENT, *words], flight.environment)
    flight.wait(lambda: "from the target" in shown.text, 120.0, "the end of the landing")
    assert shown.wait(30.0) == 0, shown.text
