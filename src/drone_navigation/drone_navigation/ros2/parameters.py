"""``ros2 param``: list, get, set and describe."""

from __future__ import annotations

import argparse
import sys

from rcl_interfaces.msg import Parameter, ParameterType
from rclpy.parameter import get_parameter_value, parameter_value_to_python
from rclpy.parameter_client import AsyncParameterClient
from rclpy.task import Future

from drone_navigation.ros2.nodes import all_nodes, found_nodes
from drone_navigation.ros2.session import CommandError, Session, absolute

__all__ = ["describe", "get", "list_parameters", "set_parameter"]

_ANSWER_S = 5.0
# The types by their numbers in ParameterType.
_TYPES = ["not set", "boolean", "integer", "double", "string"]
_TYPES += [f"{each} array" for each in ("byte", "boolean", "integer", "double", "string")]


def _found(session: Session, name: str) -> str:
    """Return the full name of a node that is there."""
    if not found_nodes(session, name):
        raise CommandError(f"Node not found: '{name}' (`ros2 node list` lists all)")
    return absolute(name)


def _asked(session: Session, name: str, request: str, *arguments: object) -> Future:
    """Return the answer of a node to a request of the client of parameters; it is done."""
    client = AsyncParameterClient(session.node, name)
    if not session.wait(client.services_are_ready, _ANSWER_S):
        raise CommandError(
            f"Wait for service timed out waiting for parameter services for node {name}"
        )
    answer = getattr(client, request)(*arguments)
    if not session.wait(answer.done, _ANSWER_S):
        raise CommandError(f"Node {name} did not answer in {_ANSWER_S:g} s.")
    return answer


def list_parameters(session: Session, options: argparse.Namespace) -> int:
    """Print the names of the parameters of a node, or of all nodes."""
    if options.node:
        names = [_found(session, options.node)]
    else:
        session.discover()
        names = [full for full, _, _ in all_nodes(session.node)]
    for name in names:
        try:
            found = sorted(_asked(session, name, "list_parameters", []).result().result.names)
        except CommandError as error:
            if options.node:
                raise
            print(error)
            continue
        if found and not options.node:
            print(f"{name}:")
        print("".join(f"  {each}\n" for each in found), end="")
    return 0


def get(session: Session, options: argparse.Namespace) -> int:
    """Print the value of a parameter."""
    name = _found(session, options.node)
    values = _asked(session, name, "get_parameters", [options.parameter]).result().values
    if not values or values[0].type == ParameterType.PARAMETER_NOT_SET:
        raise CommandError("Parameter not set")
    value = parameter_value_to_python(values[0])
    shown = value if isinstance(value, (bool, int, float, str)) else list(value)
    what, array, _ = _TYPES[values[0].type].capitalize().partition(" array")
    is_or_are = "values are" if array else "value is"
    print(shown if options.hide_type else f"{what} {is_or_are}: {shown}")
    return 0


def set_parameter(session: Session, options: argparse.Namespace) -> int:
    """Set a parameter; return 1 if the node rejects it."""
    name = _found(session, options.node)
    parameter = Parameter(name=options.parameter, value=get_parameter_value(options.value))
    (result,) = _asked(session, name, "set_parameters", [parameter]).result().results
    reason = f": {result.reason}" if result.reason else ""
    if result.successful:
        print(f"Set parameter successful{reason}")
        return 0
    print(f"Setting parameter failed{reason}", file=sys.stderr)
    return 1


def describe(session: Session, options: argparse.Namespace) -> int:
    """Print types, descriptions and limits of parameters."""
    name = _found(session, options.node)
    answer = _asked(session, name, "describe_parameters", options.parameters)
    for found in answer.result().descriptors:
        print(f"Parameter name: {found.name}\n  Type: {_TYPES[found.type]}")
        if found.description:
            print(f"  Description: {found.description}")
        print("  Constraints:")
        if found.read_only:
            print("    Read only: true")
        for limits in (*found.floating_point_range, *found.integer_range):
            print(f"    Min value: {limits.from_value}\n    Max value: {limits.to_value}")
            if limits.step:
                print(f"    Step: {limits.step}")
        if found.additional_constraints:
            print(f"    Additional constraints: {found.additional_constraints}")
    return 0
