"""State of the vehicle from the topics of its navigation server."""

from __future__ import annotations

import math
import time
from functools import cache
from typing import TypeVar

from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped
from nav_msgs.msg import Odometry, Path
from rclpy.node import Node
from sensor_msgs.msg import NavSatFix

from custom_interfaces.msg import Fence, HomePosition, VehicleStatus
from drone_navigation.nav2.targets import Present, Refusal, TargetError
from drone_navigation.qos import LATCHED_QOS, STREAM_QOS
from mavlink_vehicle.codec import mavlink
from mavlink_vehicle.profiles import profile_for
from mavlink_vehicle.profiles.profile import VehicleKind
from navigation_bridge.goals.point_requests import yaw_enu_rad
from navigation_bridge.names import SERVER_NODE_NAME
from navigation_core.geometry import Vector3

M = TypeVar("M")

# A status comes once a second; the slowest odometry of a server is as slow.
_SILENT_S = 3.0
_NO_POSITION = Refusal("NO_POSITION", "The navigation server has no valid position of the vehicle.")
_FIRMWARES = (mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA, mavlink.MAV_AUTOPILOT_PX4)
# Clients wait for one pose; more often is of no use to them.
_POSE_PERIOD_S = 0.5


@cache
def _kinds() -> dict[str, VehicleKind]:
    """Return kinds of vehicles by their names in VehicleStatus."""
    profiles = (
        profile_for(firmware, kind) for firmware in _FIRMWARES for kind in mavlink.enums["MAV_TYPE"]
    )
    return {profile.name: profile.kind for profile in profiles}


class ServerState:
    """Last messages of the server, and the pose that `amcl` would publish.

    Attributes:
        target_m: map z of the last target that was accepted for this vehicle.
    """

    def __init__(self, node: Node) -> None:
        """Listen."""
        self.target_m: float | None = None
        self._heard_s: dict[type, float] = {}
        self._messages: dict[type, object] = {}
        self._published_s = -math.inf
        self._amcl_pose = node.create_publisher(PoseWithCovarianceStamped, "amcl_pose", LATCHED_QOS)
        for kind, name, qos in (
            (VehicleStatus, "vehicle_status", LATCHED_QOS),
            (Odometry, "odometry", STREAM_QOS),
            (NavSatFix, "fix", STREAM_QOS),
            (HomePosition, "home", LATCHED_QOS),
            (Fence, "flight_volume", LATCHED_QOS),
            (Path, "plan", LATCHED_QOS),
        ):
            node.create_subscription(kind, f"{SERVER_NODE_NAME}/{name}", self._take, qos)

    def _take(self, message: object) -> None:
        kind = type(message)
        self._messages[kind], self._heard_s[kind] = message, time.monotonic()
        if isinstance(message, Odometry):
            self._publish_pose(message)

    def _publish_pose(self, odometry: Odometry) -> None:
        now_s = time.monotonic()
        if now_s < self._published_s + _POSE_PERIOD_S:
            return
        self._published_s = now_s
        self._amcl_pose.publish(
            PoseWithCovarianceStamped(header=odometry.header, pose=odometry.pose)
        )

    def last(self, kind: type[M]) -> M | None:
        """Return the last message of a type, or None."""
        found = self._messages.get(kind)
        return found if isinstance(found, kind) else None

    def _is_fresh(self, kind: type) -> bool:
        return time.monotonic() - self._heard_s.get(kind, -math.inf) < _SILENT_S

    @property
    def heard_s(self) -> float:
        """When the server was last heard, on the monotonic clock."""
        return max(self._heard_s.values(), default=-math.inf)

    def why_not(self) -> Refusal | None:
        """Return why no goal can be sent; None if one can."""
        status = self.last(VehicleStatus)
        if status is None or not self._is_fresh(VehicleStatus):
            text = "No navigation_server was found in this ROS domain and namespace."
            return Refusal("NO_VEHICLE", text)
        if not status.connected:
            text = "The navigation server receives no HEARTBEAT from a vehicle."
            return Refusal("NO_VEHICLE", text)
        if not status.position_valid or not self._is_fresh(Odometry):
            return _NO_POSITION
        return None

    @property
    def kind(self) -> VehicleKind:
        """The kind of vehicle."""
        status = self.last(VehicleStatus)
        return _kinds().get("" if status is None else status.autopilot, VehicleKind.OTHER)

    @property
    def flies_now(self) -> bool:
        """Whether the vehicle reports that it is in the air."""
        status = self.last(VehicleStatus)
        return status is not None and status.landed_state == VehicleStatus.LANDED_IN_AIR

    @property
    def active_goal(self) -> str:
        """Hexadecimal digits of the server's goal; empty if there is none."""
        status = self.last(VehicleStatus)
        return "" if status is None else str(status.active_goal)

    def present(self) -> Present:
        """Return the vehicle as a goal finds it; raises as :meth:`pose` does."""
        pose, home = self.pose().pose, self.last(HomePosition)
        position, q = pose.position, pose.orientation
        ground_m = 0.0 if home is None else home.position.z
        return Present(
            position_enu_m=(position.x, position.y, position.z),
            yaw_enu_rad=yaw_enu_rad((q.x, q.y, q.z, q.w)) or 0.0,
            ground_m=ground_m if math.isfinite(ground_m) else 0.0,
            target_m=self.target_m,
        )

    def plan_enu_m(self) -> list[Vector3]:
        """Return the corners of the path that the server flies; empty if there is none."""
        plan = self.last(Path)
        positions = [] if plan is None else [stamped.pose.position for stamped in plan.poses]
        return [(position.x, position.y, position.z) for position in positions]

    def pose(self) -> PoseStamped:
        """Return the vehicle's pose in the map.

        Raises:
            TargetError: it is not known.
        """
        odometry = self.last(Odometry)
        if odometry is None:
            raise TargetError(*_NO_POSITION)
        return PoseStamped(header=odometry.header, pose=odometry.pose.pose)
