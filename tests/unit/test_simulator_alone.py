"""The simulator's folder, taken away: it builds, tests and documents itself.

The environment sees the installed packages that the folder names as its dependencies, and nothing
of this repository; nothing is downloaded.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.processes import HANGS_AFTER_S

ROOT = Path(__file__).resolve().parents[2]
TESTS = (
    "tests/unit/test_sitl_documentation.py",
    "tests/unit/test_pytest_plugin.py",
    "tests/unit/test_count.py",
    "tests/unit/test_state.py",
    "tests/recordings/test_elsewhere.py",
)
pytestmark = [pytest.mark.wide, pytest.mark.timeout(900)]


def environment(python: Path) -> dict[str, str]:
    """That of a process that knows nothing of this repository."""
    foreign = ("PYTHON", "PYTEST", "MAKE", "AMENT", "COLCON")
    kept = {name: value for name, value in os.environ.items() if not name.startswith(foreign)}
    path = f"{python.parent}{os.pathsep}{kept['PATH']}"
    offline = {"PIP_NO_INDEX": "1", "PIP_NO_BUILD_ISOLATION": "0"}  # 0: without isolation
    return {**kept, **offline, "PATH": path, "PIP_DISABLE_PIP_VERSION_CHECK": "1"}


def run(python: Path, folder: Path, *words: str | Path) -> str:
    done = subprocess.run(
        words, cwd=folder, env=environment(python), capture_output=True, text=True,
        timeout=HANGS_AFTER_S, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder in an empty place, without what was made in it."""
    folder = tmp_path_factory.mktemp("elsewhere") / "sitl"
    made = shutil.ignore_patterns("build", "dist", "__pycache__", ".*_cache", "*.egg-info", ".venv")
    shutil.copytree(ROOT / "sitl", folder, ignore=made)
    return folder


@pytest.fixture(scope="module")
def python(folder: Path) -> Path:
    """The interpreter of its own environment, with the wheel that was built there."""
    there = folder / ".venv"
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", there], check=True)
    python = there / "bin/python"
    (site_packages,) = there.glob("lib/python*/site-packages")
    seen = run(python, folder, sys.executable, "-c", "import pytest; print(pytest.__file__)")
    (site_packages / "dependencies.pth").write_text(str(Path(seen).parents[1]))
    run(python, folder, "make", "-o", ".venv/made.stamp", "wheel")
    (wheel,) = folder.glob("dist/*.whl")
    install = ("-m", "pip", "install", "--quiet", "--no-deps", wheel)
    run(python, folder, python, *install)
    return python


def test_the_wheel_has_all_files(folder: Path, python: Path) -> None:
    program = run(python, folder.parent, python.parent / "mavlink-sitl", "--version")
    text = (folder / "pyproject.toml").read_text("utf-8")
    (version,) = re.findall(r'^version = "(.*)"$', text, re.MULTILINE)
    assert program == f"mavlink_sitl {version}\n"
    (installed,) = folder.glob(".venv/lib/python*/site-packages/mavlink_sitl")
    sources = {path.relative_to(folder) for path in folder.glob("mavlink_sitl/**/*.*")}
    there = {path.relative_to(installed.parent) for path in installed.rglob("*.*")}
    assert len(sources) > 200
    assert {path for path in sources - there if "__pycache__" not in path.parts} == set()


@pytest.mark.night
def test_its_tests_and_its_documentation_check_run(folder: Path, python: Path) -> None:
    words = ("-m", "pytest", "-q", "-m", "not wide", "-p", "no:launch_testing", *TESTS)
    said = run(python, folder, python, *words)
    assert re.search(r"^\d\d+ passed", said.splitlines()[-1]), said
    assert "failed" not in said


def test_its_pages_are_made_and_its_import_rules_hold(folder: Path, python: Path) -> None:
    pages = sorted(folder.glob("docs/*.md"))
    before = [page.read_bytes() for page in pages]
    run(python, folder, "make", "-o", ".venv/made.stamp", "pages")
    assert [page.read_bytes() for page in pages] == before
    helped = run(python, folder, "make")
    text = (folder / "Makefile").read_text("utf-8")
    (declared,) = re.findall(r"^\.PHONY: (.*)$", text, re.MULTILINE)
    assert {line.split()[1] for line in helped.splitlines()} == set(declared.split())
