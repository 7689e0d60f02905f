"""Without the packages that single commands need, these say which one and how to get it."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.processes import HANGS_AFTER_S

ROOT = Path(__file__).resolve().parents[2]
EXTRAS = ("imageio_ffmpeg", "mcap", "mcap_ros2", "mcp", "pmtiles", "pyarrow", "pyulog")
LOG = ROOT / "tests/data/rover_guided.tlog"


def without_extras(script: str, folder: Path) -> subprocess.CompletedProcess[str]:
    """Run Python where none of them can be imported."""
    hidden = f"import sys; sys.modules.update(dict.fromkeys({EXTRAS!r}))\n"
    command = [sys.executable, "-c", hidden + script]
    return subprocess.run(
        command, cwd=folder, capture_output=True, text=True, timeout=HANGS_AFTER_S, check=False
    )


EXPORT = f"""
from flight_logs.export_command import main
sys.exit(main([{str(LOG)!r}, '--to', 'out']))
"""
BAG = f"""
from drone_navigation.tlog2mcap import main
sys.exit(main([{str(LOG)!r}, '--out', 'a.mcap']))
"""
ULOG = """
open('a.ulg', 'wb').write(bytes.fromhex('554c6f67011235') + bytes(9))
from flight_reports.navigation_report import main
sys.exit(main(['a.ulg']))
"""
TILES = """
open('a.pmtiles', 'wb').close()
from drone_navigation.navigation_console import main
sys.exit(main(['--tiles', 'a.pmtiles']))
"""


AGENT = """
from drone_navigation.agents.navigation_mcp import main
sys.exit(main(['serve']))
"""


@pytest.mark.parametrize(
    ("package", "script"),
    [("mcp", AGENT), ("pyarrow", EXPORT), ("mcap", BAG), ("pyulog", ULOG), ("pmtiles", TILES)],
)
def test_a_missing_package_is_one_sentence(package: str, script: str, tmp_path: Path) -> None:
    done = without_extras(script, tmp_path)
    assert done.returncode in (1, 2), done.stderr
    last = done.stderr.strip().splitlines()[-1]
    assert f"needs the package {package}, which is not installed" in last
    assert "make setup-extras" in last
    assert "Traceback" not in done.stderr
    assert not list(tmp_path.glob("a.mcap*"))


def test_a_console_without_websockets_says_so_in_one_sentence(tmp_path: Path) -> None:
    older = "import sys; sys.modules['websockets'] = None\n"
    console = "from drone_navigation.navigation_console import main\nsys.exit(main([]))\n"
    done = without_extras(older + console, tmp_path)
    assert done.returncode == 1
    (said,) = done.stderr.strip().splitlines()
    assert said.startswith("The console needs the package websockets")


def test_only_what_needs_an_extra_imports_it() -> None:
    """The modules that import one at their top are imported late themselves."""
    late = {"archive.py", "columns.py", "export.py", "stdio_server.py"}
    found = set()
    for path in [*ROOT.glob("src/*/*/**/*.py"), *ROOT.glob("sitl/mavlink_sitl/**/*.py")]:
        for node in ast.parse(path.read_text("utf-8")).body:
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            if isinstance(node, ast.ImportFrom) and node.module:
                names = [node.module]
            if {name.split(".")[0] for name in names} & {*EXTRAS}:
                found.add(path.name)
    assert found == late
