"""Areas of a page as requests of ``~/compute_survey``, and its answers. No I/O, no clock."""

from __future__ import annotations

import math

from geometry_msgs.msg import Point

from custom_interfaces.msg import GoalCode, Waypoint
from custom_interfaces.srv import ComputeSurvey
from drone_navigation.console.messages import WAYPOINTS_MAX, PlanSurvey
from navigation_core.outcomes import OutcomeCode

__all__ = ["survey_objection", "survey_request", "survey_route"]

_CODES = {getattr(GoalCode, code.value): code.value for code in OutcomeCode}


def survey_request(asked: PlanSurvey) -> ComputeSurvey.Request:
    """Return what the server is asked; it chooses the angle, and begins near the vehicle."""
    return ComputeSurvey.Request(
        frame=Waypoint.FRAME_MAP,
        boundary=[Point(x=x, y=y) for x, y in asked.corners_enu_m],
        height=asked.height_m,
        spacing=asked.spacing_m,
        angle=math.nan,
        max_speed=asked.speed_m_s,
    )


def survey_objection(answer: ComputeSurvey.Response) -> str:
    """Return why the page cannot have the route, with its code; "" if it can."""
    if not answer.success:
        return f"{_CODES.get(answer.error_code, answer.error_code)}: {answer.message}"
    if len(answer.waypoints) > WAYPOINTS_MAX:
        return (
            f"INVALID_WAYPOINTS: The survey has {len(answer.waypoints)} waypoints, a route of the "
            f"page at most {WAYPOINTS_MAX}; give a greater distance of the lines."
        )
    return ""


def survey_route(asked: PlanSurvey, answer: ComputeSurvey.Response) -> dict[str, object]:
    """Return the page's message about a survey: waypoints and corners in the map, m, s and m2."""
    return {
        "type": "survey",
        "vehicle": asked.vehicle,
        "corners": [list(corner) for corner in asked.corners_enu_m],
        "waypoints": [
            {
                "x": round(waypoint.position.x, 2),
                "y": round(waypoint.position.y, 2),
                "z": round(waypoint.position.z, 2),
                "hold": 0.0,
            }
            for waypoint in answer.waypoints
        ],
        "length": round(answer.length, 1),
        "duration": round(answer.duration, 1),
        "area": round(answer.area, 1),
        "text": answer.message,
    }
