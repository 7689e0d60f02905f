r"""Lists the functions of the simulator that nothing calls in recorded runs of its users.

    python -m tests.unused_sitl -- python -m pytest -q tests/pair tests/interop
    PYTHONPATH=sitl/tests:$PYTHONPATH python -m tests.unused_sitl -- \
        python -m interop.dronekit_suite CHECKOUT
    python -m tests.unused_sitl

With a command: runs it and records the functions that it and its processes call, in
out/called_sitl. Without: lists those of no recorded run, with their lines. Each function marks
itself, once, so a run is hardly slower. What to run: the clients of tests/interop and
sitl/tests/interop, the suites of sitl/docs/suites.md, and the bridge (tests/pair, tests/explore).
"""

from __future__ import annotations

import argparse
import ast
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

CALLED = Path("out/called_sitl")
_PACKAGE = Path(__file__).parents[1] / "sitl" / "mavlink_sitl"
_RECORDER = """
import ast, builtins, importlib.machinery, os, sys
_to = os.open(os.environ["CALLED_SITL"], os.O_WRONLY | os.O_APPEND | os.O_CREAT)

class _Marks(ast.NodeTransformer):
    def __init__(self, path):
        self.path = path

    def visit_FunctionDef(self, node):
        self.generic_visit(node)
        first = min([node.lineno, *(each.lineno for each in node.decorator_list)])
        has_text = ast.get_docstring(node, clean=False) is not None
        key = f"{self.path}:{first}"
        mark = ast.parse(f"{key!r} in _called_ or _call_({key!r})").body[0]
        for each in ast.walk(mark):
            ast.copy_location(each, node)
        node.body.insert(int(has_text), mark)
        return node

class _Loader(importlib.machinery.SourceFileLoader):
    def get_code(self, fullname):
        path = self.path.rpartition("/mavlink_sitl/")[2]
        tree = _Marks(path).visit(ast.parse(self.get_data(self.path)))
        return compile(tree, self.path, "exec", dont_inherit=True)

class _Finder(importlib.machinery.PathFinder):
    @classmethod
    def find_spec(cls, name, path=None, target=None):
        if name.partition(".")[0] != "mavlink_sitl":
            return None
        spec = super().find_spec(name, path, target)
        if spec is not None and type(spec.loader) is importlib.machinery.SourceFileLoader:
            spec.loader = _Loader(spec.loader.name, spec.loader.path)
        return spec

_called = set()
def _call(key):
    _called.add(key)
    os.write(_to, f"{key}\\n".encode())

# Of the builtins, since a package's __main__ is run without its loader.
builtins._called_, builtins._call_ = _called, _call
sys.meta_path.insert(0, _Finder)
"""
"""As sitecustomize.py, in each process"""


class Function(NamedTuple):
    """A function of the simulator.

    Attributes:
        path: of its file, below mavlink_sitl.
        first_line: with its decorators, as Python counts.
        lines: how many lines it has, with those of the functions in it.
        name: with that of its class.
    """

    path: str
    first_line: int
    lines: int
    name: str


def functions(package: Path = _PACKAGE) -> Iterator[Function]:
    """All functions of a package that do something."""
    for path in sorted(package.rglob("*.py")):
        tree = ast.parse(path.read_text("utf-8"))
        yield from _functions_in(tree, path.relative_to(package).as_posix(), "")


def _functions_in(node: ast.AST, path: str, within: str) -> Iterator[Function]:
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.ClassDef):
            if not _has(child.bases, "Protocol"):
                yield from _functions_in(child, path, f"{within}{child.name}.")
        elif isinstance(child, ast.FunctionDef):
            first = min([child.lineno, *(each.lineno for each in child.decorator_list)])
            name = f"{within}{child.name}"
            if not _has(child.decorator_list, "abstractmethod"):
                yield Function(path, first, (child.end_lineno or first) - first + 1, name)
                yield from _functions_in(child, path, f"{name}.")
        else:
            yield from _functions_in(child, path, within)


def _has(nodes: list[ast.expr], name: str) -> bool:
    return any(isinstance(node, ast.Name) and node.id == name for node in nodes)


def record(command: list[str]) -> int:
    """Run a command and record what it calls; returns its exit code."""
    CALLED.mkdir(parents=True, exist_ok=True)
    number = len(list(CALLED.iterdir()))
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "sitecustomize.py").write_text(_RECORDER, "utf-8")
        places = os.pathsep.join([folder, *filter(None, [os.environ.get("PYTHONPATH")])])
        recorded = str((CALLED / f"{number}.txt").resolve())
        changed = {"PYTHONPATH": places, "CALLED_SITL": recorded}
        return subprocess.run(command, env=os.environ | changed, check=False).returncode


def uncalled() -> list[Function]:
    """The functions that no recorded run called."""
    called = {
        line for path in CALLED.glob("*.txt") for line in path.read_text("utf-8").splitlines()
    }
    return [each for each in functions() if f"{each.path}:{each.first_line}" not in called]


def main() -> int:
    """Record or list; the exit code is that of the command, or 2 without a record."""
    parser = argparse.ArgumentParser(
        prog="python -m tests.unused_sitl",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("command", nargs="*", help="to run and record")
    options = parser.parse_args()
    if options.command:
        return record(options.command)
    if not CALLED.is_dir():
        print(f"{CALLED} has no record: run the simulator's users first.", file=sys.stderr)
        return 2
    found = uncalled()
    for each in found:
        print(f"{each.path}:{each.first_line}: {each.name}, {each.lines} lines")
    everything = sum(1 for _ in functions())
    lines = sum(each.lines for each in found)
    print(f"{len(found)} of {everything} functions are not called, {lines} lines.")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
