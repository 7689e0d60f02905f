"""A command's node: what it discovers, and waiting that Ctrl-C ends."""

from __future__ import annotations

import argparse
import importlib
import math
import os
import signal
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from types import FrameType
from typing import Literal, Protocol, TypeAlias, overload

import rclpy
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from rclpy.task import Future

from drone_navigation.process_control.ros_start import starting_ros

__all__ = [
    "CommandError", "Interface", "Interrupted", "Message", "MessageClass", "NamesAndTypes",
    "Session", "absolute", "interface", "is_hidden", "list_of", "session",
]  # fmt: skip

_SPIN_S = 0.1
# A graph that has not changed for this time is taken for whole, but not before the second one,
# and an empty one not before the third one.
_SETTLED_S = 0.8
_DISCOVERY_MIN_S = 2.0
_EMPTY_S = 4.0
# Discovery ends here; a name that is missing then does not exist.
_DISCOVERY_MAX_S = 5.0
# While a server is discovered in part, rmw_fastrtps takes it for none.
_GONE_S = 3.0
NamesAndTypes: TypeAlias = list[tuple[str, list[str]]]
"""Names in the graph, each with its types"""

_KINDS = {"msg": "message", "srv": "service", "action": "action"}


class CommandError(Exception):
    """A command cannot be done; the sentence says why."""


class Interrupted(Exception):  # noqa: N818 - a person's wish is no error
    """A person ends the command."""


class Message(Protocol):
    """A message of a generated class."""

    SLOT_TYPES: Sequence[object]

    def get_fields_and_field_types(self) -> dict[str, str]:
        """Return the types of its fields by their names."""


MessageClass: TypeAlias = Callable[..., Message]
"""A generated class of messages"""


class Interface(Protocol):
    """A generated class of a service (it has a Request) or of an action (it has a Goal)."""

    Request: MessageClass
    Goal: MessageClass


class Session:
    """A node, and the signals of a person who ends the command."""

    def __init__(self, node: Node) -> None:
        """Begin with a node that discovers nothing yet."""
        self.node = node
        self._is_interrupted = False

    def interrupt(self, _number: int, _frame: FrameType | None) -> None:
        """End the waiting at its next turn; the second time, end everything."""
        if self._is_interrupted:
            raise KeyboardInterrupt
        self._is_interrupted = True

    def wait(self, condition: Callable[[], bool], timeout_s: float = math.inf) -> bool:
        """Spin until something holds; return whether it does, in time.

        Raises:
            Interrupted: a person has ended the command. The next wait is another one.
        """
        deadline_s = time.monotonic() + timeout_s
        while not condition():
            if self._is_interrupted:
                self._is_interrupted = False
                raise Interrupted
            if time.monotonic() >= deadline_s:
                return False
            rclpy.spin_once(self.node, timeout_sec=_SPIN_S)
        return True

    def wait_for_answer(self, answer: Future, is_ready: Callable[[], bool], ended: str) -> None:
        """Wait for an answer as long as there is a server.

        Raises:
            CommandError: it has ended; the error says what is given as `ended`.
        """
        while not self.wait(answer.done, _GONE_S):
            if not self.wait(lambda: answer.done() or is_ready(), _GONE_S):
                raise CommandError(ended)

    def discover(self, is_found: Callable[[], bool] | None = None) -> None:
        """Wait until something, or anything, is found and nothing more comes, or time is up."""
        begun_s = changed_s = time.monotonic()
        before: object = None

        def is_settled() -> bool:
            nonlocal before, changed_s
            now_s = time.monotonic()
            graph = (
                sorted(self.node.get_node_names_and_namespaces()),
                self.node.get_topic_names_and_types(),
                self.node.get_service_names_and_types(),
            )
            if graph != before:
                before, changed_s = graph, now_s
            if now_s - changed_s < _SETTLED_S:
                return False
            if is_found is not None:
                return is_found()
            is_alone = len(graph[0]) <= 1
            return now_s - begun_s >= (_EMPTY_S if is_alone else _DISCOVERY_MIN_S)

        self.wait(is_settled, _DISCOVERY_MAX_S)


@contextmanager
def session() -> Iterator[Session]:
    """Begin with ROS, and end with it; SIGINT and SIGTERM end what the command waits for."""
    with starting_ros():
        rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.NO)
    try:
        # A name that begins with an underscore is hidden.
        name = f"_ros2cli_{os.getpid()}"
        with starting_ros():
            node = Node(name, start_parameter_services=False, enable_rosout=False)
        try:
            made = Session(node)
            for number in (signal.SIGINT, signal.SIGTERM):
                signal.signal(number, made.interrupt)
            yield made
        finally:
            node.destroy_node()
    finally:
        rclpy.try_shutdown()


def absolute(name: str) -> str:
    """Return a name with the slash that it may lack."""
    return name if name.startswith("/") else f"/{name}"


def list_of(found_by: Callable[[Node], NamesAndTypes]) -> Callable[..., int]:
    """Return the command that prints the names of a kind in order, or their number."""

    def command(session: Session, options: argparse.Namespace) -> int:
        session.discover()
        found = [(name, f"{name} [{', '.join(types)}]") for name, types in found_by(session.node)
                 if getattr(options, "all", True) or not is_hidden(name)]  # fmt: skip
        if options.count:
            print(len(found))
        else:
            print("".join(f"{each[options.show_types]}\n" for each in sorted(found)), end="")
        return 0

    return command


def is_hidden(name: str) -> bool:
    """Return whether a part of a name begins with an underscore."""
    return any(part.startswith("_") for part in name.split("/"))


@overload
def interface(kind: Literal["msg"], name: str) -> MessageClass: ...
@overload
def interface(kind: Literal["srv", "action"], name: str) -> Interface: ...
def interface(kind: str, name: str) -> object:
    """Return the class of an interface.

    Args:
        kind: "msg", "srv" or "action".
        name: for instance "std_srvs/srv/Trigger"; "std_srvs/Trigger" is the same.

    Raises:
        CommandError: there is none, or it is of another kind.
    """
    parts = name.split("/")
    package, type_name = parts[0], parts[-1]
    if parts in ([package, type_name], [package, kind, type_name]):
        try:
            found: object = getattr(importlib.import_module(f"{package}.{kind}"), type_name)
            return found
        except (ImportError, AttributeError, ValueError):
            pass
    raise CommandError(
        f"The passed {_KINDS[kind]} type is invalid: '{name}' (`ros2 interface list` lists all)"
    )
