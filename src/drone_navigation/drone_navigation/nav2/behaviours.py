"""`spin`, `drive_on_heading` and `backup`, short goals relative to the pose; `follow_object`."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from typing import Any

from nav2_msgs.action import BackUp, DriveOnHeading, Spin
from rclpy.action.server import ServerGoalHandle
from rclpy.node import Node

from custom_interfaces.action import Follow
from custom_interfaces.msg import GoalCode
from drone_navigation.client.client_goal import ClientGoal
from drone_navigation.client.events import Telemetry
from drone_navigation.nav2.flights import FlightRequest, Flights
from drone_navigation.nav2.forms import optional_actions
from drone_navigation.nav2.navigators import Navigators, Preferences, point_client_goal
from drone_navigation.nav2.outcomes import Nav2Outcome, aborted, result
from drone_navigation.nav2.served import GoalEnd, duration, serve
from drone_navigation.nav2.server_state import ServerState
from drone_navigation.nav2.targets import Target, TargetError, turns
from mavlink_vehicle.positions import frames
from mavlink_vehicle.profiles.profile import VehicleKind
from navigation_bridge.names import FOLLOW_ACTION_NAME
from navigation_core.geometry import distance, wrap_angle

_SPIN_MAX_RAD = 20.0 * math.pi
# The server rejects slower goals.
_SPEED_MIN_M_S = 0.05
# Nav2's state for each of the server's.
_STATES = {"ACQUIRING": "INITIAL_PERCEPTION", "FOLLOWING": "CONTROLLING", "LOST": "STOPPING"}


class Behaviours:
    """Serves the actions that move a little."""

    def __init__(
        self,
        node: Node,
        vehicle: ServerState,
        flights: Flights,
        navigators: Navigators,
        preferences: Preferences,
    ) -> None:
        """Offer them on ``node``."""
        self._vehicle = vehicle
        self._flights = flights
        self._navigators = navigators
        self._preferences = preferences
        serve(node, Spin, "spin", self._spin)
        serve(node, BackUp, "backup", self._back_up)
        serve(node, DriveOnHeading, "drive_on_heading", self._drive_on_heading)

    def _check(self, what: str, kinds: tuple[VehicleKind, ...]) -> None:
        """Reject what the vehicle cannot do now.

        Raises:
            TargetError: with the reason.
        """
        self._navigators.present()
        kind = self._vehicle.kind
        if kind not in kinds:
            raise TargetError("UNSUPPORTED_VEHICLE", f"A {kind.value} cannot {what}.")
        if kind is VehicleKind.COPTER and not self._vehicle.flies_now:
            raise TargetError(
                "NOT_FLYING", "The vehicle is not in the air; send it to a pose first."
            )

    async def _spin(self, handle: ServerGoalHandle) -> GoalEnd:
        turn_rad = handle.request.target_yaw
        self._check("turn on the spot", (VehicleKind.COPTER,))
        if not math.isfinite(turn_rad) or abs(turn_rad) > _SPIN_MAX_RAD:
            raise TargetError("INVALID_NUMBER", f"target_yaw is {turn_rad}.")
        present = self._navigators.present()
        height_m = self._navigators.rule().height_m(0.0, present)
        place = (*present.position_enu_m[:2], height_m)
        turned_rad, yaw_rad = 0.0, present.yaw_enu_rad

        def tell(_telemetry: Telemetry) -> None:
            nonlocal turned_rad, yaw_rad
            now_rad = self._vehicle.present().yaw_enu_rad
            turned_rad += wrap_angle(now_rad - yaw_rad)
            yaw_rad = now_rad
            handle.publish_feedback(Spin.Feedback(angular_distance_traveled=abs(turned_rad)))

        started_s = time.monotonic()
        outcome = aborted("INTERNAL_ERROR", "no turn")
        for to_rad in turns(present.yaw_enu_rad, turn_rad):
            outcome = await self._move(handle, Target(place, to_rad), 0.0, started_s, tell)
            if outcome.code:
                break
        return outcome, _timed(Spin, outcome, started_s)

    async def _back_up(self, handle: ServerGoalHandle) -> GoalEnd:
        # As Nav2 does: backwards, whatever the signs are.
        self._check("reverse", (VehicleKind.COPTER,))
        request = handle.request
        return await self._straight(handle, BackUp, -abs(request.target.x), abs(request.speed))

    async def _drive_on_heading(self, handle: ServerGoalHandle) -> GoalEnd:
        request = handle.request
        kinds = [VehicleKind.COPTER]
        if request.target.x > 0.0:
            kinds += [VehicleKind.ROVER, VehicleKind.BOAT]
        self._check("move straight" if request.target.x > 0.0 else "reverse", tuple(kinds))
        if (request.target.x > 0.0) != (request.speed > 0.0):
            text = "Speed and distance must have the same sign."
            return aborted("INVALID_NUMBER", text, DriveOnHeading.Result.INVALID_INPUT), None
        return await self._straight(handle, DriveOnHeading, request.target.x, abs(request.speed))

    async def _straight(
        self,
        handle: ServerGoalHandle,
        kind: type[BackUp | DriveOnHeading],
        forward_m: float,
        speed_m_s: float,
    ) -> GoalEnd:
        target = handle.request.target
        if target.y or target.z or not math.isfinite(forward_m) or not math.isfinite(speed_m_s):
            text = "Only target.x may be set, to a finite number."
            return aborted("INVALID_NUMBER", text, kind.Result.INVALID_INPUT), None
        present = self._navigators.present()
        here = present.position_enu_m
        there = frames.body_flu_to_enu((forward_m, 0.0, 0.0), present.yaw_enu_rad)
        height_m = self._navigators.rule().height_m(0.0, present)
        place = (here[0] + there[0], here[1] + there[1], height_m)

        def tell(_telemetry: Telemetry) -> None:
            gone_m = distance(here, self._vehicle.present().position_enu_m)
            handle.publish_feedback(kind.Feedback(distance_traveled=gone_m))

        started_s = time.monotonic()
        goal = Target(place, present.yaw_enu_rad)
        speed_m_s = max(speed_m_s, _SPEED_MIN_M_S)
        outcome = await self._move(handle, goal, speed_m_s, started_s, tell)
        return outcome, _timed(kind, outcome, started_s)

    async def _move(
        self,
        handle: ServerGoalHandle,
        target: Target,
        speed_m_s: float,
        started_s: float,
        tell: Callable[[Telemetry], None],
    ) -> Nav2Outcome:
        # Since nav2_msgs 1.4.
        checks = not getattr(handle.request, "disable_collision_checks", False)
        client_goal = point_client_goal(
            target, speed_m_s, avoid_obstacles=checks and self._preferences.avoid_obstacles
        )
        allowed = handle.request.time_allowance
        allowance_s = allowed.sec + 1e-9 * allowed.nanosec
        if allowance_s > 0.0:
            allowance_s = max(allowance_s - (time.monotonic() - started_s), 0.1)
        return await self._flights.fly(
            FlightRequest(
                client_goal,
                target.position_enu_m[2],
                lambda: handle.is_cancel_requested,
                tell,
                allowance_s,
            )
        )


def _timed(
    kind: type[Spin | BackUp | DriveOnHeading], outcome: Nav2Outcome, started_s: float
) -> Spin.Result | BackUp.Result | DriveOnHeading.Result:
    message = result(kind.Result, outcome)
    message.total_elapsed_time = duration(time.monotonic() - started_s)
    if outcome.code == GoalCode.TIMEOUT:
        message.error_code = kind.Result.TIMEOUT
    return message


def follow_client_goal(request: Any, preferences: Preferences) -> ClientGoal:
    """Return the server's goal for one of `follow_object`.

    Raises:
        TargetError: its duration is negative.
    """
    allowed = request.max_duration
    duration_s = allowed.sec + 1e-9 * allowed.nanosec
    if duration_s < 0.0:
        raise TargetError("INVALID_NUMBER", f"max_duration is {duration_s:g} s.")
    goal = Follow.Goal(max_duration=duration_s, max_speed=preferences.max_speed_m_s)
    # The frame is for goals without a topic.
    goal.pose_topic = request.pose_topic
    goal.tracked_frame = "" if request.pose_topic else request.tracked_frame
    goal.offset_frame = Follow.Goal.OFFSET_TARGET
    goal.offset.x, goal.offset.z = -preferences.follow_distance_m, preferences.follow_height_m
    return ClientGoal(Follow, FOLLOW_ACTION_NAME, goal, "")


class ObjectFollower:
    """Serves the action."""

    def __init__(
        self, node: Node, flights: Flights, navigators: Navigators, preferences: Preferences
    ) -> None:
        """Offer it on ``node``, if there is such an action."""
        self._flights = flights
        self._navigators = navigators
        self._preferences = preferences
        for kind in optional_actions(["FollowObject"]).values():
            self._kind = kind
            serve(node, kind, "follow_object", self._follow)

    async def _follow(self, handle: ServerGoalHandle) -> GoalEnd:
        client_goal = follow_client_goal(handle.request, self._preferences)
        present, started_s = self._navigators.present(), time.monotonic()

        def tell(telemetry: Telemetry) -> None:
            message = self._kind.Feedback()
            message.state = getattr(message, _STATES[telemetry.follow_state or "ACQUIRING"])
            message.following_time = duration(time.monotonic() - started_s)
            handle.publish_feedback(message)

        order = FlightRequest(
            client_goal, present.position_enu_m[2], lambda: handle.is_cancel_requested, tell
        )
        outcome = await self._flights.fly(order)
        message = result(self._kind.Result, outcome)
        message.total_elapsed_time = duration(time.monotonic() - started_s)
        if outcome.code == GoalCode.TARGET_LOST:
            message.error_code = self._kind.Result.FAILED_TO_DETECT_OBJECT
        return outcome, message
