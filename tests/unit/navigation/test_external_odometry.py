"""nav_msgs/Odometry in the autopilot's axes."""

from __future__ import annotations

import math

import pytest
from nav_msgs.msg import Odometry

from drone_navigation.server.subscribing.external_odometry import external_pose
from mavlink_vehicle.protocols.streams.external_position import ExternalPositionError
from navigation_bridge.configuration.make_config import ConfigurationError, make_config


def odometry() -> Odometry:
    message = Odometry(child_frame_id="base_link")
    message.header.frame_id = "map"
    place = message.pose.pose.position
    place.x, place.y, place.z = 10.0, 20.0, 5.0
    turn = message.pose.pose.orientation
    turn.w, turn.z = math.cos(math.pi / 4), math.sin(math.pi / 4)  # to the north
    message.twist.twist.linear.x = 2.0
    message.twist.twist.linear.y = 1.0
    message.twist.twist.angular.z = 0.5
    for index in range(6):
        message.pose.covariance[7 * index] = 0.1 * (index + 1)
        message.twist.covariance[7 * index] = 0.01 * (index + 1)
    return message


def test_a_pose_to_the_north_has_heading_zero() -> None:
    pose = external_pose(odometry(), 0.1, 50.0)
    assert pose.measured_s == pytest.approx(49.9)
    assert pose.position_ned_m == (20.0, 10.0, -5.0)
    assert abs(pose.attitude[0]) == pytest.approx(1.0)
    assert pose.velocity_frd_m_s == (2.0, -1.0, 0.0)
    assert pose.rates_frd_rad_s == (0.0, 0.0, -0.5)
    assert pose.pose_variance == pytest.approx((0.2, 0.1, 0.3, 0.5, 0.4, 0.6))
    assert pose.twist_variance == pytest.approx((0.01, 0.02, 0.03, 0.04, 0.05, 0.06))


def test_a_variance_of_zero_is_unknown() -> None:
    message = odometry()
    message.pose.covariance[35] = 0.0
    message.twist.covariance[0] = 0.0
    pose = external_pose(message, 0.0, 50.0)
    assert pose.pose_variance is None
    assert pose.velocity_frd_m_s is None
    assert pose.rates_frd_rad_s is None


@pytest.mark.parametrize(("frame", "child"), [("odom", "base_link"), ("map", "camera"), ("", "")])
def test_other_frames_are_rejected(frame: str, child: str) -> None:
    message = odometry()
    message.header.frame_id, message.child_frame_id = frame, child
    with pytest.raises(ExternalPositionError, match=f"'{frame}' and '{child}'"):
        external_pose(message, 0.0, 50.0)


def test_the_origin_is_three_numbers() -> None:
    config = make_config({"external_odometry_topic": "/o", "external_origin": "47.4 8.5 488"})
    assert config.vehicle.external_origin == (47.4, 8.5, 488.0)
    assert make_config({}).vehicle.external_origin is None
    for words in ("47.4 8.5", "a b c", "91 0 0", "0 181 0", "0 0 nan", "0 0 1e9"):
        with pytest.raises(ConfigurationError, match="external_origin"):
            make_config({"external_odometry_topic": "/o", "external_origin": words})
    with pytest.raises(ConfigurationError, match="needs external_odometry_topic"):
        make_config({"external_origin": "1 2 3"})
