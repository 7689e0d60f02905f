"""Each package.xml names what its package imports, by names that rosdep resolves."""

from __future__ import annotations

import ast
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree

import pytest

from tests.support.rosdep import DATA, KEY_OF, PYPI_ONLY, Rosdep

ROOT = Path(__file__).resolve().parents[2]
IN_SRC = sorted(path.parent for path in ROOT.glob("src/*/package.xml"))
PACKAGES = [*IN_SRC, ROOT / "sitl"]
PYTHON = [folder for folder in PACKAGES if (folder / "setup.cfg").is_file()]
# ROS packages that ROS may lack as wheels, built from definitions of ours. colcon and rosdep are to
# take those of ROS.
STAND_INS = [path for path in IN_SRC if (path / "COLCON_IGNORE").is_file()]
BUILT = {path for path in IN_SRC if path not in STAND_INS}


def named_in(package: Path) -> set[str]:
    """What a package.xml names as a dependency of any kind."""
    root = ElementTree.parse(package / "package.xml").getroot()
    return {(tag.text or "").strip() for tag in root if tag.tag.endswith("depend")}


def name_of(package: Path) -> str:
    return ElementTree.parse(package / "package.xml").getroot().findtext("name", "")


def imports(tree: ast.AST) -> Iterator[str]:
    """The modules that are imported when a program runs, also late."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            yield node.module
        elif not (isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING"):
            yield from imports(node)


def imported_by(package: Path) -> set[str]:
    """The modules from elsewhere that a package imports, by their first name."""
    folders = [package / name_of(package), package / "launch"]
    files = [path for folder in folders for path in folder.rglob("*.py")]
    files += package.glob("pytest_*.py")
    found = {name for path in files for name in imports(ast.parse(path.read_text("utf-8")))}
    tops = {name.split(".")[0] for name in found} - {*sys.stdlib_module_names, name_of(package)}
    assert files
    return tops


@pytest.mark.parametrize("package", PYTHON, ids=lambda path: path.name)
def test_every_import_is_a_dependency_or_on_the_package_index_alone(package: Path) -> None:
    wanted = {KEY_OF.get(name, name) for name in imported_by(package) - PYPI_ONLY.keys()}
    assert wanted - named_in(package) - {"mavlink_sitl"} == set()
    # Nothing is named that is not imported.
    modules = {key for key in named_in(package) if key in KEY_OF.values()}
    assert modules - wanted - {"python3-pytest"} == set()


def test_definitions_of_ours_do_not_hide_those_of_ros() -> None:
    assert [path.name for path in STAND_INS] == ["geographic_msgs", "nav2_msgs", "tf2_msgs"]


@pytest.mark.wide
def test_rosdep_installs_every_dependency(tmp_path: Path) -> None:
    done = Rosdep(tmp_path).install(ROOT / "src", ROOT / "sitl")
    assert done.returncode == 0, done.stdout + done.stderr
    apt = set(re.findall(r"apt-get install -y (\S+)", done.stdout))
    pip = set(re.findall(r"pip3 install -U -I (\S+)", done.stdout))
    needed = set().union(*map(named_in, [*BUILT, ROOT / "sitl"])) - set(map(name_of, BUILT))
    assert pip == {"mcap-ros2-support", "pymavlink"}
    keys = {KEY_OF["mcap"], KEY_OF["pymavlink"]}
    keys |= {name.removeprefix("ros-jazzy-").replace("-", "_") for name in apt if "ros-" in name}
    keys |= {name for name in apt if name.startswith("python3-")}
    # Exactly these: the data name no key that nothing needs.
    assert keys == needed
    named = {line.split(":")[0] for line in (DATA / "python.yaml").read_text("utf-8").splitlines()}
    listed = re.findall(r"^ +- (\w+)$", (DATA / "jazzy.yaml").read_text("utf-8"), re.MULTILINE)
    assert needed == {name for name in named if not name.startswith("#")} | set(listed)


@pytest.mark.wide
def test_rosdep_names_a_key_that_it_does_not_know(tmp_path: Path) -> None:
    package = tmp_path / "src/flight_logs"
    package.mkdir(parents=True)
    text = (ROOT / "src/flight_logs/package.xml").read_text("utf-8")
    (package / "package.xml").write_text(text.replace("python3-rich", "python3-pyulog"), "utf-8")
    done = Rosdep(tmp_path).install(tmp_path / "src")
    assert done.returncode != 0
    assert "python3-pyulog" in done.stderr


def test_what_is_on_the_package_index_alone_is_documented_with_its_loss() -> None:
    page = (ROOT / "docs/on_board.md").read_text("utf-8")
    page = page.partition("## Installed by rosdep")[2].partition("\n## ")[0]
    rows = dict(re.findall(r"^\| `([\w-]+)` \| (.+) \|$", page, re.MULTILINE))
    assert rows.keys() == set(PYPI_ONLY.values())
    imported = set().union(*map(imported_by, PYTHON))
    assert imported >= PYPI_ONLY.keys()
