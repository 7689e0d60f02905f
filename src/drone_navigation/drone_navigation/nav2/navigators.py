"""Goals to poses and routes: `navigate_to_pose`, `navigate_through_poses`, `follow_waypoints`."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

from geometry_msgs.msg import PoseStamped
from nav2_msgs.action import (
    FollowGPSWaypoints,
    FollowWaypoints,
    NavigateThroughPoses,
    NavigateToPose,
)
from rclpy.action import ActionClient
from rclpy.action.server import ServerGoalHandle
from rclpy.node import Node
from sensor_msgs.msg import NavSatFix

from custom_interfaces.action import Navigate, NavigateWaypoints
from custom_interfaces.msg import Waypoint
from drone_navigation.client.client_goal import ClientGoal
from drone_navigation.client.events import Telemetry
from drone_navigation.nav2.flights import FlightRequest, Flights
from drone_navigation.nav2.forms import add_missed, poses_of, show_tracking, show_waypoints
from drone_navigation.nav2.outcomes import Nav2Outcome, aborted, result
from drone_navigation.nav2.served import GoalEnd, duration, serve
from drone_navigation.nav2.server_state import ServerState
from drone_navigation.nav2.targets import HeightRule, Present, Target, TargetError, map_target
from drone_navigation.server.frame_names import FrameNames
from mavlink_vehicle.positions import frames
from mavlink_vehicle.profiles.profile import VehicleKind
from navigation_bridge.goals.point_requests import yaw_enu_rad
from navigation_bridge.names import ACTION_NAME, FRAME_MAP, WAYPOINTS_ACTION_NAME

F = TypeVar("F", NavigateToPose.Feedback, NavigateThroughPoses.Feedback)
# Laps of a route are written out.
_WAYPOINTS_MAX = 5000
# Nav2 takes a pose as passed within 0.7 m, horizontally (RemovePassedGoals of its default behavior
# tree); the height of a PX4 is off by up to 0.4 m besides (observed on PX4 SIH).
_PASS_M = 1.0


@dataclass(frozen=True)
class Preferences:
    """Parameters of the node; docs/nav2.md describes them."""

    least_height_m: float
    max_speed_m_s: float
    avoid_obstacles: bool
    waypoint_pause_s: float
    follow_distance_m: float
    follow_height_m: float


def point_client_goal(target: Target, max_speed_m_s: float, *, avoid_obstacles: bool) -> ClientGoal:
    """Return the server's goal to a target."""
    goal = Navigate.Goal(avoid_obstacles=avoid_obstacles, max_speed=max_speed_m_s)
    goal.target_pose.header.frame_id = FRAME_MAP
    position, orientation = goal.target_pose.pose.position, goal.target_pose.pose.orientation
    position.x, position.y, position.z = target.position_enu_m
    orientation.w = 0.0
    if target.yaw_enu_rad is not None:
        orientation.w, _, _, orientation.z = frames.quaternion_from_yaw(target.yaw_enu_rad)
    return ClientGoal(Navigate, ACTION_NAME, goal, "")


class Navigators:
    """Serves the actions that lead to poses, and the topic `goal_pose`."""

    def __init__(
        self, node: Node, vehicle: ServerState, flights: Flights, preferences: Preferences
    ) -> None:
        """Offer them on ``node``."""
        self._node = node
        self._vehicle = vehicle
        self._flights = flights
        self._preferences = preferences
        self._frames = FrameNames.of(node.get_namespace())
        serve(node, NavigateToPose, "navigate_to_pose", self._to_pose)
        serve(node, NavigateThroughPoses, "navigate_through_poses", self._through_poses)
        serve(node, FollowWaypoints, "follow_waypoints", self._follow_waypoints)
        serve(node, FollowGPSWaypoints, "follow_gps_waypoints", self._follow_gps_waypoints)
        # As Nav2's own navigator does: the topic's goals are goals of the action.
        self._own = ActionClient(node, NavigateToPose, "navigate_to_pose")
        node.create_subscription(PoseStamped, "goal_pose", self._take_goal_pose, 10)

    def _take_goal_pose(self, pose: PoseStamped) -> None:
        self._own.send_goal_async(NavigateToPose.Goal(pose=pose))

    # --- targets --------------------------------------------------------------------------

    def rule(self) -> HeightRule:
        """Return the rule for heights of the vehicle."""
        return HeightRule.of(self._vehicle.kind, self._preferences.least_height_m)

    def present(self) -> Present:
        """Return the vehicle's pose.

        Raises:
            TargetError: it is not known.
        """
        if why := self._vehicle.why_not():
            raise TargetError(*why)
        return self._vehicle.present()

    def targets(self, poses: Sequence[PoseStamped], present: Present) -> list[Target]:
        """Return where poses lead; one without a height keeps that of the one before.

        Raises:
            TargetError: one of them cannot be flown to.
        """
        found: list[Target] = []
        for number, stamped in enumerate(poses, start=1):
            position, q = stamped.pose.position, stamped.pose.orientation
            if found:
                present = _moved(present, found[-1].position_enu_m[2])
            try:
                found.append(
                    map_target(
                        self._frames.plain(stamped.header.frame_id),
                        (position.x, position.y, position.z),
                        (q.x, q.y, q.z, q.w),
                        present,
                        self.rule(),
                    )
                )
            except TargetError as error:
                if len(poses) == 1:
                    raise
                code, text = error.refusal
                raise TargetError(code, f"{text} (pose {number} of {len(poses)})") from None
        return found

    # --- one pose -------------------------------------------------------------------------

    async def _to_pose(self, handle: ServerGoalHandle) -> GoalEnd:
        (target,) = self.targets([handle.request.pose], self.present())
        client_goal = point_client_goal(
            target,
            self._preferences.max_speed_m_s,
            avoid_obstacles=self._preferences.avoid_obstacles,
        )
        started_s = time.monotonic()

        def tell(telemetry: Telemetry) -> None:
            handle.publish_feedback(self._feedback(NavigateToPose.Feedback, telemetry, started_s))

        order = FlightRequest(
            client_goal, target.position_enu_m[2], lambda: handle.is_cancel_requested, tell
        )
        return await self._flights.fly(order), None

    def _feedback(self, make: Callable[[], F], telemetry: Telemetry, started_s: float) -> F:
        message = make()
        message.current_pose = self._vehicle.pose()
        message.navigation_time = duration(time.monotonic() - started_s)
        if math.isfinite(telemetry.time_left_s):
            message.estimated_time_remaining = duration(telemetry.time_left_s)
        message.distance_remaining = telemetry.distance_left_m
        present = self._vehicle.present()
        plan_enu_m = self._vehicle.plan_enu_m
        show_tracking(message, present.position_enu_m, present.yaw_enu_rad, plan_enu_m)
        return message

    # --- routes ---------------------------------------------------------------------------

    async def _through_poses(self, handle: ServerGoalHandle) -> GoalEnd:
        poses = poses_of(handle.request.poses)
        targets = self.targets(poses, self.present())
        started_s, passed = time.monotonic(), 0

        def tell(telemetry: Telemetry) -> None:
            nonlocal passed
            feedback = self._feedback(NavigateThroughPoses.Feedback, telemetry, started_s)
            passed = (telemetry.waypoint or 1) - 1
            feedback.number_of_poses_remaining = len(targets) - passed
            show_waypoints(feedback, poses, passed)
            handle.publish_feedback(feedback)

        waypoints = [self._waypoint(target) for target in targets]
        for waypoint in waypoints[:-1]:
            waypoint.acceptance_radius = _PASS_M
        outcome = await self._route(handle, waypoints, targets, tell)
        message = result(NavigateThroughPoses.Result, outcome)
        show_waypoints(message, poses, passed, outcome)
        return outcome, message

    async def _follow_waypoints(self, handle: ServerGoalHandle) -> GoalEnd:
        targets = self.targets(handle.request.poses, self.present())
        waypoints = [self._waypoint(t, self._pause_s()) for t in targets]
        return await self._follow(handle, FollowWaypoints, waypoints, targets)

    async def _follow_gps_waypoints(self, handle: ServerGoalHandle) -> GoalEnd:
        present = self.present()
        targets: list[Target] = []
        waypoints: list[Waypoint] = []
        for place in handle.request.gps_poses:
            if targets:
                present = _moved(present, targets[-1].position_enu_m[2])
            height_m = self.rule().height_m(self._map_height_m(place.position.altitude), present)
            q = place.orientation
            target = Target((math.nan, math.nan, height_m), yaw_enu_rad((q.x, q.y, q.z, q.w)))
            waypoint = self._waypoint(target, self._pause_s())
            waypoint.frame = Waypoint.FRAME_GEODETIC_ABOVE_HOME
            waypoint.position.x = place.position.latitude
            waypoint.position.y = place.position.longitude
            waypoint.position.z = height_m - present.ground_m
            targets.append(target)
            waypoints.append(waypoint)
        return await self._follow(handle, FollowGPSWaypoints, waypoints, targets)

    def _map_height_m(self, altitude_m: float) -> float:
        """Return the map z of an altitude above the ellipsoid; 0 and NaN are no altitudes.

        Raises:
            TargetError: the vehicle does not report its own.
        """
        if math.isnan(altitude_m) or altitude_m == 0.0:
            return 0.0
        fix = self._vehicle.last(NavSatFix)
        if fix is None or not math.isfinite(fix.altitude):
            raise TargetError(
                "NO_POSITION",
                "The vehicle does not report its altitude above the ellipsoid, which "
                "GPS waypoints count from; send an altitude of 0 to keep the height.",
            )
        return float(self._vehicle.present().position_enu_m[2] + altitude_m - fix.altitude)

    def _pause_s(self) -> float:
        # A plane would circle at each waypoint.
        plane = self._vehicle.kind is VehicleKind.PLANE
        return 0.0 if plane else self._preferences.waypoint_pause_s

    def _waypoint(self, target: Target, hold_s: float = 0.0) -> Waypoint:
        message = Waypoint(frame=Waypoint.FRAME_MAP, hold_time=hold_s)
        message.position.x, message.position.y, message.position.z = target.position_enu_m
        message.use_yaw = target.yaw_enu_rad is not None
        message.yaw = target.yaw_enu_rad or 0.0
        return message

    async def _follow(
        self,
        handle: ServerGoalHandle,
        kind: type[FollowWaypoints | FollowGPSWaypoints],
        waypoints: Sequence[Waypoint],
        targets: Sequence[Target],
    ) -> GoalEnd:
        """Fly laps, the first from `goal_index` on, as Nav2's waypoint follower does."""
        request = handle.request
        count = len(waypoints)
        if not waypoints:
            # Both since nav2_msgs 1.4.
            gps = getattr(kind.Result, "NO_WAYPOINTS_GIVEN", None)
            code = getattr(kind.Result, "NO_VALID_WAYPOINTS", gps)
            return aborted("INVALID_WAYPOINTS", "There are no poses.", code), None
        if request.goal_index >= max(count, 1):
            raise TargetError(
                "INVALID_WAYPOINTS",
                f"goal_index is {request.goal_index}, but there are {count} waypoints.",
            )
        if (1 + request.number_of_loops) * count > _WAYPOINTS_MAX:
            raise TargetError(
                "INVALID_WAYPOINTS",
                f"{1 + request.number_of_loops} laps of {count} waypoints are "
                f"more than {_WAYPOINTS_MAX}.",
            )
        laps = range(1 + request.number_of_loops)
        order = [i for lap in laps for i in range(0 if lap else request.goal_index, count)]
        route = [waypoints[i] for i in order]

        def tell(telemetry: Telemetry) -> None:
            index = order[min((telemetry.waypoint or 1) - 1, len(order) - 1)]
            handle.publish_feedback(kind.Feedback(current_waypoint=index))

        outcome = await self._route(handle, route, targets, tell)
        message = result(kind.Result, outcome)
        for missed in outcome.missed:
            index = order[missed]
            pose = request.poses[index] if kind is FollowWaypoints else None
            add_missed(message, index, outcome, pose)
        return outcome, message

    async def _route(
        self,
        handle: ServerGoalHandle,
        waypoints: Sequence[Waypoint],
        targets: Sequence[Target],
        tell: Callable[[Telemetry], None],
    ) -> Nav2Outcome:
        if not waypoints:
            return aborted("INVALID_WAYPOINTS", "There are no poses.")
        goal = NavigateWaypoints.Goal(
            execution=NavigateWaypoints.Goal.EXECUTION_SETPOINTS,
            waypoints=list(waypoints),
            laps=1,
            max_speed=self._preferences.max_speed_m_s,
            avoid_obstacles=self._preferences.avoid_obstacles,
        )
        client_goal = ClientGoal(
            NavigateWaypoints, WAYPOINTS_ACTION_NAME, goal, "", waypoints=len(waypoints)
        )
        last_m = targets[-1].position_enu_m[2]
        order = FlightRequest(client_goal, last_m, lambda: handle.is_cancel_requested, tell)
        return await self._flights.fly(order)


def _moved(present: Present, height_m: float) -> Present:
    """Return the vehicle as a target finds it that follows one at a height."""
    east_m, north_m, _ = present.position_enu_m
    return replace(present, position_enu_m=(east_m, north_m, height_m), target_m=height_m)
