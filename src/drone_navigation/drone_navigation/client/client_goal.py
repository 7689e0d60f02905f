"""Goal types of the navigation client: a point, or a route from a file."""

from __future__ import annotations

import argparse
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from custom_interfaces.action import (
    Follow,
    Land,
    Navigate,
    NavigateWaypoints,
    Orbit,
    ReturnToLaunch,
    Takeoff,
)
from drone_navigation.client.options import ACTION_COMMANDS, make_command_parser, make_parser
from drone_navigation.message_forms.waypoint_messages import waypoint_message
from navigation_bridge.names import (
    ACTION_NAME,
    FOLLOW_ACTION_NAME,
    LAND_ACTION_NAME,
    ORBIT_ACTION_NAME,
    RETURN_ACTION_NAME,
    TAKEOFF_ACTION_NAME,
    WAYPOINTS_ACTION_NAME,
)
from navigation_core.geometry import Vector3

ORBIT_YAW_MODES = {
    "centre": Orbit.Goal.YAW_CENTRE,
    "tangent": Orbit.Goal.YAW_TANGENT,
    "keep": Orbit.Goal.YAW_KEEP,
}
_OFFSET_FRAMES = {"target": Follow.Goal.OFFSET_TARGET, "map": Follow.Goal.OFFSET_MAP}
_FOLLOW_YAW_MODES = {
    "target": Follow.Goal.YAW_TARGET,
    "tangent": Follow.Goal.YAW_TANGENT,
    "keep": Follow.Goal.YAW_KEEP,
}

if TYPE_CHECKING:
    from navigation_bridge.plan_files.routes import PlannedRoute


@dataclass(frozen=True)
class ClientGoal:
    """One goal.

    Attributes:
        action: type of the action.
        name: name of the action.
        goal: what is sent.
        description: for people: "goal (1, 2, 3) m in frame map".
        notes: sentences that are shown before.
        waypoints: how many the route has; 0 for a point.
    """

    action: type[object]
    name: str
    goal: object
    description: str
    notes: tuple[str, ...] = ()
    waypoints: int = 0


def make_client_goal(options: argparse.Namespace) -> ClientGoal:
    """Return the goal of the command line; the program ends if its file cannot be flown."""
    if options.command in ACTION_COMMANDS:
        return _command(options)
    if options.plan is not None or options.waypoints is not None:
        return _route(_planned(options), options)
    return make_point_client_goal(options, options.goal)


def make_point_client_goal(options: argparse.Namespace, position_m: Vector3) -> ClientGoal:
    """Return a goal to a point with the options of the command line."""
    x, y, z = position_m
    goal = _point(options, position_m)
    # Ten digits: a latitude to the centimetre.
    unit = "" if options.frame == Navigate.Goal.FRAME_WGS84 else " m"
    place = f"goal ({x:.10g}, {y:.10g}, {z:.10g}){unit} in frame {options.frame or 'map'}"
    return ClientGoal(Navigate, ACTION_NAME, goal, place)


def _command(options: argparse.Namespace) -> ClientGoal:
    """Return the goal of a command."""
    if options.command == "orbit":
        return _orbit(options)
    if options.command == "follow":
        return _follow(options)
    if options.command == "survey":
        return _survey(options)
    if options.command == "takeoff":
        goal = Takeoff.Goal()
        goal.height = options.height
        height = f" to {options.height:g} m" if options.height else ""
        return ClientGoal(Takeoff, TAKEOFF_ACTION_NAME, goal, f"take-off{height}")
    if options.command == "land":
        return _land(options)
    return ClientGoal(ReturnToLaunch, RETURN_ACTION_NAME, ReturnToLaunch.Goal(), "return to launch")


def _land(options: argparse.Namespace) -> ClientGoal:
    goal = Land.Goal()
    goal.target_topic, goal.target_required = options.on, options.required
    goal.retries, goal.search_height = options.retries, options.search_height
    return ClientGoal(
        Land, LAND_ACTION_NAME, goal, f"landing on {options.on}" if options.on else "landing"
    )


def _follow(options: argparse.Namespace) -> ClientGoal:
    goal = Follow.Goal()
    goal.pose_topic, goal.tracked_frame = options.topic, options.tf
    goal.target_system = options.system
    goal.offset.x, goal.offset.y, goal.offset.z = options.offset
    goal.offset_frame = _OFFSET_FRAMES[options.offset_frame]
    goal.least_distance, goal.max_speed = options.least_distance, options.speed
    goal.max_duration, goal.lost_timeout = options.duration, options.target_timeout
    goal.yaw_mode = _FOLLOW_YAW_MODES[options.yaw_mode]
    what = options.topic or options.tf or f"MAVLink system {options.system}"
    return ClientGoal(Follow, FOLLOW_ACTION_NAME, goal, f"following {what}")


def _survey(options: argparse.Namespace) -> ClientGoal:
    # With the planner of surveys, which would double what the client itself takes to start.
    from drone_navigation.client.option_groups.asked_survey import survey_request  # noqa: PLC0415
    from drone_navigation.client.option_groups.terrain_file import (  # noqa: PLC0415
        TerrainFileError,
    )
    from navigation_bridge.goals.surveys import SurveyRoute, compute_survey  # noqa: PLC0415
    from navigation_bridge.plan_files.routes import PlannedRoute  # noqa: PLC0415

    try:
        route = compute_survey(survey_request(options))
    except TerrainFileError as error:
        make_command_parser("survey").error(str(error))
    if not isinstance(route, SurveyRoute):
        make_command_parser("survey").error(route.message)
    photos = f", {route.photos} photos" if route.photos else ""
    note = (
        f"The survey covers {route.area_m2:.0f} m2 by lines {route.spacing_m:.1f} m apart at "
        f"{math.degrees(route.angle_enu_rad):.0f} degrees: {route.length_m:.0f} m, "
        f"{route.duration_s / 60.0:.0f} min{photos}."
    )
    return _route(PlannedRoute(route.waypoints, (note,)), options)


def _orbit(options: argparse.Namespace) -> ClientGoal:
    goal = Orbit.Goal()
    goal.centre.header.frame_id = options.frame
    goal.centre.pose.position.x, goal.centre.pose.position.y = options.x, options.y
    goal.radius, goal.height, goal.laps = options.radius, options.height, options.laps
    goal.yaw_mode = ORBIT_YAW_MODES[options.yaw_mode]
    goal.max_speed = options.speed
    goal.avoid_obstacles = bool(options.avoid)
    laps = f"{options.laps:g} laps" if options.laps else "until it is cancelled"
    description = (
        f"circle of {options.radius:g} m about ({options.x:.10g}, {options.y:.10g}) in frame "
        f"{options.frame or 'map'}, {laps}"
    )
    return ClientGoal(Orbit, ORBIT_ACTION_NAME, goal, description)


def _point(options: argparse.Namespace, position_m: Vector3) -> Navigate.Goal:
    goal = Navigate.Goal()
    goal.target_pose.header.frame_id = options.frame
    position, orientation = goal.target_pose.pose.position, goal.target_pose.pose.orientation
    position.x, position.y, position.z = position_m
    if options.yaw is None:
        orientation.x = orientation.y = orientation.z = orientation.w = 0.0
    else:
        half_rad = math.radians(options.yaw) / 2.0
        orientation.z, orientation.w = math.sin(half_rad), math.cos(half_rad)
    goal.max_speed = options.speed
    goal.avoid_obstacles = bool(options.avoid)
    return goal


def _planned(options: argparse.Namespace) -> PlannedRoute:
    # With the codec, which would double what the client itself takes to start.
    from navigation_bridge.plan_files.items import PlanError  # noqa: PLC0415
    from navigation_bridge.plan_files.routes import read_route  # noqa: PLC0415

    try:
        return read_route(options.plan or options.waypoints)
    except PlanError as error:
        make_parser().error(str(error))


def _route(route: PlannedRoute, options: argparse.Namespace) -> ClientGoal:
    goal = NavigateWaypoints.Goal()
    goal.execution = goal.EXECUTION_MISSION if options.mission else goal.EXECUTION_SETPOINTS
    goal.waypoints = [waypoint_message(waypoint) for waypoint in route.waypoints]
    goal.laps = options.laps
    goal.first, goal.interrupted_id = options.first - 1, options.interrupted
    goal.yaw_rate = options.yaw_rate
    goal.max_speed = options.speed
    goal.avoid_obstacles = bool(options.avoid)
    executed = "as a mission" if options.mission else "by setpoints"
    description = f"a route of {len(route.waypoints)} waypoints, {executed}"
    return ClientGoal(
        NavigateWaypoints,
        WAYPOINTS_ACTION_NAME,
        goal,
        description,
        route.notes,
        len(route.waypoints),
    )
