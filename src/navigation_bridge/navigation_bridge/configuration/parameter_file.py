"""Reader of ROS parameter files for a server and its vehicles. No ROS."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import yaml

from navigation_bridge.configuration.parameter_table import ParameterValue
from navigation_bridge.configuration.parameter_values import ConfigurationError, check_value, texts

__all__ = ["ParameterFile", "check_parameter_files", "read_parameter_file"]

_ANY_NODE = "**"
_OF_ROS = frozenset({"use_sim_time", "start_type_description_service"})
_PARAMETERS_KEY = "ros__parameters"


@dataclass(frozen=True)
class ParameterFile:
    """Unchecked content of a parameter file.

    Attributes:
        server: parameters of the node without a namespace.
        vehicles: parameters of each vehicle in this file, with the server's values.
    """

    server: dict[str, ParameterValue]
    vehicles: dict[str, dict[str, ParameterValue]] = field(default_factory=dict)


def read_parameter_file(path: Path, node_name: str) -> ParameterFile:
    """Return the parameters that a ROS parameter file sets for ``node_name``.

    ROS silently ignores parameters of other nodes; a typo in the name would leave a vehicle with
    the defaults.

    Raises:
        ConfigurationError: it cannot be read, is not a parameter file, or is for other nodes.
    """
    document = _document(path)
    nodes: dict[str, dict[str, ParameterValue]] = {}
    for name, values in _nodes(document, ""):
        nodes.setdefault(name, {}).update(values)
    server = {**nodes.get(_ANY_NODE, {}), **nodes.get(node_name, {})}
    if not server:
        raise ConfigurationError(
            f"{path} sets no parameter of {node_name}; put them under '{node_name}:' and "
            "'ros__parameters:', as in bridge_config/sitl.yaml."
        )
    names = texts(server.get("vehicles", []))
    for name in nodes:
        namespace, _, last = name.rpartition("/")
        if last == node_name and namespace and namespace not in names:
            raise ConfigurationError(
                f"{path} sets parameters of /{name}, but the parameter vehicles does not list "
                f"'{namespace}'."
            )
    return ParameterFile(
        server, {name: {**server, **nodes.get(f"{name}/{node_name}", {})} for name in names}
    )


def _document(path: Path) -> Any:
    try:
        return yaml.safe_load(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise ConfigurationError(f"Cannot read {path}: {error.strerror or error}.") from error
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        where = " ".join(str(error).split())
        raise ConfigurationError(f"{path} is not YAML: {where}.") from error


def check_parameter_files(arguments: Sequence[str], node_name: str) -> None:
    """Check the files that `--ros-args --params-file FILE` names, before ROS reads them.

    Args:
        arguments: the whole command line.
        node_name: the server's node; parameters of other nodes are not checked.

    Raises:
        ConfigurationError: a file cannot be read, or sets an unknown parameter or an invalid value;
            names the file.
    """
    for flag, name in itertools.pairwise(arguments):
        if flag != "--params-file":
            continue
        for node, values in _nodes(_document(Path(name)), ""):
            if node != _ANY_NODE and node.rpartition("/")[2] not in (_ANY_NODE, node_name):
                continue
            for parameter, value in values.items():
                if parameter in _OF_ROS or parameter.startswith("qos_overrides"):
                    continue
                try:
                    check_value(parameter, value)
                except ConfigurationError as error:
                    raise ConfigurationError(f"{name}: {error}") from error


def _nodes(tree: Any, above: str) -> Iterator[tuple[str, dict[str, ParameterValue]]]:
    """Yield the nodes, whose names may be full or nested namespaces."""
    if not isinstance(tree, dict):
        return
    for key, below in tree.items():
        name = f"{above}/{key}".strip("/")
        if key == _PARAMETERS_KEY:
            if isinstance(below, dict):
                yield above.strip("/"), below
        else:
            yield from _nodes(below, name)
