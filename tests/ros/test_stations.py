"""A client of an action sees a ground station cancel or pause its goal."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from action_msgs.msg import GoalStatus, GoalStatusArray
from rclpy.qos import qos_profile_action_status_default

from custom_interfaces.msg import Fence, FenceArea, GoalEvent, StoredItems, VehicleStatus
from drone_navigation.processes import free_udp_port
from drone_navigation.qos import LATCHED_QOS
from mavlink_vehicle.codec import make
from navigation_bridge.names import ACTION_NAME, SERVER_NODE_NAME
from tests.support.ros.ros_flight import Flight, GoalRecord, navigate_goal
from tests.support.stations import missions
from tests.support.stations.pymavlink_station import PymavlinkStation

pytestmark = [pytest.mark.wide, pytest.mark.xdist_group("ros_stations")]
PAUSE_CONTINUE = 193
TARGET = {"target_system": 1, "target_component": 1}


class StationFlight(Flight):
    """A server with a ground station beside it, which lets pauses be pauses."""

    def __init__(self, folder: Path) -> None:
        """Start all."""
        port = free_udp_port()
        super().__init__(
            folder,
            "--ros-args",
            "-p", f"gcs_links:=['udpin://127.0.0.1:{port}']",
            "-p", "on_station_pause:=pause",
            "--",
        )  # fmt: skip
        self.station = PymavlinkStation(port)
        self.states: list[int] = []
        self.told: list[str] = []
        self.subscribe(
            GoalStatusArray,
            f"{ACTION_NAME}/_action/status",
            lambda message: self.states.append(message.status_list[-1].status),
            qos_profile_action_status_default,
        )
        self.subscribe(
            GoalEvent,
            f"{SERVER_NODE_NAME}/goal_events",
            lambda event: self.told.append(event.message),
            20,
        )

    def under_way(self) -> GoalRecord:
        """A goal that flies, with nothing seen yet of its end."""
        record = self.send(navigate_goal(60.0, 0.0, 3.0))
        assert record.accepted
        self.wait_for_status(record, "NAVIGATING")
        self.states.clear()
        self.told.clear()
        return record

    def close(self) -> None:
        """Stop all."""
        self.station.close()
        super().close()


@pytest.fixture(scope="module")
def watched(tmp_path_factory: pytest.TempPathFactory) -> Iterator[StationFlight]:
    flight = StationFlight(tmp_path_factory.mktemp("stations"))
    yield flight
    flight.close()


def test_a_goal_that_a_station_cancels_goes_through_canceling_to_canceled(
    watched: StationFlight,
) -> None:
    record = watched.under_way()
    watched.station.send(make("MISSION_CLEAR_ALL", **TARGET))
    result = watched.wait_for_result(record)
    assert record.status == GoalStatus.STATUS_CANCELED
    sentence = "Ground station 254/190 cleared the mission (MISSION_CLEAR_ALL)."
    assert result.message.startswith(f"CANCELED: {sentence}")
    assert "has stopped" in result.message
    states = list(dict.fromkeys(watched.states))
    assert states == [GoalStatus.STATUS_CANCELING, GoalStatus.STATUS_CANCELED]
    assert sentence in watched.told
    assert "CANCELLING" in record.statuses


def test_a_paused_goal_continues_when_the_station_says_so(watched: StationFlight) -> None:
    record = watched.under_way()
    pause = make("COMMAND_LONG", **TARGET, command=PAUSE_CONTINUE, param1=0.0)
    watched.station.send(pause)
    watched.wait_for_status(record, "PAUSED")
    answer = watched.call("resume")
    assert not answer.success
    assert "Ground station 254/190 paused the vehicle" in answer.message
    watched.station.send(make("COMMAND_LONG", **TARGET, command=PAUSE_CONTINUE, param1=1.0))
    watched.wait_for_status(record, "NAVIGATING")
    watched.cancel(record)
    result = watched.wait_for_result(record)
    assert record.status == GoalStatus.STATUS_CANCELED
    assert "Station" not in result.message


def test_what_a_station_uploads_is_on_latched_topics(watched: StationFlight) -> None:
    heard: dict[str, Any] = {}
    for name, kind in (
        ("fence", Fence),
        ("flight_volume", Fence),
        ("mission", StoredItems),
        ("rally_points", StoredItems),
        ("vehicle_status", VehicleStatus),
    ):
        topic = f"{SERVER_NODE_NAME}/{name}"
        watched.subscribe(kind, topic, partial(heard.__setitem__, name), LATCHED_QOS)
    watched.station.upload(missions.fence_with_hole(), 1)
    watched.station.upload([missions.rally_point()], 2)
    mission = [missions.home(), missions.take_off(10.0), missions.waypoint(30.0, 5.0, 12.0)]
    watched.station.upload(mission)

    def all_read() -> bool:
        return all(
            name in heard and (heard[name].areas if name == "fence" else heard[name].items)
            for name in ("fence", "mission", "rally_points")
        )

    watched.wait(all_read, 30.0, "the lists")
    square, hole = heard["fence"].areas
    assert (square.shape, square.inclusion, square.in_force) == (FenceArea.POLYGON, True, False)
    assert [(point.x, point.y) for point in square.points] == [
        (pytest.approx(e, abs=0.5), pytest.approx(n, abs=0.5))
        for n, e in ((-100.0, -100.0), (-100.0, 100.0), (100.0, 100.0), (100.0, -100.0))
    ]
    assert (hole.shape, hole.inclusion, hole.radius) == (FenceArea.CIRCLE, False, 8.0)
    (rally,) = heard["rally_points"].items
    assert (rally.position.x, rally.position.y) == pytest.approx((-10.0, 20.0), abs=0.3)
    assert [(item.number, item.command) for item in heard["mission"].items] == [(1, 22), (2, 16)]
    assert heard["mission"].items[1].position.z == pytest.approx(12.0, abs=0.3)
    assert heard["mission"].header.frame_id == "map"
    (volume,) = heard["flight_volume"].areas
    assert volume.in_force
    assert not volume.stored
    status = heard["vehicle_status"]
    assert 0.0 < status.battery_reserve < 1.0
    assert 0.0 <= status.battery_for_return < 0.5
    before = heard["mission"].id
    watched.station.upload(mission[:2])
    watched.wait(lambda: heard["mission"].id != before, 15.0, "the other mission")
