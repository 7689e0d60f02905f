"""The gimbal and the camera of a vehicle over ROS: action, service, topics and client."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from typing import Any

import pytest
from rclpy.action import ActionClient

from custom_interfaces.action import PointGimbal
from custom_interfaces.msg import GimbalState, GoalCode, ImageCaptured
from drone_navigation.qos import STREAM_QOS
from tests.support.processes import Process
from tests.support.ros.ros_flight import Flight

pytestmark = [pytest.mark.wide, pytest.mark.xdist_group("ros_gimbal")]
CLIENT = ["python", "-m", "drone_navigation.navigation_client"]
ANSWER_S = 30.0


@pytest.fixture(scope="module")
def flight(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Flight]:
    own = ("--param", "CAM1_TYPE=1", "--param", "MNT1_TYPE=1")
    flight = Flight(tmp_path_factory.mktemp("gimbal"), simulator=own)
    yield flight
    flight.close()


def pointed(flight: Flight, goal: PointGimbal.Goal) -> tuple[Any, list[Any]]:
    """Send a goal; return its result and its feedback."""
    client = ActionClient(flight.node, PointGimbal, "point_gimbal")
    assert client.wait_for_server(timeout_sec=ANSWER_S)
    feedback: list[Any] = []
    sent = client.send_goal_async(goal, lambda message: feedback.append(message.feedback))
    flight.wait(sent.done, ANSWER_S, "an answer to the goal")
    ended = sent.result().get_result_async()
    flight.wait(ended.done, ANSWER_S, "the result")
    client.destroy()
    return ended.result().result, feedback


def test_a_gimbal_is_pointed_and_its_state_published(flight: Flight) -> None:
    states: list[GimbalState] = []
    flight.subscribe(GimbalState, "navigation_server/gimbal_state", states.append, STREAM_QOS)
    result, feedback = pointed(flight, PointGimbal.Goal(pitch=-0.5, yaw=0.25))
    assert result.success, result.message
    assert result.error_code == GoalCode.SUCCESS
    assert feedback[-1].pitch == pytest.approx(-0.5, abs=0.01)
    flight.wait(lambda: bool(states), 10.0, "a state of the gimbal")
    assert (states[-1].pitch, states[-1].yaw) == pytest.approx((-0.5, 0.25), abs=0.01)
    assert not states[-1].yaw_locked
    bad, _ = pointed(flight, PointGimbal.Goal(pitch=math.nan))
    assert bad.error_code == GoalCode.INVALID_NUMBER
    assert bad.message.startswith("INVALID_NUMBER: pitch is nan")


def test_a_photo_is_taken_and_published(flight: Flight) -> None:
    photos: list[ImageCaptured] = []
    flight.subscribe(ImageCaptured, "navigation_server/image_captured", photos.append, STREAM_QOS)
    answer = flight.call("trigger_camera")
    assert answer.success, answer.message
    flight.wait(lambda: bool(photos), 10.0, "a photo")
    assert photos[0].success
    assert photos[0].index >= 1
    assert abs(photos[0].latitude) > 1.0


def test_the_client_points_and_shoots(flight: Flight) -> None:
    for arguments, event in (
        (["point", "--angle", "-90", "0"], "point"),
        (["point", "--at", "10", "5", "0"], "point"),
        (["point", "--release"], "point"),
        (["photo"], "photo"),
    ):
        client = Process("client", [*CLIENT, *arguments, "--json"], flight.environment)
        assert client.wait(ANSWER_S) == 0, client.text
        said = json.loads(client.text.splitlines()[-1])
        assert said["event"] == event
        assert said["message"].startswith("SUCCESS: ")
