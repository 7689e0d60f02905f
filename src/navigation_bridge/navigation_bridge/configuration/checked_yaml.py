"""YAML files validated against a JSON Schema, with errors that name line and key."""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from typing import Any

import yaml


def load_yaml(text: str, name: str, error_type: type[ValueError]) -> Any:
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


def hold(data: object, rules: Mapping[str, Any], where: str, error_type: type[ValueError]) -> None:
    """Validate data against a JSON Schema.

    Args:
        data: the parsed YAML.
        rules: the schema.
        where: position in the file, for messages.
        error_type: raised if the data is invalid.
    """
    # Only a server with a file of obstacles needs it.
    import jsonschema  # noqa: PLC0415

    validator = jsonschema.Draft202012Validator(rules)
    error = jsonschema.exceptions.best_match(validator.iter_errors(data))
    if error is None:
        return
    path = "".join(f"[{p}]" if isinstance(p, int) else f".{p}" for p in error.absolute_path)
    what = error.message if len(error.message) < 200 else "does not match the schema"
    raise error_type(f"{where}: {path.lstrip('.')}{': ' if path else ''}{what}.")


class _Loader(yaml.SafeLoader):
    """Rejects duplicate keys, which YAML would drop silently."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Hashable, Any]:
        seen = set()
        for key, _ in node.value:
            if key.value in seen:
                problem = f"duplicate key {key.value!r}"
                raise yaml.MarkedYAMLError(problem=problem, problem_mark=key.start_mark)
            seen.add(key.value)
        return super().construct_mapping(node, deep)
