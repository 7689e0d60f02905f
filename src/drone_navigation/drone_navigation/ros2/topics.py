"""``ros2 topic``: info, echo, hz and pub."""

from __future__ import annotations

import argparse
import time
from collections import deque

import numpy as np
from rclpy.qos import (
    DurabilityPolicy,
    QoSProfile,
    ReliabilityPolicy,
    qos_profile_sensor_data,
)

from drone_navigation.ros2.session import (
    CommandError,
    Message,
    MessageClass,
    Session,
    absolute,
    interface,
)
from drone_navigation.ros2.values import SHOWN_MAX, as_yaml, filled, read_yaml

__all__ = ["echo", "hz", "info", "pub"]

_DEPTH = 100
_PRINTED_S = 1.0
_WINDOW = 10_000
# The last message gets this time to reach the wire before the node ends.
_KEEP_ALIVE_S = 0.1


def _types(session: Session, name: str) -> list[str]:
    """Return the types of a topic, none if it is unknown."""

    def known() -> list[str]:
        types: list[str] = dict(session.node.get_topic_names_and_types()).get(absolute(name), [])
        return types

    session.discover(lambda: bool(known()))
    return known()


def _class_of(session: Session, options: argparse.Namespace) -> MessageClass:
    if getattr(options, "type", None):
        session.discover()
        return interface("msg", options.type)
    types = _types(session, options.name)
    if not types:
        raise CommandError(
            f"WARNING: topic [{options.name}] does not appear to be published yet\n"
            "Could not determine the type for the passed topic"
        )
    if len(types) > 1:
        raise CommandError(f"Topic [{options.name}] has more than one type: {', '.join(types)}")
    return interface("msg", types[0])


def info(session: Session, options: argparse.Namespace) -> int:
    """Print the type of a topic and who publishes and subscribes it."""
    types = _types(session, options.name)
    if not types:
        raise CommandError(f"Unknown topic '{options.name}'")
    node, name = session.node, absolute(options.name)
    end = "\n\n" if options.verbose else "\n"
    print(f"Type: {types[0] if len(types) == 1 else types}", end=end)
    for title, ends in (
        ("Publisher", node.get_publishers_info_by_topic(name)),
        ("Subscription", node.get_subscriptions_info_by_topic(name)),
    ):
        print(f"{title} count: {len(ends)}", end=end)
        for each in ends if options.verbose else ():
            print(each, end=end)
    return 0


def _qos(session: Session, name: str) -> QoSProfile:
    """Return what all publishers of a topic can give."""
    offered = [end.qos_profile for end in session.node.get_publishers_info_by_topic(absolute(name))]
    is_reliable = {each.reliability for each in offered} == {ReliabilityPolicy.RELIABLE}
    is_latched = {each.durability for each in offered} == {DurabilityPolicy.TRANSIENT_LOCAL}
    return QoSProfile(
        depth=_DEPTH,
        reliability=ReliabilityPolicy.RELIABLE if is_reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if is_latched else DurabilityPolicy.VOLATILE,
    )


def echo(session: Session, options: argparse.Namespace) -> int:
    """Print the messages of a topic until it is ended, or the first one."""
    kind = _class_of(session, options)
    shown_max = None if options.full_length else SHOWN_MAX
    fields = options.field.split(".") if options.field else []
    heard: deque[object] = deque()

    def on_message(message: object) -> None:
        heard.append(message)

    session.node.create_subscription(kind, options.name, on_message, _qos(session, options.name))
    while True:
        session.wait(lambda: bool(heard))
        part = heard.popleft()
        for field in fields:
            if not hasattr(part, field):
                raise CommandError(f"Invalid field '{options.field}': there is no '{field}'")
            part = getattr(part, field)
        print(as_yaml(part, shown_max), end="---\n", flush=True)
        if options.once:
            return 0


def hz(session: Session, options: argparse.Namespace) -> int:
    """Print the rate of a topic once a second until it is ended."""
    kind = _class_of(session, options)
    gaps_s: deque[float] = deque(maxlen=options.window)
    last_s: list[float] = []

    def on_message(_: object) -> None:
        now_s = time.monotonic()
        gaps_s.extend(now_s - before_s for before_s in last_s)
        last_s[:] = [now_s]

    session.node.create_subscription(kind, options.name, on_message, qos_profile_sensor_data)
    printed_s: list[float] = []
    while True:
        session.wait(lambda: False, _PRINTED_S)
        if gaps_s and printed_s != last_s:
            printed_s = list(last_s)
            gaps = np.array(gaps_s)
            print(
                f"average rate: {1.0 / gaps.mean():.3f}\n\tmin: {gaps.min():.3f}s max: "
                f"{gaps.max():.3f}s std dev: {gaps.std():.5f}s window: {len(gaps)}",
                flush=True,
            )


def pub(session: Session, options: argparse.Namespace) -> int:
    """Publish a message again and again until it is ended, or a number of times."""
    kind = interface("msg", options.type)
    values = read_yaml(options.values)
    times = 1 if options.once else options.times
    node = session.node

    def message() -> Message:
        return filled(kind, values, node.get_clock().now().to_msg())

    message()
    publisher = node.create_publisher(kind, options.name, QoSProfile(depth=10))
    while times and not publisher.get_subscription_count():
        print("Waiting for at least 1 matching subscription(s)...", flush=True)
        session.wait(lambda: publisher.get_subscription_count() > 0, _PRINTED_S)
    print("publisher: beginning loop")
    count = 0
    while True:
        count += 1
        made = message()
        print(f"publishing #{count}: {made!r}\n", flush=True)
        publisher.publish(made)
        if count == times:
            session.wait(lambda: False, _KEEP_ALIVE_S)
            return 0
        session.wait(lambda: False, 1.0 / options.rate)
