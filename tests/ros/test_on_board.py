"""The server as systemd and a container start it: stopped, killed, and started again."""

from __future__ import annotations

import json
import os
import re
import shlex
import signal
import subprocess
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from drone_navigation.processes import free_udp_port
from mavlink_vehicle.io.tlog import TlogReader
from tests.support.processes import HANGS_AFTER_S, Process, patient_s
from tests.support.ros.ros_flight import new_domain
from tests.unit.test_on_board import INSTALLED, step, the, unit

pytestmark = [pytest.mark.wide, pytest.mark.xdist_group("ros_on_board")]

ROOT = Path(__file__).resolve().parents[2]
SET_UP = ROOT / "bridge_config/real/ardupilot_copter.yaml"
READY_S = 60.0


@pytest.fixture
def stack() -> Iterator[ExitStack]:
    with ExitStack() as stack:
        yield stack


def environment() -> dict[str, str]:
    """Return what systemd gives a service, and a domain of its own."""
    own = dict(line.split("=", 1) for line in unit()[("Service", "Environment")])
    return {**own, "PATH": os.defpath, "ROS_DOMAIN_ID": str(new_domain())}


def command(folder: Path, port: int) -> list[str]:
    """Return the command of the unit with the paths of this place."""
    config = folder / "vehicle.yaml"
    text = SET_UP.read_text("utf-8")
    link = f'link_url: "udpin://127.0.0.1:{port}"'
    config.write_text(re.sub(r"^    link_url: .*", f"    {link}", text, flags=re.MULTILINE))
    script = the("ExecStart").replace(INSTALLED, str(ROOT))
    return shlex.split(script.replace("/etc/mavbridge/vehicle.yaml", str(config)))


def started(stack: ExitStack, words: list[str], folder: Path, names: dict[str, str]) -> Process:
    names = {**names, "HOME": str(folder)}
    inside = ["env", "-i", "-C", str(folder), *(f"{k}={v}" for k, v in names.items()), *words]
    process = Process("server", inside, {**os.environ})
    stack.callback(process.stop)
    return process


def test_a_killed_server_is_started_again_and_keeps_both_recordings(
    stack: ExitStack, tmp_path: Path
) -> None:
    port, names = free_udp_port(), environment()
    words = command(tmp_path, port)
    link = f"udpout://127.0.0.1:{port}"
    simulator = Process("simulator", ["python", "-m", "mavlink_sitl", "--link", link, "--quiet"])
    stack.callback(simulator.stop)
    for number in (signal.SIGKILL, signal.SIGTERM):
        server = started(stack, words, tmp_path, names)
        server.wait_for("Position valid", READY_S)
        server.signal(number)
        assert server.wait(patient_s(5.0)) == (-9 if number is signal.SIGKILL else 0)
        assert "Traceback" not in server.text
    recordings = sorted(tmp_path.glob("flight-*.tlog"))
    assert [path.name for path in recordings] == ["flight-000001.tlog", "flight-000002.tlog"]
    assert all(list(TlogReader(path)) for path in recordings)
    # The journal has the log; ROS writes none.
    assert not list(tmp_path.glob(".ros/log/**/*.log"))


def test_a_setting_that_cannot_be_used_ends_the_service_for_good(
    stack: ExitStack, tmp_path: Path
) -> None:
    words = command(tmp_path, free_udp_port())
    path = tmp_path / "vehicle.yaml"
    path.write_text(path.read_text("utf-8").replace("arming: never", "arming: perhaps"))
    server = started(stack, words, tmp_path, environment())
    assert server.wait(READY_S) == int(the("RestartPreventExitStatus"))
    assert "arming" in server.text
    assert "Traceback" not in server.text


def test_a_device_that_is_missing_is_waited_for(stack: ExitStack, tmp_path: Path) -> None:
    words = command(tmp_path, 0)
    path = tmp_path / "vehicle.yaml"
    path.write_text(
        path.read_text("utf-8").replace("udpin://127.0.0.1:0", "serial:///dev/autopilot")
    )
    server = started(stack, words, tmp_path, environment())
    server.wait_for("/dev/autopilot:57600: no such device; retrying.", READY_S)
    server.wait_for("Navigation server waiting for link", READY_S)
    server.signal(signal.SIGTERM)
    assert server.wait(patient_s(5.0)) == 0


def test_the_entry_of_the_image_starts_what_it_is_given() -> None:
    shell, option, script = json.loads(step("ENTRYPOINT"))
    words = [shell, option, script.replace(INSTALLED, str(ROOT)), "navigation_server", "--version"]
    done = subprocess.run(
        ["env", "-i", f"PATH={os.defpath}", *words],
        capture_output=True, text=True, timeout=HANGS_AFTER_S, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert re.search(r"\d+\.\d+\.\d+", done.stdout)
