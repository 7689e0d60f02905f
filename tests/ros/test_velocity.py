"""Velocity commands through real DDS, published as teleop_twist_keyboard publishes them."""

from __future__ import annotations

import math
import signal
from collections.abc import Iterator
from pathlib import Path

import pytest
from action_msgs.msg import GoalStatus
from geometry_msgs.msg import PoseStamped, Twist

from custom_interfaces.action import FollowVelocity, Takeoff
from custom_interfaces.msg import GoalCode, GoalEvent
from navigation_bridge.names import SERVER_NODE_NAME
from tests.support.ros.ros_flight import Flight, navigate_goal
from tests.support.ros.teleop import SPEED_M_S, Teleop

pytestmark = [pytest.mark.wide, pytest.mark.xdist_group("ros_actions")]


class Watch:
    """Where the vehicle is, and what became of its goals."""

    def __init__(self, flight: Flight) -> None:
        """Subscribe."""
        self.poses: list[PoseStamped] = []
        self.events: list[GoalEvent] = []
        flight.subscribe(PoseStamped, f"{SERVER_NODE_NAME}/pose", self.poses.append, 10)
        flight.subscribe(GoalEvent, f"{SERVER_NODE_NAME}/goal_events", self.events.append, 10)
        flight.wait(lambda: bool(self.poses), 10.0, "a pose")

    @property
    def place(self) -> tuple[float, float, float]:
        """The last position, map frame."""
        position = self.poses[-1].pose.position
        return (position.x, position.y, position.z)


def up(flight: Flight) -> None:
    result = flight.wait_for_result(flight.send(Takeoff.Goal(height=3.0)))
    assert result.success, result.message


@pytest.fixture
def steered(tmp_path: Path) -> Iterator[Flight]:
    flight = Flight(tmp_path)
    yield flight
    flight.close()


@pytest.fixture
def plain(tmp_path: Path) -> Iterator[Flight]:
    given = ("-p", "cmd_vel_type:=plain", "-p", "cmd_vel_start:=command")
    flight = Flight(tmp_path, "--ros-args", *given, "--")
    yield flight
    flight.close()


def said(flight: Flight) -> str:
    assert flight.server is not None
    return flight.server.text


def test_stamped_commands_fly_the_vehicle_during_a_goal_and_stop_with_them(
    steered: Flight,
) -> None:
    up(steered)
    watch, teleop = Watch(steered), Teleop(steered, stamped=True)
    before = watch.place
    teleop.hold("i", 1.0)
    assert math.dist(watch.place, before) < 0.4  # nothing without a goal
    steered.wait(lambda: "Velocity commands are ignored" in said(steered), 5.0, "a warning")

    record = steered.send(FollowVelocity.Goal(max_speed=1.0))
    assert record.accepted
    steered.wait_for_status(record, "HOLDING")
    teleop.hold("i", 5.0)
    assert record.feedback[-1].current_status == "NAVIGATING"
    assert record.feedback[-1].ground_speed == pytest.approx(SPEED_M_S, abs=0.2)
    assert math.isfinite(record.feedback[-1].course)
    assert record.feedback[-1].climb_rate == pytest.approx(0.0, abs=0.2)
    assert record.feedback[-1].limited_by == ""
    flown_m = math.dist(watch.place, before)
    assert 1.0 < flown_m < 1.3 * SPEED_M_S * 6.0
    steered.wait_for_status(record, "HOLDING")  # silence
    steered.spin_for(2.0)
    place = watch.place
    steered.spin_for(2.0)
    assert math.dist(watch.place, place) < 0.3
    assert record.feedback[-1].height == pytest.approx(3.0, abs=0.8)

    for twist, frame_id, words in (
        (Twist(), "odom", "unknown frame 'odom'; use 'base_link' or 'map'"),
        (nan_twist(), "map", "linear (nan, 0, 0) m/s"),
    ):
        teleop.hold("k", 5.5)  # a warning is given at most every 5 s
        teleop.publish(twist, frame_id=frame_id)
        steered.wait(lambda words=words: words in said(steered), 5.0, words)  # type: ignore[misc]
    teleop.hold("k", 5.5)
    old = Twist()
    old.linear.x = 3.0
    place = watch.place
    for _ in range(10):
        teleop.publish(old, age_s=3)
        steered.spin_for(0.1)
    assert "its stamp is 3.0" in said(steered)
    assert math.dist(watch.place, place) < 0.3

    teleop.hold("i", 1.0)
    steered.cancel(record)
    result = steered.wait_for_result(record)
    assert record.status == GoalStatus.STATUS_CANCELED
    assert result.error_code == GoalCode.CANCELED, result.message


def nan_twist() -> Twist:
    twist = Twist()
    twist.linear.x = math.nan
    return twist


def test_a_key_starts_a_goal_where_that_is_allowed_and_a_server_that_stops_stops_the_vehicle(
    plain: Flight,
) -> None:
    up(plain)
    watch, teleop = Watch(plain), Teleop(plain, stamped=False)
    teleop.hold("k", 0.5)
    assert not [event for event in watch.events if event.event == "ACCEPTED"]
    before = watch.place
    teleop.hold("i", 4.0)
    plain.wait(lambda: bool(started(watch)), 5.0, "a goal")
    assert math.dist(watch.place, before) > 0.7
    height_m = watch.place[2]
    teleop.hold("t", 3.0)
    assert watch.place[2] > height_m + 0.6
    teleop.hold("k", 1.0)

    assert plain.call("hold").success
    place = watch.place
    teleop.hold("i", 2.0)  # hold is hold
    assert math.dist(watch.place, place) < 0.4
    assert "send a goal first (follow_velocity)" in said(plain)

    result = plain.wait_for_result(plain.send(navigate_goal(0.0, 0.0, 3.0)))
    assert result.success, result.message
    count = len(started(watch))
    teleop.hold("k", 0.3)
    teleop.hold("i", 2.0)
    assert len(started(watch)) == count + 1
    assert plain.server is not None
    plain.server.signal(signal.SIGINT)
    plain.server.wait(20.0)
    assert "ended: SHUTTING_DOWN: The navigation server was stopped." in said(plain)


def started(watch: Watch) -> list[GoalEvent]:
    return [event for event in watch.events if event.event == "ACCEPTED"]


def test_a_plane_flies_a_course_and_a_climb_and_reports_both(tmp_path: Path) -> None:
    settings = ("-p", "volume_radius_m:=3000.0", "-p", "speed_up_m_s:=3.0")
    flight = Flight(tmp_path, "--ros-args", *settings, "--", simulator=("--vehicle", "plane"))
    try:
        result = flight.wait_for_result(flight.send(Takeoff.Goal(height=50.0)), 120.0)
        assert result.success, result.message
        teleop = Teleop(flight, stamped=True)
        record = flight.send(FollowVelocity.Goal(max_speed=20.0))
        assert record.accepted
        flight.wait_for_status(record, "HOLDING")
        twist = Twist()
        twist.linear.y, twist.linear.z = 20.0, 2.0
        for _ in range(150):
            teleop.publish(twist, frame_id="map")
            flight.spin_for(0.1)
        last = record.feedback[-1]
        assert last.current_status == "CLIMBING"
        assert last.course == pytest.approx(0.5 * math.pi, abs=0.1)
        assert last.climb_rate == pytest.approx(2.0, abs=0.6)
        assert last.limited_by == ""
        twist.linear.y = 3.0
        for _ in range(15):
            teleop.publish(twist, frame_id="map")
            flight.spin_for(0.1)
        assert record.feedback[-1].current_status == "BLOCKED"
        assert "the least airspeed of this plane" in record.feedback[-1].limited_by
        flight.cancel(record)
        assert flight.wait_for_result(record).error_code == GoalCode.CANCELED
    finally:
        flight.close()
