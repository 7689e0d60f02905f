"""A landing on a target, as a ROS 2 client and the command see it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

import pytest

from custom_interfaces.action import Land, Takeoff
from custom_interfaces.msg import GoalCode
from drone_navigation.processes import free_udp_port
from tests.support.processes import Process
from tests.support.ros.ros_flight import READY_TIMEOUT_S, Flight
from tests.support.ros.target_publisher import TargetPublisher

pytestmark = [pytest.mark.wide, pytest.mark.xdist_group("ros_orbit")]
CLIENT = ["python", "-m", "drone_navigation.navigation_client"]


TARGET = ["python", "-m", "drone_navigation.navigation_target"]


@pytest.fixture
def flight(tmp_path: Path) -> Iterator[Flight]:
    made = Flight(tmp_path, simulator=("--autopilot", "px4"))
    yield made
    made.close()


def test_a_client_and_the_command_land_on_a_target(flight: Flight) -> None:
    target = TargetPublisher(flight, (0.0, 1.0))
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


def test_the_mark_of_a_simulated_world_is_landed_on_by_what_its_camera_sees(
    tmp_path: Path,
) -> None:
    port = free_udp_port()
    camera = ("--mark", "1.5,1", "--camera", f"udpout://127.0.0.1:{port}")
    lands_on_targets = ("--param", "PLND_ENABLED=1", "--param", "PLND_TYPE=1")
    flight = Flight(tmp_path, simulator=(*camera, *lands_on_targets))
    relay = Process(
        "navigation_target", [*TARGET, "--link", f"udpin://127.0.0.1:{port}"], flight.environment
    )
    try:
        relay.wait_for("Publishes on /target", READY_TIMEOUT_S)
        assert flight.wait_for_result(flight.send(Takeoff.Goal(height=5.0))).success
        goal = Land.Goal(target_topic="/target", target_required=True, retries=1)
        result = flight.wait_for_result(flight.send(goal))
        assert result.error_code == GoalCode.SUCCESS, result.message
        position = result.final_pose.pose.position
        assert (position.x, position.y) == pytest.approx((1.0, 1.5), abs=0.3)
        assert result.lateral_error < 0.3
        assert relay.stop() == 0, relay.text
    finally:
        relay.stop()
        flight.close()
