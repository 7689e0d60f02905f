"""Services of Nav2's names: state, life cycle, cost maps; and all that is rejected."""

from __future__ import annotations

import math
from typing import Any

from geometry_msgs.msg import PoseWithCovarianceStamped
from lifecycle_msgs.msg import State
from lifecycle_msgs.srv import GetState
from nav2_msgs.srv import LoadMap, ManageLifecycleNodes
from rclpy.action.server import ServerGoalHandle
from rclpy.node import Node
from std_srvs.srv import Trigger

from drone_navigation.nav2.flights import Flights
from drone_navigation.nav2.forms import optional_actions, optional_services
from drone_navigation.nav2.outcomes import aborted
from drone_navigation.nav2.served import GoalEnd, Nav2Action, serve
from drone_navigation.nav2.server_state import ServerState

# By the name of the type; nav2_msgs 1.3 has not all of them.
_NOT_OFFERED = {
    "FollowPath": ("follow_path", "External paths are not followed; send poses."),
    "SmoothPath": ("smooth_path", "Paths are not smoothed; the server smooths its own."),
    "AssistedTeleop": (
        "assisted_teleop", "Use the action follow_velocity and its topic cmd_vel."
    ),
    "DockRobot": ("dock_robot", "There are no docks; send a pose, or land."),
    "UndockRobot": ("undock_robot", "There are no docks; send a pose, or take off."),
    "ComputeRoute": ("compute_route", "There is no graph of routes; send poses."),
    "ComputeAndTrackRoute": (
        "compute_and_track_route", "There is no graph of routes; send poses."
    ),
}  # fmt: skip
# In nav2_msgs 1.4, ClearCostmapAroundPose is missing.
_CLEARING = {
    "ClearEntireCostmap": "clear_entirely_{}_costmap",
    "ClearCostmapExceptRegion": "clear_costmap_except_region",
    "ClearCostmapAroundRobot": "clear_costmap_around_robot",
    "ClearCostmapAroundPose": "clear_costmap_around_pose",
}
_MANAGERS = ("lifecycle_manager_navigation", "lifecycle_manager_localization")
_NODES = ("bt_navigator", "amcl")
_STOPPING = (
    ManageLifecycleNodes.Request.PAUSE,
    ManageLifecycleNodes.Request.RESET,
    ManageLifecycleNodes.Request.SHUTDOWN,
    ManageLifecycleNodes.Request.CLEANUP,
)
# An initial pose farther from the estimate than this is worth a warning; it is ignored anyway.
_POSE_OFF_MAX_M = 3.0


def reject_the_rest(node: Node) -> None:
    """Offer what is not served, and answer at once: clients of Nav2 wait for servers forever."""

    def reject(kind: Nav2Action, name: str, why: str) -> None:
        code = getattr(kind.Result, "UNKNOWN", 0)
        outcome = aborted("UNSUPPORTED", f"{name} is not offered. {why}", code)

        async def run(_handle: ServerGoalHandle) -> GoalEnd:
            return outcome, None

        serve(node, kind, name, run)

    for known, kind in optional_actions(list(_NOT_OFFERED)).items():
        reject(kind, *_NOT_OFFERED[known])

    def load_map(_request: LoadMap.Request, response: LoadMap.Response) -> LoadMap.Response:
        response.result = LoadMap.Response.RESULT_UNDEFINED_FAILURE
        node.get_logger().warning(
            "map_server/load_map is not offered: obstacles come from the server's obstacles_file "
            "and sensors."
        )
        return response

    node.create_service(LoadMap, "map_server/load_map", load_map)


def offer_clearing(node: Node) -> None:
    """Offer the services that clear cost maps; they change nothing."""

    def clear(_request: object, response: Any) -> Any:
        node.get_logger().info(
            "Nothing is cleared: the server's map forgets what its sensors no longer detect."
        )
        if hasattr(response, "success"):
            response.success = True
        return response

    for known, kind in optional_services(list(_CLEARING)).items():
        for which in ("global", "local"):
            name = _CLEARING[known].format(which)
            node.create_service(kind, f"{which}_costmap/{name}", clear)


class LifeCycle:
    """State of the nodes that clients of Nav2 wait for: active while a goal can be sent."""

    def __init__(self, node: Node, vehicle: ServerState, flights: Flights) -> None:
        """Offer the services on ``node``."""
        self._node = node
        self._vehicle = vehicle
        self._flights = flights
        for name in _NODES:
            node.create_service(GetState, f"{name}/get_state", self._get_state)
        for name in _MANAGERS:
            node.create_service(Trigger, f"{name}/is_active", self._is_active)
            node.create_service(ManageLifecycleNodes, f"{name}/manage_nodes", self._manage)
        node.create_subscription(
            PoseWithCovarianceStamped, "initialpose", self._take_initial_pose, 10
        )

    def _get_state(
        self, _request: GetState.Request, response: GetState.Response
    ) -> GetState.Response:
        why = self._vehicle.why_not()
        if why:
            self._node.get_logger().info(f"Not active. {why}", throttle_duration_sec=10.0)
            response.current_state = State(id=State.PRIMARY_STATE_INACTIVE, label="inactive")
        else:
            response.current_state = State(id=State.PRIMARY_STATE_ACTIVE, label="active")
        return response

    def _is_active(self, _request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        why = self._vehicle.why_not()
        response.success = why is None
        response.message = str(why or "")
        return response

    def _manage(
        self, request: ManageLifecycleNodes.Request, response: ManageLifecycleNodes.Response
    ) -> ManageLifecycleNodes.Response:
        if request.command in _STOPPING:
            if not self._flights.is_idle:
                self._node.get_logger().warning(
                    "Cancelling the goal, as requested by manage_nodes."
                )
            self._flights.stop()
        response.success = True
        return response

    def _take_initial_pose(self, message: PoseWithCovarianceStamped) -> None:
        """Ignore it: the autopilot's estimator knows where the vehicle is."""
        if self._vehicle.why_not():
            return
        here, given = self._vehicle.present().position_enu_m, message.pose.pose.position
        off_m = math.hypot(given.x - here[0], given.y - here[1])
        if off_m > _POSE_OFF_MAX_M:
            self._node.get_logger().warning(
                f"The initial pose is ignored, and {off_m:.0f} m from the vehicle: the autopilot "
                "estimates its pose by itself.",
                throttle_duration_sec=10.0,
            )
