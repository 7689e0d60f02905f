"""A middleware or a keystore that is not there is one sentence, before rclpy is imported."""

from __future__ import annotations

import importlib.util
import os
import subprocess
import sys
from pathlib import Path

import pytest

from drone_navigation.process_control.middleware import middleware_problem
from drone_navigation.process_control.quiet_start import PROGRAMS
from tests.support.processes import HANGS_AFTER_S

NEEDS_NAV2 = pytest.mark.skipif(
    importlib.util.find_spec("nav2_msgs") is None, reason="make setup-nav2 builds it"
)
ENFORCED = {"ROS_SECURITY_ENABLE": "true", "ROS_SECURITY_STRATEGY": "Enforce"}


def test_what_is_there_is_taken(tmp_path: Path) -> None:
    assert middleware_problem(os.environ) is None
    assert middleware_problem({**os.environ, "RMW_IMPLEMENTATION": "rmw_fastrtps_cpp"}) is None
    (tmp_path / "enclaves").mkdir()
    assert middleware_problem({**ENFORCED, "ROS_SECURITY_KEYSTORE": str(tmp_path)}) is None
    assert middleware_problem({**ENFORCED, "ROS_SECURITY_STRATEGY": "Permissive"}) is None


def test_a_middleware_of_another_folder_of_ros_is_found(tmp_path: Path) -> None:
    index = tmp_path / "share/ament_index/resource_index/rmw_typesupport"
    index.mkdir(parents=True)
    (index / "rmw_zenoh_cpp").touch()
    variables = dict(os.environ, RMW_IMPLEMENTATION="rmw_zenoh_cpp")
    assert "this ROS has rmw_fastrtps_cpp" in (middleware_problem(variables) or "")
    variables["AMENT_PREFIX_PATH"] = f"{tmp_path}:{os.environ['AMENT_PREFIX_PATH']}"
    assert middleware_problem(variables) is None


@pytest.mark.parametrize("program", sorted(PROGRAMS))
@pytest.mark.parametrize(
    ("variables", "said"),
    [
        (
            {"RMW_IMPLEMENTATION": "rmw_absent_cpp"},
            "RMW_IMPLEMENTATION is 'rmw_absent_cpp', but this ROS has rmw_fastrtps_cpp",
        ),
        (ENFORCED, "ROS_SECURITY_STRATEGY is 'Enforce', but ROS_SECURITY_KEYSTORE is not set"),
        ({**ENFORCED, "ROS_SECURITY_KEYSTORE": "/nowhere"}, "'/nowhere' has no folder enclaves"),
    ],
)
def test_each_program_ends_with_the_sentence(
    program: str, variables: dict[str, str], said: str
) -> None:
    module = {"ros2": "ros2_command", "navigation_mcp": "agents.navigation_mcp"}.get(
        program, program
    )
    script = f"import sys; sys.argv[0] = {program!r}; import drone_navigation.{module}"
    done = subprocess.run(
        [sys.executable, "-c", script], env={**os.environ, **variables}, capture_output=True,
        text=True, timeout=HANGS_AFTER_S, check=False,
    )  # fmt: skip
    assert done.returncode == 2, done.stderr
    assert said in done.stderr
    assert len(done.stderr.splitlines()) == 1


@pytest.mark.parametrize(
    "command",
    [
        ["navigation_server"],
        pytest.param(["navigation_client", "status"], marks=pytest.mark.wide),
        pytest.param(["navigation_console"], marks=pytest.mark.wide),
        pytest.param(["navigation_target"], marks=pytest.mark.wide),
        pytest.param(["navigation_nav2"], marks=[pytest.mark.wide, NEEDS_NAV2]),
        pytest.param(["ros2", "node", "list"], marks=pytest.mark.wide),
    ],
    ids=lambda command: command[0],
)
def test_an_enclave_that_the_middleware_cannot_use_is_one_sentence(
    command: list[str], tmp_path: Path
) -> None:
    # It has no certificates; the wheels' Fast DDS has no security either.
    (tmp_path / "enclaves").mkdir()
    keystore = {**ENFORCED, "ROS_SECURITY_KEYSTORE": str(tmp_path)}
    done = subprocess.run(
        command, env={**os.environ, **keystore}, capture_output=True, text=True,
        timeout=HANGS_AFTER_S, check=False,
    )  # fmt: skip
    assert done.returncode == 2, done.stderr
    assert "Traceback" not in done.stderr
    (said,) = (line for line in done.stderr.splitlines() if line.startswith(command[0]))
    assert said.startswith(f"{command[0]}: ROS cannot start: ")
    assert "a keystore is for the ROS_DOMAIN_ID it was made with" in said
