"""MAVSDK is the ground station while ROS goals fly; the server passes on what they say.

Real processes and real UDP: simulator, navigation server and MAVSDK, which hears of the vehicle
by the server's `gcs_links` only. docs/ground_stations.md says what its acts do to a goal.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from action_msgs.msg import GoalStatus

from custom_interfaces.action import Navigate, NavigateWaypoints
from custom_interfaces.msg import Waypoint
from drone_navigation.processes import free_udp_port
from tests.support.ros.ros_flight import Flight, GoalRecord, navigate_goal

pytest.importorskip("mavsdk", reason="MAVSDK from PyPI is not installed")

from tests.support.stations.mavsdk_station import WAIT_S, Station, listening, wait, within

pytestmark = [pytest.mark.wide, pytest.mark.xdist_group("mavsdk_station")]
STATION = "Ground station 245/190"


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
        return self._ended(record, GoalStatus.STATUS_CANCELED, "CANCELED", how)

    def taken_over(self, record: GoalRecord, how: str) -> str:
        """The goal's message, once it has ended because the station flies."""
        return self._ended(record, GoalStatus.STATUS_ABORTED, "PILOT_OVERRIDE", how)

    def _ended(self, record: GoalRecord, status: int, code: str, how: str) -> str:
        result = self.flight.wait_for_result(record)
        assert record.status == status, result.message
        assert result.message.startswith(f"{code}: "), result.message
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


@pytest.fixture(scope="module")
def px4(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Watched]:
    yield from begun(tmp_path_factory.mktemp("px4"), "--autopilot", "px4")


def test_a_station_reads_parameters_and_positions_while_a_goal_flies(ardupilot: Watched) -> None:
    record = ardupilot.fly(8.0, 0.0, 4.0)
    assert ardupilot.station.param.get_param_float("WPNAV_SPEED") == 1000.0
    everything = within(3.0 * WAIT_S, ardupilot.station.param.get_all_params)
    names = {each.name for each in (*everything.float_params, *everything.int_params)}
    assert {"WPNAV_SPEED", "RTL_ALT", "MAV_GCS_SYSID"} <= names
    result = ardupilot.flight.wait_for_result(record)
    assert result.success, result.message
    assert ardupilot.station.north_east_up() == pytest.approx((0.0, 8.0, 4.0), abs=1.0)


@pytest.mark.parametrize("by_mission", [False, True], ids=["setpoints", "mission"])
def test_clearing_the_mission_cancels_a_goal(ardupilot: Watched, by_mission: bool) -> None:
    """An ArduPilot in AUTO rejects it, and is stopped by the server."""
    if by_mission:
        record = ardupilot.fly_mission((60.0, 10.0, 4.0), (60.0, 20.0, 4.0))
    else:
        record = ardupilot.fly(60.0, 0.0, 4.0)
    ardupilot.station.send("MISSION_CLEAR_ALL", target_system=1, target_component=1, mission_type=0)
    ardupilot.cancelled(record, "cleared the mission (MISSION_CLEAR_ALL)")
    assert len(ardupilot.places()) <= 1, "of ours nothing is left"


def test_a_mission_is_downloaded_and_then_cleared_as_mavsdk_does_it(ardupilot: Watched) -> None:
    """It uploads home alone."""
    record = ardupilot.fly_mission((60.0, 10.0, 4.0), (60.0, 20.0, 4.0))
    assert len(ardupilot.places()) >= 3, "home and two waypoints"
    ardupilot.station.mission.clear_mission()
    ardupilot.cancelled(record, "cleared the mission (MISSION_COUNT 1)")


def test_another_mission_uploaded_over_it_cancels_the_goal_and_stays(ardupilot: Watched) -> None:
    record = ardupilot.fly_mission((60.0, -10.0, 4.0), (60.0, -20.0, 4.0))
    theirs = ardupilot.station.items((16, -20.0, 0.0, 6.0), (16, -20.0, 10.0, 6.0))
    ardupilot.station.mission.upload_mission(theirs)
    ardupilot.cancelled(record, "uploaded another mission (MISSION_COUNT 3)")
    assert ardupilot.places()[1:] == [(item.x, item.y) for item in theirs[1:]]


def test_a_pause_of_a_mission_cancels_the_goal(ardupilot: Watched) -> None:
    record = ardupilot.fly_mission((60.0, 10.0, 4.0), (60.0, 20.0, 4.0))
    ardupilot.station.mission.pause_mission()
    ardupilot.cancelled(record, "paused the vehicle")


def test_a_paused_copter_flies_the_next_goal(ardupilot: Watched) -> None:
    """In GUIDED an ArduCopter ignores setpoints until it is resumed or leaves the mode."""
    assert ardupilot.flight.wait_for_result(ardupilot.fly(0.0, 0.0, 4.0)).success
    record = ardupilot.fly(60.0, 0.0, 4.0)
    pause = {f"param{number}": 0 for number in range(1, 8)}
    target = {"target_system": 1, "target_component": 1}
    ardupilot.station.send("COMMAND_LONG", command=193, confirmation=0, **pause, **target)
    ardupilot.cancelled(record, "paused the vehicle (DO_PAUSE_CONTINUE 0)")
    position = record.result.final_pose.pose.position
    record = ardupilot.fly(position.x + 4.0, position.y, position.z)
    assert ardupilot.flight.wait_for_result(record).success


def test_a_change_of_mode_is_an_override_that_names_the_station(ardupilot: Watched) -> None:
    record = ardupilot.fly(0.0, 60.0, 4.0)
    ardupilot.station.action.return_to_launch()
    ardupilot.taken_over(record, "DO_SET_MODE RTL")


def test_px4_is_cleared_paused_and_taken_over(px4: Watched) -> None:
    record = px4.fly(60.0, 0.0, 6.0)
    assert px4.station.param.get_param_float("MPC_XY_CRUISE") == 5.0
    px4.station.mission.clear_mission()
    px4.cancelled(record, "MISSION_CLEAR_ALL")
    record = px4.fly_mission((60.0, 10.0, 6.0), (60.0, 20.0, 6.0))
    assert len(px4.places()) >= 2
    px4.station.mission.clear_mission()
    px4.cancelled(record, "MISSION_CLEAR_ALL")
    record = px4.fly_mission((60.0, -10.0, 6.0), (60.0, -20.0, 6.0))
    px4.station.mission.pause_mission()
    px4.cancelled(record, "paused")
    record = px4.fly(0.0, 60.0, 6.0)
    home_m = px4.station.telemetry.home().absolute_altitude_m
    px4.station.action.goto_location(*px4.station.point(0.0, 0.0), home_m + 8.0, 0.0)
    px4.taken_over(record, "DO_REPOSITION")
