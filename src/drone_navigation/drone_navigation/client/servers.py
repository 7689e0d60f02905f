"""Error messages for a client that finds no server."""

from __future__ import annotations

import difflib

from rclpy.action import get_action_names_and_types
from rclpy.node import Node

from navigation_bridge.names import ACTION_NAME

__all__ = ["no_server"]


def no_server(node: Node, wanted: str) -> str:
    """Return the missing server and the available alternatives.

    Args:
        node: the client's, in the namespace of the vehicle that was asked for.
        wanted: action or service, relative to it.
    """
    name = node.resolve_service_name(wanted).strip("/")
    asked = node.get_namespace().strip("/")
    vehicles = sorted(
        action.removesuffix(f"/{ACTION_NAME}").strip("/")
        for action, _ in get_action_names_and_types(node)
        if action == f"/{ACTION_NAME}" or action.endswith(f"/{ACTION_NAME}")
    )
    named = [vehicle for vehicle in vehicles if vehicle and vehicle != asked]
    if named:
        near = difflib.get_close_matches(asked, named, 1) if asked else []
        choice = f"did you mean --vehicle {near[0]}? " if near else "choose with --vehicle NAME. "
        return f"No server offers {name}; {choice}Vehicles here: {', '.join(named)}."
    if asked and "" in vehicles:
        return (
            f"No server offers {name}; the server here has one vehicle without a name: "
            "omit --vehicle."
        )
    return f"No server offers {name}; start navigation_server in the same ROS domain."
