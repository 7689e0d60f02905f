"""Rules of the house that no import contract holds: folders and class names."""

from __future__ import annotations

import ast
import re
from collections import Counter, defaultdict
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

import mavlink_sitl

pytestmark = pytest.mark.xdist_group("test_house")  # it parses each module once

ROOT = Path(__file__).parents[2]
PRODUCT = sorted([*ROOT.glob("src/*/**/*.py"), *ROOT.glob("sitl/mavlink_sitl/**/*.py")])
MODULES_MAX = 15
"""Modules of one folder, without ``__init__``."""
LINES_MAX, METHODS_MAX = 300, 25
"""Of a class of the product; the simulator is a project of its own."""


def _name(file: Path) -> str:
    return file.relative_to(ROOT).as_posix()


@cache
def _parsed(file: Path) -> ast.Module:
    return ast.parse(file.read_text())


@pytest.fixture(autouse=True, scope="module")
def forget_the_trees() -> Iterator[None]:
    """A million nodes would make each later collection of the process take a second."""
    yield
    _parsed.cache_clear()


def test_the_product_is_found() -> None:
    assert len(PRODUCT) > 500


def test_no_folder_grows_past_fifteen_modules() -> None:
    modules = Counter(_name(file.parent) for file in PRODUCT if file.name != "__init__.py")
    assert {folder: n for folder, n in modules.items() if n > MODULES_MAX} == {}


def test_a_class_fits_on_a_few_pages() -> None:
    files = [file for file in PRODUCT if file.is_relative_to(ROOT / "src")]
    large = {}
    for file in files:
        for node in ast.walk(_parsed(file)):
            if isinstance(node, ast.ClassDef) and node.end_lineno is not None:
                lines = node.end_lineno - node.lineno + 1
                methods = sum(isinstance(part, ast.FunctionDef) for part in node.body)
                if lines > LINES_MAX or methods > METHODS_MAX:
                    large[node.name] = (lines, methods)
    assert large == {}


def test_a_class_name_has_one_meaning_in_src() -> None:
    homes: dict[str, list[str]] = defaultdict(list)
    for file in PRODUCT:
        if file.is_relative_to(ROOT / "src"):
            for node in ast.walk(_parsed(file)):
                if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                    homes[node.name].append(_name(file))
    assert {name: files for name, files in homes.items() if len(files) > 1} == {}


# The simulator in sitl/ is a project of its own: it knows nothing of the bridge, and the bridge
# uses what a user of the simulator would.
OTHERS = {path.name for path in (ROOT / "src").iterdir()} | {"tests"}
SITL = {
    "comparison",
    "interop",
    "mavlink_sitl",
    "pytest_mavlink_sitl",
    "recordings",
    "sitl_support",
    "unit",
}
"""Packages of its folder."""
PUBLIC_MODULES = {"mavlink_sitl", "pytest_mavlink_sitl"}
INNER_NAMES = {
    "src/flight_rehearsal/flight_rehearsal/rehearsed_flight.py": {
        "mavlink_sitl.autopilot.px4.vehicle": "a rehearsal begins with the charge of the vehicle, "
        "and the pack of PX4's simulator is full on the ground"
    },
}
"""Modules of the simulator that are not public, by file that imports them, and why."""


def _imports(file: Path) -> set[str]:
    """Return the modules that a file imports; names of the simulator's package with them."""
    found: set[str] = set()
    for node in ast.walk(_parsed(file)):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            found.add(node.module)
            if node.module == "mavlink_sitl":
                found |= {f"mavlink_sitl.{alias.name}" for alias in node.names}
    return found


def test_the_simulator_knows_nothing_of_the_bridge() -> None:
    files = sorted((ROOT / "sitl").rglob("*.py"))
    assert len(files) > 300
    known = {
        _name(file): names
        for file in files
        if (names := {module for module in _imports(file) if module.split(".")[0] in OTHERS})
    }
    assert known == {}
    named = re.compile(rf"\b(?:{'|'.join(OTHERS - {'tests'})})\b|\bsrc/")
    pages = [path for kind in ("*.md", "*.toml", "*.cfg") for path in (ROOT / "sitl").rglob(kind)]
    assert len(pages) > 10
    told = {_name(path): named.findall(path.read_text("utf-8")) for path in [*files, *pages]}
    assert {name: words for name, words in told.items() if words} == {}


def test_the_simulator_is_used_by_its_public_names() -> None:
    public = {*PUBLIC_MODULES, "mavlink_sitl.geodesy"}
    public |= {f"mavlink_sitl.{name}" for name in mavlink_sitl.__all__}
    inner = {}
    for folder in ("src", "tests", "scripts"):
        for file in sorted((ROOT / folder).rglob("*.py")):
            used = {name for name in _imports(file) if name.split(".")[0] in SITL}
            if used - public:
                inner[_name(file)] = used - public
    assert inner == {name: set(reasons) for name, reasons in INNER_NAMES.items()}


# Optional features of the server: the names of their files, and in how many folders these are.
SERVER_PACKAGES = (
    "mavlink_vehicle",
    "navigation_core",
    "navigation_bridge",
    "drone_navigation/drone_navigation/server",
    "drone_navigation/drone_navigation/console",
    "flight_rehearsal/flight_rehearsal",
)
FEATURES = {
    "logs": (r"/logs/|log_requests", 3),
    "RTCM": (r"rtcm|correction", 3),
    "external position": (r"external_", 3),
    "velocity": (r"velocity_(commands|topic)|follow_velocity|tasks/steering", 3),
    "target": (r"follow(ed)?_target|target_(topic|guide)|tracked_target", 4),
    "traffic": (r"/traffic/|in_traffic", 3),
    "rehearsal": (r"rehears", 2),
    "storage": (r"storage|list_operation", 3),
}
SHELLS = (
    "mavlink_vehicle/mavlink_vehicle/io/driver.py",
    "navigation_bridge/navigation_bridge/bridge.py",
    "navigation_bridge/navigation_bridge/clients/client_goals.py",
    "navigation_bridge/navigation_bridge/clients/client_services.py",
    "navigation_bridge/navigation_bridge/engine.py",
    "navigation_bridge/navigation_bridge/fleet.py",
    "navigation_bridge/navigation_bridge/reporting.py",
    "navigation_bridge/navigation_bridge/tasks/admission.py",
    "navigation_bridge/navigation_bridge/vehicle_events.py",
    "drone_navigation/drone_navigation/server/publishing/topics.py",
    "drone_navigation/drone_navigation/server/server.py",
    "drone_navigation/drone_navigation/server/vehicle_node.py",
    "drone_navigation/drone_navigation/server/vehicle_outputs.py",
)
"""Modules that run features by their lists, and name none."""


def _files_of(feature: str) -> list[Path]:
    pattern = re.compile(FEATURES[feature][0])
    roots = [ROOT / "src" / package for package in SERVER_PACKAGES]
    found = [file for file in PRODUCT if any(file.is_relative_to(root) for root in roots)]
    return [file for file in found if pattern.search(_name(file))]


@pytest.mark.parametrize("feature", FEATURES)
def test_a_feature_is_in_few_folders(feature: str) -> None:
    folders = {_name(file.parent) for file in _files_of(feature)}
    assert 2 <= len(folders) <= FEATURES[feature][1], folders


@pytest.mark.parametrize("feature", FEATURES)
def test_the_shells_name_no_feature(feature: str) -> None:
    modules = {
        ".".join(file.relative_to(ROOT / "src").with_suffix("").parts[1:])
        for file in _files_of(feature)
    }
    named = {shell: _imports(ROOT / "src" / shell) & modules for shell in SHELLS}
    assert {shell: names for shell, names in named.items() if names} == {}


# Modules that read a clock that may be set, stand still or go back, with the reason.
_STAMP = "stamps of messages"
_RECORDED = "times in a recording"
SETTABLE_CLOCKS = {
    "src/drone_navigation/drone_navigation/steady_timer.py": {
        "create_timer": "the one timer, on the steady clock",
        "Clock": "the steady one",
    },
    "src/drone_navigation/drone_navigation/server/actions.py": {"get_clock": _STAMP},
    "src/drone_navigation/drone_navigation/ros2/topics.py": {"get_clock": _STAMP},
    "src/drone_navigation/drone_navigation/server/payload/payload_servers.py": {
        "get_clock": _STAMP
    },
    "src/drone_navigation/drone_navigation/server/publishing/topics.py": {"get_clock": _STAMP},
    "src/drone_navigation/drone_navigation/server/traffic/traffic_topic.py": {
        "get_clock": _STAMP,
        "now": "read once, at the start: the order of goals of several servers, not their ends",
    },
    "src/drone_navigation/drone_navigation/bag/goals.py": {"get_clock": _RECORDED},
    "src/drone_navigation/drone_navigation/server/replay_node.py": {
        "get_clock": "a replay sets it to the recording's time",
        "ROSClock": "the same",
    },
    "src/drone_navigation/drone_navigation/server/frames/trajectory_frames.py": {
        "get_clock": "how old a transform is; one that is too old is rejected with a reason"
    },
    "src/drone_navigation/drone_navigation/server/subscribing/external_odometry.py": {
        "get_clock": "when a position was measured, for the autopilot, which gets no other time; "
        "an impossible age is rejected with a reason"
    },
    "src/drone_navigation/drone_navigation/server/subscribing/target_topic.py": {
        "get_clock": "how old a sample of a target is; an impossible age is rejected with a reason"
    },
    "src/drone_navigation/drone_navigation/server/subscribing/trajectory_messages.py": {
        "get_clock": "when the times of a trajectory count from; a late one is rejected"
    },
    "src/drone_navigation/drone_navigation/server/traffic/remote_id_timer.py": {
        "Clock": "the UTC time in Remote ID, which nothing acts on"
    },
    "src/drone_navigation/drone_navigation/presence.py": {
        "time_ns": "read once, at the start: which of two servers of one name ends; both reject "
        "goals meanwhile"
    },
    "src/drone_navigation/drone_navigation/nav2/other_servers.py": {"time_ns": "the same"},
    "src/drone_navigation/drone_navigation/navigation_target.py": {
        "get_clock": "stamps, and the age of those that a camera has given"
    },
    "src/mavlink_vehicle/mavlink_vehicle/io/signing_key.py": {
        "time": "the time that MAVLink signs with, which never goes back"
    },
    "src/mavlink_vehicle/mavlink_vehicle/io/tlog.py": {"time": _RECORDED},
    "sitl/mavlink_sitl/wall_clock_link.py": {
        "time": "the time of a simulated camera's picture, for a receiver on another clock"
    },
}
_CLOCKS = frozenset({"create_timer", "create_rate", "get_clock", "Clock", "ROSClock", "Rate"})
_OF_TIME = frozenset({"time", "time_ns", "clock_gettime"})
_OF_DATETIME = frozenset({"now", "utcnow", "today"})


def _settable_clocks(tree: ast.Module) -> set[str]:
    """Return the names of what reads, or runs on, a clock that is not the steady one."""
    imported = {
        (node.module, alias.name)
        for node in ast.walk(tree)
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }
    found = {name for module, name in imported if module == "time" and name in _OF_TIME}
    found |= {name for module, name in imported if module == "rclpy.clock" and name in _CLOCKS}
    for node in ast.walk(tree):
        if not isinstance(node, ast.Attribute):
            continue
        owner = node.value.id if isinstance(node.value, ast.Name) else ""
        is_clock = node.attr in ("create_timer", "create_rate", "get_clock")
        is_clock |= owner == "time" and node.attr in _OF_TIME
        is_clock |= owner in ("datetime", "date") and node.attr in _OF_DATETIME
        if is_clock:
            found.add(node.attr)
    return found


def test_nothing_that_acts_runs_on_a_clock_that_can_be_set_or_stand_still() -> None:
    found = {_name(file): _settable_clocks(_parsed(file)) for file in PRODUCT}
    expected = {name: set(reasons) for name, reasons in SETTABLE_CLOCKS.items()}
    assert {name: names for name, names in found.items() if names} == expected


def test_a_timer_on_the_clock_of_a_node_is_found() -> None:
    source = "import time\nfrom datetime import datetime\n"
    source += "node.create_timer(1.0, work)\ntime.time()\ndatetime.now()\ntime.monotonic()\n"
    assert _settable_clocks(ast.parse(source)) == {"create_timer", "time", "now"}


# Names that say nothing to an engineer of this field, with the term that does.
NAMES_RULED_OUT = {
    "berth": "parking position",
    "caution": "limits",
    "conduct": "the state or the rule itself",
    "desk": "requests",
    "footing": "the requirements",
    "look_around": "measure or observe",
    "pace": "speed, rate or time scale",
    "stillborn": "rejected or never started",
    "take_up": "start or resume",
    "tempered": "limited",
    "think": "replan, search or act",
    "thinks": "replan, search or act",
    "told": "reported, commanded or sent",
}
_RULED_OUT = re.compile(rf"(?:^|_)(?:{'|'.join(NAMES_RULED_OUT)})s?(?:_|$)")


def _snake(name: str) -> str:
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", name).lower()


def _names_in(tree: ast.Module) -> set[str]:
    """Return the identifiers of a module: what it defines, uses, imports and passes."""
    found = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Name):
            found.add(node.id)
        elif isinstance(node, ast.Attribute):
            found.add(node.attr)
        elif isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            found.add(node.name)
        elif isinstance(node, ast.arg | ast.keyword) and node.arg:
            found.add(node.arg)
        elif isinstance(node, ast.ImportFrom) and node.module:
            found.update(node.module.split("."))
    return found


def _ruled_out(names: set[str]) -> set[str]:
    return {name for name in names if _RULED_OUT.search(_snake(name))}


def test_identifiers_are_the_terms_of_the_field() -> None:
    found = {}
    for file in PRODUCT:
        names = _ruled_out(_names_in(_parsed(file)) | {file.stem})
        if names:
            found[_name(file)] = names
    assert found == {}


def test_a_name_that_is_ruled_out_is_found() -> None:
    tree = ast.parse("class DeskLimits:\n    def look_around(self, told_s): self._think()\n")
    assert _ruled_out(_names_in(tree)) == {"DeskLimits", "look_around", "told_s", "_think"}
    assert _ruled_out({"space", "spaces_m", "retold", "untold", "replan", "desktop"}) == set()
