"""YAML files read as a declared kind of value, with errors that name line and key."""

from __future__ import annotations

from collections.abc import Hashable
from typing import TypeVar

import yaml

from navigation_bridge.configuration.checked_values import InvalidValueError, Kind

T = TypeVar("T")


def read_yaml(text: str, name: str, kind: Kind[T], error_type: type[ValueError]) -> T:
    """Return what a YAML file has, checked and converted.

    Args:
        text: the YAML.
        name: name of the file, for messages.
        kind: of its content.
        error_type: raised if it is not valid YAML, or not of the kind.
    """
    try:
        return kind.read(load_yaml(text, name, error_type))
    except InvalidValueError as error:
        raise error_type(f"{name}: {error}") from None


def load_yaml(text: str, name: str, error_type: type[ValueError]) -> object:
    """Parse YAML.

    Args:
        text: the YAML.
        name: name of the file, for messages.
        error_type: raised if it is not valid YAML.
    """
    try:
        return yaml.load(text, Loader=_Loader)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        where = f"{name}:{mark.line + 1}" if mark is not None else name
        raise error_type(f"{where}: {error.problem or error.context}.") from None
    except (yaml.YAMLError, RecursionError, ValueError) as error:
        first = str(error).splitlines()[0] if str(error) else "nested too deeply"
        raise error_type(f"{name}: {first}.") from None


class _Loader(yaml.SafeLoader):
    """Rejects duplicate keys, which YAML would drop silently."""

    def construct_mapping(
        self, node: yaml.MappingNode, deep: bool = False
    ) -> dict[Hashable, object]:
        seen = set()
        for key, _ in node.value:
            if key.value in seen:
                problem = f"duplicate key {key.value!r}"
                raise yaml.MarkedYAMLError(problem=problem, problem_mark=key.start_mark)
            seen.add(key.value)
        return super().construct_mapping(node, deep)
