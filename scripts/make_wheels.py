"""Builds wheels: the packages that are useful without ROS, and the interfaces: `make wheels`.

The former are each built from a copy, with the `setup.cfg` that colcon uses less the sections that
only ROS needs: the entries of ament's index, and the folder of the executables. The simulator, a
project of its own, is described by its pyproject.toml. No network: the build tools are those of
this environment. The interfaces are compiled for each version of Python that is found and that the
set-up supports; their tools are fetched as the set-up does.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
from configparser import ConfigParser
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = (
    ROOT / "sitl",
    ROOT / "src" / "mavlink_vehicle",
    ROOT / "src" / "flight_logs",
)
"""Pure Python. `flight_logs` needs `mavlink_vehicle`, whose codec it reads messages with"""
VERSIONS = ("3.10", "3.11", "3.12", "3.13", "3.14")
"""Of Python, that the set-up supports"""
OF_ROS = ("options.data_files", "develop", "install")
NOT_COPIED = shutil.ignore_patterns("build", "dist", "docs", "tests", "*.egg-info", "__pycache__")


def main() -> int:
    """Build all wheels; the exit code is pip's."""
    parser = argparse.ArgumentParser(description="Build the wheels that need no ROS.")
    parser.add_argument(
        "--out", type=Path, default=ROOT / "dist", help="folder to write to (default: dist)"
    )
    parser.add_argument(
        "--interfaces",
        action="store_true",
        help="also the interfaces, for each Python 3.10 to 3.14 that is found; WHEEL_PYTHONS names "
        "more interpreters, separated by colons",
    )
    options = parser.parse_args()
    folder = options.out.resolve()
    with tempfile.TemporaryDirectory() as scratch:
        copies = [_copy(package, Path(scratch)) for package in PACKAGES]
        pip = [sys.executable, "-m", "pip", "--disable-pip-version-check", "wheel", "--quiet"]
        offline = ["--no-index", "--no-deps", "--no-build-isolation"]
        made = Path(scratch) / "wheels"
        code = subprocess.call([*pip, *offline, "--wheel-dir", str(made), *copies])
        folder.mkdir(parents=True, exist_ok=True)
        for wheel in sorted(made.glob("*.whl")):
            print(shutil.copy(wheel, folder))
    for version in VERSIONS if options.interfaces else ():
        if _interpreter(version) is None:
            print(f"No Python {version} was found, so there is no wheel of the interfaces for it.")
    set_up = [str(ROOT / "scripts" / "setup_environment.py"), "--ros", "wheels"]
    for python in interpreters() if options.interfaces and not code else ():
        code = subprocess.call([python, "-I", "-S", *set_up, "--wheel", str(folder)]) or code
    return code


def interpreters() -> list[str]:
    """Return one interpreter for each version that is found, this one first, and those named."""
    named = filter(None, os.environ.get("WHEEL_PYTHONS", "").split(":"))
    found = filter(None, map(_interpreter, VERSIONS))
    return list(dict.fromkeys([sys.executable, *named, *found]))


def _interpreter(version: str) -> str | None:
    """Return an interpreter that works. The commands that pyenv puts on the path need not do."""
    if version == f"3.{sys.version_info.minor}":
        return sys.executable
    pyenv = sorted(Path.home().glob(f".pyenv/versions/{version}.*/bin/python"), reverse=True)
    for path in (*map(str, pyenv), shutil.which(f"python{version}")):
        if (
            path
            and not subprocess.run(
                [path, "-c", ""], stderr=subprocess.DEVNULL, check=False
            ).returncode
        ):
            return path
    return None


def _copy(package: Path, folder: Path) -> str:
    """Copy a package with its licence, without what is ROS's own; return where it is."""
    copy = folder / package.name
    shutil.copytree(package, copy, ignore=NOT_COPIED)
    shutil.copy(ROOT / "LICENSE", copy)
    if (copy / "pyproject.toml").is_file():
        (copy / "setup.cfg").unlink()
        return str(copy)
    settings = ConfigParser(interpolation=None)
    settings.optionxform = str  # type: ignore[assignment,method-assign]
    settings.read(copy / "setup.cfg", "utf-8")
    for section in OF_ROS:
        settings.remove_section(section)
    metadata = settings["metadata"]
    metadata["name"] = metadata["name"].replace("_", "-")
    if (copy / "README.md").is_file():
        # The page of the package index; where colcon builds, there is no such file.
        metadata["long_description"] = "file: README.md"
        metadata["long_description_content_type"] = "text/markdown"
    with (copy / "setup.cfg").open("w", encoding="utf-8") as stream:
        settings.write(stream)
    return str(copy)


if __name__ == "__main__":
    sys.exit(main())
