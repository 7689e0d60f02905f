"""Areas of a page as requests of ``~/compute_survey``, and its answers. No I/O, no clock."""

from __future__ import annotations

import math

from geometry_msgs.msg import Point

from custom_interfaces.msg import Corners, GoalCode, Waypoint, WaypointAct
from custom_interfaces.srv import ComputeSurvey
from drone_navigation.console.messages import WAYPOINTS_MAX, PlanSurvey
from navigation_core.outcomes import OutcomeCode

__all__ = ["survey_objection", "survey_request", "survey_route"]

_CODES = {getattr(GoalCode, code.value): code.value for code in OutcomeCode}


def survey_request(asked: PlanSurvey) -> ComputeSurvey.Request:
    """Return what the server is asked; it chooses the angle, and begins near the vehicle."""
    request = ComputeSurvey.Request(
        frame=Waypoint.FRAME_MAP,
        boundary=[Point(x=x, y=y) for x, y in asked.corners_enu_m],
        holes=[Corners(corners=[Point(x=x, y=y) for x, y in hole]) for hole in asked.holes_enu_m],
        height=asked.height_m,
        spacing=asked.spacing_m,
        angle=math.nan,
        max_speed=asked.speed_m_s,
    )
    if (camera := asked.camera) is not None:
        request.sensor_width, request.sensor_height = (
            camera.sensor_width_mm,
            camera.sensor_height_mm,
        )
        request.focal_length = camera.focal_length_mm
        request.side_overlap, request.front_overlap = camera.side_overlap, camera.front_overlap
    return request


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
        "waypoints": [_waypoint(waypoint) for waypoint in answer.waypoints],
        "length": round(answer.length, 1),
        "duration": round(answer.duration, 1),
        "area": round(answer.area, 1),
        "photos": answer.photos,
        "text": answer.message,
    }


def _waypoint(waypoint: Waypoint) -> dict[str, object]:
    place = waypoint.position
    # A survey has no other acts.
    acts = [
        {"kind": "distance", "metres": round(act.distance, 2)}
        for act in waypoint.acts
        if act.kind == WaypointAct.TRIGGER_DISTANCE
    ]
    values = {"x": round(place.x, 2), "y": round(place.y, 2), "z": round(place.z, 2), "hold": 0.0}
    return values | ({"acts": acts} if acts else {})
