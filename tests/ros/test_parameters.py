"""The table of parameters as ROS parameters of a node."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import rclpy
from rclpy.node import Node
from rclpy.parameter import Parameter

from drone_navigation.processes import ros_environment
from drone_navigation.server.parameters import (
    declare_parameters,
    declare_vehicle_parameters,
    follow_changes,
)
from drone_navigation.server.server import vehicle_arguments
from navigation_bridge.configuration.make_config import (
    ConfigurationError,
    ServerConfig,
    make_config,
)
from navigation_bridge.configuration.parameter_table import PARAMETERS
from tests.support.processes import Process
from tests.support.ros.ros_flight import new_domain

MakeNode = Callable[..., Node]


@pytest.fixture(scope="module")
def context() -> Iterator[rclpy.Context]:
    context = rclpy.Context()
    rclpy.init(context=context, domain_id=new_domain())
    yield context
    rclpy.try_shutdown(context=context)


@pytest.fixture
def make_node(context: rclpy.Context) -> Iterator[MakeNode]:
    nodes: list[Node] = []

    def make(**values: Any) -> Node:
        overrides = [Parameter(name, value=value) for name, value in values.items()]
        nodes.append(Node("navigation_server", context=context, parameter_overrides=overrides))
        return nodes[-1]

    yield make
    for node in nodes:
        node.destroy_node()


@pytest.mark.parametrize(
    ("values", "simulator", "may_arm"),
    [
        ({}, True, True),
        ({"feedback_rate_hz": 5.0}, True, True),
        ({"link_url": "udpin://127.0.0.1:14551"}, True, False),
        ({"arming": "never"}, True, False),
        ({"arming": "auto", "link_url": "udpin://127.0.0.1:14551"}, True, True),
        ({}, False, False),
        ({"speed_default_m_s": 1.0}, False, False),
        ({"arming": "auto"}, False, True),
    ],
)
def test_the_server_arms_only_the_simulators_vehicle_or_when_told(
    make_node: MakeNode, values: dict[str, Any], simulator: bool, may_arm: bool
) -> None:
    config = make_config(declare_parameters(make_node(**values), simulator))
    assert config.bridge.goto.may_arm is may_arm


def test_every_parameter_has_a_descriptor_with_its_range(make_node: MakeNode) -> None:
    node = make_node()
    declare_parameters(node, simulator=True)
    for spec in PARAMETERS:
        descriptor = node.describe_parameter(spec.name)
        assert descriptor.description == spec.description
        assert descriptor.read_only is spec.fixed
        ranges = [*descriptor.floating_point_range, *descriptor.integer_range]
        if spec.limits is not None:
            assert (ranges[0].from_value, ranges[0].to_value) == spec.limits
        if spec.choices is not None:
            assert all(choice in descriptor.additional_constraints for choice in spec.choices)


def test_a_whole_number_is_taken_for_a_float(make_node: MakeNode) -> None:
    config = make_config(declare_parameters(make_node(speed_default_m_s=2), simulator=True))
    assert config.bridge.goto.limits.speed_horizontal_m_s == 2.0


@pytest.mark.parametrize(
    ("values", "named"),
    [
        ({"colour": "blue"}, "colour"),
        ({"setpoint_rate_hz": 0.1}, "setpoint_rate_hz"),
        ({"setpoint_rate_hz": "fast"}, "setpoint_rate_hz"),
        ({"target_system": 300}, "target_system"),
        ({"arming": "maybe"}, "arming"),
        ({"vehicles": "a"}, "vehicles"),
        ({"vehicles": ["a", "a"]}, "vehicles"),
        ({"gcs_links": [14550]}, "gcs_links"),
    ],
)
def test_what_cannot_be_used_is_rejected_by_name(
    make_node: MakeNode, values: dict[str, Any], named: str
) -> None:
    with pytest.raises(ConfigurationError, match=named):
        declare_parameters(make_node(**values), simulator=True)


@pytest.mark.parametrize("given", [[], [""], ["a", "b"]])
def test_a_list_of_texts_may_be_empty(make_node: MakeNode, given: list[str]) -> None:
    values = declare_parameters(make_node(vehicles=given), simulator=True)
    assert values["vehicles"] == [name for name in given if name]


@pytest.fixture
def changeable(make_node: MakeNode) -> tuple[Node, list[ServerConfig]]:
    """A node whose parameters may change, and the settings that the changes made."""
    node = make_node()
    applied: list[ServerConfig] = []
    follow_changes(node, declare_parameters(node, simulator=True), applied.append)
    return node, applied


def test_a_change_takes_effect(changeable: tuple[Node, list[ServerConfig]]) -> None:
    node, applied = changeable
    (result,) = node.set_parameters([Parameter("speed_default_m_s", value=1.5)])
    assert result.successful, result.reason
    assert applied[-1].bridge.goto.limits.speed_horizontal_m_s == 1.5
    (result,) = node.set_parameters([Parameter("arrival_radius_m", value=0.8)])
    assert result.successful, result.reason
    assert applied[-1].bridge.goto.limits.speed_horizontal_m_s == 1.5
    assert applied[-1].bridge.goto.arrival_radius_m == 0.8


def test_a_change_that_contradicts_is_rejected_with_the_reason(
    changeable: tuple[Node, list[ServerConfig]],
) -> None:
    node, applied = changeable
    (result,) = node.set_parameters([Parameter("speed_default_m_s", value=20.0)])
    assert not result.successful
    assert "speed_max_m_s" in result.reason
    assert node.get_parameter("speed_default_m_s").value == 3.0
    assert applied == []


@pytest.mark.parametrize("name", [spec.name for spec in PARAMETERS if spec.fixed])
def test_what_is_taken_at_the_start_cannot_change(
    changeable: tuple[Node, list[ServerConfig]], name: str
) -> None:
    node, applied = changeable
    before = node.get_parameter(name).value
    (result,) = node.set_parameters([Parameter(name, value=before)])
    assert not result.successful
    assert "read-only" in result.reason
    assert applied == []


FLEET = """
navigation_server: {ros__parameters: {vehicles: [a, b], arming: auto, speed_default_m_s: 2.0}}
/a/navigation_server: {ros__parameters: {target_system: 1, speed_default_m_s: 1.0}}
b: {navigation_server: {ros__parameters: {target_system: 2, colour: blue}}}
/north/navigation_server: {ros__parameters: {vehicles: [a]}}
/north/a/navigation_server: {ros__parameters: {target_system: 7}}
/wide/navigation_server: {ros__parameters: {record_tlog: own.tlog}}
"""


@pytest.fixture
def make_vehicle(context: rclpy.Context, tmp_path: Path) -> Iterator[MakeNode]:
    """Makes a vehicle's node as a server does that was started with a parameter file."""
    path = tmp_path / "fleet.yaml"
    path.write_text(FLEET, encoding="utf-8")
    nodes: list[Node] = []

    def make(namespace: str, *arguments: str) -> Node:
        argv = ["navigation_server", "--ros-args", *arguments, "--params-file", str(path)]
        nodes.append(
            Node(
                "navigation_server",
                namespace=namespace,
                context=context,
                cli_args=vehicle_arguments(argv),
                use_global_arguments=False,
            )
        )
        return nodes[-1]

    yield make
    for node in nodes:
        node.destroy_node()


SERVER = {spec.name: spec.default for spec in PARAMETERS} | {
    "vehicles": ["a", "b"], "arming": "auto", "speed_default_m_s": 2.0,
}  # fmt: skip


def test_a_vehicle_has_the_servers_values_but_for_its_own(make_vehicle: MakeNode) -> None:
    node = make_vehicle("/a")
    values = declare_vehicle_parameters(node, "a", SERVER)
    assert (values["target_system"], values["speed_default_m_s"]) == (1, 1.0)
    assert values["arming"] == "auto"
    assert node.get_parameter("arming").value == "auto"
    assert not node.has_parameter("vehicles")
    assert make_config(values).vehicle.target_system == 1


def test_what_renames_or_moves_the_server_does_not_make_its_vehicles_one(
    make_vehicle: MakeNode,
) -> None:
    moves = ("-r", "__ns:=/north", "--remap", "__node:=other", "-p", "speed_up_m_s:=2.5")
    node = make_vehicle("/north/a", *moves)
    assert node.get_fully_qualified_name() == "/north/a/navigation_server"
    values = declare_vehicle_parameters(node, "a", SERVER)
    assert (values["target_system"], values["speed_up_m_s"]) == (7, 2.5)


@pytest.mark.parametrize(
    ("namespace", "said"),
    [("/b", "Vehicle b: .*'colour'"), ("/wide", "record_tlog belongs to the server")],
)
def test_a_vehicles_parameter_that_it_cannot_have_is_rejected_by_name(
    make_vehicle: MakeNode, namespace: str, said: str
) -> None:
    with pytest.raises(ConfigurationError, match=said):
        declare_vehicle_parameters(make_vehicle(namespace), namespace.strip("/"), SERVER)


@pytest.mark.parametrize("option", ["--config", "--params-file"])
def test_a_file_without_the_servers_namespace_ends_the_start(tmp_path: Path, option: str) -> None:
    path = tmp_path / "mine.yaml"
    path.write_text("navigation_server:\n  ros__parameters: {arming: auto}\n", encoding="utf-8")
    ros = ["--ros-args", "-r", "__ns:=/l1"]
    own = ["--config", str(path), *ros] if option == "--config" else [*ros, option, str(path)]
    words = ["python", "-m", "drone_navigation.navigation_server", *own]
    server = Process("navigation_server", words, ros_environment(new_domain()))
    try:
        assert server.wait(30.0) == 2, server.text
    finally:
        server.stop()
    sentence = f"{path} sets no parameter of /l1/navigation_server: it has /navigation_server"
    assert sentence in server.text
    assert "link" not in server.text
