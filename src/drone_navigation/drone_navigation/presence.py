"""Detection of another server with the same actions in the ROS domain.

An action has one server. With two, rcl gives a client's goal to both, and both fly. So a server
that finds another one of its name takes no goals, and one that has just started ends.
"""

from __future__ import annotations

import threading
import time
import uuid

from rclpy.action import get_action_server_names_and_types_by_node
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node, NodeNameNonExistentError
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy

from custom_interfaces.msg import VehicleStatus
from navigation_bridge.names import ACTION_NAME, SERVER_NODE_NAME
from navigation_core.outcomes import OutcomeCode, Rejection

__all__ = ["SERVER_ID", "Presence"]

SERVER_ID = f"{time.time_ns():020d}-{uuid.uuid4().hex}"
"""Distinguishes this process's statuses from those of others; the smaller id came first."""

# Statuses come once a second. A server that was killed stays in the graph for 20 s (the lease of
# its DDS participant), but says nothing any more.
_SILENT_S = 2.5
# Transient local: the last status of another server comes as soon as it is found.
_STATUS_QOS = QoSProfile(
    history=HistoryPolicy.KEEP_LAST,
    depth=10,
    reliability=ReliabilityPolicy.RELIABLE,
    durability=DurabilityPolicy.TRANSIENT_LOCAL,
)


class Presence:
    """Monitors the servers of one name.

    Its methods ask the graph and may take milliseconds: not for the thread that flies.

    Attributes:
        other_server: whether goals were rejected because of another server at the last `look`.
    """

    def __init__(self, node: Node, own_id: str = "") -> None:
        """Listen; a server begins when it finds another one.

        A server would hear itself first of all, and each message wakes its executor, which asks
        about all its readers: a fifth of the processor time of 20 vehicles in flight.

        Args:
            node: a server's, or a client's.
            own_id: of the server that asks; empty for a client.
        """
        self._node = node
        self.own_id = own_id
        self._heard_s: dict[str, float] = {}
        self._contested: set[str] = set()
        self._others_since_s: float | None = None
        self._reported = False
        self.other_server = False
        self._begins = threading.Lock()
        self._listens = False
        if not own_id:
            self._listen()

    def _listen(self) -> None:
        with self._begins:
            if self._listens:
                return
            self._listens = True
            topic = "~/vehicle_status" if self.own_id else f"{SERVER_NODE_NAME}/vehicle_status"
            self._node.create_subscription(VehicleStatus, topic, self._take, _STATUS_QOS)

    def _take(self, status: VehicleStatus) -> None:
        server_id = status.server_id
        if server_id and server_id != self.own_id:
            self._heard_s[server_id] = time.monotonic()
            (self._contested.add if status.other_server else self._contested.discard)(server_id)

    @property
    def alive(self) -> int:
        """Number of other servers that reported recently."""
        return len(self._alive())

    @property
    def is_second(self) -> bool:
        """True if another active server started before this one."""
        return any(other < self.own_id for other in self._alive())

    def _alive(self) -> list[str]:
        since_s = time.monotonic() - _SILENT_S
        return [other for other, heard_s in list(self._heard_s.items()) if heard_s >= since_s]

    @property
    def offered(self) -> int:
        """Number of servers in the graph, including recently killed ones."""
        return int(self._node.count_services(f"{ACTION_NAME}/_action/send_goal"))

    def rejection(self) -> Rejection | None:
        """Return why a server rejects goals now, or None."""
        if self.offered <= 1:
            self._others_since_s = None
            self._tell(False)
            return None
        self._listen()
        now_s = time.monotonic()
        if self._others_since_s is None:
            self._others_since_s = now_s
        # One that was found just now has had no time to say that it is alive.
        settled = now_s - self._others_since_s > _SILENT_S
        others = self._programs() - {(self._node.get_name(), self._node.get_namespace())}
        if self.alive or others:
            self._tell(True)
        elif settled:
            self._tell(False)
            return None
        return Rejection(OutcomeCode.DUPLICATE_SERVER, duplicate(self._node))

    def look(self) -> None:
        """Look for other servers; call periodically."""
        self.other_server = self.rejection() is not None

    def _tell(self, other: bool) -> None:
        if other == self._reported:
            return
        self._reported = other
        if other:
            self._node.get_logger().warning(f"No goals are accepted. {duplicate(self._node)}")
        else:
            self._node.get_logger().info("The other server is gone; goals are accepted again.")

    @property
    def several(self) -> bool:
        """For a client: whether more than one server would take its goal.

        A server has been here for longer, and may know of one that is not found here yet.
        """
        alive = self._alive()
        if len(alive) > 1 or not self._contested.isdisjoint(alive):
            return True
        return self.offered > 1 and len(self._programs()) > 1

    def _programs(self) -> set[tuple[str, str]]:
        """Return names and namespaces of all nodes that offer the action."""
        node = self._node
        action = node.resolve_service_name(ACTION_NAME)
        found = set()
        for name, namespace in node.get_node_names_and_namespaces():
            try:
                offered = get_action_server_names_and_types_by_node(node, name, namespace)
            except (NodeNameNonExistentError, rclpy_implementation.RCLError):
                continue  # it went away meanwhile
            if any(other == action for other, _ in offered):
                found.add((name, namespace))
        return found


def duplicate(node: Node) -> str:
    """Return the advice for two servers of one name."""
    name = node.resolve_service_name(ACTION_NAME)
    return (
        f"Another server offers {name} in this ROS domain, and both would execute goals; stop one "
        "of them, give one a namespace (--ros-args -r __ns:=/name), or set another ROS_DOMAIN_ID."
    )
