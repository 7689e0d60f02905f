"""Set-up: its CPU seconds, and megabytes of 2**20 bytes in its folder.

A clone of this one is set up for running, with the packages that uv has kept on this machine, and
removed. A network that has to bring them costs more. The short form only looks whether this one is
set up.
"""

from __future__ import annotations

import os
import resource
import subprocess
import tempfile
from pathlib import Path
from typing import Any

from tests.bench.rows import row

CPU_S, SIZE_MB, AGAIN_S = 55.0, 500.0, 3.0
# With pip, everything in one lock, and a unit for each file of the interfaces: 55.5 s for the
# packages and 110 s for the interfaces.
_FORMER_CPU_S, _FORMER_MB = 165.5, 1500.0
_ROOT = Path(__file__).resolve().parents[2]
_LIMIT_S = 3600.0


def measures(short: bool = False) -> list[dict[str, Any]]:
    """Set a clone up, and look whether it is again."""
    if short:
        return [_again(_cpu_s(_ROOT, {}), ("the goal", AGAIN_S))]
    wheels = {"MAVBRIDGE_ROS": "wheels"}
    with tempfile.TemporaryDirectory() as folder:
        clone = Path(folder, "clone")
        subprocess.run(["git", "clone", "--quiet", _ROOT, clone], check=True, timeout=_LIMIT_S)
        first_s, again_s = _cpu_s(clone, wheels), _cpu_s(clone, wheels)
        made = [clone / name for name in (".venv", "install", "build")]
        size_mb = sum(_size_bytes(path) for path in made) / 2**20
    former = "with pip, units of one file"
    return [
        row(
            "CPU time of the set-up",
            (first_s, "s"),
            (former, _FORMER_CPU_S),
            f"< {CPU_S:g} s",
        ),
        row(
            "disk that the set-up takes",
            (size_mb, "MB"),
            (former, _FORMER_MB),
            f"< {SIZE_MB:g} MB",
        ),
        _again(again_s, ("the first", first_s)),
    ]


def _again(again_s: float, reference: tuple[str, float]) -> dict[str, Any]:
    return row(
        "CPU time of a set-up that finds nothing to do",
        (again_s, "s"),
        reference,
        f"< {AGAIN_S:g} s",
    )


def _cpu_s(folder: Path, settings: dict[str, str]) -> float:
    """Return what `make setup` and all its processes took."""
    ours = ("ROS_", "AMENT_", "CMAKE_", "MAVBRIDGE_", "PYTHON")
    environment = {k: v for k, v in os.environ.items() if not k.startswith(ours)} | settings
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(
        ["make", "setup"],
        cwd=folder,
        env=environment,
        stdout=subprocess.DEVNULL,
        check=True,
        timeout=_LIMIT_S,
    )
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def _size_bytes(folder: Path) -> int:
    """Return what the files of a folder occupy, without following links."""
    return sum(512 * path.lstat().st_blocks for path in folder.rglob("*"))
