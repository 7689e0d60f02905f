"""`compute_path_to_pose` and the cost maps: previews from what the server publishes.

The path is searched by the server's own planner, in the obstacles that it publishes. Only the
server's goal checks the rest: its fence, the battery, how it turns.
"""

from __future__ import annotations

import itertools
import math
import time
from collections.abc import Sequence

from geometry_msgs.msg import PoseStamped
from nav2_msgs.action import ComputePathThroughPoses, ComputePathToPose
from nav2_msgs.msg import Costmap, CostmapMetaData
from nav2_msgs.srv import GetCostmap
from rcl_interfaces.srv import GetParameters
from rclpy.action.server import ServerGoalHandle
from rclpy.node import Node
from rclpy.task import Future
from visualization_msgs.msg import MarkerArray

from drone_navigation.nav2.forms import poses_of
from drone_navigation.nav2.maps import costs, obstacles_of, path
from drone_navigation.nav2.navigators import Navigators
from drone_navigation.nav2.outcomes import SUCCEEDED, aborted, result
from drone_navigation.nav2.served import GoalEnd, duration, serve
from drone_navigation.nav2.server_state import ServerState
from drone_navigation.qos import LATCHED_QOS
from drone_navigation.steady_timer import steady_timer
from navigation_bridge.names import SERVER_NODE_NAME
from navigation_core.geometry import Vector3
from navigation_core.planning.planner import NoPath, PlanLimits, plan

# Side and cell of the cost maps, m.
_GLOBAL_M, _LOCAL_M = (100.0, 0.5), (20.0, 0.25)
_NAMES = (
    "vehicle_radius_m",
    "obstacle_margin_m",
    "volume_radius_m",
    "volume_altitude_min_m",
    "volume_altitude_max_m",
)


class Planners:
    """Serves paths and cost maps."""

    def __init__(self, node: Node, vehicle: ServerState, navigators: Navigators) -> None:
        """Offer them on ``node``."""
        self._node = node
        self._vehicle = vehicle
        self._navigators = navigators
        self._markers: MarkerArray | None = None
        self._settings: dict[str, float] = {}
        self._asked: Future | None = None
        self._parameters = node.create_client(GetParameters, f"{SERVER_NODE_NAME}/get_parameters")
        node.create_subscription(
            MarkerArray, f"{SERVER_NODE_NAME}/obstacles", self._take_obstacles, LATCHED_QOS
        )
        steady_timer(node, 1.0, self._ask)
        serve(node, ComputePathToPose, "compute_path_to_pose", self._to_pose)
        serve(node, ComputePathThroughPoses, "compute_path_through_poses", self._through_poses)
        for name, extent in (("global", _GLOBAL_M), ("local", _LOCAL_M)):
            node.create_service(
                GetCostmap,
                f"{name}_costmap/get_costmap",
                lambda _request, response, extent=extent: self._get_costmap(extent, response),
            )

    def _take_obstacles(self, message: MarkerArray) -> None:
        self._markers = message

    def _ask(self) -> None:
        """Ask the server for its settings until it answers, and again each time it starts."""
        ready = self._parameters.service_is_ready()
        if not ready:
            self._settings, self._asked = {}, None
        elif self._asked is None:
            self._asked = self._parameters.call_async(GetParameters.Request(names=list(_NAMES)))
        elif not self._settings and self._asked.done():
            values = self._asked.result().values
            self._settings = {n: v.double_value for n, v in zip(_NAMES, values, strict=False)}

    # --- paths ----------------------------------------------------------------------------

    async def _to_pose(self, handle: ServerGoalHandle) -> GoalEnd:
        request = handle.request
        # Since nav2_msgs 1.5.
        viapoints = getattr(request, "viapoints", ())
        return self._compute(ComputePathToPose, request, [*viapoints, request.goal])

    async def _through_poses(self, handle: ServerGoalHandle) -> GoalEnd:
        goals = poses_of(handle.request.goals)
        if not goals:
            code = ComputePathThroughPoses.Result.NO_VIAPOINTS_GIVEN
            return aborted("INVALID_WAYPOINTS", "There are no poses.", code), None
        return self._compute(ComputePathThroughPoses, handle.request, goals)

    def _compute(
        self,
        kind: type[ComputePathToPose | ComputePathThroughPoses],
        request: ComputePathToPose.Goal | ComputePathThroughPoses.Goal,
        goals: Sequence[PoseStamped],
    ) -> GoalEnd:
        began_s = time.monotonic()
        present = self._navigators.present()
        codes = kind.Result
        if not self._settings:
            return aborted(
                "NO_VEHICLE", "The server has not reported its parameters.", codes.UNKNOWN
            ), None
        stops = [*([request.start] if request.use_start else []), *goals]
        points = [target.position_enu_m for target in self._navigators.targets(stops, present)]
        if not request.use_start:
            points.insert(0, present.position_enu_m)
        if not all(map(math.isfinite, itertools.chain(*points))):
            return aborted("INVALID_NUMBER", "A coordinate is not finite.", codes.UNKNOWN), None
        low_m, high_m = (
            present.ground_m + self._settings[f"volume_altitude_{end}_m"] for end in ("min", "max")
        )
        for number, point in enumerate(points[1:], start=1):
            if math.hypot(*point[:2]) > self._settings["volume_radius_m"]:
                text = f"Pose {number} is outside volume_radius_m."
                return aborted("OUTSIDE_VOLUME", text, codes.GOAL_OUTSIDE_MAP), None
        drives = self._navigators.rule().drives
        limits = PlanLimits(
            clearance_m=self._settings["vehicle_radius_m"] + self._settings["obstacle_margin_m"],
            heights_m=None if drives else (min(low_m, points[0][2]), high_m),
            thorough=False,
        )
        obstacles = obstacles_of(self._markers)
        corners: list[Vector3] = [points[0]]
        for goal in points[1:]:
            found = plan(corners[-1], goal, obstacles, limits)
            if isinstance(found, NoPath):
                return aborted("NO_PATH", found.reason, codes.NO_VALID_PATH), None
            corners += found.points_enu_m[1:]
        message = result(kind.Result, SUCCEEDED)
        message.path = path(corners, self._vehicle.pose().header)
        message.planning_time = duration(time.monotonic() - began_s)
        return SUCCEEDED, message

    # --- cost maps ------------------------------------------------------------------------

    def _get_costmap(
        self, extent: tuple[float, float], response: GetCostmap.Response
    ) -> GetCostmap.Response:
        why = self._vehicle.why_not()
        if why or not self._settings:
            self._node.get_logger().warning(f"An empty cost map: nothing is known yet. {why or ''}")
            return response
        radius_m = self._settings["vehicle_radius_m"]
        radii_m = (radius_m, radius_m + self._settings["obstacle_margin_m"])
        centre = self._vehicle.present().position_enu_m
        found = costs(obstacles_of(self._markers), centre, extent, radii_m)
        header = self._vehicle.pose().header
        metadata = CostmapMetaData(layer="obstacles", resolution=found.cell_m)
        metadata.update_time = header.stamp
        metadata.size_y, metadata.size_x = found.values.shape
        metadata.origin.position.x, metadata.origin.position.y = found.corner_m
        response.map = Costmap(header=header, metadata=metadata, data=found.values.ravel().tolist())
        return response
