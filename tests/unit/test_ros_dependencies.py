"""Each package.xml names what its package imports, by names that rosdep resolves."""

from __future__ import annotations

import ast
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree

import pytest

ROOT = Path(__file__).resolve().parents[2]
IN_SRC = sorted(path.parent for path in ROOT.glob("src/*/package.xml"))
PACKAGES = [*IN_SRC, ROOT / "sitl"]
PYTHON = [folder for folder in PACKAGES if (folder / "setup.cfg").is_file()]
KEYS = {
    line
    for line in (ROOT / "tests/data/rosdep_keys.txt").read_text("utf-8").splitlines()
    if not line.startswith("#")
}
KEY_OF = {
    "PIL": "python3-pil", "jsonschema": "python3-jsonschema", "matplotlib": "python3-matplotlib",
    "mcap": "mcap-ros2-support", "numpy": "python3-numpy", "pymavlink": "python3-pymavlink-pip",
    "pytest": "python3-pytest", "rich": "python3-rich", "scipy": "python3-scipy",
    "serial": "python3-serial", "websockets": "python3-websockets", "yaml": "python3-yaml",
}  # fmt: skip
"""rosdep's key by the name of a Python module; those of ROS packages are the same"""
PYPI_ONLY = {
    "fastcrc": "fastcrc", "imageio_ffmpeg": "imageio-ffmpeg", "pmtiles": "pmtiles",
    "pyarrow": "pyarrow", "pyulog": "pyulog", "ruckig": "ruckig", "shtab": "shtab",
}  # fmt: skip
"""Name on the package index by the name of the module; docs/on_board.md says what each is for"""


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


@pytest.mark.parametrize("package", PACKAGES, ids=lambda path: path.name)
def test_rosdep_resolves_every_dependency(package: Path) -> None:
    """With `--from-paths src --ignore-src`, so the simulator's folder is not looked into."""
    assert named_in(package) - KEYS - {name_of(path) for path in IN_SRC} == set()


@pytest.mark.parametrize("package", PYTHON, ids=lambda path: path.name)
def test_every_import_is_a_dependency_or_on_the_package_index_alone(package: Path) -> None:
    wanted = {KEY_OF.get(name, name) for name in imported_by(package) - PYPI_ONLY.keys()}
    assert wanted - named_in(package) - {"mavlink_sitl"} == set()
    # Nothing is named that is not imported.
    modules = {key for key in named_in(package) if key in KEY_OF.values()}
    assert modules - wanted - {"python3-pytest"} == set()


def test_the_list_of_keys_has_those_that_are_named_and_no_others() -> None:
    assert set().union(*map(named_in, PACKAGES)) - {name_of(path) for path in IN_SRC} == KEYS


def test_what_is_on_the_package_index_alone_is_documented_with_its_loss() -> None:
    page = (ROOT / "docs/on_board.md").read_text("utf-8")
    section = page.split("## As a package of a ROS workspace\n", 1)[1].split("\n## ")[0]
    rows = dict(re.findall(r"^\| `([\w-]+)` \| (.+) \|$", section, re.MULTILINE))
    assert rows.keys() == set(PYPI_ONLY.values())
    imported = set().union(*map(imported_by, PYTHON))
    assert imported >= PYPI_ONLY.keys()
