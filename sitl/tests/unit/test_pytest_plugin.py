"""The fixtures for other people's tests, found by pytest as it finds an installed plugin."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from sitl_support.programs import WAIT_S

SITL = Path(__file__).parents[2]
PAGE = (SITL / "docs/sitl.md").read_text(encoding="utf-8")

OWN_WORLD = """
import pytest
from mavlink_sitl import parse_world

@pytest.fixture
def sitl_world():
    return parse_world("obstacles: [{kind: cylinder, at_m: [5, 0], radius_m: 1, height_m: 9}]")

def test_world(sitl_copter):
    assert len(sitl_copter.world.obstacles) == 1

def test_many(sitl_simulation):
    simulation = sitl_simulation(vehicles=None, seed=3, world=None)
    assert len(simulation.vehicles) == 1
    assert not simulation.world.obstacles

@pytest.fixture
def sitl_tick_s():
    return 0.05

def test_ticks(sitl_copter):
    from_s = sitl_copter.time_s
    assert sitl_copter.run_until(lambda: sitl_copter.time_s > from_s, 1.0)
    assert abs(sitl_copter.time_s - from_s - 0.05) < 1e-6

def test_kinds(sitl_rover, sitl_boat):
    assert sitl_rover.truth.on_ground.all()
    assert sitl_boat.time_s > 0.0
"""

OWN_SOCKET = """
import socket
from pymavlink.dialects.v20 import all as mav

def test_socket(sitl_udp_copter):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sock:
        sock.bind(("127.0.0.1", sitl_udp_copter.port))
        sock.settimeout(200)
        message = mav.MAVLink(None).parse_buffer(sock.recv(300))[0]
    assert message.get_srcSystem() == 1
"""

UNDISTURBED = """
import sys

def test_nothing_is_loaded(pytestconfig):
    assert pytestconfig.pluginmanager.hasplugin("mavlink_sitl")
    assert "mavlink_sitl" not in sys.modules
    assert "numpy" not in sys.modules
"""


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the metadata that an installation of the package would have."""
    base = tmp_path_factory.mktemp("metadata")
    command = [sys.executable, "setup.py", "--quiet", "egg_info", "--egg-base", str(base)]
    subprocess.run(command, cwd=SITL, check=True, timeout=WAIT_S, capture_output=True)
    return base


def run(tests: dict[str, str], installed: Path, folder: Path) -> str:
    """Return what pytest says of test files in an empty folder."""
    for name, text in tests.items():
        (folder / f"test_{name}.py").write_text(text, encoding="utf-8")
    path = os.pathsep.join([str(installed), str(SITL)])
    environment = {**os.environ, "PYTHONPATH": path}
    environment.pop("PYTEST_DISABLE_PLUGIN_AUTOLOAD", None)
    command = [sys.executable, "-m", "pytest", "-v", "-W", "error", "-p", "no:cacheprovider"]
    done = subprocess.run(
        [*command, "-p", "no:launch_testing", "-p", "no:launch_ros", "."],
        cwd=folder,
        env=environment,
        timeout=WAIT_S,
        capture_output=True,
        text=True,
        check=False,
    )
    return done.stdout + done.stderr


def example() -> str:
    blocks: list[str] = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    (test,) = (block for block in blocks if "def test_" in block)
    return test


@pytest.fixture(scope="module")
def said(installed: Path, tmp_path_factory: pytest.TempPathFactory) -> str:
    """The output of pytest for all tests that use fixtures; one start of it takes two seconds."""
    broken = example().replace("NAV_TAKEOFF", "NAV_LOITER_UNLIM")
    tests = {"example": example(), "broken": broken, "world": OWN_WORLD, "socket": OWN_SOCKET}
    return run(tests, installed, tmp_path_factory.mktemp("theirs"))


def results(said: str, name: str) -> list[str]:
    """Return the results of the tests of a file."""
    return re.findall(rf"^test_{name}\.py::\S+ (\w+)", said, re.MULTILINE)


@pytest.mark.night
def test_the_example_of_the_documentation_passes(said: str) -> None:
    assert results(said, "example") == ["PASSED"], said


def test_the_example_would_notice_a_vehicle_that_stays(said: str) -> None:
    assert results(said, "broken") == ["FAILED"], said


def test_fixtures_can_be_given_another_world_and_tick(said: str) -> None:
    assert results(said, "world") == ["PASSED"] * 4, said


def test_a_copter_on_a_socket(said: str) -> None:
    assert results(said, "socket") == ["PASSED"], said


def test_who_does_not_use_it_is_not_disturbed(installed: Path, tmp_path: Path) -> None:
    said = run({"undisturbed": UNDISTURBED}, installed, tmp_path)
    assert results(said, "undisturbed") == ["PASSED"], said


def test_every_fixture_is_documented() -> None:
    source = (SITL / "pytest_mavlink_sitl.py").read_text(encoding="utf-8")
    fixtures = re.findall(r"@pytest\.fixture\ndef (\w+)", source)
    assert len(fixtures) >= 5
    for name in fixtures:
        assert f"`{name}`" in PAGE, name
