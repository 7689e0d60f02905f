"""The lock, the packages, the action and the import rules are what they claim to be."""

from __future__ import annotations

import importlib.metadata
import importlib.util
import re
import runpy
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from custom_interfaces.action import Navigate
from tests.support.processes import HANGS_AFTER_S

pytestmark = pytest.mark.wide_but_first


if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

ROOT = Path(__file__).resolve().parents[2]
PYPROJECT: dict[str, Any] = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
ROS_KIND = (ROOT / "install/environment.bash").read_text("utf-8").split(None, 3)[2]
LAYERS = ("", "-extras", "-dev", "-build")
LOCKS = [f"{ros}{layer}" for ros in ("wheels", "kilted", "system") for layer in LAYERS]


def lock_entries(kind: str) -> list[str]:
    """The entries of a lock, each with its continuation lines."""
    text = (ROOT / f"requirements/{kind}.txt").read_text("utf-8")
    return [entry for entry in re.split(r"\n(?=\S)", text.strip()) if not entry.startswith("#")]


def requirement(entry: str) -> Requirement:
    return Requirement(entry.split("\\", maxsplit=1)[0])


@pytest.mark.parametrize("kind", LOCKS)
def test_lock_pins_everything_by_hash_and_names_no_host(kind: str) -> None:
    entries = lock_entries(kind)
    assert len(entries) > 10
    for entry in entries:
        first, *hashes = (line.rstrip("\\ ").strip() for line in entry.splitlines())
        assert re.match(r"[a-z0-9-]+==[\w.]+( ; .+)?$", first), first
        assert hashes, first
        assert all(re.fullmatch(r"--hash=sha256:[0-9a-f]{64}", line) for line in hashes), first
    assert "://" not in "".join(entries)


@pytest.mark.parametrize("kind", LOCKS)
def test_lock_holds_every_declared_dependency(kind: str) -> None:
    groups = PYPROJECT["dependency-groups"]
    locked = {canonicalize_name(requirement(entry).name) for entry in lock_entries(kind)}
    ros, _, layer = kind.partition("-")
    extras = ("extras", f"ros-{ros}-extras")
    own = {
        "": ("runtime",),
        "extras": ("runtime", *extras),
        "dev": ("runtime", *extras, "dev"),
        "build": ("build", f"ros-{ros}-build"),
    }
    for group in (f"ros-{ros}", *own[layer]):
        declared = {canonicalize_name(Requirement(line).name) for line in groups[group]}
        assert declared <= locked


@pytest.mark.parametrize("ros", ["wheels", "kilted", "system"])
def test_all_locks_have_the_same_versions(ros: str) -> None:
    versions = {
        entry.split(maxsplit=1)[0] for layer in LAYERS for entry in lock_entries(f"{ros}{layer}")
    }
    # More than one of a package is for more than one version of Python, and all are in the last.
    dev = {entry.split(maxsplit=1)[0] for entry in lock_entries(f"{ros}-dev")}
    shared = {pin.split("==")[0] for pin in dev}
    assert {pin for pin in versions if pin.split("==")[0] in shared} == dev


def test_running_takes_none_of_the_heavy_packages() -> None:
    heavy = {"cmake", "imageio-ffmpeg", "mavproxy", "mcap", "mypy", "pyarrow", "pyulog", "uv"}
    locked = {canonicalize_name(requirement(entry).name) for entry in lock_entries("wheels")}
    assert not locked & heavy


def test_installed_packages_are_those_of_the_lock() -> None:
    for entry in lock_entries(f"{ROS_KIND}-dev"):
        wanted = requirement(entry)
        if wanted.marker is None or wanted.marker.evaluate():
            installed = importlib.metadata.version(wanted.name)
            assert installed in wanted.specifier, f"{wanted.name} {installed}"


@pytest.mark.parametrize(
    ("package", "commands"),
    [
        (
            "drone_navigation",
            {
                "navigation_server",
                "navigation_client",
                "navigation_console",
                "navigation_mcp",
                "navigation_nav2",
                "navigation_report",
                "navigation_target",
                "ros2",
                "tlog2mcap",
            },
        ),
        ("flight_logs", {"tlog_export"}),
        ("mavlink_sitl", {"mavlink-sitl"}),
    ],
)
def test_entry_points_can_be_called(package: str, commands: set[str]) -> None:
    points = importlib.metadata.distribution(package).entry_points
    scripts = {point.name: point.load() for point in points if point.group == "console_scripts"}
    assert scripts.keys() == commands
    assert all(callable(main) for main in scripts.values())


@pytest.mark.wide
def test_simulator_installs_on_its_own(tmp_path: Path) -> None:
    shutil.copytree(ROOT / "sitl", tmp_path / "sitl")
    pip = [sys.executable, "-m", "pip", "--disable-pip-version-check", "install", "--quiet"]
    offline = ["--no-index", "--no-deps", "--no-build-isolation"]
    target = tmp_path / "target"
    subprocess.run(
        [*pip, *offline, "--target", target, tmp_path / "sitl"], check=True, timeout=HANGS_AFTER_S
    )
    [installed] = importlib.metadata.distributions(path=[str(target)])
    needs = {canonicalize_name(Requirement(line).name) for line in installed.requires or ()}
    assert needs == {"fastcrc", "jsonschema", "numpy", "pymavlink", "pyyaml"}
    modules = {path.relative_to(ROOT / "sitl") for path in ROOT.glob("sitl/mavlink_sitl/**/*.py")}
    missing = [module for module in modules if not (target / module).is_file()]
    assert not missing


COURSE_POSE = "geometry_msgs/PoseStamped"


@pytest.mark.parametrize(
    ("part", "fields"),
    [
        (
            Navigate.Goal,
            {"target_pose": COURSE_POSE, "avoid_obstacles": "boolean", "max_speed": "float"},
        ),
        (
            Navigate.Result,
            {
                "success": "boolean",
                "final_pose": COURSE_POSE,
                "total_elapsed_time": "float",
                "final_error": "float",
                "message": "string",
                # Not of the course.
                "error_code": "uint16",
            },
        ),
        (
            Navigate.Feedback,
            {
                "current_pose": COURSE_POSE,
                "distance_remaining": "float",
                "estimated_time_remaining": "float",
                "battery_percentage": "float",
                "current_status": "string",
                # Not of the course: at the end, so that the course's own come as it shows them.
                "replans": "uint32",
                "setpoint_delay": "float",
            },
        ),
    ],
)
def test_action_has_the_fields_of_the_course_and_the_replans(
    part: Any, fields: dict[str, str]
) -> None:
    assert list(part.get_fields_and_field_types().items()) == list(fields.items())


def test_names_and_values_of_the_constants_agree() -> None:
    text = (ROOT / "src/custom_interfaces/action/Navigate.action").read_text("utf-8")
    names = re.findall(r'^string (?:CODE|STATUS)_(\w+)="(\w+)"$', text, re.MULTILINE)
    assert len(names) > 20
    assert [name for name, value in names if name != value] == []


def contract_modules() -> list[str]:
    """Every module that an import contract names, optional layers included."""
    found = []
    for contract in PYPROJECT["tool"]["importlinter"]["contracts"]:
        found += contract.get("modules", []) + contract.get("source_modules", [])
        for container in contract.get("containers", []):
            for layer in contract["layers"]:
                found += [f"{container}.{name}" for name in re.findall(r"\w+", layer)]
    return sorted(set(found))


def test_modules_named_by_the_import_contracts_exist() -> None:
    # A contract about a misspelt optional layer would hold for ever.
    for module in contract_modules():
        assert importlib.util.find_spec(module) is not None, module


def test_all_packages_have_the_version_that_is_in_one_file() -> None:
    version = (ROOT / "VERSION").read_text("utf-8").strip()
    script = runpy.run_path(str(ROOT / "scripts/set_version.py"))
    found, with_version = script["files"](), script["with_version"]
    assert len(found) == 2 * 9 + 4
    for path in found:
        text = path.read_text("utf-8")
        assert with_version(text, version) == text, f"make version: {path}"
        assert with_version(text, "9.8.7").count("9.8.7") == 1, path


def test_every_description_names_the_project_and_is_the_same_in_both_files() -> None:
    for path in sorted(ROOT.glob("src/*/package.xml")):
        (described,) = re.findall(r"<description>(.*)</description>", path.read_text("utf-8"))
        assert described.startswith("mavbridge: "), path
        if path.with_name("setup.cfg").exists():
            text = path.with_name("setup.cfg").read_text("utf-8")
            assert f"\ndescription = {described}\n" in text, path


def test_the_newest_changes_are_those_of_the_version() -> None:
    version = (ROOT / "VERSION").read_text("utf-8").strip()
    sections = re.findall(
        r"^## \[(.*?)\]", (ROOT / "CHANGELOG.md").read_text("utf-8"), re.MULTILINE
    )
    assert sections[:2] == ["Unreleased", version]


@pytest.mark.parametrize(
    ("command", "package"),
    [
        ("navigation_server", "drone_navigation"),
        ("navigation_client", "drone_navigation"),
        ("navigation_console", "drone_navigation"),
        ("navigation_nav2", "drone_navigation"),
        ("navigation_target", "drone_navigation"),
        ("tlog2mcap", "drone_navigation"),
        ("ros2", "drone_navigation"),
        ("navigation_report", "flight_reports"),
        ("tlog_export", "flight_logs"),
        ("python -m mavlink_sitl", "mavlink_sitl"),
        ("python -m flight_reports.flight_plot", "flight_reports"),
        ("python -m flight_reports.flight_video", "flight_reports"),
        ("python -m drone_navigation.demo", "drone_navigation"),
        ("python -m drone_navigation.demo_nav2", "drone_navigation"),
    ],
)
def test_every_command_reports_its_version(command: str, package: str) -> None:
    words = [*command.split(), "--version"]
    said = subprocess.run(
        words, capture_output=True, text=True, check=True, timeout=HANGS_AFTER_S
    ).stdout
    assert said.split()[-1] == importlib.metadata.version(package)
    assert said.startswith((command, package))


def test_make_lists_its_targets() -> None:
    makefile = (ROOT / "Makefile").read_text("utf-8")
    [declared] = re.findall(r"^\.PHONY: (.*)$", makefile, re.MULTILINE)
    shown = subprocess.run(["make"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    listed = re.findall(r"^make ([\w-]+) ", shown, re.MULTILINE)
    assert sorted(listed) == sorted(declared.split())
