"""Areas of a page as requests of the service, and its answers as the page's route."""

from __future__ import annotations

import json
import math
from typing import Any

import pytest
from geometry_msgs.msg import Point

from custom_interfaces.msg import GoalCode, Waypoint, WaypointAct
from custom_interfaces.srv import ComputeSurvey
from drone_navigation.console.messages import PlanSurvey, RejectedError, parse
from drone_navigation.console.surveying.survey_messages import (
    survey_objection,
    survey_request,
    survey_route,
)

CORNERS = ((0.0, 0.0), (10.0, 0.0), (0.0, 10.0))
ASKED = PlanSurvey("/", CORNERS, 8.0, 2.5, 3.0, holes_enu_m=(), camera=None)

SENT: dict[str, Any] = {
    "type": "survey",
    "vehicle": "/",
    "corners": [{"x": x, "y": y} for x, y in CORNERS],
    "height": 8.0,
    "spacing": 2.5,
    "speed": 3.0,
    "holes": [],
    "camera": None,
}


def test_the_service_gets_the_area_and_chooses_the_angle() -> None:
    request = survey_request(ASKED)
    assert [(corner.x, corner.y) for corner in request.boundary] == list(ASKED.corners_enu_m)
    assert (request.frame, request.height) == (Waypoint.FRAME_MAP, 8.0)
    assert (request.spacing, request.max_speed) == (2.5, 3.0)
    assert math.isnan(request.angle)
    assert not request.use_entry


def test_holes_and_the_camera_are_passed_on_and_its_photos_become_acts() -> None:
    hole = [{"x": 1.0, "y": 1.0}, {"x": 2.0, "y": 1.0}, {"x": 1.0, "y": 2.0}]
    camera = {"width": 13.2, "height": 8.8, "focal": 10.0, "side": 0.7, "front": 0.8}
    asked = {**SENT, "spacing": 0, "holes": [hole], "camera": camera}
    found = parse(json.dumps(asked))
    assert isinstance(found, PlanSurvey)
    request = survey_request(found)
    assert [(c.x, c.y) for c in request.holes[0].corners] == [(1.0, 1.0), (2.0, 1.0), (1.0, 2.0)]
    sensor = (request.sensor_width, request.sensor_height, request.focal_length)
    assert sensor == pytest.approx((13.2, 8.8, 10.0))
    assert (request.side_overlap, request.front_overlap) == pytest.approx((0.7, 0.8))
    act = WaypointAct(kind=WaypointAct.TRIGGER_DISTANCE, distance=1.75)
    answer = ComputeSurvey.Response(success=True, photos=12, waypoints=[Waypoint(acts=[act])])
    told = survey_route(found, answer)
    assert told["photos"] == 12
    acts = [{"kind": "distance", "metres": 1.75}]
    assert told["waypoints"] == [{"x": 0.0, "y": 0.0, "z": 0.0, "hold": 0.0, "acts": acts}]
    with pytest.raises(RejectedError, match="a distance of its lines, or a camera"):
        parse(json.dumps({**asked, "camera": None}))
    for wrong in ({"focal": 0}, {"side": 1.0}, {"width": -1}):
        with pytest.raises(RejectedError):
            parse(json.dumps({**asked, "camera": {**camera, **wrong}}))


def test_the_page_gets_the_lines_or_a_code_and_a_sentence() -> None:
    waypoints = [Waypoint(position=Point(x=1.0, y=2.0, z=8.0)) for _ in range(501)]
    answer = ComputeSurvey.Response(success=True, waypoints=waypoints[:2], length=12.34, area=50.0)
    assert survey_objection(answer) == ""
    told = survey_route(ASKED, answer)
    assert told["waypoints"] == [{"x": 1.0, "y": 2.0, "z": 8.0, "hold": 0.0}] * 2
    assert (told["length"], told["area"]) == (12.3, 50.0)
    answer.waypoints = waypoints
    assert survey_objection(answer).startswith("INVALID_WAYPOINTS: The survey has 501 waypoints")
    rejected = ComputeSurvey.Response(error_code=GoalCode.OUTSIDE_FENCE, message="Waypoint 2 is.")
    assert survey_objection(rejected) == "OUTSIDE_FENCE: Waypoint 2 is."
