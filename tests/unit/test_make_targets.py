"""Each target of the Makefile runs, shortly, in a copy of the repository.

The set-up isn't run again: whoever runs this has done so.
"""

from __future__ import annotations

import contextlib
import os
import re
import shutil
import signal
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.support.processes import HANGS_AFTER_S

ROOT = Path(__file__).resolve().parents[2]
MAKEFILE = (ROOT / "Makefile").read_text("utf-8")
TARGETS = re.findall(r"^([a-z0-9-]+):", MAKEFILE, re.MULTILINE)
MADE = (".venv", "build", "install")
KEPT = ("scripts", "src")
LIMIT_S = 500.0
LIMITS_S = {"wheels": 2000.0}
"""It compiles all interfaces for each Python, which takes an idle machine three minutes."""
pytestmark = [pytest.mark.wide, pytest.mark.by_day, pytest.mark.timeout(900)]

AT_NIGHT = ("wheels", "test-night", "demo-video", "shape", "demo-nav2", "demo-fleet")
"""Those that take a minute or more: wheels are built for each Python, and Nav2's client is slow"""

WHOLE = {
    "help": (),
    "demo-video": ("LOG=flight.tlog",),
    "plot": ("LOG=flight.tlog",),
    "report": ("LOG=flight.tlog",),
    # The tests themselves are what runs this.
    "test": ("PYTEST=python -m pytest --version",),
    "test-all": ("PYTEST=python -m pytest --version",),
    "test-night": (
        "PYTEST=python -m pytest --version",
        *("NIGHT=0", "NIGHT_LAYOUTS=1", "NIGHT_SEEDS=1"),
    ),
    "explore": ("SEEDS=1", "FIRST=1014", "WORKERS=1"),
    "bench": ("ARGS=--short --only traffic --output bench.json",),
    "pages": (),
    "shape": (),
    "wheels": (),
    "version": (),
}
"""Targets that run to their end, and the variables that make them short."""

INTERRUPTED = {
    "demo": ((), "accepted"),
    "demo-rover": ((), "accepted"),
    "demo-fleet": ((), "pauses vehicle"),
    "demo-agent": ((), "takes off"),
    "demo-nav2": (("ARGS=--serve",), "Ctrl-C ends it"),
    "console": (("ARGS=--no-browser --port 0",), "The console is at"),
}
"""Targets that are interrupted as soon as they have printed this."""

PRINTED = {
    "lock": "it needs the network",
    "test-arm64": "it downloads another Debian",
    "test-kilted": "it sets a copy up on other wheels",
    "lint": "mypy takes minutes for all packages",
    **{
        target: "it would change the environment that the tests run in"
        for target in TARGETS
        if target == "build" or target.startswith("setup")
    },
}
"""Targets whose commands are only printed, and why."""

CLEANED = {
    "clean": ("build", "install", "dist", "log", "out", ".mypy_cache"),
    "distclean": ("build", "install", "dist", "log", "out", ".mypy_cache", ".venv"),
}
"""Folders that a target removes."""


def make(*words: str) -> list[str]:
    """The command line; what the set-up has made counts as made."""
    old = [word for target in PRINTED if target != "lint" for word in ("-o", target)]
    return ["make", "--no-print-directory", *old, *words]


def environment() -> dict[str, str]:
    """That of a person's terminal, without the make that runs the tests; nothing is downloaded."""
    kept = {name: value for name, value in os.environ.items() if not name.startswith("MAKE")}
    return {**kept, "PIP_NO_INDEX": "1", "PYTHONUNBUFFERED": "1"}


def run(folder: Path, *words: str) -> str:
    done = subprocess.run(
        make(*words), cwd=folder, env=environment(), capture_output=True, text=True,
        timeout=LIMITS_S.get(words[0], LIMIT_S), check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def copy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The repository, and what its set-up has made."""
    folder = tmp_path_factory.mktemp("make") / "copy"
    left_out = shutil.ignore_patterns(
        *MADE, ".git", "out", "log", "dist", "__pycache__", ".*_cache"
    )
    shutil.copytree(ROOT, folder, ignore=left_out, symlinks=True)
    for name in MADE:
        if (ROOT / name).exists():
            (folder / name).symlink_to(ROOT / name)
    shutil.copy(ROOT / "tests/data/copter_lowbatt.tlog", folder / "flight.tlog")
    return folder


def test_every_target_is_here() -> None:
    (phony,) = re.findall(r"^\.PHONY: (.*)$", MAKEFILE, re.MULTILINE)
    assert set(phony.split()) == set(TARGETS)
    assert {*WHOLE, *INTERRUPTED, *PRINTED, *CLEANED} == set(TARGETS), "say how it runs shortly"


@pytest.mark.parametrize(
    "target",
    [
        pytest.param(
            target,
            marks=[pytest.mark.timeout(LIMITS_S.get(target, LIMIT_S) + 400.0)]
            + [pytest.mark.night] * (target in AT_NIGHT),
        )
        for target in WHOLE
    ],
)
def test_a_target_runs(copy: Path, target: str) -> None:
    printed = run(copy, target, *WHOLE[target])
    if target == "help":
        shown = re.findall(r"^make ([a-z0-9-]+) ", printed, re.MULTILINE)
        assert shown == re.findall(r"^([a-z0-9-]+):.*## ", MAKEFILE, re.MULTILINE)
    made = {
        "bench": "bench.json", "demo-video": "flight.mp4", "plot": "flight.png",
        "report": "flight.html", "wheels": "dist/mavbridge_interfaces-*.whl",
    }  # fmt: skip
    if target in made:
        assert list(copy.glob(made[target]))


@pytest.mark.parametrize("half", ["tests/ros", "--ignore=tests/ros"])
def test_either_half_of_all_tests_can_fail(copy: Path, half: str) -> None:
    fails = f"python -c \"import sys; print('ran'); sys.exit('{half}' in sys.argv)\""
    done = subprocess.run(
        make("-o", "test", "test-all", f"PYTEST={fails}"), cwd=copy, env=environment(),
        capture_output=True, text=True, timeout=LIMIT_S, check=False,
    )  # fmt: skip
    assert done.returncode != 0
    assert done.stdout.split() == ["ran", "ran"], done.stdout + done.stderr


def test_what_is_written_into_the_repository_is_as_it_was(copy: Path) -> None:
    paths = (*copy.glob("docs/*.md"), *copy.glob("src/*/package.xml"), *copy.glob("*/*/setup.cfg"))
    before = {path: path.read_bytes() for path in paths}
    run(copy, "pages")
    run(copy, "version")
    assert [path.name for path in paths if path.read_bytes() != before[path]] == []


@pytest.fixture
def started(copy: Path, request: pytest.FixtureRequest) -> Iterator[subprocess.Popen[str]]:
    """A target in a session of its own, as in a terminal: an interrupt reaches all processes."""
    words, _ = INTERRUPTED[request.param]
    # A job in the background of a shell ignores interrupts, and would hand that down.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    process = subprocess.Popen(
        make(request.param, *words), cwd=copy, env=environment(), start_new_session=True,
        stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
    )  # fmt: skip
    signal.signal(signal.SIGINT, before)
    try:
        yield process
    finally:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.communicate(timeout=HANGS_AFTER_S)


@pytest.mark.parametrize(
    ("started", "target"),
    [pytest.param(t, t, marks=[pytest.mark.night] * (t in AT_NIGHT)) for t in INTERRUPTED],
    indirect=["started"],
)
def test_a_target_that_flies_starts_and_can_be_interrupted(
    started: subprocess.Popen[str], target: str
) -> None:
    _, sign = INTERRUPTED[target]
    assert started.stdout is not None
    printed: list[str] = []
    for line in started.stdout:
        printed.append(line)
        if sign in line:
            break
    else:
        pytest.fail(f"make {target} ended without '{sign}':\n{''.join(printed)}")
    os.killpg(started.pid, signal.SIGINT)
    begun_s = time.monotonic()
    started.wait(HANGS_AFTER_S)
    print(f"make {target} ended after {time.monotonic() - begun_s:.1f} s")


@pytest.mark.parametrize("target", sorted(PRINTED))
def test_a_target_that_is_not_run_has_commands(target: str) -> None:
    done = subprocess.run(
        ["make", "-n", target], cwd=ROOT, env=environment(), capture_output=True, text=True,
        timeout=HANGS_AFTER_S, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    # Each sets up what it needs, or a copy.
    assert re.search(r"scripts/(setup|try_kilted)\.sh", done.stdout)
    print(f"make {target} is printed only: {PRINTED[target]}.")


@pytest.mark.parametrize("target", CLEANED)
def test_a_target_that_removes_keeps_the_rest(tmp_path: Path, target: str) -> None:
    shutil.copy(ROOT / "Makefile", tmp_path)
    for name in {*CLEANED["distclean"], *KEPT}:
        (tmp_path / name / "inner").mkdir(parents=True)
    run(tmp_path, target)
    left = {path.name for path in tmp_path.iterdir()}
    assert left == {"Makefile", *KEPT, *CLEANED["distclean"]} - set(CLEANED[target])
