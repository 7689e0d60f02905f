"""MCAP files read with the readers of the MCAP project, which know nothing of ROS."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from mcap.reader import make_reader
from mcap.records import Channel, Schema
from mcap_ros2.decoder import DecoderFactory


class Decoders(DecoderFactory):
    """Those of `mcap_ros2`, which rejects the names of the messages of actions: "A_B"."""

    def decoder_for(
        self, message_encoding: str, schema: Schema | None
    ) -> Callable[[bytes], Any] | None:
        """Return the decoder of a schema, whatever its name is."""
        if schema is not None:
            schema = replace(schema, name=schema.name.replace("_FeedbackM", "FeedbackM"))
        return super().decoder_for(message_encoding, schema)


@dataclass(frozen=True)
class Topic:
    """A topic of a bag: its channel, its schema, and (time in ns, message) of each message."""

    channel: Channel
    schema: Schema
    messages: list[tuple[int, Any]]

    @property
    def plain(self) -> list[Any]:
        """Return the messages without their stamps."""
        return [plain(message) for _, message in self.messages]


@dataclass(frozen=True)
class ReadBag:
    """All of a bag."""

    profile: str
    topics: dict[str, Topic]
    log_times_ns: list[int]
    """Of all messages, in the order of the file."""


def read_bag(path: Path) -> ReadBag:
    """Read a bag, and decode it by the definitions that it holds."""
    with path.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True, decoder_factories=[Decoders()])
        summary = reader.get_summary()
        assert summary is not None
        topics = {
            channel.topic: Topic(channel, summary.schemas[channel.schema_id], [])
            for channel in summary.channels.values()
        }
        times_ns = []
        for _, channel, message, decoded in reader.iter_decoded_messages(log_time_order=False):
            topics[channel.topic].messages.append((message.log_time, decoded))
            times_ns.append(message.log_time)
        return ReadBag(reader.get_header().profile, topics, times_ns)


def plain(value: Any) -> Any:
    """Return a message of ROS or of a bag's decoder as dictionaries and lists, without stamps.

    NaN becomes None, so that equal messages are equal; bytes become numbers.
    """
    names = getattr(value, "get_fields_and_field_types", None)
    if names is not None or type(value).__module__ == "mcap_ros2._dynamic":
        fields = names() if names is not None else type(value).__slots__
        return {name: plain(getattr(value, name)) for name in fields if name != "stamp"}
    if isinstance(value, bytes) and len(value) == 1:
        return value[0]
    if isinstance(value, (float, np.floating)):
        value = float(value)
        return None if math.isnan(value) else value
    if isinstance(value, str):
        return value
    if isinstance(value, (int, np.integer)):
        return int(value)
    return [plain(item) for item in value]


def missing_in_order(found: list[Any], wanted: list[Any]) -> Any:
    """Return the first of ``wanted`` that does not follow the others in ``found``, or None."""
    rest = iter(found)
    return next((item for item in wanted if item not in rest), None)
