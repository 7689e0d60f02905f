"""Names of packages by rosdep's keys, and rosdep itself on the keys in tests/data/rosdep."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

from tests.support.processes import HANGS_AFTER_S

ROOT = Path(__file__).resolve().parents[2]
DATA = ROOT / "tests/data/rosdep"

KEY_OF = {
    "PIL": "python3-pil", "jsonschema": "python3-jsonschema", "matplotlib": "python3-matplotlib",
    "mcap": "mcap-ros2-support", "numpy": "python3-numpy", "pymavlink": "python3-pymavlink-pip",
    "pytest": "python3-pytest", "rich": "python3-rich", "scipy": "python3-scipy",
    "serial": "python3-serial", "shapely": "python3-shapely",
    "websockets": "python3-websockets", "yaml": "python3-yaml",
}  # fmt: skip
"""rosdep's key by the name of a Python module; those of ROS packages are the same"""
PYPI_ONLY = {
    "fastcrc": "fastcrc", "imageio_ffmpeg": "imageio-ffmpeg", "mcp": "mcp", "pmtiles": "pmtiles",
    "pyarrow": "pyarrow", "pyulog": "pyulog", "ruckig": "ruckig", "shtab": "shtab",
}  # fmt: skip
"""Name on the package index by the name of the module; docs/on_board.md says what each is for"""
DISTRIBUTION_OF = {
    "mcap-ros2-support": "mcap-ros2-support", "python3-jsonschema": "jsonschema",
    "python3-matplotlib": "matplotlib", "python3-numpy": "numpy", "python3-pil": "pillow",
    "python3-pymavlink-pip": "pymavlink", "python3-pytest": "pytest", "python3-rich": "rich",
    "python3-scipy": "scipy", "python3-serial": "pyserial", "python3-shapely": "shapely",
    "python3-websockets": "websockets",
    "python3-yaml": "PyYAML",
}  # fmt: skip
"""Name on the package index by rosdep's key"""


class Rosdep:
    """rosdep as on Ubuntu 24.04 with Jazzy, without a network: it prints what it would install."""

    def __init__(self, folder: Path) -> None:
        """Take in the keys.

        Args:
            folder: an empty one, for its settings.
        """
        sources = folder / "sources"
        sources.mkdir()
        (sources / "20-default.list").write_text(f"yaml {(DATA / 'python.yaml').as_uri()}\n")
        # rosdep takes packages in these folders for installed.
        there = ("AMENT_PREFIX_PATH", "CMAKE_PREFIX_PATH", "ROS_PACKAGE_PATH")
        self._environment = {
            **{name: value for name, value in os.environ.items() if name not in there},
            "HOME": str(folder),
            "ROS_HOME": str(folder / "ros"),
            "ROSDEP_SOURCE_PATH": str(sources),
            "ROSDISTRO_INDEX_URL": (DATA / "index-v4.yaml").as_uri(),
            "ROS_PYTHON_VERSION": "3",
        }
        done = self._run("update", "--rosdistro", "jazzy")
        assert done.returncode == 0, done.stdout + done.stderr

    def install(self, *folders: Path) -> subprocess.CompletedProcess[str]:
        """Run `rosdep install --from-paths FOLDERS --ignore-src`, which installs nothing here."""
        options = ["--ignore-src", "--simulate", "-y", "--os=ubuntu:noble", "--rosdistro=jazzy"]
        # Else it leaves out what this machine happens to have.
        options.append("--reinstall")
        return self._run("install", "--from-paths", *map(str, folders), *options)

    def _run(self, *words: str) -> subprocess.CompletedProcess[str]:
        command = [
            sys.executable,
            "-c",
            "from rosdep2.main import rosdep_main; rosdep_main()",
            *words,
        ]
        return subprocess.run(
            command,
            env=self._environment,
            capture_output=True,
            text=True,
            timeout=HANGS_AFTER_S,
            check=False,
        )
