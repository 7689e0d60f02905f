"""Writes the table of docs/parameters.md and the JSON Schemas in bridge_config: `make pages`.

They come from the declarations in navigation_bridge, and tests hold them equal.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from navigation_bridge.configuration import known_obstacles
from navigation_bridge.configuration.checked_values import Kind
from navigation_bridge.configuration.parameter_table import PARAMETERS, ParameterSpec
from navigation_bridge.configuration.parameter_values import TOKEN
from navigation_bridge.recording import shadow_file

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs/parameters.md"
SCHEMAS = ROOT / "bridge_config"
DRAFT = "https://json-schema.org/draft/2020-12/schema"
HEAD = "| Parameter | Default | Meaning (range) |\n|---|---|---|\n"


def table(parameters: Sequence[ParameterSpec]) -> str:
    """Return the table of the page."""
    return HEAD + "".join(map(_row, parameters))


def _row(spec: ParameterSpec) -> str:
    number = isinstance(spec.default, int | float) and not isinstance(spec.default, bool)
    default = f"{spec.default:g}" if number else json.dumps(spec.default)
    bounds = "" if spec.limits is None else f" ({spec.limits[0]:g}..{spec.limits[1]:.15g})"
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
        "$schema": DRAFT,
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
    found = {"description": spec.description, **spec.kind.schema, **spec.schema}
    return {**found, "default": spec.default}


def schema_of_file(title: str, description: str, kind: Kind[Any]) -> dict[str, Any]:
    """Return the JSON Schema of a file of declared content."""
    about = {"title": title, "description": description}
    return {"$schema": DRAFT, **about, **kind.schema}


FILES = {
    "navigation_server": schema(PARAMETERS),
    "obstacles": schema_of_file(
        "Known obstacles for navigation_server",
        "Static obstacles. Heights are above the map origin.",
        known_obstacles.FILE,
    ),
    "shadow_goals": schema_of_file(
        "Shadow goals for navigation_server",
        "Goals to run against a recording. `goal` has the fields of `ros2 action send_goal`.",
        shadow_file.FILE,
    ),
}
"""Schemas by the names of their files"""


def main() -> int:
    """Write all."""
    PAGE.write_text(page(PAGE.read_text("utf-8"), PARAMETERS), "utf-8")
    for name, found in FILES.items():
        path = SCHEMAS / f"{name}.schema.json"
        path.write_text(json.dumps(found, indent=2) + "\n", "utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
