"""The interface of a node that publishes: of ROS, or of a bag."""

from __future__ import annotations

from typing import Protocol

from rclpy.qos import QoSProfile
from rclpy.time import Time

__all__ = ["Advertiser", "PublishingNode", "StampClock", "TopicPublisher"]


class TopicPublisher(Protocol):
    """Publishes messages of one topic."""

    def publish(self, message: object) -> None:
        """Publish a message of the topic's type."""

    def get_subscription_count(self) -> int:
        """Return how many get it."""


class StampClock(Protocol):
    """The clock of the stamps."""

    def now(self) -> Time:
        """Return its time."""


class Advertiser(Protocol):
    """Offers topics."""

    def create_publisher(
        self, message_type: type, topic: str, qos: QoSProfile | int
    ) -> TopicPublisher:
        """Return a publisher."""


class PublishingNode(Advertiser, Protocol):
    """Offers topics of a vehicle, with stamps."""

    def get_fully_qualified_name(self) -> str:
        """Return the node's name with its namespace."""

    def get_clock(self) -> StampClock:
        """Return the clock of the stamps."""
