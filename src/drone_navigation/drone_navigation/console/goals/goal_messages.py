"""Goals of a page as goals of the server's actions. No I/O, no clock."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TypeAlias

from custom_interfaces.action import Follow, Land, Navigate, NavigateWaypoints, Orbit
from custom_interfaces.msg import Waypoint
from drone_navigation.console.acts.page_acts import act_message
from drone_navigation.console.messages import PageCommand, PageFollow, PageGoal, PageWaypoint
from navigation_bridge.names import (
    ACTION_NAME,
    FOLLOW_ACTION_NAME,
    FRAME_MAP,
    ORBIT_ACTION_NAME,
    WAYPOINTS_ACTION_NAME,
)

__all__ = ["ActionGoal", "action_goal", "landing"]

ActionGoal: TypeAlias = Navigate.Goal | NavigateWaypoints.Goal | Orbit.Goal | Follow.Goal


def action_goal(
    order: PageGoal | PageFollow,
) -> tuple[str, ActionGoal, Sequence[PageWaypoint]]:
    """Return an action's name, its goal, and the waypoints that it leads to.

    A route has several waypoints, a hold time, acts, laps or a turn.
    """
    if isinstance(order, PageFollow):
        return FOLLOW_ACTION_NAME, _followed(order), ()
    waypoints = order.waypoints
    if order.radius_m:
        # The centre is no waypoint: the vehicle never comes to it.
        return ORBIT_ACTION_NAME, _circle(order), ()
    is_point = len(waypoints) == 1 and not waypoints[0].hold_time_s and not waypoints[0].acts
    if is_point and order.laps == 1 and not order.turn_deg_s:
        goal = Navigate.Goal(max_speed=order.speed_m_s, avoid_obstacles=order.avoid_obstacles)
        goal.target_pose.header.frame_id = FRAME_MAP
        position = goal.target_pose.pose.position
        position.x, position.y, position.z = waypoints[0].position_enu_m
        # All zeros: the vehicle faces the direction of travel.
        goal.target_pose.pose.orientation.w = 0.0
        return ACTION_NAME, goal, waypoints
    route = NavigateWaypoints.Goal(
        execution=NavigateWaypoints.Goal.EXECUTION_SETPOINTS,
        waypoints=[_waypoint(waypoint) for waypoint in waypoints],
        laps=order.laps,
        max_speed=order.speed_m_s,
        avoid_obstacles=order.avoid_obstacles,
        # To the right is clockwise.
        yaw_rate=-math.radians(order.turn_deg_s),
    )
    return WAYPOINTS_ACTION_NAME, route, waypoints


def landing(command: PageCommand) -> Land.Goal:
    """Return the goal that lands where the vehicle is, or on a target."""
    topic = command.target_topic.strip()
    if not topic:
        # The other fields may hold anything; that must not keep it from landing.
        return Land.Goal()
    return Land.Goal(
        target_topic=topic,
        target_required=command.target_required,
        retries=command.retries,
    )


def _followed(order: PageFollow) -> Follow.Goal:
    goal = Follow.Goal(
        offset_frame=Follow.Goal.OFFSET_MAP if order.in_map else Follow.Goal.OFFSET_TARGET,
        least_distance=order.least_distance_m,
        max_speed=order.speed_m_s,
    )
    goal.offset.x, goal.offset.y, goal.offset.z = order.ahead_m, order.left_m, order.above_m
    if order.source == "topic":
        goal.pose_topic = order.target
    elif order.source == "frame":
        goal.tracked_frame = order.target
    else:
        goal.target_system = int(order.target)
    return goal


def _circle(order: PageGoal) -> Orbit.Goal:
    x, y, height_m = order.waypoints[0].position_enu_m
    circle = Orbit.Goal(
        radius=order.radius_m,
        height=height_m,
        laps=float(order.laps),
        max_speed=order.speed_m_s,
        avoid_obstacles=order.avoid_obstacles,
    )
    circle.centre.header.frame_id = FRAME_MAP
    circle.centre.pose.position.x, circle.centre.pose.position.y = x, y
    return circle


def _waypoint(waypoint: PageWaypoint) -> Waypoint:
    message = Waypoint(frame=Waypoint.FRAME_MAP, hold_time=waypoint.hold_time_s)
    message.position.x, message.position.y, message.position.z = waypoint.position_enu_m
    message.acts = [act_message(act) for act in waypoint.acts]
    return message
