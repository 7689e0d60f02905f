"""The parameter table, what is made of it, and the files in bridge_config/."""

from __future__ import annotations

import json
import math
import re
import runpy
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import jsonschema
import pytest
import yaml

from drone_navigation.server.options import make_parser
from drone_navigation.server.parameters import descriptor_of
from mavlink_vehicle.codec import mavlink
from mavlink_vehicle.io.links import LinkKind, parse_url
from mavlink_vehicle.vehicle_config import VehicleConfig
from navigation_bridge.configuration.declarations import make, parameter, specs_of
from navigation_bridge.configuration.make_config import (
    ConfigurationError,
    ServerConfig,
    check_value,
    make_config,
)
from navigation_bridge.configuration.parameter_table import (
    PARAMETERS,
    ParameterSpec,
    ParameterValue,
    unknown_parameter,
)
from navigation_core.limits import Limits
from navigation_core.safety.target_checks import check_target
from navigation_core.tasks.goto_config import GotoConfig
from navigation_core.tasks.traffic.volumes import Separation

ROOT = Path(__file__).resolve().parents[3]
SCRIPT: dict[str, Any] = runpy.run_path(str(ROOT / "scripts/list_parameters.py"))
SCHEMA = json.loads((SCRIPT["SCHEMAS"] / "navigation_server.schema.json").read_text("utf-8"))
CONFIG = ROOT / "bridge_config"
NO_SET_UPS = {"worlds", "obstacles", "shadow_goals"}
FILES = sorted(path for path in CONFIG.rglob("*.yaml") if path.parent.name not in NO_SET_UPS)
SET_UPS = [
    f"{firmware}_{kind}.yaml"
    for firmware in ("ardupilot", "px4")
    for kind in ("copter", "rover", "boat", "plane")
]


def name_of(path: Path) -> str:
    return str(path.relative_to(ROOT))


def parameters(path: Path) -> dict[str, ParameterValue]:
    values = yaml.safe_load(path.read_text("utf-8"))["navigation_server"]["ros__parameters"]
    assert isinstance(values, dict)
    return values


def links(path: Path) -> list[str]:
    """Return the links of a file, the one in force first, then those that are comments."""
    return re.findall(r'^ +(?:# )?link_url: "([^"]+)"$', path.read_text("utf-8"), re.MULTILINE)


@pytest.mark.parametrize("path", FILES, ids=name_of)
def test_every_parameter_file_fits_the_schema_and_the_table(path: Path) -> None:
    document = yaml.safe_load(path.read_text("utf-8"))
    jsonschema.validate(document, SCHEMA)
    make_config(document["navigation_server"]["ros__parameters"])


@pytest.mark.parametrize("place", ["real", "simulated"])
def test_there_is_a_set_up_for_each_firmware_and_kind(place: str) -> None:
    assert sorted(path.name for path in (CONFIG / place).iterdir()) == sorted(SET_UPS)


@pytest.mark.parametrize("path", FILES, ids=name_of)
def test_a_file_begins_with_what_it_is_for_and_how_to_start_it(path: Path) -> None:
    first, *following = path.read_text("utf-8").splitlines()[:3]
    assert first.startswith(
        ("# A real ", "# A simulated ", "# The simulated ", "# Three simulated ")
    )
    assert any(f"navigation_server --config {name_of(path)}" in line for line in following)


@pytest.mark.parametrize("place", ["real", "simulated"])
@pytest.mark.parametrize("name", SET_UPS)
def test_a_set_up_gives_a_link_of_each_kind_to_choose_from(place: str, name: str) -> None:
    path = CONFIG / place / name
    parsed = [parse_url(link) for link in links(path)]
    assert {link.kind for link in parsed} == {LinkKind.UDP_IN, LinkKind.TCP_OUT, LinkKind.SERIAL}
    assert len(parsed) == 3
    assert links(path)[0] == parameters(path)["link_url"]
    # Each of them can be taken as it stands.
    for link in links(path):
        assert make_config({**parameters(path), "link_url": link}).link_url == link


@pytest.mark.parametrize("name", SET_UPS)
def test_simulated_and_real_configurations_match(name: str) -> None:
    real, simulated = (parameters(CONFIG / place / name) for place in ("real", "simulated"))
    differing = {key for key in real | simulated if real.get(key) != simulated.get(key)}
    assert differing == {"link_url", "arming"}


@pytest.mark.parametrize("place", ["real", "simulated"])
@pytest.mark.parametrize(
    ("kind", "height_m"), [("copter", 2.0), ("copter", 50.0), ("plane", 30.0), ("plane", 100.0)]
)
def test_round_heights_are_accepted_wherever_the_ground_is_measured(
    place: str, kind: str, height_m: float
) -> None:
    """A vehicle that stands, or the home of a PX4, may be some decimetres off."""
    for firmware in ("ardupilot", "px4"):
        config = make_config(parameters(CONFIG / place / f"{firmware}_{kind}.yaml"))
        for ground_enu_m in (-0.4, 0.0, 0.4):
            target = (10.0, 5.0, height_m)
            assert check_target(target, None, ground_enu_m, config.bridge.volume) is None


@pytest.mark.parametrize("name", SET_UPS)
def test_only_a_simulated_set_up_stays_on_this_machine(name: str) -> None:
    for link in map(parse_url, links(CONFIG / "simulated" / name)):
        assert link.kind is LinkKind.SERIAL or link.host == "127.0.0.1"


def test_schema_and_page_are_those_of_the_declarations() -> None:
    for name, schema in SCRIPT["FILES"].items():
        text = (SCRIPT["SCHEMAS"] / f"{name}.schema.json").read_text("utf-8")
        assert json.loads(text) == schema, "run make pages"
        jsonschema.Draft202012Validator.check_schema(schema)
    text = SCRIPT["PAGE"].read_text("utf-8")
    assert text == SCRIPT["page"](text, PARAMETERS), "run make pages"


@dataclass(frozen=True)
class WithBrakes(ServerConfig):
    brakes_m_s: float = parameter(
        "brake_speed_m_s",
        2.5,
        "Speed above which the [brakes](navigate.md) are `used`.",
        (0.5, 9.0),
        fixed=True,
    )


def test_a_parameter_is_declared_once() -> None:
    parameters = specs_of(WithBrakes)
    spec = parameters[-1]
    assert spec.description == "Speed above which the brakes are used."
    values = {each.name: each.default for each in parameters}
    assert make(WithBrakes, values).brakes_m_s == spec.default == 2.5
    assert make(WithBrakes, values | {"brake_speed_m_s": 3}).brakes_m_s == 3.0
    descriptor = descriptor_of(spec)
    assert (descriptor.description, descriptor.read_only) == (spec.description, True)
    (bounds,) = descriptor.floating_point_range
    assert (bounds.from_value, bounds.to_value) == (0.5, 9.0)
    help_text = make_parser(parameters).format_help()
    assert re.search(r"brake_speed_m_s +Speed above .* used\. \(default: 2\.5\)", help_text)
    *_, row = SCRIPT["table"](parameters).splitlines()
    meaning = "Speed above which the [brakes](navigate.md) are `used` (0.5..9)"
    assert row == f"| `brake_speed_m_s` | `2.5` | {meaning} |"
    validator = jsonschema.Draft202012Validator(SCRIPT["schema"](parameters))
    for good, value in ((True, 0.5), (True, 9), (False, 9.5), (False, "fast"), (False, True)):
        document = {"navigation_server": {"ros__parameters": {"brake_speed_m_s": value}}}
        assert validator.is_valid(document) is good, value
        with nullcontext() if good else pytest.raises(ConfigurationError, match="brake_speed_m_s"):
            spec.check(value)
    near = unknown_parameter("brake_sped_m_s", [each.name for each in parameters])
    assert "did you mean 'brake_speed_m_s'?" in str(near)


def test_a_default_of_the_core_stands_in_the_core_alone() -> None:
    made = make_config({})
    assert made.bridge.goto == GotoConfig()
    assert made.bridge.goto.limits == Limits()
    assert made.bridge.traffic.separation == Separation()
    rates_hz = made.vehicle.optional_rates_hz
    assert made.vehicle == VehicleConfig(optional_rates_hz=rates_hz)


def test_only_the_simulator_is_armed_by_default() -> None:
    assert not make_config({}).bridge.goto.may_arm
    for path in FILES:
        simulated = path.parent.name == "simulated" or path.name in ("sitl.yaml", "fleet.yaml")
        assert parameters(path)["arming"] == ("auto" if simulated else "never"), path


def test_the_server_sends_the_configured_heartbeat_type() -> None:
    assert make_config({}).vehicle.heartbeat_type is None
    for word, number in (
        ("auto", None),
        ("gcs", mavlink.MAV_TYPE_GCS),
        ("onboard", mavlink.MAV_TYPE_ONBOARD_CONTROLLER),
    ):
        assert make_config({"heartbeat_type": word}).vehicle.heartbeat_type == number


def _bad_values(spec: ParameterSpec) -> list[ParameterValue]:
    if isinstance(spec.default, list):
        return ["text", 3, True, ["no/token/nor:link"], ["a b"]]
    if isinstance(spec.default, str):
        return [3, *(["nonsense"] if spec.choices else [])]
    if isinstance(spec.default, bool):
        return ["true", 0, 1, 0.0, []]
    bad: list[ParameterValue] = ["text", True, math.nan]
    if spec.limits is not None:
        bad += [spec.limits[0] - 1, spec.limits[1] + 1]
    return bad


@pytest.mark.parametrize("spec", PARAMETERS, ids=lambda spec: spec.name)
def test_invalid_values_are_rejected_by_name(spec: ParameterSpec) -> None:
    for value in _bad_values(spec):
        with pytest.raises(ConfigurationError, match=spec.name):
            check_value(spec.name, value)


@pytest.mark.parametrize("spec", PARAMETERS, ids=lambda spec: spec.name)
def test_the_limits_themselves_are_legal(spec: ParameterSpec) -> None:
    for value in (spec.default, *(spec.limits or ()), *(spec.choices or ())):
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
def test_contradictions_and_unknown_names_are_rejected(
    values: dict[str, ParameterValue], name: str
) -> None:
    with pytest.raises(ConfigurationError, match=name):
        make_config(values)


@pytest.mark.parametrize(
    ("names", "said"),
    [
        (["a", "b", "a"], "'a' twice"),
        (["2a"], "'2a' cannot be a namespace"),
        (["a", "b-c"], "'b-c' cannot be a namespace"),
        (["/a"], "'/a' cannot be a namespace"),
        (["a__b"], "'a__b' cannot be a namespace"),
        (["x" * 65], "up to 64 letters"),
    ],
)
def test_a_vehicle_has_a_name_of_its_own_that_can_be_a_namespace(
    names: list[str], said: str
) -> None:
    with pytest.raises(ConfigurationError, match=f"vehicles.*{said}"):
        make_config({"vehicles": names})


@pytest.mark.parametrize(
    ("urls", "said"),
    [
        (["udpin://127.0.0.1:14551", "udpin:127.0.0.1:14551"], "twice"),
        (["nonsense"], "'nonsense' is not a link"),
        (["tlog:flight.tlog"], "recording"),
        (["udpin:127.0.0.1:14550"], "the vehicle's link"),
    ],
)
def test_a_ground_station_has_a_link_of_its_own(urls: list[str], said: str) -> None:
    with pytest.raises(ConfigurationError, match=f"gcs_links.*{said}"):
        make_config({"gcs_links": urls})


def test_empty_strings_of_a_list_are_dropped() -> None:
    config = make_config({"vehicles": [""], "gcs_links": ["", "udpin://127.0.0.1:14551"]})
    assert config.vehicles == ()
    assert config.gcs_links == ("udpin://127.0.0.1:14551",)
