"""`colcon build` of `src` and `sitl` beside a sourced ROS, without `make`.

No machine of the tests has ROS from apt. Its wheels stand for it: entered as `setup.bash` of a ROS
enters one, with the packages that a ROS has and the wheels lack, which colcon builds below.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import pytest

from drone_navigation.processes import free_udp_port
from tests.support.processes import Process
from tests.support.ros.ros_flight import FLIGHT_TIMEOUT_S, READY_TIMEOUT_S, new_domain
from tests.unit.test_environment import ROS_KIND, load_set_up

pytestmark = [pytest.mark.night, pytest.mark.timeout(2400)]
ROOT = Path(__file__).resolve().parents[2]
COLCON = Path(sys.executable).with_name("colcon")
OF_ROS = ("geographic_msgs", "tf2_msgs")


@pytest.fixture(scope="module")
def ros(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """The environment of a shell that has sourced a ROS: wheels, and what ROS has besides."""
    if ROS_KIND == "system":
        pytest.skip("there is a sourced ROS, which colcon builds on by itself")
    setup_environment = load_set_up()
    folder = tmp_path_factory.mktemp("ros")
    tools = folder / "ros"
    command = [setup_environment.base_interpreter(), "-m", "venv", "--without-pip", str(tools)]
    subprocess.run(command, check=True)
    for layer in ("", "build"):
        setup_environment.install_lock(setup_environment.lock_of(ROS_KIND, layer), tools)
    setup_environment.mend_cmake_files(tools)
    entered = setup_environment.base_environment(ROS_KIND, tools)
    entered |= {"PYTHONPATH": str(setup_environment.site_packages(tools)), "ROS_VERSION": "2"}
    for name in OF_ROS:
        ignored = shutil.ignore_patterns("COLCON_IGNORE")
        shutil.copytree(ROOT / "src" / name, folder / "src" / name, ignore=ignored)
    return sourced(build(folder, [folder / "src"], entered), entered)


def build(folder: Path, sources: list[Path], environment: dict[str, str]) -> Path:
    """Build packages by colcon; return the folder that they are installed in."""
    words: list[str | Path] = [COLCON, "--log-base", folder / "log", "build"]
    words += ["--base-paths", *sources, "--build-base", folder / "build"]
    words += ["--install-base", folder / "install", "--executor", "sequential"]
    # As the set-up compiles them, in a tenth of the time.
    one_unit = ROOT / "scripts/interfaces/one_unit.cmake"
    words += ["--cmake-args", "-G", "Ninja", f"-DCMAKE_PROJECT_INCLUDE={one_unit}"]
    done = subprocess.run(
        list(map(str, words)), env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]
    return folder / "install"


def sourced(install: Path, environment: dict[str, str]) -> dict[str, str]:
    """The environment after `. install/setup.bash`."""
    script = f". {install}/setup.bash && env -0"
    done = subprocess.run(
        ["bash", "-c", script], env=environment, capture_output=True, text=True, check=True
    )
    return dict(entry.split("=", 1) for entry in done.stdout.split("\0") if entry)


def our_packages() -> set[str]:
    """The packages of `src` and `sitl` that are not ROS's own."""
    files = [*ROOT.glob("src/*/package.xml"), ROOT / "sitl/package.xml"]
    ours = [path for path in files if not path.with_name("COLCON_IGNORE").exists()]
    return {ElementTree.parse(path).findtext("name", "") for path in ours}


def test_a_workspace_built_by_colcon_has_all_packages_and_a_goal_is_flown_with_it(
    ros: dict[str, str], tmp_path: Path
) -> None:
    install = build(tmp_path, [ROOT / "src", ROOT / "sitl"], ros)
    assert {path.name for path in install.glob("*/") if (path / "share").is_dir()} == our_packages()
    entered = sourced(install, ros) | {
        "ROS_DOMAIN_ID": str(new_domain()),
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
    }
    for module in ("custom_interfaces.action", "drone_navigation", "navigation_kernels"):
        where = f"import {module} as m; print(m.__file__)"
        done = subprocess.run(
            ["python", "-c", where], env=entered, capture_output=True, text=True, check=True
        )
        assert str(tmp_path) in done.stdout
    port = free_udp_port()
    commands = install / "drone_navigation/lib/drone_navigation"
    copter = ["python", "-m", "mavlink_sitl", "--link", f"udpout://127.0.0.1:{port}"]
    server = [str(commands / "navigation_server"), "--link", f"udpin://127.0.0.1:{port}"]
    started = [
        Process("sitl", [*copter, "--ready-after", "1"], entered),
        Process("server", [*server, "--arming", "auto"], entered),
    ]
    try:
        started[1].wait_for("Position valid", READY_TIMEOUT_S)
        goal = [str(commands / "navigation_client"), "--goal", "3", "0", "3"]
        started.append(Process("client", goal, entered))
        assert started[2].wait(FLIGHT_TIMEOUT_S) == 0, started[2].text
        assert started[1].stop() == 0
    finally:
        for process in started:
            process.stop()
