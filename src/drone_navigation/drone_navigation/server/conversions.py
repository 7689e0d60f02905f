"""Conversions between ROS messages and the bridge's own types."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TypeAlias, TypeVar

from builtin_interfaces.msg import Time
from geometry_msgs.msg import Point, PoseStamped

from custom_interfaces.action import (
    Follow,
    FollowVelocity,
    Land,
    Navigate,
    NavigateWaypoints,
    Orbit,
    ReturnToLaunch,
    Takeoff,
)
from custom_interfaces.msg import GoalCode, Waypoint, WaypointAct
from navigation_bridge.goals.goal import GoalFeedback, GoalFinished
from navigation_bridge.goals.lifecycle import GoalState
from navigation_bridge.goals.requests import (
    ActKind,
    ActRequest,
    AltitudeReference,
    FollowRequest,
    FollowYaw,
    LandRequest,
    NavigateRequest,
    OffsetFrame,
    OrbitRequest,
    OrbitYaw,
    PointMode,
    ReturnRequest,
    TakeoffRequest,
    TargetSource,
    VelocityRequest,
    WaypointRequest,
    WaypointsRequest,
)
from navigation_bridge.names import FRAME_MAP
from navigation_bridge.vehicle.map_frame import MapPose
from navigation_core.outcomes import OutcomeCode
from navigation_core.tasks.progress import FollowState, TrajectoryProgress

M = TypeVar("M")
# Of a message, by name.
Fields: TypeAlias = dict[str, object]

_REFERENCES = {
    Waypoint.FRAME_GEODETIC_AMSL: AltitudeReference.AMSL,
    Waypoint.FRAME_GEODETIC_ABOVE_HOME: AltitudeReference.HOME,
    Waypoint.FRAME_GEODETIC_ABOVE_GROUND: AltitudeReference.GROUND,
}
# Slower than this a vehicle has no course: the velocity is noise.
_COURSE_LEAST_M_S = 0.3
_GRABS = {WaypointAct.GRIPPER_RELEASE: False, WaypointAct.GRIPPER_GRAB: True}


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
        first=goal.first,
        interrupted_id=goal.interrupted_id,
        yaw_rate_rad_s=goal.yaw_rate,
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
        acts=tuple(_act(act) for act in message.acts),
    )


def _act(message: WaypointAct) -> ActRequest:
    kinds = [kind for kind in ActKind if kind.value == message.kind]
    points = [point for point in PointMode if point.value == message.point]
    return ActRequest(
        kind=kinds[0] if kinds else None,
        required=message.required,
        distance_m=message.distance,
        point=points[0] if points else None,
        pitch_rad=message.pitch,
        yaw_rad=message.yaw,
        yaw_locked=message.yaw_locked,
        target=(message.target.x, message.target.y, message.target.z),
        grabs=_GRABS.get(message.gripper),
        channel=message.channel,
        pulse_us=message.pulse,
        duration_s=message.duration,
    )


def request_from_orbit(
    goal: Orbit.Goal, request: type[OrbitRequest] = OrbitRequest
) -> OrbitRequest:
    """Return the request that an Orbit goal makes."""
    centre = goal.centre.pose.position
    modes = [yaw for yaw in OrbitYaw if yaw.value == goal.yaw_mode]
    return request(
        frame_id=goal.centre.header.frame_id,
        centre=(centre.x, centre.y, centre.z),
        radius_m=goal.radius,
        height_m=goal.height,
        laps=goal.laps,
        max_speed_m_s=goal.max_speed,
        yaw=modes[0] if modes else None,
        avoid_obstacles=goal.avoid_obstacles,
    )


def request_from_follow(
    goal: Follow.Goal, request: type[FollowRequest] = FollowRequest
) -> FollowRequest:
    """Return the request that a Follow goal makes."""
    offset = goal.offset
    axes = [frame for frame in OffsetFrame if frame.value == goal.offset_frame]
    modes = [yaw for yaw in FollowYaw if yaw.value == goal.yaw_mode]
    return request(
        source=TargetSource(goal.pose_topic, goal.tracked_frame, goal.target_system),
        offset_m=(offset.x, offset.y, offset.z),
        offset_frame=axes[0] if axes else None,
        least_distance_m=goal.least_distance,
        max_speed_m_s=goal.max_speed,
        max_duration_s=goal.max_duration,
        lost_timeout_s=goal.lost_timeout,
        yaw=modes[0] if modes else None,
    )


def request_from_takeoff(
    goal: Takeoff.Goal, request: type[TakeoffRequest] = TakeoffRequest
) -> TakeoffRequest:
    """Return the request that a Takeoff goal makes."""
    return request(goal.height)


def request_from_land(goal: Land.Goal, request: type[LandRequest] = LandRequest) -> LandRequest:
    """Return the request that a Land goal makes."""
    return request(
        target_topic=goal.target_topic,
        target_required=goal.target_required,
        retries=goal.retries,
        search_height_m=goal.search_height,
    )


def request_from_return(
    _goal: ReturnToLaunch.Goal, request: type[ReturnRequest] = ReturnRequest
) -> ReturnRequest:
    """Return the request that a ReturnToLaunch goal makes."""
    return request()


def request_from_velocity(
    goal: FollowVelocity.Goal, request: type[VelocityRequest] = VelocityRequest
) -> VelocityRequest:
    """Return the request that a FollowVelocity goal makes."""
    return request(goal.max_speed)


def code_number(code: OutcomeCode) -> int:
    """Return the number of GoalCode.msg for a code."""
    return int(getattr(GoalCode, code.value))


def pose_stamped(pose: MapPose | None, stamp: Time, frame_id: str = FRAME_MAP) -> PoseStamped:
    """Return the pose in the map frame; all NaN if unknown."""
    message = PoseStamped()
    put_pose(message, pose, stamp, frame_id)
    return message


def put_pose(message: PoseStamped, pose: MapPose | None, stamp: Time, frame_id: str) -> None:
    """Write the pose in the map frame into a message; all NaN if unknown."""
    message.header.stamp = stamp
    message.header.frame_id = frame_id
    position, orientation = message.pose.position, message.pose.orientation
    if pose is None:
        position.x = position.y = position.z = math.nan
        orientation.x = orientation.y = orientation.z = orientation.w = math.nan
        return
    position.x, position.y, position.z = pose.position_enu_m
    orientation.x, orientation.y, orientation.z, orientation.w = pose.orientation_xyzw


def _or_nan(value: float | None) -> float:
    return math.nan if value is None else value


def _common_feedback(feedback: GoalFeedback) -> Fields:
    """Return the fields that all feedbacks have but the pose; an unknown battery is NaN."""
    remaining = feedback.battery_remaining
    return {
        "battery_percentage": math.nan if remaining is None else 100.0 * remaining,
        "current_status": feedback.status.value,
    }


def _feedback_to_end(feedback: GoalFeedback) -> Fields:
    """Return the fields of a goal that has a target or an end."""
    return {
        **_common_feedback(feedback),
        "distance_remaining": feedback.distance_remaining_m,
        "estimated_time_remaining": feedback.time_remaining_s,
    }


def velocity_feedback(feedback: GoalFeedback) -> Fields:
    """Return the fields of the feedback of a goal that follows velocity commands."""
    east, north, up = feedback.velocity_enu_m_s or (math.nan, math.nan, math.nan)
    moves = math.hypot(east, north) >= _COURSE_LEAST_M_S
    return dict(
        **_common_feedback(feedback),
        height=_or_nan(feedback.height_m),
        setpoint_delay=feedback.late_s,
        course=math.atan2(north, east) if moves else math.nan,
        ground_speed=math.hypot(east, north),
        climb_rate=up,
        limited_by=feedback.limited_by,
    )


def trajectory_feedback(feedback: GoalFeedback) -> Fields:
    """Return the fields of the feedback of a goal that flies trajectories."""
    flown = feedback.trajectory or TrajectoryProgress(time_scale=0.0)
    return dict(
        **_feedback_to_end(feedback),
        error=flown.error_m,
        time_scale=flown.time_scale,
        limited_by=flown.limited_by,
        replacements=flown.replacements,
        height=_or_nan(feedback.height_m),
        setpoint_delay=feedback.late_s,
    )


def follow_feedback(feedback: GoalFeedback) -> Fields:
    """Return the fields of the feedback of a goal that follows a target."""
    follow = feedback.follow
    state = FollowState.ACQUIRING if follow is None else follow.state
    place = None if follow is None else follow.position_enu_m
    x, y, z = place or (math.nan, math.nan, math.nan)
    return dict(
        **_common_feedback(feedback),
        state=getattr(Follow.Feedback, state.value),
        distance=math.nan if follow is None else follow.distance_m,
        target_position=Point(x=x, y=y, z=z),
        target_age=math.inf if follow is None else follow.age_s,
        height=_or_nan(feedback.height_m),
        replans=feedback.replans,
        setpoint_delay=feedback.late_s,
    )


def flown_feedback(feedback: GoalFeedback, **more: object) -> Fields:
    """Return the fields of the feedback of a flight that is led, with more fields."""
    return dict(
        **_feedback_to_end(feedback),
        replans=feedback.replans,
        setpoint_delay=feedback.late_s,
        **more,
    )


def height_feedback(feedback: GoalFeedback) -> Fields:
    """Return the fields of the feedback of a climb or descent."""
    return dict(**_feedback_to_end(feedback), height=_or_nan(feedback.height_m))


def waypoints_feedback(feedback: GoalFeedback) -> Fields:
    """Return the fields of the feedback of a route."""
    route = feedback.route
    return flown_feedback(
        feedback,
        current_waypoint=0 if route is None else route.current,
        current_lap=0 if route is None else route.lap,
        waypoints_remaining=0 if route is None else route.remaining,
    )


def orbit_feedback(feedback: GoalFeedback) -> Fields:
    """Return the fields of the feedback of a circle."""
    orbit = feedback.orbit
    return flown_feedback(
        feedback,
        laps_flown=0.0 if orbit is None else orbit.laps_flown,
        radius_error=math.nan if orbit is None else orbit.radius_error_m,
    )


def result_of(make: Callable[..., M], finished: GoalFinished, stamp: Time, **more: object) -> M:
    """Return a result with the fields that all have, and more."""
    return make(
        success=finished.state is GoalState.SUCCEEDED,
        error_code=code_number(finished.code),
        message=finished.message,
        final_pose=pose_stamped(finished.pose, stamp),
        total_elapsed_time=finished.elapsed_s,
        **more,
    )


def land_result(make: Callable[..., M], finished: GoalFinished, stamp: Time) -> M:
    """Return the result of a landing, with its distance from the target."""
    return result_of(make, finished, stamp, lateral_error=_or_nan(finished.final_error_m))


def flown_result(make: Callable[..., M], finished: GoalFinished, stamp: Time, **more: object) -> M:
    """Return the result of a flight to a target, with more fields."""
    final_error = _or_nan(finished.final_error_m)
    return result_of(make, finished, stamp, final_error=final_error, **more)


def waypoints_result(make: Callable[..., M], finished: GoalFinished, stamp: Time) -> M:
    """Return the result of a route."""
    return flown_result(
        make,
        finished,
        stamp,
        waypoints_reached=finished.waypoints_reached,
        waypoints_missed=finished.waypoints_missed,
        next_index=finished.next_index,
        route_id=finished.route_id,
    )


def orbit_result(make: Callable[..., M], finished: GoalFinished, stamp: Time) -> M:
    """Return the result of a circle."""
    return flown_result(make, finished, stamp, laps_flown=finished.laps_flown)
