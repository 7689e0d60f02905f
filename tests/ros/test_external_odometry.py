"""External odometry from a topic to the vehicle's link."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from nav_msgs.msg import Odometry

from tests.support.ros.ros_flight import Flight

pytestmark = [pytest.mark.wide, pytest.mark.xdist_group("ros_external")]


@pytest.fixture(scope="module")
def flight(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Flight]:
    parameter = "external_odometry_topic:=/camera/odometry"
    folder = tmp_path_factory.mktemp("external")
    flight = Flight(folder, "--ros-args", "-p", parameter, "--")
    yield flight
    flight.close()


def test_odometry_of_the_topic_reaches_the_link_and_bad_ones_are_rejected(flight: Flight) -> None:
    publisher = flight.advertise(Odometry, "/camera/odometry", 10)
    flight.wait(lambda: publisher.get_subscription_count() > 0, 20.0, "a subscription")
    message = Odometry(child_frame_id="base_link")
    message.header.frame_id = "map"
    message.pose.pose.position.x = 3.0
    message.pose.pose.orientation.w = 1.0

    def publish() -> None:
        message.header.stamp = flight._node.get_clock().now().to_msg()
        publisher.publish(message)

    def arrived() -> bool:
        publish()
        return bool(flight.relay.from_server("VISION_POSITION_ESTIMATE"))

    flight.wait(arrived, 10.0, "a position")
    (sent, *_) = flight.relay.from_server("VISION_POSITION_ESTIMATE")
    assert (sent.x, sent.y) == (0.0, 3.0)  # east
    assert abs(sent.yaw) == pytest.approx(1.5708, abs=1e-3)
    assert flight.server is not None
    message.header.frame_id = "odom"
    publish()
    flight.server.wait_for("External odometry ignored: External odometry is in the frames", 10.0)
    message.header.frame_id = "map"
    message.header.stamp.sec = 0
    message.header.stamp.nanosec = 0
    publisher.publish(message)
    flight.server.wait_for("External odometry has no stamp", 10.0)
