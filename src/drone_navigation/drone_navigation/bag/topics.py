"""Bag-backed stand-in for the node that the server's ``publishing.topics.Topics`` needs."""

from __future__ import annotations

from dataclasses import dataclass

from nav_msgs.msg import OccupancyGrid
from rclpy.qos import QoSProfile
from rclpy.time import Time

from drone_navigation.bag.mcap_bag import Bag, Channel
from navigation_bridge.names import SERVER_NODE_NAME
from navigation_bridge.recording.replay import RecordedTime

_LAST_S = 2.0**31
"""Last second of a ROS time stamp."""


class BagError(ValueError):
    """A recording cannot be written as a bag; the text says why."""


@dataclass
class BagTime(RecordedTime):
    """Time of a recording that keeps what the recorder's clock said at its last packets.

    Attributes:
        marks: (seconds of the recording, seconds since 1970) of the last two packets; a player
            looks at a packet while the one before is worked on.
    """

    marks: tuple[tuple[float, float], ...] = ()

    def advance(self, unix_s: float) -> float:
        """Take the stamp (s since 1970) of the next packet; returns the new ``now``.

        A packet whose time ROS can't hold, as after damage, has that of the one before.

        Raises:
            BagError: already the first packet has such a time.
        """
        if unix_s >= _LAST_S:
            if not self.marks:
                raise BagError(
                    "The recorder's clock is past 2038, the end of the ROS time stamp range."
                )
            unix_s = self.marks[-1][1]
        now = super().advance(unix_s)
        self.marks = (*self.marks[-1:], (now, unix_s))
        return now

    def unix_s(self, now: float) -> float:
        """Return what the recorder's clock said at a time of the recording, or before it."""
        mark_s, unix_s = next((mark for mark in self.marks if mark[0] >= now), self.marks[-1])
        return unix_s - (mark_s - now)


class BagClock:
    """The recorder's clock at what is being played: a node's clock.

    Attributes:
        time: of the recording; for :func:`~navigation_bridge.recording.replay.play`.
        unix_ns: nanoseconds since 1970; whole microseconds, as recorded.
    """

    def __init__(self) -> None:
        """Begin before the first packet."""
        self.time = BagTime()
        self.unix_ns = 0

    def move(self, now: float) -> None:
        """Say how many seconds of the recording have passed."""
        self.unix_ns = round(max(self.time.unix_s(now), 0.0) * 1e6) * 1000

    def now(self) -> Time:
        """Return the time as a node's clock does."""
        return Time(nanoseconds=self.unix_ns)


class BagPublisher:
    """A publisher that writes into a bag."""

    def __init__(self, channel: Channel, clock: BagClock, on_demand: bool) -> None:
        """Write to ``channel`` at the clock's time; nobody asks a bag for what is on demand."""
        self._channel = channel
        self._clock = clock
        self._readers = 0 if on_demand else 1

    def publish(self, message: object) -> None:
        """Write a message."""
        self._channel.write(message, self._clock.unix_ns)

    def get_subscription_count(self) -> int:
        """Return 1, the bag; 0 of what is published on demand."""
        return self._readers


class BagNode:
    """The publishing part of a navigation server's node."""

    def __init__(self, bag: Bag, clock: BagClock, namespace: str = "") -> None:
        """Write into ``bag``.

        Args:
            bag: where topics go.
            clock: time of the messages.
            namespace: the vehicle's name; empty for the only one.
        """
        self._bag = bag
        self._clock = clock
        self._namespace = f"/{namespace}".rstrip("/")

    def create_publisher(
        self, message_type: type, topic: str, qos: QoSProfile | int
    ) -> BagPublisher:
        """Return a publisher of a topic, named as for a node."""
        profile = QoSProfile(depth=qos) if isinstance(qos, int) else qos
        name = topic
        if topic.startswith("~"):
            name = self.get_fully_qualified_name() + topic.removeprefix("~")
        elif not topic.startswith("/"):
            name = f"{self._namespace}/{topic}"
        channel = self._bag.channel(message_type, name, profile)
        return BagPublisher(channel, self._clock, on_demand=message_type is OccupancyGrid)

    def get_fully_qualified_name(self) -> str:
        """Return the node's name with its namespace."""
        return f"{self._namespace}/{SERVER_NODE_NAME}"

    def get_clock(self) -> BagClock:
        """Return the recorder's clock."""
        return self._clock
