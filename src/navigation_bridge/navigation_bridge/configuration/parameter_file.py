"""Reader of ROS parameter files for a server and its vehicles. No ROS."""

from __future__ import annotations

import difflib
import itertools
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from navigation_bridge.configuration.checked_yaml import load_yaml
from navigation_bridge.configuration.parameter_table import ParameterValue, check_value
from navigation_bridge.configuration.parameter_values import ConfigurationError, texts
from navigation_bridge.configuration.text_files import read_text

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
    """Return the parameters that a ROS parameter file sets for a node without a namespace.

    Raises:
        ConfigurationError: it cannot be read, is not a parameter file, or is for other nodes.
    """
    nodes: dict[str, dict[str, ParameterValue]] = {}
    for key, values in _nodes(_document(path), ""):
        nodes.setdefault(key, {}).update(values)
    server = _values_of(nodes, node_name)
    names = texts(server.get("vehicles", []))
    _check_keys(path, list(nodes), [node_name, *(f"{name}/{node_name}" for name in names)])
    vehicles = {name: {**server, **nodes.get(f"{name}/{node_name}", {})} for name in names}
    return ParameterFile(server, vehicles)


def names_of_vehicles(path: Path) -> tuple[str, ...]:
    """Return the vehicles that a ROS parameter file lists for a server, whatever its namespace.

    Raises:
        ConfigurationError: it cannot be read or is not a parameter file.
    """
    listed = (
        values["vehicles"] for _, values in _nodes(_document(path), "") if "vehicles" in values
    )
    return tuple(texts(next(listed, [])))


def check_keys(arguments: Sequence[str], nodes: Sequence[str]) -> None:
    """Check that each file of ``--params-file FILE`` is for a server, by the keys of its nodes.

    ROS silently ignores the parameters of other nodes: a typo in a name, or a namespace that the
    file does not know, would leave a vehicle with the defaults.

    Args:
        arguments: the whole command line.
        nodes: full names of the server's node and, after it, of its vehicles'.

    Raises:
        ConfigurationError: a file is for other nodes, or for a vehicle that the server lacks.
    """
    wanted = [node.strip("/") for node in nodes]
    for name in _parameter_files(arguments):
        keys = [key for key, _ in _nodes(_document(Path(name)), "")]
        _check_keys(Path(name), keys, wanted)


def _check_keys(path: Path, keys: Sequence[str], nodes: Sequence[str]) -> None:
    server = nodes[0]
    namespace, _, node_name = server.rpartition("/")
    if not any(_matches(key, node) for key in keys for node in nodes):
        text = f"{path} sets no parameter of /{server}"
        near = difflib.get_close_matches(server, keys, 1, cutoff=0.5)
        near = near or [key for key in keys if key.rpartition("/")[2] == node_name]
        if near:
            text += f": it has /{near[0]}; did you mean /{server}?"
        elif keys:
            text += f": it has {', '.join(f'/{key}' for key in keys[:3])}."
        else:
            text += "."
        raise ConfigurationError(
            f"{text} Put the parameters under '/{server}:' (or '/**:') and 'ros__parameters:', as "
            "in bridge_config/sitl.yaml."
        )
    for key in keys:
        above, _, last = key.rpartition("/")
        inside = above.removeprefix(f"{namespace}/") if namespace else above
        below = above.startswith(f"{namespace}/") if namespace else bool(above)
        if last == node_name and below and not any(_matches(key, node) for node in nodes):
            raise ConfigurationError(
                f"{path} sets parameters of /{key}, but the parameter vehicles does not list "
                f"'{inside}'."
            )


def _values_of(nodes: dict[str, dict[str, ParameterValue]], node: str) -> dict[str, ParameterValue]:
    """Return the values for a node; those under its own name win."""
    values: dict[str, ParameterValue] = {}
    for key in sorted(nodes, key=lambda key: key == node):
        if _matches(key, node):
            values.update(nodes[key])
    return values


def _matches(key: str, node: str) -> bool:
    """Whether a key of a file is for a node: ``*`` is one name, ``**`` any number of them."""
    wildcards = {"**": r"(?:/[^/]+)*", "*": r"/[^/]+"}
    pattern = "".join(wildcards.get(word, "/" + re.escape(word)) for word in key.split("/"))
    return re.fullmatch(pattern, f"/{node}") is not None


def _document(path: Path) -> object:
    return load_yaml(read_text(path, ConfigurationError), str(path), ConfigurationError)


def check_parameter_files(arguments: Sequence[str], node_name: str) -> None:
    """Check the files that `--ros-args --params-file FILE` names, before ROS reads them.

    Args:
        arguments: the whole command line.
        node_name: the server's node; parameters of other nodes are not checked.

    Raises:
        ConfigurationError: a file cannot be read, or sets an unknown parameter or an invalid value;
            names the file.
    """
    for name in _parameter_files(arguments):
        for node, values in _nodes(_document(Path(name)), ""):
            if node.rpartition("/")[2] not in ("**", "*", node_name):
                continue
            for parameter, value in values.items():
                if parameter in _OF_ROS or parameter.startswith("qos_overrides"):
                    continue
                try:
                    check_value(parameter, value)
                except ConfigurationError as error:
                    raise ConfigurationError(f"{name}: {error}") from error


def _parameter_files(arguments: Sequence[str]) -> list[str]:
    return [name for flag, name in itertools.pairwise(arguments) if flag == "--params-file"]


def _nodes(tree: object, above: str) -> Iterator[tuple[str, dict[str, ParameterValue]]]:
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
