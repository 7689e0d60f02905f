"""Imports product modules with other code than their files have: with marks, or with a defect.

Nothing is written to disk and no byte code is kept.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from importlib.machinery import ModuleSpec, PathFinder, SourceFileLoader
from importlib.util import find_spec
from pathlib import Path
from types import CodeType, ModuleType

PRODUCT = ("mavlink_vehicle", "navigation_bridge", "navigation_core")
"""The packages that the exploration judges."""
Compile = Callable[[str, str, Path], tuple[CodeType, dict[str, object]] | None]
"""Of a module's name, source and file: its code and the globals it needs; None: as it is."""

_TOOLS = ("planting", "coverage", "hunt", "mutants", "mutation_tool")
_INDEPENDENT = {f"tests.explore.{name}" for name in _TOOLS}


class _Loader(SourceFileLoader):
    """Executes what a function compiled."""

    def __init__(self, name: str, path: str, code: CodeType, names: dict[str, object]) -> None:
        super().__init__(name, path)
        self._code = code
        self._names = names

    def exec_module(self, module: ModuleType) -> None:
        """Execute it."""
        vars(module).update(self._names)
        super().exec_module(module)

    def get_code(self, fullname: str) -> CodeType:
        """Return it."""
        return self._code


class Planter:
    """Finds the modules of the product; put it first on `sys.meta_path`."""

    def __init__(self, compile_module: Compile) -> None:
        """Begin."""
        self._compile = compile_module

    def find_spec(
        self, name: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Return a spec for a module that has other code."""
        if not is_product(name):
            return None
        spec = PathFinder.find_spec(name, path, target)
        if spec is None or spec.origin is None or not spec.origin.endswith(".py"):
            return None
        file = Path(spec.origin)
        compiled = self._compile(name, file.read_text(encoding="utf-8"), file)
        if compiled is not None:
            spec.loader = _Loader(name, spec.origin, *compiled)
        return spec


def is_product(name: str) -> bool:
    """Whether a module belongs to the product."""
    return name.partition(".")[0] in PRODUCT


def plant(compile_module: Compile) -> None:
    """Import the product again from here on; for processes that end afterwards."""
    for name in [name for name in sys.modules if is_product(name) or _depends(name)]:
        del sys.modules[name]
    sys.meta_path.insert(0, Planter(compile_module))


def _depends(name: str) -> bool:
    """Whether a module may hold on to the product's classes."""
    return name.startswith(("tests.explore.", "tests.support")) and name not in _INDEPENDENT


def source_of(module: str) -> str:
    """Return the source of a module."""
    spec = find_spec(module)
    assert spec is not None
    assert spec.origin is not None
    return Path(spec.origin).read_text(encoding="utf-8")
