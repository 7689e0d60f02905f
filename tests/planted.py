"""A plug-in for pytest: the product has a defect, or marks the statements that tests execute.

`python -m tests.worth` gives it `DEFECT`, the name of one in tests/explore/defects.py, or
`REACHED`, a file that gets the names of the defects whose statement was executed. Processes that a
test starts stay sound.
"""

from __future__ import annotations

import ast
import os
from pathlib import Path
from types import CodeType

from tests.explore.coverage import compile_marked, statement_lines
from tests.explore.defects import MUTANTS, Mutant, planted
from tests.explore.planting import Compile, plant, source_of

_MARKS = "__reached__"
_marks: dict[str, bytearray] = {}


def pytest_configure() -> None:
    """Plant what the environment asks for."""
    if "DEFECT" in os.environ:
        mutant = next(each for each in MUTANTS if each.name == os.environ["DEFECT"])
        plant(_broken(mutant))
    elif "REACHED" in os.environ:
        plant(_marked)


def pytest_unconfigure() -> None:
    """Report which defects were reached."""
    if "REACHED" in os.environ:
        names = [mutant.name for mutant in MUTANTS if _is_reached(mutant)]
        Path(os.environ["REACHED"]).write_text("\n".join(names), encoding="utf-8")


def _broken(mutant: Mutant) -> Compile:
    def compiled(name: str, source: str, path: Path) -> tuple[CodeType, dict[str, object]] | None:
        if name != mutant.module:
            return None
        return compile(ast.parse(planted(source, mutant)), str(path), "exec"), {}

    return compiled


def _marked(name: str, source: str, path: Path) -> tuple[CodeType, dict[str, object]]:
    _marks[name] = bytearray(source.count("\n") + 2)
    return compile_marked(source, path), {_MARKS: _marks[name]}


def _is_reached(mutant: Mutant) -> bool:
    if mutant.module not in _marks:
        return False
    source = source_of(mutant.module)
    before = source.partition(mutant.sound)[0].count("\n") + 1
    lines = range(before, before + mutant.sound.count("\n") + 1)
    first = {statement_lines(source)[line] for line in lines}
    # Outside all functions it was executed by the import.
    return any(line == 0 or _marks[mutant.module][line] for line in first)
