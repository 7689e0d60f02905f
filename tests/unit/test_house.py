"""Rules of the house that no import contract holds: folders and class names."""

from __future__ import annotations

import ast
from collections import Counter, defaultdict
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[2]
PRODUCT = sorted(
    file
    for top in ("src", "sitl")
    for file in (ROOT / top).glob("*/**/*.py" if top == "src" else "mavlink_sitl/**/*.py")
)
MODULES_MAX = 15
"""Modules of one folder, without ``__init__``."""


def _name(file: Path) -> str:
    return file.relative_to(ROOT).as_posix()


@cache
def _parsed(file: Path) -> ast.Module:
    return ast.parse(file.read_text())


def test_the_product_is_found() -> None:
    assert len(PRODUCT) > 500


def test_no_folder_grows_past_fifteen_modules() -> None:
    modules = Counter(_name(file.parent) for file in PRODUCT if file.name != "__init__.py")
    assert {folder: n for folder, n in modules.items() if n > MODULES_MAX} == {}


def test_a_class_name_has_one_meaning_in_src() -> None:
    homes: dict[str, list[str]] = defaultdict(list)
    for file in PRODUCT:
        if file.is_relative_to(ROOT / "src"):
            for node in ast.walk(_parsed(file)):
                if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                    homes[node.name].append(_name(file))
    assert {name: files for name, files in homes.items() if len(files) > 1} == {}
