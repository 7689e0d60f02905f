"""``ros2 node``: list and info."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable

from rclpy.action.graph import (
    get_action_client_names_and_types_by_node,
    get_action_server_names_and_types_by_node,
)
from rclpy.node import Node

from drone_navigation.ros2.session import (
    CommandError,
    NamesAndTypes,
    Session,
    absolute,
    is_hidden,
)

__all__ = ["all_nodes", "found_nodes", "info", "list_nodes", "nodes_that_have"]

_ByNode = Callable[[Node, str, str], NamesAndTypes]


def all_nodes(node: Node, include_hidden: bool = False) -> list[tuple[str, str, str]]:
    """Return full name, name and namespace of each node, in order of the full names."""
    found = [
        (f"{space.rstrip('/')}/{name}", name, space)
        for name, space in node.get_node_names_and_namespaces()
    ]
    return sorted(each for each in found if include_hidden or not is_hidden(each[0]))


def found_nodes(session: Session, name: str) -> list[tuple[str, str, str]]:
    """Return the nodes of a full name, none if they are not discovered; as `all_nodes`."""

    def found() -> list[tuple[str, str, str]]:
        nodes = all_nodes(session.node, include_hidden=True)
        return [each for each in nodes if each[0] == absolute(name)]

    session.discover(lambda: bool(found()))
    return found()


def nodes_that_have(node: Node, wanted: str, by_node: _ByNode) -> NamesAndTypes:
    """Return the nodes that have a name of a kind, and the types that they give it."""
    found = []
    for full_name, name, space in all_nodes(node, include_hidden=True):
        types = dict(_of(node, by_node, name, space)).get(wanted)
        if types:
            found.append((full_name, types))
    return found


def _of(node: Node, by_node: _ByNode, name: str, space: str) -> NamesAndTypes:
    try:
        return sorted(by_node(node, name, space))
    except RuntimeError:  # it has ended meanwhile
        return []


def list_nodes(session: Session, options: argparse.Namespace) -> int:
    """Print the names of all nodes."""
    session.discover()
    names = [full_name for full_name, _, _ in all_nodes(session.node, options.all)]
    if len(set(names)) < len(names):
        print("WARNING: Be aware that there are nodes in the graph that share an exact name, "
              "which can have unintended side effects.", file=sys.stderr)  # fmt: skip
    print(len(names) if options.count else "\n".join(names))
    return 0


def info(session: Session, options: argparse.Namespace) -> int:
    """Print all that a node publishes, subscribes and serves."""
    found = found_nodes(session, options.node)
    if not found:
        raise CommandError(f"Unable to find node '{options.node}'")
    (wanted, name, space), *others = found
    if others:
        print(f"There are {len(others) + 1} nodes in the graph with the exact name '{wanted}'. You "
              "are seeing information about only one of them.", file=sys.stderr)  # fmt: skip
    print(wanted)
    kinds: tuple[tuple[str, _ByNode], ...] = (
        ("Subscribers", Node.get_subscriber_names_and_types_by_node),
        ("Publishers", Node.get_publisher_names_and_types_by_node),
        ("Service Servers", Node.get_service_names_and_types_by_node),
        ("Service Clients", Node.get_client_names_and_types_by_node),
        ("Action Servers", get_action_server_names_and_types_by_node),
        ("Action Clients", get_action_client_names_and_types_by_node),
    )
    for title, by_node in kinds:
        print(f"  {title}:")
        has = [(n, t) for n, t in _of(session.node, by_node, name, space)
               if options.all or not is_hidden(n)]  # fmt: skip
        print("\n".join(f"    {each}: {', '.join(types)}" for each, types in has))
    return 0
