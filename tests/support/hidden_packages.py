"""Python packages that a child process finds as little as if they were not installed."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable
from importlib import metadata
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def hide(modules: Iterable[str], folder: Path) -> str:
    """Make them missing for whoever has the returned entry first in PYTHONPATH.

    Args:
        modules: their full names; what is below one is missing, too.
        folder: an empty one for the file that Python reads as it starts.
    """
    names = sorted(modules)
    line = f"import sys\nsys.modules.update(dict.fromkeys({names!r}))\n"
    (folder / "sitecustomize.py").write_text(line, encoding="utf-8")
    return str(folder)


def beside(entry: str) -> dict[str, str]:
    """Return this process's environment with an entry first in PYTHONPATH."""
    paths = filter(None, (entry, os.environ.get("PYTHONPATH", "")))
    return {**os.environ, "PYTHONPATH": ":".join(paths)}


def modules_beside(distributions: Iterable[str]) -> set[str]:
    """The modules of all locked packages but some, what these need, and ROS."""
    locked: set[str] = set()
    for lock in (ROOT / "requirements").glob("*.txt"):
        locked.update(re.findall(r"^([\w.-]+)==", lock.read_text("utf-8"), re.MULTILINE))
    kept = _with_needs(map(_normal, distributions))
    return {
        module
        for module, owners in metadata.packages_distributions().items()
        if (names := set(map(_normal, owners))) <= locked
        and not names & kept
        and not any(name.startswith("ros-") for name in names)
    }


def _with_needs(names: Iterable[str]) -> set[str]:
    """Distributions and, of those that are installed, all that they need."""
    found: set[str] = set()
    left = list(names)
    while left:
        name = left.pop()
        if name in found:
            continue
        found.add(name)
        try:
            needs = metadata.requires(name) or []
        except metadata.PackageNotFoundError:
            continue
        plain = (need for need in needs if "extra ==" not in need)
        left += [_normal(re.split(r"[^\w.-]", need)[0]) for need in plain]
    return found


def _normal(name: str) -> str:
    return re.sub(r"[-_.]+", "-", name).lower()
