"""ROS messages <-> the bridge's own types."""

from __future__ import annotations

import math

from builtin_interfaces.msg import Time
from geometry_msgs.msg import PoseStamped

from custom_interfaces.action import Navigate
from drone_navigation.goal import GoalFeedback, GoalFinished
from drone_navigation.lifecycle import GoalState
from drone_navigation.requests import FRAME_MAP, MapPose, NavigateRequest


def request_from_goal(goal: Navigate.Goal) -> NavigateRequest:
    """Return the request that a Navigate goal makes."""
    pose = goal.target_pose.pose
    q = pose.orientation
    return NavigateRequest(
        frame_id=goal.target_pose.header.frame_id,
        position_m=(pose.position.x, pose.position.y, pose.position.z),
        orientation_xyzw=(q.x, q.y, q.z, q.w),
        avoid_obstacles=goal.avoid_obstacles,
        max_speed_m_s=goal.max_speed,
    )


def pose_stamped(pose: MapPose | None, stamp: Time) -> PoseStamped:
    """Return the pose in frame map; all NaN when it is unknown, never a made-up place."""
    message = PoseStamped()
    message.header.stamp = stamp
    message.header.frame_id = FRAME_MAP
    position, orientation = message.pose.position, message.pose.orientation
    if pose is None:
        position.x = position.y = position.z = math.nan
        orientation.x = orientation.y = orientation.z = orientation.w = math.nan
        return message
    position.x, position.y, position.z = pose.position_enu_m
    orientation.x, orientation.y, orientation.z, orientation.w = pose.orientation_xyzw
    return message


def feedback_message(feedback: GoalFeedback, stamp: Time) -> Navigate.Feedback:
    """Return the action feedback; an unknown battery is NaN."""
    message = Navigate.Feedback()
    message.current_pose = pose_stamped(feedback.pose, stamp)
    message.distance_remaining = feedback.distance_remaining_m
    message.estimated_time_remaining = feedback.time_remaining_s
    remaining = feedback.battery_remaining
    message.battery_percentage = math.nan if remaining is None else 100.0 * remaining
    message.current_status = feedback.status.value
    return message


def result_message(finished: GoalFinished, stamp: Time) -> Navigate.Result:
    """Return the action result."""
    message = Navigate.Result()
    message.success = finished.state is GoalState.SUCCEEDED
    message.final_pose = pose_stamped(finished.pose, stamp)
    message.total_elapsed_time = finished.elapsed_s
    error_m = finished.final_error_m
    message.final_error = math.nan if error_m is None else error_m
    message.message = finished.message
    return message
