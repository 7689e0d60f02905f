"""Parameter files of ``--ros-args --params-file``: a sentence that names the file."""

from __future__ import annotations

from pathlib import Path

import pytest

from navigation_bridge.configuration.parameter_file import check_parameter_files
from navigation_bridge.configuration.parameter_values import ConfigurationError, check_value


def check(path: Path, *before: str) -> None:
    arguments = ["navigation_server", "--ros-args", *before, "--params-file", str(path)]
    check_parameter_files(arguments, "navigation_server")


def written(folder: Path, node: str, line: str) -> Path:
    path = folder / "mine.yaml"
    path.write_text(f"{node}:\n  ros__parameters:\n    {line}\n", encoding="utf-8")
    return path


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(ConfigurationError, match=r"Cannot read .*missing\.yaml: No such file"):
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


def test_the_closest_name_is_suggested() -> None:
    with pytest.raises(ConfigurationError, match=r"did you mean 'speed_default_m_s'\?"):
        check_value("speed_defalt_m_s", 2.0)
