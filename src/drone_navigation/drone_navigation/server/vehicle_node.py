"""One vehicle of a server: its ROS node and the bridge behind it."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from rclpy.node import Node

from drone_navigation.presence import SERVER_ID, Presence
from drone_navigation.server.actions import GoalServers
from drone_navigation.server.bridge_access import BridgeAccess
from drone_navigation.server.features import FEATURE_SERVERS, SharedFeature
from drone_navigation.server.frame_names import FrameNames
from drone_navigation.server.parameters import follow_changes
from drone_navigation.server.publishing.topics import StationLinks, Topics
from drone_navigation.server.service_servers import ServiceServers
from drone_navigation.server.spinning import Spinner
from drone_navigation.server.vehicle_outputs import VehicleOutputs
from drone_navigation.server.waiting import STOPPED
from mavlink_vehicle.io.clock import Clock
from mavlink_vehicle.io.endpoints import LinkStatistics
from mavlink_vehicle.io.tlog import TlogWriter
from mavlink_vehicle.vehicle import Vehicle
from navigation_bridge.bridge import Bridge
from navigation_bridge.clients.client_goals import STOPPED as SERVER_STOPPED
from navigation_bridge.configuration.make_config import ServerConfig
from navigation_bridge.configuration.parameter_table import ParameterValue
from navigation_bridge.fleet import Member
from navigation_bridge.vehicle.left_behind import what_is_left
from navigation_core.outcomes import OutcomeCode
from navigation_core.safety.target_checks import Rejection
from navigation_core.searches import AT_ONCE, Searcher

STOPPING = Rejection(OutcomeCode.SHUTTING_DOWN, STOPPED)
INACTIVE = Rejection(
    OutcomeCode.INACTIVE, "The navigation server is inactive: activate it (~/change_state)."
)
DEACTIVATED = Rejection(OutcomeCode.INACTIVE, "The navigation server was deactivated.")


class VehicleNode:
    """One vehicle's node.

    Its executor is its own, so that a client that keeps one vehicle's callbacks busy does not
    keep the others waiting.

    Attributes:
        node: the ROS node, named ``navigation_server`` in the vehicle's namespace.
        config: the settings at the start.
        member: what a fleet runs; takes work for the bridge.
        outputs: publishes what the bridge puts out.
        presence: knows of other servers of the vehicle's name; there from :meth:`serve` on.
        ready_logged: whether it was said that the vehicle's link is open.
    """

    presence: Presence

    def __init__(
        self,
        node: Node,
        values: dict[str, ParameterValue],
        config: ServerConfig,
        recorder: TlogWriter | None,
        clock: Clock,
        spinner: Spinner,
        searcher: Searcher = AT_ONCE,
        shared: Sequence[SharedFeature] = (),
    ) -> None:
        """Make the vehicle's part on the driver's thread; :meth:`serve` makes the rest.

        Args:
            node: the vehicle's, on which its parameters are declared.
            values: the parameters' values, which are kept up to date.
            config: the settings that they make.
            recorder: of all traffic of the server.
            clock: the driver's.
            spinner: of the node.
            searcher: who searches for paths.
            shared: features that it shares with the other vehicles of the server.
        """
        self.node = node
        self.config = config
        self._values = values
        self._clock = clock
        name = node.get_namespace().strip("/") or node.get_name()
        vehicle = Vehicle(config.vehicle)
        self._bridge = Bridge(vehicle, config.bridge, searcher, name=name)
        for feature in shared:
            feature.join(self._bridge)
        self.outputs = VehicleOutputs(self._bridge, recorder)
        self.member = Member(name, config.vehicle.target_system, self._bridge)
        self._spinner = spinner
        self._active = False
        self._refusal: Rejection | None = None
        self._bridge.refuse(INACTIVE)
        self._server: GoalServers | None = None
        self._why = SERVER_STOPPED
        self._closed = False
        self._servers: list[object] = []
        self.ready_logged = False

    def serve(
        self, statistics: Callable[[], LinkStatistics], stations: StationLinks | None = None
    ) -> None:
        """Offer actions, services and topics; the fleet has its driver by now.

        Args:
            statistics: returns what was met on the vehicle's link.
            stations: returns URL and counts of the links to ground stations, if this node is
                the one that reports them.
        """
        node, bridge, member, clock = self.node, self._bridge, self.member, self._clock
        frames, config = FrameNames.of(node.get_namespace()), self.config
        self.presence = Presence(node, SERVER_ID)
        which_tf = config.publish_tf
        topics = Topics(node, bridge, statistics, frames, stations, self.presence, which_tf, clock)
        access = BridgeAccess(
            node, bridge, member, clock, config, topics, frames, lambda: self._closed
        )
        server = self._server = GoalServers(access, self.presence)
        follow_changes(
            node,
            self._values,
            lambda changed: member.post(lambda: bridge.configure(changed.bridge)),
        )
        self.outputs.attach(node, server, ServiceServers(access), topics)
        self._servers = [make(access) for make in FEATURE_SERVERS]

    def start(self, is_open: bool) -> None:
        """Log whether the vehicle can be reached.

        Args:
            is_open: whether bytes can pass the vehicle's link by now.
        """
        if is_open:
            self.log_ready()
        else:
            self.node.get_logger().warning(
                f"Navigation server waiting for link {self.config.link_url}"
            )

    def activate(self) -> None:
        """Accept goals and services from now on, unless they are rejected for good."""
        self._active = True
        self.member.post(lambda: self._bridge.refuse(self._refusal))
        if self.ready_logged:
            self.log_ready()

    def deactivate(self) -> None:
        """Reject what is requested from now on, stop the vehicle and end its goal."""
        self._active = False
        self._end_goal(INACTIVE, DEACTIVATED)

    def log_ready(self) -> None:
        """Log that the vehicle's link is open."""
        self.ready_logged = True
        if not self._active:
            self.node.get_logger().info(
                f"Navigation server listens on {self.config.link_url}; it is inactive and accepts "
                "no goals"
            )
            return
        goto = self.config.bridge.goto
        arming = "never arms"
        if goto.may_leave_ground:
            arming = "may arm and take off" if goto.may_arm else "may take off once armed"
        self.node.get_logger().info(f"Navigation server ready on {self.config.link_url}; {arming}")

    def log_what_is_left(self, is_recorded: bool) -> None:
        """Log the final state of the vehicle, or of a recorded one, at the server's end."""
        left = what_is_left(self._bridge.vehicle, is_recorded)
        logger = self.node.get_logger()
        if left.needs_attention:
            logger.warning(left.sentence)
        else:
            logger.info(left.sentence)

    def refuse(self, refusal: Rejection) -> None:
        """Reject all goals and services, also while the server is active."""
        self._refusal = refusal

    def shut_down(self) -> None:
        """Reject what is requested from now on, stop the vehicle and end its goal."""
        self._end_goal(STOPPING, SERVER_STOPPED)

    def _end_goal(self, refusal: Rejection, why: Rejection) -> None:
        self._why = why
        self.member.post(lambda: self._bridge.refuse(refusal))
        self.member.post(lambda: self._bridge.goals.shut_down(self._clock.now(), why))

    def release(self) -> None:
        """End a goal whose vehicle has not come to rest yet, and command a hold."""
        self.member.post(lambda: self._bridge.goals.release(self._clock.now(), self._why))

    def close(self) -> None:
        """Answer every request that still waits."""
        self._closed = True

    def is_idle(self) -> bool:
        """True if no goal is open, no list half written, or none can still end in order."""
        bridge = self._bridge
        works = bridge.is_writing or bridge.is_parking or bridge.goals.active is not None
        if works and not self.member.given_up:
            return False
        return self._server is None or self._server.is_idle()

    @property
    def is_at_rest(self) -> bool:
        """Whether the vehicle is disarmed, or unknown, and has no goal."""
        return not self._bridge.vehicle.live.known.armed and self.is_idle()

    @property
    def has_to_avoid(self) -> bool:
        """Whether obstacles, a fence or a sensor are known, so that paths may be needed."""
        bridge = self._bridge
        known, fence = bridge.config.obstacles.known, bridge.vehicle.stored_lists.fence
        return bool(known.items or fence or bridge.obstacles.has_sensor)

    def abandon(self) -> None:
        """End the goals still open."""
        if self._server is not None:
            self._server.abandon(OutcomeCode.INTERNAL_ERROR, "The server ended before the goal.")

    @property
    def is_busy(self) -> bool:
        """Whether requests of clients are being processed."""
        return self._spinner.is_busy
