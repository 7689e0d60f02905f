"""Reads ROS parameter files without ROS: what they set for the server and for its vehicles."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import yaml

from drone_navigation.parameter_table import ParameterValue
from drone_navigation.parameter_values import ConfigurationError, texts

__all__ = ["ParameterFile", "read_parameter_file"]

_ANY_NODE = "**"
_PARAMETERS_KEY = "ros__parameters"


@dataclass(frozen=True)
class ParameterFile:
    """What a parameter file sets, unchecked.

    Attributes:
        server: of the node without a namespace.
        vehicles: of each vehicle that the server has by this file, the server's values included.
    """

    server: dict[str, ParameterValue]
    vehicles: dict[str, dict[str, ParameterValue]] = field(default_factory=dict)


def read_parameter_file(path: Path, node_name: str) -> ParameterFile:
    """Return the parameters that a ROS parameter file sets for ``node_name``.

    ROS ignores what is meant for another node, so that a slip in the name would leave a
    vehicle with the defaults, without a word.

    Raises:
        ConfigurationError: it cannot be read, is no parameter file, or is for other nodes.
    """
    try:
        document = yaml.safe_load(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise ConfigurationError(f"Cannot read {path}: {error.strerror or error}.") from error
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        where = " ".join(str(error).split())
        raise ConfigurationError(f"{path} is not YAML: {where}.") from error
    nodes: dict[str, dict[str, ParameterValue]] = {}
    for name, values in _nodes(document, ""):
        nodes.setdefault(name, {}).update(values)
    server = {**nodes.get(_ANY_NODE, {}), **nodes.get(node_name, {})}
    if not server:
        raise ConfigurationError(
            f"{path} sets no parameter of {node_name}; write them below '{node_name}:' and "
            "'ros__parameters:', as in bridge_config/sitl.yaml."
        )
    names = texts(server.get("vehicles", []))
    for name in nodes:
        namespace, _, last = name.rpartition("/")
        if last == node_name and namespace and namespace not in names:
            raise ConfigurationError(
                f"{path} sets parameters of /{name}, but the parameter vehicles does not name "
                f"'{namespace}'."
            )
    return ParameterFile(
        server, {name: {**server, **nodes.get(f"{name}/{node_name}", {})} for name in names}
    )


def _nodes(tree: Any, above: str) -> Iterator[tuple[str, dict[str, ParameterValue]]]:
    """Find nodes, whose names may be written at once or as namespaces one below the other."""
    if not isinstance(tree, dict):
        return
    for key, below in tree.items():
        name = f"{above}/{key}".strip("/")
        if key == _PARAMETERS_KEY:
            if isinstance(below, dict):
                yield above.strip("/"), below
        else:
            yield from _nodes(below, name)
