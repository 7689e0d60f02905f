"""The parameter table, what is made of it, and the files in bridge_config/."""

from __future__ import annotations

import json
import math
from pathlib import Path

import jsonschema
import pytest
import yaml

from drone_navigation.configuration import (
    PARAMETERS,
    ConfigurationError,
    ParameterSpec,
    ParameterValue,
    check_value,
    make_config,
)

ROOT = Path(__file__).resolve().parents[3]
SCHEMA = json.loads((ROOT / "bridge_config/navigation_server.schema.json").read_text("utf-8"))
PROPERTIES = SCHEMA["properties"]["navigation_server"]["properties"]["ros__parameters"][
    "properties"
]
FILES = sorted((ROOT / "bridge_config").glob("*.yaml"))


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.name)
def test_every_parameter_file_fits_the_schema_and_the_table(path: Path) -> None:
    document = yaml.safe_load(path.read_text("utf-8"))
    jsonschema.validate(document, SCHEMA)
    make_config(document["navigation_server"]["ros__parameters"])


def test_the_schema_says_the_same_as_the_table() -> None:
    assert set(PROPERTIES) == {spec.name for spec in PARAMETERS}
    for spec in PARAMETERS:
        stated = PROPERTIES[spec.name]
        assert stated["default"] == spec.default, spec.name
        assert stated["description"] == spec.description, spec.name
        assert stated.get("minimum") == spec.minimum, spec.name
        assert stated.get("maximum") == spec.maximum, spec.name
        assert stated.get("enum") == (list(spec.choices) if spec.choices else None), spec.name


def test_only_the_simulator_is_armed_unless_told() -> None:
    assert not make_config({}).bridge.goto.may_arm
    arming = {
        path.name: yaml.safe_load(path.read_text("utf-8"))["navigation_server"]["ros__parameters"][
            "arming"
        ]
        for path in FILES
    }
    assert {name for name, policy in arming.items() if policy == "auto"} == {"sitl.yaml"}


def _bad_values(spec: ParameterSpec) -> list[ParameterValue]:
    if isinstance(spec.default, str):
        return [3, *(["nonsense"] if spec.choices else [])]
    bad: list[ParameterValue] = ["text", True, math.nan]
    if spec.minimum is not None:
        bad.append(spec.minimum - 1)
    if spec.maximum is not None:
        bad.append(spec.maximum + 1)
    return bad


@pytest.mark.parametrize("spec", PARAMETERS, ids=lambda spec: spec.name)
def test_bad_values_are_refused_by_name(spec: ParameterSpec) -> None:
    for value in _bad_values(spec):
        with pytest.raises(ConfigurationError, match=spec.name):
            check_value(spec.name, value)


@pytest.mark.parametrize("spec", PARAMETERS, ids=lambda spec: spec.name)
def test_the_limits_themselves_are_legal(spec: ParameterSpec) -> None:
    for value in (spec.default, spec.minimum, spec.maximum, *(spec.choices or ())):
        if value is not None:
            check_value(spec.name, value)


@pytest.mark.parametrize(
    ("values", "name"),
    [
        ({"volume_altitude_min_m": 50.0, "volume_altitude_max_m": 20.0}, "volume_altitude_min_m"),
        ({"takeoff_height_min_m": 9.0}, "takeoff_height_min_m"),
        ({"speed_default_m_s": 12.0}, "speed_default_m_s"),
        ({"heartbeat_timeout_s": 30.0}, "link_lost_abort_s"),
        ({"colour": "blue"}, "colour"),
    ],
)
def test_contradictions_and_unknown_names_are_refused(
    values: dict[str, ParameterValue], name: str
) -> None:
    with pytest.raises(ConfigurationError, match=name):
        make_config(values)
