"""Conversions between ROS messages and the bridge's own types."""

from __future__ import annotations

import math
from typing import Any

from builtin_interfaces.msg import Time
from geometry_msgs.msg import PoseStamped

from custom_interfaces.action import (
    Land,
    Navigate,
    NavigateWaypoints,
    ReturnToLaunch,
    Takeoff,
)
from custom_interfaces.msg import GoalCode, Waypoint
from navigation_bridge.goals.goal import GoalFeedback, GoalFinished
from navigation_bridge.goals.lifecycle import GoalState
from navigation_bridge.goals.requests import (
    AltitudeReference,
    LandRequest,
    NavigateRequest,
    ReturnRequest,
    TakeoffRequest,
    WaypointRequest,
    WaypointsRequest,
)
from navigation_bridge.names import FRAME_MAP
from navigation_bridge.vehicle.map_frame import MapPose
from navigation_core.outcomes import OutcomeCode

_REFERENCES = {
    Waypoint.FRAME_GEODETIC_AMSL: AltitudeReference.AMSL,
    Waypoint.FRAME_GEODETIC_ABOVE_HOME: AltitudeReference.HOME,
    Waypoint.FRAME_GEODETIC_ABOVE_GROUND: AltitudeReference.GROUND,
}


def request_from_goal(
    goal: Navigate.Goal, request: type[NavigateRequest] = NavigateRequest
) -> NavigateRequest:
    """Return the request that a Navigate goal makes."""
    pose = goal.target_pose.pose
    q = pose.orientation
    return request(
        frame_id=goal.target_pose.header.frame_id,
        position=(pose.position.x, pose.position.y, pose.position.z),
        orientation_xyzw=(q.x, q.y, q.z, q.w),
        avoid_obstacles=goal.avoid_obstacles,
        max_speed_m_s=goal.max_speed,
    )


def request_from_waypoints(
    goal: NavigateWaypoints.Goal, request: type[WaypointsRequest] = WaypointsRequest
) -> WaypointsRequest:
    """Return the request that a NavigateWaypoints goal makes."""
    return request(
        waypoints=tuple(_waypoint(waypoint) for waypoint in goal.waypoints),
        by_mission=goal.execution == NavigateWaypoints.Goal.EXECUTION_MISSION,
        laps=goal.laps,
        max_speed_m_s=goal.max_speed,
        avoid_obstacles=goal.avoid_obstacles,
    )


def _waypoint(message: Waypoint) -> WaypointRequest:
    position = message.position
    return WaypointRequest(
        position=(position.x, position.y, position.z),
        altitude_reference=_REFERENCES.get(message.frame),
        acceptance_radius_m=message.acceptance_radius,
        hold_time_s=message.hold_time,
        yaw_enu_rad=message.yaw if message.use_yaw else None,
        max_speed_m_s=message.max_speed,
    )


def request_from_takeoff(
    goal: Takeoff.Goal, request: type[TakeoffRequest] = TakeoffRequest
) -> TakeoffRequest:
    """Return the request that a Takeoff goal makes."""
    return request(goal.height)


def request_from_land(_goal: Land.Goal, request: type[LandRequest] = LandRequest) -> LandRequest:
    """Return the request that a Land goal makes."""
    return request()


def request_from_return(
    _goal: ReturnToLaunch.Goal, request: type[ReturnRequest] = ReturnRequest
) -> ReturnRequest:
    """Return the request that a ReturnToLaunch goal makes."""
    return request()


def code_number(code: OutcomeCode) -> int:
    """Return the number of GoalCode.msg for a code."""
    return int(getattr(GoalCode, code.value))


def pose_stamped(pose: MapPose | None, stamp: Time, frame_id: str = FRAME_MAP) -> PoseStamped:
    """Return the pose in the map frame; all NaN if unknown."""
    message = PoseStamped()
    message.header.stamp = stamp
    message.header.frame_id = frame_id
    position, orientation = message.pose.position, message.pose.orientation
    if pose is None:
        position.x = position.y = position.z = math.nan
        orientation.x = orientation.y = orientation.z = orientation.w = math.nan
        return message
    position.x, position.y, position.z = pose.position_enu_m
    orientation.x, orientation.y, orientation.z, orientation.w = pose.orientation_xyzw
    return message


def feedback_message(feedback: GoalFeedback, stamp: Time) -> Navigate.Feedback:
    """Return the feedback of Navigate; an unknown battery is NaN."""
    message = Navigate.Feedback()
    _fill_feedback(message, feedback, stamp)
    message.replans = feedback.replans
    message.setpoint_delay = feedback.late_s
    return message


def waypoints_feedback(feedback: GoalFeedback, stamp: Time) -> NavigateWaypoints.Feedback:
    """Return the feedback of NavigateWaypoints."""
    message = NavigateWaypoints.Feedback()
    _fill_feedback(message, feedback, stamp)
    message.replans = feedback.replans
    message.setpoint_delay = feedback.late_s
    route = feedback.route
    if route is not None:
        message.current_waypoint = route.current
        message.current_lap = route.lap
        message.waypoints_remaining = route.remaining
    return message


def takeoff_feedback(feedback: GoalFeedback, stamp: Time) -> Takeoff.Feedback:
    """Return the feedback of Takeoff."""
    return _height_feedback(Takeoff.Feedback(), feedback, stamp)


def land_feedback(feedback: GoalFeedback, stamp: Time) -> Land.Feedback:
    """Return the feedback of Land."""
    return _height_feedback(Land.Feedback(), feedback, stamp)


def return_feedback(feedback: GoalFeedback, stamp: Time) -> ReturnToLaunch.Feedback:
    """Return the feedback of ReturnToLaunch."""
    return _height_feedback(ReturnToLaunch.Feedback(), feedback, stamp)


def _height_feedback(message: Any, feedback: GoalFeedback, stamp: Time) -> Any:
    _fill_feedback(message, feedback, stamp)
    message.height = math.nan if feedback.height_m is None else feedback.height_m
    return message


def _fill_feedback(message: Any, feedback: GoalFeedback, stamp: Time) -> None:
    """Fill the fields common to all feedbacks."""
    message.current_pose = pose_stamped(feedback.pose, stamp)
    message.distance_remaining = feedback.distance_remaining_m
    message.estimated_time_remaining = feedback.time_remaining_s
    remaining = feedback.battery_remaining
    message.battery_percentage = math.nan if remaining is None else 100.0 * remaining
    message.current_status = feedback.status.value


def result_message(finished: GoalFinished, stamp: Time) -> Navigate.Result:
    """Return the result of Navigate."""
    message = Navigate.Result()
    message.success = finished.state is GoalState.SUCCEEDED
    message.final_pose = pose_stamped(finished.pose, stamp)
    message.total_elapsed_time = finished.elapsed_s
    error_m = finished.final_error_m
    message.final_error = math.nan if error_m is None else error_m
    message.message = finished.message
    message.error_code = code_number(finished.code)
    return message


def waypoints_result(finished: GoalFinished, stamp: Time) -> NavigateWaypoints.Result:
    """Return the result of NavigateWaypoints."""
    message = _result(NavigateWaypoints.Result(), finished, stamp)
    message.waypoints_reached = finished.waypoints_reached
    error_m = finished.final_error_m
    message.final_error = math.nan if error_m is None else error_m
    message.waypoints_missed = finished.waypoints_missed
    return message


def takeoff_result(finished: GoalFinished, stamp: Time) -> Takeoff.Result:
    """Return the result of Takeoff."""
    return _result(Takeoff.Result(), finished, stamp)


def land_result(finished: GoalFinished, stamp: Time) -> Land.Result:
    """Return the result of Land."""
    return _result(Land.Result(), finished, stamp)


def return_result(finished: GoalFinished, stamp: Time) -> ReturnToLaunch.Result:
    """Return the result of ReturnToLaunch."""
    return _result(ReturnToLaunch.Result(), finished, stamp)


def _result(message: Any, finished: GoalFinished, stamp: Time) -> Any:
    message.success = finished.state is GoalState.SUCCEEDED
    message.error_code = code_number(finished.code)
    message.message = finished.message
    message.final_pose = pose_stamped(finished.pose, stamp)
    message.total_elapsed_time = finished.elapsed_s
    return message
