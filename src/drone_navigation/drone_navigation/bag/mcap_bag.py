"""MCAP writer for ROS messages in the layout of rosbag2: profile ``ros2``, CDR, ``ros2msg``."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

from rclpy.qos import QoSProfile
from rclpy.serialization import serialize_message

from drone_navigation.bag.message_definitions import ENCODING, definition, type_name
from flight_logs.extras import extra
from flight_logs.whole_file import whole_file

if TYPE_CHECKING:
    from mcap.writer import Writer

_PROFILE = "ros2"
_LIBRARY = "drone_navigation tlog2mcap"
# The deadline, lifespan or lease of an endpoint that was given none.
_INFINITE = {"sec": 9223372036, "nsec": 854775807}
_LIVELINESS_AUTOMATIC = 1


class Channel:
    """A topic of a bag.

    Attributes:
        topic: its full name.
        count: messages that were written.
    """

    def __init__(self, writer: Writer, topic: str, number: int) -> None:
        """Belong to a writer that knows this channel by ``number``."""
        self.topic = topic
        self.count = 0
        self._writer = writer
        self._number = number

    def write(self, message: object, unix_ns: int) -> None:
        """Add a message of the topic's type, at a time since 1970 in nanoseconds."""
        self.count += 1
        self._writer.add_message(
            channel_id=self._number,
            log_time=unix_ns,
            publish_time=unix_ns,
            sequence=self.count,
            data=serialize_message(message),
        )


class Bag:
    """Writes a bag into a stream that is open; :meth:`finish` comes last."""

    def __init__(self, stream: IO[bytes]) -> None:
        """Begin.

        Raises:
            MissingPackageError: the package that writes MCAP is not installed.
        """
        with extra("mcap", "A bag"):
            from mcap.writer import Writer  # noqa: PLC0415 an extra
        self._writer: Any = Writer(stream)  # has a method without types
        self._writer.start(profile=_PROFILE, library=_LIBRARY)
        self._schemas: dict[str, int] = {}
        self._channels: dict[str, Channel] = {}

    @property
    def counts(self) -> Counter[str]:
        """Number of messages of each topic."""
        return Counter({channel.topic: channel.count for channel in self._channels.values()})

    def channel(self, message_type: type, topic: str, qos: QoSProfile) -> Channel:
        """Return the channel of a topic, made at the first call.

        Raises:
            DefinitionError: the definition of the type is not installed.
        """
        if topic not in self._channels:
            number = self._writer.register_channel(
                topic=topic,
                message_encoding="cdr",
                schema_id=self._schema(message_type),
                metadata={"offered_qos_profiles": qos_text(qos)},
            )
            self._channels[topic] = Channel(self._writer, topic, number)
        return self._channels[topic]

    def finish(self) -> None:
        """Write the index."""
        self._writer.finish()

    def _schema(self, message_type: type) -> int:
        name = type_name(message_type)
        if name not in self._schemas:
            text = definition(message_type).encode()
            self._schemas[name] = self._writer.register_schema(name, ENCODING, text)
        return self._schemas[name]


def qos_text(qos: QoSProfile) -> str:
    """Return a publisher's QoS as rosbag2 notes it: YAML with the numbers of ``rmw``.

    rosbag2 has written words in place of the numbers since Jazzy; all its versions read these.
    """
    forever = "\n".join(f"    {unit}: {value}" for unit, value in _INFINITE.items())
    return (
        f"- history: {qos.history.value}\n"
        f"  depth: {qos.depth}\n"
        f"  reliability: {qos.reliability.value}\n"
        f"  durability: {qos.durability.value}\n"
        f"  deadline:\n{forever}\n"
        f"  lifespan:\n{forever}\n"
        f"  liveliness: {_LIVELINESS_AUTOMATIC}\n"
        f"  liveliness_lease_duration:\n{forever}\n"
        "  avoid_ros_namespace_conventions: false"
    )


@contextmanager
def open_bag(path: Path) -> Iterator[Bag]:
    """Yield a bag to write into; its folder is made, the file is complete or does not exist.

    Raises:
        OSError: it can't be written.
        MissingPackageError: the package that writes MCAP is not installed.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    with whole_file(path) as draft, draft.open("wb") as stream:
        bag = Bag(stream)
        yield bag
        bag.finish()
