"""A server loads what searches for paths need once there is something to avoid."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from drone_navigation.processes import free_udp_port, ros_environment
from tests.support.processes import Process, patient_s
from tests.support.ros.ros_flight import READY_TIMEOUT_S, new_domain

pytestmark = [pytest.mark.wide, pytest.mark.xdist_group("ros_demo")]

OBSTACLES = """
frame: map
obstacles:
  - {kind: cylinder, name: mast, at_m: [20.0, 0.0], radius_m: 0.5, height_m: 10.0}
"""
_SERVER = ["python", "-m", "drone_navigation.navigation_server", "--arming", "auto", "--link"]


@pytest.fixture
def started() -> Iterator[list[Process]]:
    processes: list[Process] = []
    yield processes
    for process in processes:
        process.stop()


def server(started: list[Process], *parameters: str) -> Process:
    link = f"udpin://127.0.0.1:{free_udp_port()}"
    words = [*_SERVER, link, *(["--ros-args", *parameters] if parameters else [])]
    started.append(Process("server", words, ros_environment(new_domain())))
    return started[-1]


def has_loaded_scipy(process: Process) -> bool:
    return "/scipy/spatial/" in Path(f"/proc/{process.pid}/maps").read_text("utf-8")


def test_scipy_is_loaded_once_there_is_something_to_avoid(
    started: list[Process], tmp_path: Path
) -> None:
    file = tmp_path / "obstacles.yaml"
    file.write_text(OBSTACLES)
    nothing_to_avoid = server(started)
    nothing_to_avoid.wait_for("ready on", READY_TIMEOUT_S)
    avoids = server(started, "-p", f"obstacles_file:={file}")
    avoids.wait_for("ready on", READY_TIMEOUT_S)
    limit_s = time.monotonic() + patient_s(20.0)
    while not has_loaded_scipy(avoids):
        assert time.monotonic() < limit_s, "what searches need was not loaded"
        time.sleep(0.05)
    assert not has_loaded_scipy(nothing_to_avoid)
