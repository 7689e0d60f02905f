"""Each command in a code block of the documentation runs, shortly.

A client finds no server and says so, a server and a simulator start and are stopped, and what
reads files reads small ones, to its end.
"""

from __future__ import annotations

import json
import os
import re
import shlex
import shutil
import subprocess
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest
import yaml

from custom_interfaces.action import FollowVelocity
from drone_navigation.check.this_computer import ROW_HEAD
from drone_navigation.processes import Process, free_udp_port, ros_environment
from tests.support.logs.firmware_logs import ardupilot_log
from tests.support.logs.recordings import SMALL
from tests.support.ros.ros_flight import new_domain

ROOT = Path(__file__).resolve().parents[2]
PAGES = sorted(
    [
        ROOT / "README.md", ROOT / "CONTRIBUTING.md", *ROOT.glob("docs/**/*.md"),
        *ROOT.glob("sitl/docs/*.md"),
    ]
)  # fmt: skip
TARGETS = re.findall(r"^([a-z0-9-]+):", (ROOT / "Makefile").read_text("utf-8"), re.MULTILINE)
OWN_PORTS = ("14540", "14550", "14551", "14560", "5760")
NO_SERVER, USAGE, REJECTED = 5, 2, 3
LIMIT_S = 300.0
pytestmark = [
    pytest.mark.wide,
    pytest.mark.by_day,
    pytest.mark.xdist_group("shown_commands"),
    pytest.mark.timeout(900),
]

AT_NIGHT = ("python -m flight_reports.flight_video", "python -m tests.fleets --seeds")
"""Those that keep the processors busy for a minute or more"""

NOT_RUN = {
    "(cd /opt": "it would change this machine",
    ". /opt/ros": "it needs a full ROS 2 installation",
    ". install/setup.bash": "it needs a workspace that colcon has built",
    "colcon build": "it needs a full ROS 2 installation",
    "cp -a . /opt": "it would change this machine",
    "docker ": "it needs a Docker daemon",
    "git clone": "it needs the network",
    "journalctl": "it needs systemd",
    "ls -l /dev/autopilot": "it needs an autopilot",
    "navigation_server --config /etc": "it needs a vehicle that is set up",
    "mkdir wheels": "it needs a wheel of a release",
    "python3 -m venv old": "it installs from the network",
    "python3 -m pip install": "it installs from the network",
    "python -m interop.autotest": "it needs a clone of ArduPilot",
    "python -m interop.dronekit_suite": "it needs a clone of DroneKit",
    "python -m interop.mavsdk_examples": "it needs a clone of MAVSDK-Python",
    "ros2 launch": "it needs a full ROS 2 installation",
    "ros2 run teleop_twist_keyboard": "it needs a full ROS 2 installation",
    "rosdep install": "it would change this machine",
    "rviz2": "it needs a full ROS 2 installation",
    "sudo ": "it would change this machine",
}
"""Commands that are not run, and why."""

LAT, LON = -35.3632621, 149.1652374
PLAN = {
    "fileType": "Plan",
    "version": 1,
    "groundStation": "QGroundControl",
    "mission": {
        "version": 2, "firmwareType": 3, "vehicleType": 2, "cruiseSpeed": 15, "hoverSpeed": 5,
        "plannedHomePosition": [LAT, LON, 584],
        "items": [
            {"type": "SimpleItem", "autoContinue": True, "command": 16, "doJumpId": number,
             "frame": 3, "params": [0, 0, 0, None, LAT + 1e-4 * number, LON, 10]}
            for number in (1, 2)
        ],
    },
    "geoFence": {
        "version": 2, "polygons": [],
        "circles": [{"version": 1, "inclusion": True,
                     "circle": {"center": [LAT, LON], "radius": 100}}],
    },
    "rallyPoints": {"version": 2, "points": []},
}  # fmt: skip


@dataclass(frozen=True)
class Place:
    """A folder with what the commands read, and ports of its own instead of the usual ones."""

    folder: Path
    ports: dict[str, str]
    environment: dict[str, str]

    def with_own_ports(self, text: str) -> str:
        """Put the ports of this place into a command or a file; keep to this machine."""
        pattern = "|".join(self.ports)
        text = re.sub(rf"\b({pattern})\b", lambda found: self.ports[found[0]], text)
        return text.replace("0.0.0.0", "127.0.0.1")

    def process(self, *words: str) -> Process:
        script = f"cd {shlex.quote(str(self.folder))} && exec {shlex.join(words)}"
        return Process(words[0], ["bash", "-c", script], self.environment)

    def run(self, *words: str) -> tuple[int, str]:
        """Run it to its end; return its exit code and what it printed."""
        process = self.process(*words)
        try:
            code = process.wait(LIMIT_S)
        finally:
            process.stop()
        assert "Traceback" not in process.text, process.text
        return code, process.text

    def succeeds(self, *words: str) -> None:
        code, text = self.run(*words)
        assert code == 0, text

    def starts(self, sign: str, *words: str) -> None:
        """Start what runs until it is stopped, and stop it."""
        process = self.process(*words)
        try:
            process.wait_for(sign, LIMIT_S)
        finally:
            process.stop(30.0)
        assert "Traceback" not in process.text, process.text


@pytest.fixture(scope="module")
def domain() -> int:
    """The ROS domain of all commands: they run one after the other, and there are 101 domains."""
    return new_domain()


@pytest.fixture
def place(tmp_path: Path, domain: int) -> Place:
    environment = ros_environment(domain)
    environment["PYTHONPATH"] = f"{ROOT}:{environment.get('PYTHONPATH', '')}"
    place = Place(tmp_path, {port: str(free_udp_port()) for port in OWN_PORTS}, environment)
    shutil.copytree(ROOT / "bridge_config", tmp_path / "bridge_config")
    for path in (tmp_path / "bridge_config").rglob("*.yaml"):
        path.write_text(place.with_own_ports(path.read_text("utf-8")), "utf-8")
    shutil.copy(
        tmp_path / "bridge_config/simulated/ardupilot_copter.yaml", tmp_path / "my_vehicle.yaml"
    )
    for name in ("flights", "pictures", "films", "pages"):
        (tmp_path / name).mkdir()
    recording = ROOT / "tests/data/copter_lowbatt.tlog"
    for name in ("flight", "my", "before", "after", "flights/a", "flights/b"):
        shutil.copy(recording, tmp_path / f"{name}.tlog")
    shutil.copy(SMALL / "multi_udp.tlog", tmp_path / "fleet.tlog")
    log = ardupilot_log("4.5").data
    for name in ("00000007.BIN", "vehicle1_log7_20261123T063631Z.bin"):
        (tmp_path / name).write_bytes(log)
    (tmp_path / "my.plan").write_text(json.dumps(PLAN), "utf-8")
    shown_files = blocks(ROOT / "docs/programs.md", "yaml")
    (rules,) = [each for each in shown_files if each.startswith("agents:")]
    (tmp_path / "agents.yaml").write_text(rules, "utf-8")
    grid = "ncols 20\nnrows 20\nxllcorner -20\nyllcorner -20\ncellsize 5\n" + 400 * "0 "
    (tmp_path / "hill.asc").write_text(grid, "utf-8")
    (tmp_path / "some.parm").write_text("WPNAV_SPEED 500\n", "utf-8")
    (tmp_path / "signing.key").write_text(64 * "1", "utf-8")
    (tmp_path / "goals.yaml").write_text(blocks(ROOT / "docs/logs.md", "yaml")[0], "utf-8")
    return place


def blocks(page: Path, *languages: str) -> list[str]:
    """Return the code blocks of a page in some languages."""
    found = re.findall(r"^```(\w*)\n(.*?)^```", page.read_text("utf-8"), re.MULTILINE | re.DOTALL)
    return [block for language, block in found if language in languages]


def shown() -> list[object]:
    """Return each command, with the page that shows it."""
    commands: dict[str, str] = {}
    for page in PAGES:
        for block in blocks(page, "", "bash"):
            for line in re.sub(r"\\\n\s*", "", block).splitlines():
                command = re.sub(r"(^|\s+)#.*", "", line).strip()
                commands.setdefault(command.removeprefix("scripts/run "), page.name)
    commands.pop("", None)
    return [
        pytest.param(
            line,
            id=f"{page}: {line[:60]}",
            marks=[pytest.mark.night] * line.startswith(AT_NIGHT),
        )
        for line, page in commands.items()
    ]


def client(place: Place, *words: str) -> None:
    code, text = place.run(*words, "--server-timeout", "1")
    assert code == NO_SERVER, text
    assert "start navigation_server" in text


def server(place: Place, *words: str) -> None:
    own, _, of_ros = (shlex.join(words)).partition(" --ros-args")
    words = tuple(shlex.split(own))
    if not {"--link", "--config"} & set(words):
        words += ("--link", f"udpin://127.0.0.1:{place.ports['14550']}")
    if "--check" in words:  # no vehicle is there
        _, text = place.run(*words, "--timeout", "1")
        assert "No vehicle was found" in text, text
        assert ("This computer" in text) is ("--no-computer" not in words), text
    elif "--computer-row" in words:
        code, text = place.run(*words)
        assert code == 0, text
        assert ROW_HEAD in text
    elif "--shadow-goals" in words:
        code, text = place.run(*words)
        assert code != USAGE, text
    else:
        place.starts(
            "Navigation server ", *words, *shlex.split("--ros-args" + of_ros if of_ros else "")
        )


def simulator(place: Place, *words: str) -> None:
    if "--link" not in " ".join(words):
        words += ("--link", f"udpout://127.0.0.1:{place.ports['14550']}")
    place.starts(": ready", *words)


def goal(place: Place, *words: str) -> None:
    """Give the values to the server that reads them as ros2 does, without a vehicle."""
    action, _, values = words[3:6]
    if action == "/follow_velocity":  # no recording has the velocities that it follows
        FollowVelocity.Goal(**yaml.safe_load(values))
        return
    goals = {"goals": [{"at_s": 5.0, "action": action.strip("/"), "goal": yaml.safe_load(values)}]}
    (place.folder / "shown.yaml").write_text(yaml.safe_dump(goals), "utf-8")
    link = ("--link", "tlog:flight.tlog")
    code, text = place.run("navigation_server", *link, "--shadow-goals", "shown.yaml")
    assert code != USAGE, text
    assert action.strip("/") in text, text


def target(_: Place, *words: str) -> None:
    """That it runs is what test_make_targets.py tests."""
    assert words[1] in TARGETS
    done = subprocess.run(
        ["make", "-n", *words[1:]], cwd=ROOT, capture_output=True, text=True, timeout=60,
        check=False,
        env={name: value for name, value in os.environ.items() if not name.startswith("MAKE")},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr


def in_shell(place: Place, *words: str) -> None:
    line = " ".join(words)
    if line.startswith("source setup.bash"):
        line = f"cd {shlex.quote(str(ROOT))} && {line}"
    place.succeeds("bash", "-euc", line)


def fleets(place: Place, *words: str) -> None:
    few = [
        "1" if before == "--seeds" else word
        for before, word in zip(("", *words), words, strict=False)
    ]
    place.succeeds(*few, "--count", "3", "--workers", "1")


def bench(place: Place, *words: str) -> None:
    """That each file runs is what test_short_forms.py tests."""
    script = str(ROOT / "tests/bench/run.py")
    if "--only" not in words:
        words += ("--only", "traffic")
    place.succeeds("python", script, *words[2:], "--short", "--output", "bench.json")


def whole(place: Place, *words: str) -> None:
    globbed = [
        name
        for word in words
        for name in (sorted(str(p) for p in place.folder.glob(word)) if "*" in word else [word])
    ]
    place.succeeds(*globbed)


def agents(place: Place, *words: str) -> None:
    """No agent has a token, and nothing waits."""
    code, text = place.run(*words)
    assert code == {"serve": USAGE, "proposals": 0}.get(words[1], REJECTED), text
    assert ("has the token" if words[1] == "serve" else "waits.") in text


def without_a_topic(place: Place, *words: str) -> None:
    code, text = place.run(*words)
    assert code == 1
    assert "Could not determine the type" in text, text


def until_stopped(place: Place, *words: str) -> None:
    place.starts("", *words)


HOW: dict[str, Callable[..., None]] = {
    "navigation_client": client,
    "navigation_server": server,
    "navigation_mcp": agents,
    "navigation_nav2": until_stopped,
    "navigation_target": until_stopped,
    "navigation_report": whole,
    "tlog_export": whole,
    "tlog2mcap": whole,
    "python -m flight_reports": whole,
    "python -m mavlink_sitl": simulator,
    "python -m tests.fleets": fleets,
    "python tests/bench/run.py": bench,
    "ros2 action send_goal": goal,
    "ros2 action list": whole,
    "ros2 action info": whole,
    "ros2 service call": until_stopped,
    "ros2 topic echo": without_a_topic,
    "ros2 run drone_navigation navigation_server": server,
    "ros2 run mavbridge_trees": until_stopped,
    "make": target,
    "source": in_shell,
    "export": in_shell,
    "(": in_shell,
}
"""How a command that begins so is run."""


@pytest.mark.parametrize("line", shown())
def test_a_command_of_the_documentation_runs(place: Place, line: str) -> None:
    for beginning, reason in NOT_RUN.items():
        if line.startswith(beginning):
            pytest.skip(f"{line}: {reason}")
    ways = [how for beginning, how in HOW.items() if line.startswith(beginning)]
    assert len(ways) == 1, f"Say how this runs shortly, or call the block text: {line}"
    (how,) = ways
    given = place.with_own_ports(line)
    how(place, *(given.split(" ") if how is in_shell else shlex.split(given)))
