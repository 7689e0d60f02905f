"""Parameter files of several vehicles, and settings that they cannot share."""

from __future__ import annotations

from pathlib import Path

import pytest

from navigation_bridge.configuration.fleet_config import check_server_wide, make_vehicle_configs
from navigation_bridge.configuration.make_config import ConfigurationError, make_config
from navigation_bridge.configuration.parameter_file import read_parameter_file
from navigation_bridge.configuration.parameter_table import ParameterValue

ROOT = Path(__file__).resolve().parents[3]
NODE = "navigation_server"


def written(folder: Path, text: str) -> Path:
    path = folder / "parameters.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def test_the_set_up_of_three_vehicles_is_one_for_each() -> None:
    file = read_parameter_file(ROOT / "bridge_config/fleet.yaml", NODE)
    configs = make_vehicle_configs(file.vehicles)
    assert {name: config.vehicle.target_system for name, config in configs.items()} == {
        "copter": 1, "px4": 2, "rover": 3,
    }  # fmt: skip
    assert configs["copter"].link_url == configs["px4"].link_url != configs["rover"].link_url
    assert all(config.bridge.goto.may_arm for config in configs.values())


def test_server_parameters_are_defaults_of_all_vehicles(
    tmp_path: Path,
) -> None:
    path = written(
        tmp_path,
        """
        /**: {ros__parameters: {arming: auto, speed_default_m_s: 1.0}}
        navigation_server: {ros__parameters: {vehicles: [a, b], speed_default_m_s: 2.0}}
        /a/navigation_server: {ros__parameters: {target_system: 1}}
        b: {navigation_server: {ros__parameters: {target_system: 2, speed_default_m_s: 3.0}}}
        """,
    )
    configs = make_vehicle_configs(read_parameter_file(path, NODE).vehicles)
    speeds = {
        name: config.bridge.goto.limits.speed_horizontal_m_s for name, config in configs.items()
    }
    assert speeds == {"a": 2.0, "b": 3.0}
    assert configs["a"].bridge.goto.may_arm


def test_parameters_of_an_unlisted_vehicle_are_rejected(tmp_path: Path) -> None:
    path = written(
        tmp_path,
        """
        navigation_server: {ros__parameters: {vehicles: [a]}}
        /A/navigation_server: {ros__parameters: {target_system: 1}}
        """,
    )
    with pytest.raises(ConfigurationError, match=r"/A/navigation_server.*does not list 'A'"):
        read_parameter_file(path, NODE)


@pytest.mark.parametrize(
    ("vehicles", "said"),
    [
        ({"a": {"target_system": 1}, "b": {"target_system": 1}}, "a and b have the same"),
        ({"a": {"target_system": 1}, "b": {}}, "Vehicle b: .*target_system is 0"),
        ({"a": {"target_system": 1, "arming": "maybe"}}, "Vehicle a: .*arming"),
        (
            {"a": {"target_system": 1, "gcs_links": ["udpin:127.0.0.1:14550"]}},
            "gcs_links.*the vehicle's link",
        ),
    ],
)
def test_indistinguishable_or_invalid_vehicles_are_rejected_by_name(
    vehicles: dict[str, dict[str, ParameterValue]], said: str
) -> None:
    with pytest.raises(ConfigurationError, match=said):
        make_vehicle_configs(vehicles)


def test_more_vehicles_than_were_measured_are_rejected_with_the_figure() -> None:
    names = [f"v{number}" for number in range(26)]
    assert len(make_config({"vehicles": names[:25]}).vehicles) == 25
    with pytest.raises(
        ConfigurationError, match=r"^26 vehicles .* at most 25 \(parameter vehicles_max\)"
    ):
        make_config({"vehicles": names})
    assert len(make_config({"vehicles": names, "vehicles_max": 26}).vehicles) == 26


def test_a_single_vehicle_needs_no_system_id() -> None:
    configs = make_vehicle_configs({"x": {}})
    assert configs["x"].vehicle.target_system == 0, "the first that is heard"


def test_parameters_of_the_server_are_rejected_for_a_vehicle() -> None:
    server: dict[str, ParameterValue] = {"record_tlog": "all.tlog"}
    check_server_wide("a", {"record_tlog": "all.tlog", "arming": "auto"}, server)
    with pytest.raises(
        ConfigurationError, match=r"Vehicle a: parameter record_tlog belongs to the server"
    ):
        check_server_wide("a", {"record_tlog": "a.tlog"}, server)
