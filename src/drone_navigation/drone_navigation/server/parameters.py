"""The server's parameters as ROS parameters: declared with descriptors, unknown ones rejected."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    ParameterType,
    SetParametersResult,
)
from rclpy.exceptions import InvalidParameterTypeException, InvalidParameterValueException
from rclpy.node import Node
from rclpy.parameter import Parameter

from navigation_bridge.configuration.fleet_config import check_server_wide
from navigation_bridge.configuration.make_config import (
    ConfigurationError,
    ServerConfig,
    make_config,
)
from navigation_bridge.configuration.parameter_table import (
    PARAMETERS,
    SERVER_WIDE,
    SPECS,
    ParameterSpec,
    ParameterValue,
    check_value,
    unknown_parameter,
)
from navigation_bridge.configuration.parameter_values import texts

_IMPLICIT = {"use_sim_time", "start_type_description_service"}


def declare_parameters(node: Node, simulator: bool) -> dict[str, ParameterValue]:
    """Declare every parameter of :data:`PARAMETERS` and return their values.

    Args:
        node: what they are declared on.
        simulator: nothing was configured but single parameters; unless one of them is
            ``link_url`` or ``arming``, this is the simulator's set-up.

    Raises:
        ConfigurationError: an override names no parameter, or a value cannot be used.
    """
    overrides = _overrides(node)
    values: dict[str, ParameterValue] = {}
    for spec in PARAMETERS:
        if spec.name == "arming" and simulator and not overrides.keys() & {"arming", "link_url"}:
            # The only set-up in which the server arms although no setting allows it.
            spec = replace(spec, default="auto")  # noqa: PLW2901
        values[spec.name] = _declare(node, spec)
    make_config(values)
    return values


def current_values(node: Node) -> dict[str, ParameterValue]:
    """Return the values that the parameters of a node have now."""
    values = {spec.name: node.get_parameter(spec.name).value for spec in PARAMETERS}
    # For rclpy an empty list is one of bytes; a list with an empty text stands for it.
    return {
        name: list(texts(value)) if isinstance(value, list) else value
        for name, value in values.items()
    }


def declare_vehicle_parameters(
    node: Node, name: str, server_values: Mapping[str, ParameterValue]
) -> dict[str, ParameterValue]:
    """Declare the parameters of one of several vehicles and return the values of all.

    Args:
        node: the vehicle's.
        name: the vehicle's, for people.
        server_values: the values of the server's node, which are the vehicle's defaults.

    Raises:
        ConfigurationError: an override names no parameter of a vehicle, or cannot be used.
    """
    values = dict(server_values)
    try:
        overrides = _overrides(node)
        for spec in PARAMETERS:
            if spec.name not in SERVER_WIDE:
                own = replace(spec, default=server_values[spec.name])
                values[spec.name] = _declare(node, own)
    except ConfigurationError as error:
        raise ConfigurationError(f"Vehicle {name}: {error}") from error
    check_server_wide(name, overrides, server_values)
    return values


def refuse_changes(node: Node, example: str) -> None:
    """Reject changes of the server node's parameters, which its vehicles have taken over.

    Args:
        node: the server's, with several vehicles.
        example: name of a vehicle's node.
    """

    def on_set(parameters: list[Parameter]) -> SetParametersResult:
        ours = any(parameter.name in SPECS.keys() - {"replay_speed"} for parameter in parameters)
        reason = f"Each vehicle has its own settings; set it on a node such as {example}."
        return SetParametersResult(successful=not ours, reason=reason if ours else "")

    node.add_on_set_parameters_callback(on_set)


def _overrides(node: Node) -> dict[str, ParameterValue]:
    """Return the overrides that a node was given, if each is of a parameter that exists."""
    # rclpy has no public way to list the overrides that nobody declared.
    overrides = {name: given.value for name, given in node._parameter_overrides.items()}
    for name in sorted(overrides):
        if name not in SPECS and name not in _IMPLICIT and not name.startswith("qos_overrides"):
            raise unknown_parameter(name)
    return overrides


def follow_changes(
    node: Node, values: dict[str, ParameterValue], apply: Callable[[ServerConfig], None]
) -> None:
    """Check every later parameter change, and apply the new settings.

    Args:
        node: what the parameters were declared on.
        values: the values in force; kept up to date.
        apply: takes the new settings.
    """

    def on_set(parameters: list[Parameter]) -> SetParametersResult:
        changed = {p.name: p.value for p in parameters if p.name in SPECS}
        try:
            config = make_config({**values, **changed})
        except ConfigurationError as error:
            return SetParametersResult(successful=False, reason=str(error))
        values.update(changed)
        if changed:
            apply(config)
        return SetParametersResult(successful=True)

    node.add_on_set_parameters_callback(on_set)


def _declare(node: Node, spec: ParameterSpec) -> ParameterValue:
    override = node._parameter_overrides.get(spec.name)
    if override is not None and override.value is not None:
        # rclpy's own sentences about a wrong type name neither type nor value.
        check_value(spec.name, override.value)
    descriptor = descriptor_of(spec)
    if isinstance(spec.default, float) and override is not None and type(override.value) is int:
        # `speed:=3` on a command line is an integer for ROS; a person means 3.0.
        node._parameter_overrides.pop(spec.name)
        return _declared(node, spec, float(override.value), descriptor)
    if isinstance(spec.default, list):
        # For rclpy an empty list is one of bytes; a list with an empty text stands for it.
        if override is not None and override.value in ([], None):
            node._parameter_overrides.pop(spec.name)
        return list(texts(_declared(node, spec, [""], descriptor)))
    return _declared(node, spec, spec.default, descriptor)


def _declared(
    node: Node, spec: ParameterSpec, default: ParameterValue, descriptor: ParameterDescriptor
) -> ParameterValue:
    try:
        value: ParameterValue = node.declare_parameter(spec.name, default, descriptor).value
    except (InvalidParameterValueException, InvalidParameterTypeException) as error:
        raise ConfigurationError(
            f"Parameter {spec.name} is invalid: {error}. {spec.description}"
        ) from error
    return value


def descriptor_of(spec: ParameterSpec) -> ParameterDescriptor:
    """Return how ROS describes a parameter."""
    descriptor = ParameterDescriptor(
        name=spec.name, description=spec.description, read_only=spec.fixed
    )
    if spec.choices is not None:
        descriptor.additional_constraints = f"one of: {', '.join(spec.choices)}"
    if isinstance(spec.default, bool):
        descriptor.type = ParameterType.PARAMETER_BOOL
    elif isinstance(spec.default, float):
        descriptor.type = ParameterType.PARAMETER_DOUBLE
        if spec.limits is not None:
            low, high = spec.limits
            descriptor.floating_point_range = [FloatingPointRange(from_value=low, to_value=high)]
    elif isinstance(spec.default, list):
        descriptor.type = ParameterType.PARAMETER_STRING_ARRAY
    elif isinstance(spec.default, int):
        descriptor.type = ParameterType.PARAMETER_INTEGER
        if spec.limits is not None:
            low, high = map(int, spec.limits)
            descriptor.integer_range = [IntegerRange(from_value=low, to_value=high, step=1)]
    else:
        descriptor.type = ParameterType.PARAMETER_STRING
    return descriptor
