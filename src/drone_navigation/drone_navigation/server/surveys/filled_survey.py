"""The answer to a request for a survey, as far as it needs no vehicle."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from geometry_msgs.msg import Point

from custom_interfaces.msg import Waypoint
from custom_interfaces.srv import ComputeSurvey
from drone_navigation.message_forms.waypoint_messages import waypoint_message
from navigation_bridge.goals.requests import AltitudeReference, WaypointsRequest
from navigation_bridge.goals.surveys import Camera, SurveyRequest, compute_survey
from navigation_core.limits import Limits
from navigation_core.outcomes import OutcomeCode
from navigation_core.safety.target_checks import Rejection
from navigation_core.surveys.terrain import TerrainGrid

__all__ = ["fill_survey"]

_REFERENCES = {
    Waypoint.FRAME_MAP: None,
    Waypoint.FRAME_GEODETIC_AMSL: AltitudeReference.AMSL,
    Waypoint.FRAME_GEODETIC_ABOVE_HOME: AltitudeReference.HOME,
    Waypoint.FRAME_GEODETIC_ABOVE_GROUND: AltitudeReference.GROUND,
}


def fill_survey(
    asked: ComputeSurvey.Request,
    answer: ComputeSurvey.Response,
    entry: tuple[float, float] | None,
    limits: Limits,
) -> WaypointsRequest | Rejection:
    """Fill in the waypoints and their figures.

    Args:
        asked: the request.
        answer: the response that is filled.
        entry: where the vehicle comes from, in the frame of the request; None = the first corner.
        limits: speed and acceleration, for the duration; climbs over terrain keep them.

    Returns:
        The route as a goal, or why there is none.
    """
    if asked.frame not in _REFERENCES:
        text = f"Frame {asked.frame} is unknown; give one of Waypoint.FRAME_*, 0 to 3."
        return Rejection(OutcomeCode.UNKNOWN_FRAME, text)
    camera = None
    if asked.focal_length:
        camera = Camera(
            asked.sensor_width,
            asked.sensor_height,
            asked.focal_length,
            asked.side_overlap,
            asked.front_overlap,
        )
    route = compute_survey(
        SurveyRequest(
            boundary=_corners(asked.boundary),
            holes=tuple(_corners(hole.corners) for hole in asked.holes),
            altitude_reference=_REFERENCES[asked.frame],
            height_m=asked.height,
            spacing_m=asked.spacing,
            camera=camera,
            angle_enu_rad=asked.angle,
            entry=entry,
            overrun_m=asked.overrun,
            acceptance_radius_m=asked.acceptance_radius,
            speed_m_s=asked.max_speed or limits.speed_horizontal_m_s,
            acceleration_m_s2=limits.acceleration_horizontal_m_s2,
            terrain=_terrain(asked),
            climb_m_s=limits.speed_up_m_s,
            descent_m_s=limits.speed_down_m_s,
        )
    )
    if isinstance(route, Rejection):
        return route
    answer.waypoints = [waypoint_message(waypoint) for waypoint in route.waypoints]
    answer.length, answer.duration = route.length_m, route.duration_s
    answer.photos, answer.area = route.photos, route.area_m2
    answer.angle, answer.spacing = route.angle_enu_rad, route.spacing_m
    return WaypointsRequest(route.waypoints, max_speed_m_s=asked.max_speed)


def _corners(points: Sequence[Point]) -> tuple[tuple[float, float], ...]:
    return tuple((point.x, point.y) for point in points)


def _terrain(asked: ComputeSurvey.Request) -> TerrainGrid | None:
    if not asked.terrain_heights:
        return None
    origin = asked.terrain_origin
    return TerrainGrid(
        (origin.x, origin.y),
        asked.terrain_resolution,
        asked.terrain_width,
        np.asarray(asked.terrain_heights, float),
    )
