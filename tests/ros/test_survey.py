"""A survey, computed by the service and flown by the command."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest
from geometry_msgs.msg import Point

from custom_interfaces.action import NavigateWaypoints
from custom_interfaces.msg import Corners, GoalCode, Waypoint
from custom_interfaces.srv import ComputeSurvey
from navigation_bridge.names import SERVER_NODE_NAME
from tests.support.processes import Process
from tests.support.ros.ros_flight import Flight

pytestmark = [pytest.mark.wide, pytest.mark.xdist_group("ros_orbit")]
CLIENT = ["python", "-m", "drone_navigation.navigation_client"]


def corners(*places: tuple[float, float]) -> list[Point]:
    return [Point(x=x, y=y) for x, y in places]


FIELD = corners((0.0, 2.0), (12.0, 2.0), (12.0, 10.0), (0.0, 10.0))


def computed(flight: Flight, **fields: Any) -> ComputeSurvey.Response:
    client = flight.node.create_client(ComputeSurvey, f"{SERVER_NODE_NAME}/compute_survey")
    assert client.wait_for_service(timeout_sec=20.0)
    asked = {"boundary": FIELD, "height": 4.0, "spacing": 4.0, "angle": math.nan} | fields
    answer = client.call_async(ComputeSurvey.Request(**asked))
    flight.wait(answer.done, 60.0, "a survey")
    flight.node.destroy_client(client)
    return answer.result()


def test_a_survey_is_computed_flown_and_continued(tmp_path: Path) -> None:
    flight = Flight(tmp_path)
    try:
        survey = computed(flight)
        assert survey.success, survey.message
        assert (survey.error_code, survey.area) == (GoalCode.SUCCESS, pytest.approx(96.0))
        assert len(survey.waypoints) == 4
        assert survey.length == pytest.approx(28.0)
        assert math.isnan(survey.battery_needed), "nothing was measured yet"

        hole = Corners(corners=corners((5.0, 5.0), (7.0, 5.0), (7.0, 7.0), (5.0, 7.0)))
        around = computed(flight, holes=[hole])
        assert around.success
        assert around.length > survey.length

        # A slope to the north, 2 m over the field.
        slope: dict[str, Any] = {
            "terrain_origin": Point(x=-4.0, y=-2.0),
            "terrain_resolution": 4.0,
            "terrain_width": 6,
            "terrain_heights": [0.25 * (4.0 * row - 2.0) for row in range(5) for _ in range(6)],
        }
        above = computed(flight, **slope)
        assert above.success, above.message
        for waypoint in above.waypoints:
            place = waypoint.position
            assert place.z == pytest.approx(4.0 + 0.25 * place.y)

        photos = computed(
            flight, spacing=0.0, sensor_width=0.0132, sensor_height=0.0088, focal_length=0.0088,
            side_overlap=0.5, front_overlap=0.5,
        )  # fmt: skip
        assert photos.error_code == GoalCode.UNSUPPORTED_VEHICLE, "this copter has no camera"
        assert photos.photos > 10
        assert photos.waypoints[0].acts[0].distance == pytest.approx(2.0)

        for fields, code in (
            ({"boundary": FIELD[:2]}, GoalCode.INVALID_WAYPOINTS),
            ({"boundary": [FIELD[0], FIELD[2], FIELD[1], FIELD[3]]}, GoalCode.INVALID_WAYPOINTS),
            ({"spacing": 0.0}, GoalCode.INVALID_NUMBER),
            (slope | {"terrain_width": 7}, GoalCode.INVALID_WAYPOINTS),
            (slope | {"terrain_origin": Point(x=4.0)}, GoalCode.INVALID_WAYPOINTS),
            (slope | {"max_speed": 100.0}, GoalCode.INVALID_WAYPOINTS),
            (slope | {"height": 1.0}, GoalCode.INVALID_NUMBER),
            ({"frame": 9}, GoalCode.UNKNOWN_FRAME),
            ({"height": 5000.0}, GoalCode.OUTSIDE_VOLUME),
            ({"frame": Waypoint.FRAME_GEODETIC_ABOVE_GROUND}, GoalCode.INVALID_WAYPOINTS),
        ):
            rejected = computed(flight, **fields)
            assert not rejected.success
            assert rejected.error_code == code, (fields, rejected.message)
            assert rejected.message.endswith(".")

        goal = NavigateWaypoints.Goal(
            execution=NavigateWaypoints.Goal.EXECUTION_SETPOINTS, waypoints=survey.waypoints, laps=1
        )
        record = flight.send(goal)
        flight.wait(
            lambda: bool(record.feedback) and record.feedback[-1].current_waypoint >= 2,
            60.0,
            "a waypoint",
        )
        flight.cancel(record)
        result = flight.wait_for_result(record)
        assert result.next_index >= 1
        goal.first, goal.interrupted_id = result.next_index, result.route_id
        result = flight.wait_for_result(flight.send(goal))
        assert result.error_code == GoalCode.SUCCESS, result.message

        words = ["survey", "--boundary", "0,2 12,2 12,10 0,10", "--height", "4", "--spacing", "4"]
        shown = Process("client", [*CLIENT, *words], flight.environment)
        assert shown.wait(120.0) == 0, shown.text
        assert "The survey covers 96 m2 by lines 4.0 m apart" in shown.text
        shown = Process("client", [*CLIENT, *words[:2], "0,0 9,9", *words[3:]], flight.environment)
        assert shown.wait(60.0) == 2
        assert "give three" in shown.text
    finally:
        flight.close()


@pytest.mark.wide
def test_a_rover_follows_no_terrain(tmp_path: Path) -> None:
    flight = Flight(tmp_path, simulator=("--vehicle", "rover"))
    try:
        assert computed(flight, height=0.0).success
        terrain = {"terrain_resolution": 20.0, "terrain_width": 2, "terrain_heights": [0.0] * 4}
        rejected = computed(flight, **terrain)
        assert rejected.error_code == GoalCode.UNSUPPORTED_VEHICLE, rejected.message
        assert rejected.message == "Only copters follow the terrain; this is a rover."
    finally:
        flight.close()
