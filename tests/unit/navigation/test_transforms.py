"""The published tree of frames: REP 105, one parent each, and what is not known is left out."""

from __future__ import annotations

from typing import Any

import pytest
from builtin_interfaces.msg import Time

from drone_navigation.server.frame_names import FrameNames
from drone_navigation.server.publishing.telemetry_messages import geo_pose
from drone_navigation.server.publishing.transforms import Transforms, geoid_height_m
from mavlink_vehicle.state.telemetry import GlobalPosition, GpsFix
from mavlink_vehicle.state.vehicle_state import VehicleState
from navigation_bridge.configuration.sensor_poses import SensorPose
from navigation_bridge.configuration.server_config import PublishTf
from navigation_bridge.vehicle.map_frame import MapPose

STAMP = Time(sec=7)
ORIGIN = (47.0, 8.0, 500.0)
POSE = MapPose((1.0, 2.0, 3.0), 0.0, (0.0, 0.0, 0.0, 1.0))
MOUNTED = SensorPose.parse("0.2 0 0.1 0 0 180")


def state(ellipsoid_m: float | None = 547.5) -> VehicleState:
    gps = GpsFix(0.0, 3, 9, 0.8, 1.2, altitude_ellipsoid_m=ellipsoid_m, altitude_amsl_m=500.0)
    position = GlobalPosition(0.0, 0, 47.001, 8.001, 510.0, 10.0, (0.0, 0.0, 0.0), 0.0)
    return VehicleState(gps=gps, global_position=position)


class Node:
    """Keeps what is published, by topic."""

    def __init__(self) -> None:
        self.told: dict[str, list[Any]] = {}
        self.listeners = 1

    def create_publisher(self, _kind: Any, topic: str, _qos: Any) -> Any:
        told = self.told.setdefault(topic, [])

        class Publisher:
            publish = staticmethod(told.append)
            get_subscription_count = staticmethod(lambda: self.listeners)

        return Publisher

    def tree(self) -> dict[str, str]:
        """Return the parent of each frame; each has one."""
        latest = [self.told[topic][-1:] for topic in ("/tf", "/tf_static")]
        transforms = [one for messages in latest for m in messages for one in m.transforms]
        parents = {one.child_frame_id: one.header.frame_id for one in transforms}
        assert len(parents) == len(transforms)
        return parents


def published(
    prefix: str = "",
    which: PublishTf = PublishTf.ALL,
    sensors: tuple[str, ...] = ("laser",),
    pose: SensorPose = MOUNTED,
    ellipsoid_m: float | None = 547.5,
) -> Node:
    node = Node()
    transforms = Transforms(node, FrameNames(prefix), which)
    for frame_id in sensors:
        transforms.add_sensor(frame_id)
    transforms.follow(POSE, state())
    transforms.publish(STAMP)
    transforms.publish_still(ORIGIN, state(ellipsoid_m), pose, STAMP)
    return node


def test_the_tree_is_that_of_rep_105() -> None:
    assert published().tree() == {
        "map": "earth", "odom": "map", "base_link": "odom", "gps": "base_link",
        "laser": "base_link",
    }  # fmt: skip


def test_odom_is_followed_from_the_first_listener_on() -> None:
    node = Node()
    node.listeners = 0
    transforms = Transforms(node, FrameNames(), PublishTf.ALL)
    assert not transforms.are_followed(0.0)
    node.listeners = 1
    assert transforms.are_followed(1.0)
    node.listeners = 0
    assert transforms.are_followed(2.0)
    assert not transforms.are_heard(2.0)


def test_listeners_are_counted_four_times_a_second() -> None:
    node = Node()
    transforms = Transforms(node, FrameNames(), PublishTf.ALL)
    assert transforms.are_heard(5.0)
    node.listeners = 0
    assert transforms.are_heard(5.2)
    assert not transforms.are_heard(5.3)
    node.listeners = 1
    assert not transforms.are_heard(5.4)
    assert transforms.are_heard(0.1), "a recording that is played again begins earlier"


def test_each_of_several_vehicles_has_a_tree_on_one_earth() -> None:
    assert published("a/", sensors=("a/laser", "laser", "a/", "a/odom")).tree() == {
        "a/map": "earth", "a/odom": "a/map", "a/base_link": "a/odom", "a/gps": "a/base_link",
        "a/laser": "a/base_link",
    }  # fmt: skip


@pytest.mark.parametrize("name", ["map", "odom", "base_link", "gps", "earth", ""])
def test_a_sensor_in_a_frame_of_the_vehicle_adds_nothing(name: str) -> None:
    assert published(sensors=(name,)).tree() == published(sensors=()).tree()


def test_a_sensor_without_a_pose_and_an_earth_without_the_geoid_are_left_out() -> None:
    assert "laser" not in published(pose=SensorPose()).tree()
    assert "map" not in published(ellipsoid_m=None).tree()


def test_what_a_robot_model_has_is_left_to_it() -> None:
    assert "laser" not in published(which=PublishTf.VEHICLE).tree()
    assert published(which=PublishTf.VEHICLE).tree()["base_link"] == "odom"
    assert published(which=PublishTf.NONE).told == {}


def test_the_mounting_is_that_of_the_parameter() -> None:
    (message,) = published().told["/tf_static"]
    (laser,) = [one for one in message.transforms if one.child_frame_id == "laser"]
    moved, turn = laser.transform.translation, laser.transform.rotation
    assert (moved.x, moved.y, moved.z) == (0.2, 0.0, 0.1)
    assert (turn.x, turn.y, abs(turn.z), turn.w) == pytest.approx((0, 0, 1, 0), abs=1e-9)


def test_static_transforms_are_sent_on_change_all_at_once() -> None:
    node = Node()
    transforms = Transforms(node, FrameNames(), PublishTf.ALL)
    told = node.told["/tf_static"]

    def publish(origin: Any, ellipsoid_m: float) -> set[str]:
        transforms.publish_still(origin, state(ellipsoid_m), MOUNTED, STAMP)
        return {one.child_frame_id for one in told[-1].transforms}

    assert publish(None, 547.5) == {"gps"}
    assert publish(ORIGIN, 547.5) == {"gps", "map"}
    assert publish(ORIGIN, 547.6) == {"gps", "map"}  # noise of the receiver
    assert len(told) == 2
    transforms.add_sensor("laser")
    assert publish(ORIGIN, 547.5) == {"gps", "map", "laser"}
    publish((47.1, 8.0, 500.0), 547.5)
    assert len(told) == 4
    transforms.begin_again()
    publish((47.1, 8.0, 500.0), 547.5)
    assert len(told) == 5


def test_a_geodetic_pose_is_above_the_ellipsoid_or_says_nothing() -> None:
    known = geo_pose(POSE, state(), geoid_height_m(state()), STAMP)
    place = known.pose.position
    assert (place.latitude, place.longitude, place.altitude) == (47.001, 8.001, 557.5)
    assert known.pose.orientation.w == 1.0
    assert known.header.stamp == STAMP
    unknown = geo_pose(POSE, state(None), geoid_height_m(state(None)), STAMP)
    assert unknown.pose.position.altitude != unknown.pose.position.altitude
