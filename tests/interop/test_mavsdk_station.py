"""MAVSDK is the ground station while ROS goals fly; the server passes on what they say.

Real processes and real UDP: simulator, navigation server and MAVSDK, which hears of the vehicle
by the server's `gcs_links` only. What its acts do to a goal is in docs/ground_stations.md.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from action_msgs.msg import GoalStatus

from custom_interfaces.action import Navigate, NavigateWaypoints
from custom_interfaces.msg import GoalCode, Waypoint
from drone_navigation.processes import free_udp_port
from tests.support.ros_flight import Flight, GoalRecord, navigate_goal

pytest.importorskip("mavsdk", reason="MAVSDK from PyPI is not installed")

from tests.support.mavsdk_station import Station, listening, wait

pytestmark = [pytest.mark.xdist_group("mavsdk_station"), pytest.mark.timeout(120)]
STATION = "Station 245/190"


class Watched:
    """A flight that MAVSDK watches through the server."""

    def __init__(self, flight: Flight, station: Station) -> None:
        self.flight = flight
        self.station = station

    def fly(self, x: float, y: float, z: float) -> GoalRecord:
        """A goal by setpoints that is under way."""
        record = self.flight.send(navigate_goal(x, y, z))
        assert record.accepted, self.flight.rejections
        self.flight.wait_for_status(record, Navigate.Feedback.STATUS_NAVIGATING)
        return record

    def fly_mission(self, *points: tuple[float, float, float]) -> GoalRecord:
        """A goal that the autopilot flies as a mission, under way."""
        goal = NavigateWaypoints.Goal(execution=NavigateWaypoints.Goal.EXECUTION_MISSION)
        for x, y, z in points:
            waypoint = Waypoint()
            waypoint.position.x, waypoint.position.y, waypoint.position.z = x, y, z
            goal.waypoints.append(waypoint)
        record = self.flight.send(goal)
        assert record.accepted, self.flight.rejections
        self.flight.wait_for_status(record, Navigate.Feedback.STATUS_NAVIGATING)
        return record

    def cancelled(self, record: GoalRecord, how: str) -> str:
        """The goal's message, once it has ended CANCELED by what the station did."""
        result = self.flight.wait_for_result(record)
        assert record.status == GoalStatus.STATUS_CANCELED, result.message
        assert result.error_code == GoalCode.CANCELED, result.message
        assert STATION in result.message
        assert how in result.message
        return str(result.message)

    def taken_over(self, record: GoalRecord, how: str) -> str:
        """The goal's message, once it has ended because the station flies."""
        result = self.flight.wait_for_result(record)
        assert record.status == GoalStatus.STATUS_ABORTED, result.message
        assert result.error_code == GoalCode.PILOT_OVERRIDE, result.message
        assert STATION in result.message
        assert how in result.message
        return str(result.message)

    def places(self) -> list[tuple[int, int]]:
        """The mission that the vehicle has, as the station downloads it: latitudes, longitudes."""
        return [(item.x, item.y) for item in self.station.mission.download_mission()]


def begun(folder: Path, *simulator: str) -> Iterator[Watched]:
    port = free_udp_port()
    link = f"gcs_links:=['udpout://127.0.0.1:{port}']"
    flight = Flight(folder, "--ros-args", "-p", link, "--", simulator=simulator)
    try:
        with listening(port) as station:
            wait(lambda: station.telemetry.health().is_home_position_ok, "home")
            yield Watched(flight, station)
    finally:
        flight.close()


@pytest.fixture(scope="module")
def ardupilot(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Watched]:
    yield from begun(tmp_path_factory.mktemp("ardupilot"))


def test_a_station_reads_parameters_and_positions_while_a_goal_flies(ardupilot: Watched) -> None:
    record = ardupilot.fly(8.0, 0.0, 4.0)
    assert ardupilot.station.param.get_param_float("WPNAV_SPEED") == 1000.0
    everything = ardupilot.station.param.get_all_params()
    names = {each.name for each in (*everything.float_params, *everything.int_params)}
    assert {"WPNAV_SPEED", "RTL_ALT", "SYSID_MYGCS"} <= names
    result = ardupilot.flight.wait_for_result(record)
    assert result.success, result.message
    assert ardupilot.station.north_east_up() == pytest.approx((0.0, 8.0, 4.0), abs=1.0)
