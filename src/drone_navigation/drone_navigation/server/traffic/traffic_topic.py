"""The topics of traffic: reservations between servers, and others that somebody sees."""

from __future__ import annotations

import random
import threading
from collections.abc import Callable
from datetime import datetime, timezone

from rclpy.node import Node
from rclpy.qos import HistoryPolicy, QoSProfile, ReliabilityPolicy

from custom_interfaces.msg import TrafficReport, TrafficState
from drone_navigation.process_control.ros_differences import publisher_count
from drone_navigation.server.traffic.traffic_messages import (
    TrafficMessageError,
    seen_from,
    state_from,
    state_message,
)
from mavlink_vehicle.io.clock import Clock
from navigation_bridge.bridge import Bridge
from navigation_bridge.configuration.make_config import ServerConfig
from navigation_bridge.fleet import Member
from navigation_bridge.traffic.shared_traffic import SharedTraffic
from navigation_bridge.traffic.vehicle_separation import VehicleSeparation
from navigation_core.tasks.traffic.negotiation import Negotiation

__all__ = ["TRAFFIC_TOPIC", "TrafficTopic"]

TRAFFIC_TOPIC = "/traffic_states"
_PERIOD_S = 0.2
# A state that is late is worth nothing: the next one has all of it.
_QOS = QoSProfile(
    history=HistoryPolicy.KEEP_LAST, depth=20, reliability=ReliabilityPolicy.BEST_EFFORT
)


class TrafficTopic:
    """Sends this server's reservations, and takes those of others.

    All of it happens on the driver's thread, where the reservations are.
    """

    def __init__(self, node: Node, config: ServerConfig, clock: Clock) -> None:
        """Prepare; without separation nothing is shared.

        Args:
            node: the server's.
            config: settings of the server.
            clock: the driver's.
        """
        self._node, self._clock = node, clock
        self._config = config.bridge.traffic
        epoch_s = datetime.now(timezone.utc).timestamp() - clock.now()
        self._shared = SharedTraffic(self._config.separation, epoch_s)
        self._has_listeners = False
        self._closing = threading.Event()
        # Not a timer of the node: its executor would ask about all readers several times for each
        # call.
        self._thread = threading.Thread(target=self._keep_looking, name="traffic", daemon=True)

    def join(self, bridge: Bridge) -> None:
        """Keep one more vehicle apart from the others."""
        if self._config.on:
            bridge.feature(VehicleSeparation).share(self._shared)

    def serve(self, member: Member) -> None:
        """Create the topics; ``member`` takes work for the driver's thread."""
        if not self._config.on:
            return
        node, shared = self._node, self._shared
        self._member = member
        name = node.get_fully_qualified_name()
        peers = [f"/{peer.strip('/')}" for peer in self._config.peers]
        shared.negotiation = Negotiation(
            shared.reservations, name, random.getrandbits(63), peers, self._clock.now()
        )
        self._publisher = node.create_publisher(TrafficState, TRAFFIC_TOPIC, _QOS)
        self._states = node.create_subscription(TrafficState, TRAFFIC_TOPIC, self._take_state, _QOS)
        if self._config.topic:
            node.create_subscription(TrafficReport, self._config.topic, self._take_report, _QOS)
        self._thread.start()

    def close(self) -> None:
        """Report to others that this server ends, and that nothing of it is agreed any more."""
        if self._config.on:
            self._closing.set()
            self._thread.join(_PERIOD_S)
            self._post(lambda: self._send(ends=True))

    def _keep_looking(self) -> None:
        while not self._closing.wait(_PERIOD_S):
            self._look()

    def _look(self) -> None:
        others = publisher_count(self._node, self._states) - 1
        self._has_listeners = self._publisher.get_subscription_count() > 1

        def look() -> None:
            if self._shared.negotiation is not None:
                self._shared.negotiation.find(others)
            self._send()

        self._post(look)

    def _post(self, work: Callable[[], object]) -> None:
        if not self._member.given_up:
            self._member.post(work)

    def _send(self, ends: bool = False) -> None:
        shared, now = self._shared, self._clock.now()
        shared.look(now)
        if shared.earth is None or shared.negotiation is None:
            return
        state = shared.negotiation.state(shared.alone(), now)
        if not self._has_listeners:
            return  # a server that hears itself wakes its executor five times a second
        stamp = self._node.get_clock().now().to_msg()
        self._publisher.publish(state_message(state, shared.earth, stamp, ends))

    def _take_state(self, message: TrafficState) -> None:
        if message.server == self._node.get_fully_qualified_name():
            return

        def take() -> None:
            shared = self._shared
            if shared.earth is None or shared.negotiation is None:
                return
            state = state_from(message, shared.earth)
            shared.negotiation.receive(state, self._clock.now(), message.ends)

        self._guarded(take, f"A state of {message.server}")

    def _take_report(self, message: TrafficReport) -> None:
        self._guarded(
            lambda: self._shared.see(seen_from(message), self._clock.now()), "A traffic report"
        )

    def _guarded(self, take: Callable[[], None], what: str) -> None:
        def work() -> None:
            try:
                take()
            except TrafficMessageError as error:
                self._node.get_logger().warning(
                    f"{what} was ignored: {error}", throttle_duration_sec=5.0
                )

        self._post(work)
