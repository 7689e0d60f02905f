"""The wheels work in environments that have nothing but their dependencies.

Each environment is empty but for one line that lets it see the installed packages of an
interpreter; pip then installs from the folder of the wheels alone, so a dependency that a wheel
does not declare rightly, or a file that it lacks, is found without a network. The packages of this
repository are on no such path: here they come by PYTHONPATH, which these environments don't get.
"""

from __future__ import annotations

import os
import re
import runpy
import shutil
import signal
import socket
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from zipfile import ZipFile

import pytest

from tests.support.processes import HANGS_AFTER_S

# By day test_simulator_alone.py builds and tries a wheel.
pytestmark = pytest.mark.night


ROOT = Path(__file__).resolve().parents[2]
VERSION = (ROOT / "VERSION").read_text("utf-8").strip()
(SITL_VERSION,) = re.findall(
    r'^version = "(.*)"$', (ROOT / "sitl/pyproject.toml").read_text("utf-8"), re.MULTILINE
)
PAGES = (ROOT / "sitl/README.md", ROOT / "sitl/docs/sitl.md")
DEPENDENCIES = (
    "fastcrc", "jsonschema", "numpy", "pyarrow", "pymavlink", "pytest", "pyulog", "rich",
    "serial", "yaml",
)  # fmt: skip


interpreters: Callable[[], list[str]] = runpy.run_path(str(ROOT / "scripts/make_wheels.py"))[
    "interpreters"
]


def outside() -> dict[str, str]:
    """The environment of a process that knows nothing of this repository."""
    kept = {k: v for k, v in os.environ.items() if not k.startswith(("PYTHON", "PYTEST"))}
    return {**kept, "PIP_DISABLE_PIP_VERSION_CHECK": "1", "PIP_NO_INDEX": "1"}


def run(*words: str | Path, folder: Path | None = None) -> str:
    done = subprocess.run(
        words,
        cwd=folder,
        env=outside(),
        capture_output=True,
        text=True,
        timeout=HANGS_AFTER_S,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def wheels(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("dist")
    build = [sys.executable, str(ROOT / "scripts/make_wheels.py"), "--out", str(folder)]
    subprocess.run(build, check=True, timeout=HANGS_AFTER_S)
    return folder


@pytest.fixture(scope="module", params=interpreters())
def python(
    request: pytest.FixtureRequest, wheels: Path, tmp_path_factory: pytest.TempPathFactory
) -> Path:
    """An interpreter of an environment with the wheels."""
    imports = "".join(f"import {name}; " for name in DEPENDENCIES)
    probe = imports + "import sysconfig; print(sysconfig.get_path('purelib'))"
    found = subprocess.run(
        [request.param, "-c", probe], env=outside(), capture_output=True, text=True, check=False
    )
    if found.returncode:
        pytest.skip(f"{request.param}: {found.stderr.strip().splitlines()[-1]}")
    there = tmp_path_factory.mktemp("environment")
    run(request.param, "-m", "venv", "--without-pip", there)
    (site_packages,) = there.glob("lib/python*/site-packages")
    (site_packages / "dependencies.pth").write_text(found.stdout)
    python = there / "bin" / "python"
    pip = (sys.executable, "-m", "pip", "--python", python, "install", "--quiet")
    run(*pip, "--find-links", wheels, "mavlink-sitl", "flight-logs")
    return python


def test_the_wheels_are_pure_and_have_all_files(wheels: Path) -> None:
    names = {path.name for path in wheels.iterdir()}
    projects = {"flight_logs": VERSION, "mavlink_sitl": SITL_VERSION, "mavlink_vehicle": VERSION}
    assert names == {f"{name}-{version}-py3-none-any.whl" for name, version in projects.items()}
    git = ["git", "ls-files", "sitl/mavlink_sitl"]
    listed = subprocess.run(git, cwd=ROOT, capture_output=True, text=True, check=False)
    if listed.returncode:
        pytest.skip("not a clone: git knows no files")
    ours = {line.removeprefix("sitl/") for line in listed.stdout.splitlines()}
    packed = ZipFile(wheels / f"mavlink_sitl-{SITL_VERSION}-py3-none-any.whl").namelist()
    assert len(ours) > 200
    assert not ours - set(packed)
    assert not [name for name in packed if ".data/" in name], "files for ROS alone"


def test_the_command_reports_its_version(python: Path) -> None:
    assert run(python.parent / "mavlink-sitl", "--version") == f"mavlink_sitl {SITL_VERSION}\n"
    assert run(python.parent / "tlog_export", "--version") == f"tlog_export {VERSION}\n"


def test_the_command_runs_a_vehicle(python: Path) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as ground:
        ground.bind(("127.0.0.1", 0))
        ground.settimeout(HANGS_AFTER_S)
        link = f"udpout://127.0.0.1:{ground.getsockname()[1]}"
        command = [
            str(python.parent / "mavlink-sitl"),
            "--quiet",
            "--autopilot",
            "px4",
            "--link",
            link,
        ]
        program = subprocess.Popen(command, env=outside())
        try:
            assert ground.recv(300)[0] == 0xFD
            program.send_signal(signal.SIGTERM)
            assert program.wait(HANGS_AFTER_S) == 0
        finally:
            program.kill()
            program.wait()


def examples(page: Path) -> list[str]:
    return re.findall(r"```python\n(.*?)```", page.read_text("utf-8"), re.DOTALL)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.parent.name)
def test_the_examples_of_the_pages_run(python: Path, page: Path, tmp_path: Path) -> None:
    kinds = [example.count("def test_") > 0 for example in examples(page)]
    assert sorted(set(kinds)) == [False, True]
    for number, example in enumerate(examples(page)):
        is_test = kinds[number]
        path = tmp_path / f"{'test_' if is_test else ''}example_{number}.py"
        path.write_text(example, "utf-8")
        if not is_test:
            run(python, path, folder=tmp_path)
    said = run(python, "-m", "pytest", "-q", "-p", "no:cacheprovider", ".", folder=tmp_path)
    assert f"{sum(kinds)} passed" in said


def test_the_logs_are_read_without_the_bridge(python: Path, tmp_path: Path) -> None:
    shutil.copy(ROOT / "tests/data/rover_guided.tlog", tmp_path / "flight.tlog")
    (example,) = examples(ROOT / "src/flight_logs/README.md")
    run(python, "-c", f"{example}\nassert len(position) > 100", folder=tmp_path)
    export = ("tlog_export", "flight.tlog", "--to", "out", "--format", "csv")
    assert "Wrote" in run(python.parent / export[0], *export[1:], folder=tmp_path)
    assert (tmp_path / "out/HEARTBEAT.csv").is_file()
