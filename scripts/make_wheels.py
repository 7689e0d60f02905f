"""Builds the packages that are useful without ROS as wheels: `make wheels`.

Each is built from a copy, with the `setup.cfg` that colcon uses less the sections that only ROS
needs: the entries of ament's index, and the folder of the executables. No network: the build
tools are those of this environment.
"""

from __future__ import annotations

import argparse
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
OF_ROS = ("options.data_files", "develop", "install")
NOT_COPIED = shutil.ignore_patterns("build", "dist", "*.egg-info", "__pycache__")


def main() -> int:
    """Build all wheels; the exit code is pip's."""
    parser = argparse.ArgumentParser(description="Build the wheels that need no ROS.")
    parser.add_argument(
        "--out", type=Path, default=ROOT / "dist", help="folder to write to (default: dist)"
    )
    folder = parser.parse_args().out.resolve()
    with tempfile.TemporaryDirectory() as scratch:
        copies = [_copy(package, Path(scratch)) for package in PACKAGES]
        pip = [sys.executable, "-m", "pip", "--disable-pip-version-check", "wheel", "--quiet"]
        offline = ["--no-index", "--no-deps", "--no-build-isolation"]
        code = subprocess.call([*pip, *offline, "--wheel-dir", str(folder), *copies])
    if not code:
        version = (ROOT / "VERSION").read_text("utf-8").strip()
        print("\n".join(sorted(str(path) for path in folder.glob(f"*-{version}-*.whl"))))
    return code


def _copy(package: Path, folder: Path) -> str:
    """Copy a package with its licence, without what is ROS's own; return where it is."""
    copy = folder / package.name
    shutil.copytree(package, copy, ignore=NOT_COPIED)
    shutil.copy(ROOT / "LICENSE", copy)
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
