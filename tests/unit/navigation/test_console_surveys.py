"""Areas of a page as requests of the service, and its answers as the page's route."""

from __future__ import annotations

import math

from geometry_msgs.msg import Point

from custom_interfaces.msg import GoalCode, Waypoint
from custom_interfaces.srv import ComputeSurvey
from drone_navigation.console.messages import PlanSurvey
from drone_navigation.console.surveying.survey_messages import (
    survey_objection,
    survey_request,
    survey_route,
)

ASKED = PlanSurvey("/", ((0.0, 0.0), (10.0, 0.0), (0.0, 10.0)), 8.0, 2.5, 3.0)


def test_the_service_gets_the_area_and_chooses_the_angle() -> None:
    request = survey_request(ASKED)
    assert [(corner.x, corner.y) for corner in request.boundary] == list(ASKED.corners_enu_m)
    assert (request.frame, request.height) == (Waypoint.FRAME_MAP, 8.0)
    assert (request.spacing, request.max_speed) == (2.5, 3.0)
    assert math.isnan(request.angle)
    assert not request.use_entry


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
