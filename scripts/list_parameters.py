"""Writes what lists the server's parameters: `make pages`.

That is the table of docs/parameters.md and the JSON Schema of parameter files; both come from the
declarations in navigation_bridge/configuration/, and
tests/unit/navigation/test_configuration.py holds them equal.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from navigation_bridge.configuration.parameter_table import PARAMETERS, ParameterSpec
from navigation_bridge.configuration.parameter_values import TOKEN

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs/parameters.md"
SCHEMA = ROOT / "bridge_config/navigation_server.schema.json"
HEAD = "| Parameter | Default | Meaning (range) |\n|---|---|---|\n"


def table(parameters: Sequence[ParameterSpec]) -> str:
    """Return the table of the page."""
    return HEAD + "".join(map(_row, parameters))


def _row(spec: ParameterSpec) -> str:
    number = isinstance(spec.default, int | float)
    default = f"{spec.default:g}" if number else json.dumps(spec.default)
    bounds = "" if spec.minimum is None else f" ({spec.minimum:g}..{spec.maximum:.15g})"
    return f"| `{spec.name}` | `{default}` | {spec.text.removesuffix('.')}{bounds} |\n"


def page(text: str, parameters: Sequence[ParameterSpec]) -> str:
    """Return the page with its table written again."""
    return text.partition(HEAD)[0] + table(parameters)


def schema(parameters: Sequence[ParameterSpec]) -> dict[str, Any]:
    """Return the JSON Schema of parameter files."""
    own = {spec.name: False for spec in parameters if spec.server_wide}
    node = {
        "type": "object",
        "additionalProperties": False,
        "required": ["ros__parameters"],
        "properties": {
            "ros__parameters": {
                "type": "object",
                "additionalProperties": False,
                "properties": {spec.name: _property(spec) for spec in parameters},
            }
        },
    }
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "Parameter file of navigation_server",
        "type": "object",
        "additionalProperties": False,
        "required": ["navigation_server"],
        "properties": {"navigation_server": node},
        "patternProperties": {
            f"^/?{TOKEN.removeprefix('(?!.*__)')}/navigation_server$": {
                "description": "What one of several vehicles has of its own.",
                "allOf": [
                    {"$ref": "#/properties/navigation_server"},
                    {"properties": {"ros__parameters": {"properties": own}}},
                ],
            }
        },
    }


def _property(spec: ParameterSpec) -> dict[str, Any]:
    names = {list: "array", str: "string", int: "integer", float: "number", bool: "boolean"}
    found: dict[str, Any] = {"description": spec.description, "type": names[type(spec.default)]}
    if isinstance(spec.default, list):
        found["items"] = {"type": "string"}
    if spec.choices is not None:
        found["enum"] = list(spec.choices)
    if spec.minimum is not None:
        found |= {"minimum": spec.minimum, "maximum": spec.maximum}
    return {**found, **spec.schema, "default": spec.default}


def main() -> int:
    """Write both."""
    PAGE.write_text(page(PAGE.read_text("utf-8"), PARAMETERS), "utf-8")
    SCHEMA.write_text(json.dumps(schema(PARAMETERS), indent=2) + "\n", "utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
