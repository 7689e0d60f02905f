"""Parameter files of ``--ros-args --params-file``: a sentence that names the file."""

from __future__ import annotations

from pathlib import Path

import pytest

from navigation_bridge.configuration.make_config import ConfigurationError, check_value
from navigation_bridge.configuration.parameter_file import (
    check_keys,
    check_parameter_files,
    names_of_vehicles,
)


def check(path: Path, *before: str) -> None:
    arguments = ["navigation_server", "--ros-args", *before, "--params-file", str(path)]
    check_parameter_files(arguments, "navigation_server")


def written(folder: Path, node: str, line: str) -> Path:
    path = folder / "mine.yaml"
    path.write_text(f"{node}:\n  ros__parameters:\n    {line}\n", encoding="utf-8")
    return path


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(ConfigurationError, match=r"missing\.yaml: No such file"):
        check(tmp_path / "missing.yaml")


@pytest.mark.parametrize(
    ("line", "sentence"),
    [
        ("armin: never", "There is no parameter 'armin'; did you mean 'arming'?"),
        ("xyzzy: 1", "There is no parameter 'xyzzy'; docs/parameters.md lists them."),
        ("arming: 3", "arming"),
        ("setpoint_rate_hz: fast", "setpoint_rate_hz"),
    ],
)
@pytest.mark.parametrize("node", ["navigation_server", "/**", "/a/navigation_server"])
def test_a_wrong_parameter_is_named_with_its_file(
    tmp_path: Path, node: str, line: str, sentence: str
) -> None:
    path = written(tmp_path, node, line)
    with pytest.raises(ConfigurationError) as error:
        check(path)
    assert str(error.value).startswith(f"{path}: ")
    assert sentence in str(error.value)


@pytest.mark.parametrize(
    ("node", "line"),
    [
        ("navigation_server", "arming: never"),
        ("navigation_server", "use_sim_time: true"),
        ("other_node", "colour: blue"),
    ],
)
def test_valid_parameters_and_those_of_other_nodes_are_accepted(
    tmp_path: Path, node: str, line: str
) -> None:
    check(written(tmp_path, node, line), "-p", "arming:=never")


def test_a_parameter_that_is_set_twice_is_rejected_with_its_line(tmp_path: Path) -> None:
    path = written(tmp_path, "navigation_server", "arming: never\n    arming: auto")
    with pytest.raises(ConfigurationError, match=r"mine\.yaml:4: duplicate key 'arming'"):
        check(path)


def test_the_closest_name_is_suggested() -> None:
    with pytest.raises(ConfigurationError, match=r"did you mean 'speed_default_m_s'\?"):
        check_value("speed_defalt_m_s", 2.0)


def check_for(folder: Path, text: str, *nodes: str) -> None:
    path = folder / "mine.yaml"
    path.write_text(text, encoding="utf-8")
    check_keys(["navigation_server", "--ros-args", "--params-file", str(path)], nodes)


def keyed(*keys: str) -> str:
    return "".join(f"{key}:\n  ros__parameters: {{arming: never}}\n" for key in keys)


@pytest.mark.parametrize(
    ("keys", "node", "words"),
    [
        (
            ["navigation_server"],
            "/l1/navigation_server",
            "has /navigation_server; did you mean /l1",
        ),
        (["/l2/navigation_server"], "/l1/navigation_server", "did you mean /l1/navigation_server?"),
        (["l1/navigation_server"], "/navigation_server", "did you mean /navigation_server?"),
        (["/navigation_sever"], "/navigation_server", "has /navigation_sever; did you mean"),
        (["/*"], "/l1/navigation_server", "sets no parameter of /l1/navigation_server"),
        (["camera"], "/navigation_server", "it has /camera. Put the parameters under '/navigation"),
        ([], "/navigation_server", "sets no parameter of /navigation_server."),
    ],
)
def test_a_file_for_other_nodes_is_rejected_with_the_key_that_matches(
    tmp_path: Path, keys: list[str], node: str, words: str
) -> None:
    with pytest.raises(ConfigurationError) as error:
        check_for(tmp_path, keyed(*keys), node)
    assert words in str(error.value)
    assert f"'{node}:' (or '/**:')" in str(error.value)


@pytest.mark.parametrize(
    ("keys", "nodes"),
    [
        (["/**"], ["/l1/navigation_server"]),
        (["/*"], ["/navigation_server"]),
        (["/*/navigation_server"], ["/l1/navigation_server"]),
        (["/**/navigation_server"], ["/navigation_server"]),
        (["/**/navigation_server"], ["/l1/l2/navigation_server"]),
        (["camera", "navigation_server"], ["/navigation_server"]),
        (["/l2/navigation_server", "/l1/navigation_server"], ["/l1/navigation_server"]),
        (["/l1/a/navigation_server"], ["/l1/navigation_server", "/l1/a/navigation_server"]),
    ],
)
def test_a_file_with_a_key_for_the_server_is_accepted(
    tmp_path: Path, keys: list[str], nodes: list[str]
) -> None:
    check_for(tmp_path, keyed(*keys), *nodes)


def test_a_key_may_be_nested(tmp_path: Path) -> None:
    nested = "l1:\n  navigation_server:\n    ros__parameters: {arming: never}\n"
    check_for(tmp_path, nested, "/l1/navigation_server")


def test_a_vehicle_that_the_server_lacks_is_rejected(tmp_path: Path) -> None:
    text = keyed("/l1/navigation_server", "/l1/b/navigation_server")
    with pytest.raises(ConfigurationError, match="vehicles does not list 'b'"):
        check_for(tmp_path, text, "/l1/navigation_server", "/l1/a/navigation_server")


@pytest.mark.parametrize(
    ("line", "names"),
    [("vehicles: [a, b]", ("a", "b")), ("vehicles: ['']", ()), ("arming: auto", ())],
)
@pytest.mark.parametrize("node", ["navigation_server", "/**", "/north/navigation_server"])
def test_the_vehicles_of_a_file_are_listed_whatever_the_namespace(
    tmp_path: Path, node: str, line: str, names: tuple[str, ...]
) -> None:
    assert names_of_vehicles(written(tmp_path, node, line)) == names
