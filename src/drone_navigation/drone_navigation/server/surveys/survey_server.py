"""The service that computes a survey, and says whether it may be flown."""

from __future__ import annotations

import math
from collections.abc import Sequence

from geometry_msgs.msg import Point
from rclpy.callback_groups import ReentrantCallbackGroup

from custom_interfaces.msg import GoalCode, Waypoint
from custom_interfaces.srv import ComputeSurvey
from drone_navigation.message_forms.waypoint_messages import waypoint_message
from drone_navigation.server.bridge_access import BridgeAccess
from mavlink_vehicle.errors import DriverError
from navigation_bridge.goals.requests import AltitudeReference, WaypointsRequest
from navigation_bridge.goals.surveys import Camera, SurveyRequest, SurveyRoute, compute_survey
from navigation_core.outcomes import OutcomeCode
from navigation_core.safety.target_checks import Rejection

__all__ = ["SurveyServer"]

_CALL_TIMEOUT_S = 2.0
_REFERENCES = {
    Waypoint.FRAME_MAP: None,
    Waypoint.FRAME_GEODETIC_AMSL: AltitudeReference.AMSL,
    Waypoint.FRAME_GEODETIC_ABOVE_HOME: AltitudeReference.HOME,
    Waypoint.FRAME_GEODETIC_ABOVE_GROUND: AltitudeReference.GROUND,
}
# Reasons that are the survey's; others are the vehicle's at this moment.
_OF_THE_ROUTE = frozenset(
    {
        OutcomeCode.INVALID_NUMBER,
        OutcomeCode.INVALID_WAYPOINTS,
        OutcomeCode.NEGATIVE_SPEED,
        OutcomeCode.BELOW_GROUND,
        OutcomeCode.OUTSIDE_VOLUME,
        OutcomeCode.OUTSIDE_FENCE,
        OutcomeCode.UNSUPPORTED_VEHICLE,
    }
)


class SurveyServer:
    """Offers ``~/compute_survey``."""

    def __init__(self, access: BridgeAccess) -> None:
        """Offer it."""
        self._access = access
        self._server = access.node.create_service(
            ComputeSurvey,
            "~/compute_survey",
            self._compute,
            callback_group=ReentrantCallbackGroup(),
        )

    def _compute(
        self, asked: ComputeSurvey.Request, answer: ComputeSurvey.Response
    ) -> ComputeSurvey.Response:
        """Compute in an executor's thread; the driver's thread is asked for what is known."""
        answer.battery_needed = math.nan
        try:
            if asked.frame not in _REFERENCES:
                text = f"Frame {asked.frame} is unknown; give one of Waypoint.FRAME_*, 0 to 3."
                return _rejected(answer, Rejection(OutcomeCode.UNKNOWN_FRAME, text))
            route = compute_survey(self._request(asked))
            if isinstance(route, Rejection):
                return _rejected(answer, route)
            _fill(answer, route)
            goal = WaypointsRequest(route.waypoints, max_speed_m_s=asked.max_speed)
            return self._admitted(answer, goal)
        except DriverError as error:
            return _rejected(answer, Rejection(OutcomeCode.INTERNAL_ERROR, str(error)))

    def _request(self, asked: ComputeSurvey.Request) -> SurveyRequest:
        limits = self._access.config.bridge.goto.limits
        camera = None
        if asked.focal_length:
            camera = Camera(
                asked.sensor_width,
                asked.sensor_height,
                asked.focal_length,
                asked.side_overlap,
                asked.front_overlap,
            )
        reference = _REFERENCES[asked.frame]
        entry = (asked.entry.x, asked.entry.y) if asked.use_entry else self._here(reference)
        return SurveyRequest(
            boundary=_corners(asked.boundary),
            holes=tuple(_corners(hole.corners) for hole in asked.holes),
            altitude_reference=reference,
            height_m=asked.height,
            spacing_m=asked.spacing,
            camera=camera,
            angle_enu_rad=asked.angle,
            entry=entry,
            overrun_m=asked.overrun,
            acceptance_radius_m=asked.acceptance_radius,
            speed_m_s=asked.max_speed or limits.speed_horizontal_m_s,
            acceleration_m_s2=limits.acceleration_horizontal_m_s2,
        )

    def _here(self, reference: AltitudeReference | None) -> tuple[float, float] | None:
        """Return where the vehicle is, None while that is not known."""
        bridge = self._access.bridge
        if reference is None:
            pose = self._access.driver.call(lambda: bridge.pose, _CALL_TIMEOUT_S)
            return None if pose is None else pose.position_enu_m[:2]
        place = self._access.driver.call(
            lambda: bridge.vehicle.state.global_position, _CALL_TIMEOUT_S
        )
        return None if place is None else (place.latitude_deg, place.longitude_deg)

    def _admitted(
        self, answer: ComputeSurvey.Response, goal: WaypointsRequest
    ) -> ComputeSurvey.Response:
        """Add whether the server would take the route now, and the energy that it takes."""
        bridge, now = self._access.bridge, self._access.clock.now
        rejection = self._access.driver.call(
            lambda: bridge.goals.check(goal, now()), _CALL_TIMEOUT_S
        )
        if rejection is not None and rejection.code in _OF_THE_ROUTE:
            return _rejected(answer, rejection)
        rate_per_s = self._access.driver.call(lambda: bridge.battery_rate_per_s, _CALL_TIMEOUT_S)
        answer.battery_needed = rate_per_s * answer.duration
        answer.success = True
        answer.message = (
            f"{len(answer.waypoints)} waypoints, {answer.length:.0f} m, {answer.duration:.0f} s."
        )
        if rejection is not None:
            answer.message += f" It would be rejected now: {rejection.message}"
        return answer


def _corners(points: Sequence[Point]) -> tuple[tuple[float, float], ...]:
    return tuple((point.x, point.y) for point in points)


def _rejected(answer: ComputeSurvey.Response, rejection: Rejection) -> ComputeSurvey.Response:
    answer.success, answer.message = False, rejection.message
    answer.error_code = int(getattr(GoalCode, rejection.code.value))
    return answer


def _fill(answer: ComputeSurvey.Response, route: SurveyRoute) -> None:
    answer.waypoints = [waypoint_message(waypoint) for waypoint in route.waypoints]
    answer.length, answer.duration = route.length_m, route.duration_s
    answer.photos, answer.area = route.photos, route.area_m2
    answer.angle, answer.spacing = route.angle_enu_rad, route.spacing_m
