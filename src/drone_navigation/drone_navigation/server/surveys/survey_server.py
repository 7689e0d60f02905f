"""The service that computes a survey, and says whether it may be flown."""

from __future__ import annotations

import math

from rclpy.callback_groups import ReentrantCallbackGroup

from custom_interfaces.msg import GoalCode, Waypoint
from custom_interfaces.srv import ComputeSurvey
from drone_navigation.server.bridge_access import BridgeAccess
from mavlink_vehicle.errors import DriverError
from mavlink_vehicle.profiles.profile import VehicleKind
from navigation_bridge.goals.requests import WaypointsRequest
from navigation_core.outcomes import OutcomeCode
from navigation_core.safety.target_checks import Rejection

__all__ = ["SurveyServer"]

_CALL_TIMEOUT_S = 2.0
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
        # With Shapely, which takes 7 MB: few servers are ever asked for a survey.
        from drone_navigation.server.surveys.filled_survey import fill_survey  # noqa: PLC0415

        answer.battery_needed = math.nan
        try:
            if asked.terrain_heights and (unfit := self._unfit_for_terrain()):
                return _rejected(answer, unfit)
            entry = (asked.entry.x, asked.entry.y) if asked.use_entry else self._here(asked.frame)
            goal = fill_survey(asked, answer, entry, self._access.config.bridge.goto.limits)
            if isinstance(goal, Rejection):
                return _rejected(answer, goal)
            return self._admitted(answer, goal)
        except DriverError as error:
            return _rejected(answer, Rejection(OutcomeCode.INTERNAL_ERROR, str(error)))

    def _unfit_for_terrain(self) -> Rejection | None:
        """Return why the vehicle follows no terrain; None while its kind is not known."""
        vehicle = self._access.bridge.vehicle
        profile = self._access.driver.call(lambda: vehicle.profile, _CALL_TIMEOUT_S)
        if profile is None or profile.kind is VehicleKind.COPTER:
            return None
        text = f"Only copters follow the terrain; this is a {profile.kind.value}."
        return Rejection(OutcomeCode.UNSUPPORTED_VEHICLE, text)

    def _here(self, frame: int) -> tuple[float, float] | None:
        """Return where the vehicle is, None while that is not known."""
        bridge = self._access.bridge
        if frame == Waypoint.FRAME_MAP:
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


def _rejected(answer: ComputeSurvey.Response, rejection: Rejection) -> ComputeSurvey.Response:
    answer.success, answer.message = False, rejection.message
    answer.error_code = int(getattr(GoalCode, rejection.code.value))
    return answer
