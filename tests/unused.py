r"""Lists the functions of a folder that nothing calls in recorded runs of their users.

    python -m tests.unused src -- python -m pytest -q tests/pair tests/replay tests/ros
    python -m tests.unused src -- python -m tests.bench
    python -m tests.unused src

    python -m tests.unused sitl -- python -m pytest -q tests/pair tests/interop
    PYTHONPATH=sitl/tests:$PYTHONPATH python -m tests.unused sitl -- \
        python -m interop.dronekit_suite CHECKOUT
    python -m tests.unused sitl

With a command: runs it and records the functions that it and its processes call, in
out/called_FOLDER. Without: lists those of no recorded run, with their lines, and ends with 1 when
there are any. Each function marks itself, once, so a run is hardly slower; it does so by its name,
so that records outlive edits. Functions that stay although no run called them stand with the
reason in FOLDER/tests/data/kept_functions.yaml.
Commands to run: for src all tests but those of units (tests/unit calls what it tests), the
benchmarks and the commands of the documentation; for sitl the clients of tests/interop and
sitl/tests/interop, the suites of sitl/docs/suites.md, the bridge (tests/pair, tests/ros,
tests/explore), and the tests that run the simulator's command and read its files as its pages show
(test_program, test_options, test_world, test_sitl_documentation and test_pytest_plugin of
sitl/tests/unit).
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

import yaml

_TOP = Path(__file__).parents[1]
_RECORDER = """
import ast, builtins, importlib.machinery, os, sys
_to = os.open(os.environ["CALLED_FILE"], os.O_WRONLY | os.O_APPEND | os.O_CREAT)
_packages = os.environ["CALLED_PACKAGES"].split()

def _call(function):
    builtins._called_.add(function)
    os.write(_to, f"{function}\\n".encode())

builtins._called_, builtins._call_ = set(), _call

class _Marks(ast.NodeTransformer):
    def __init__(self, module):
        self.module, self.within = module, []

    def visit_ClassDef(self, node):
        self.within.append(node.name)
        self.generic_visit(node)
        self.within.pop()
        return node

    def visit_FunctionDef(self, node):
        self.visit_ClassDef(node)
        function = repr(f"{self.module}:{'.'.join([*self.within, node.name])}")
        has_text = ast.get_docstring(node, clean=False) is not None
        mark = ast.parse(f"{function} in _called_ or _call_({function})").body[0]
        for each in ast.walk(mark):
            ast.copy_location(each, node)
        node.body.insert(int(has_text), mark)
        return node

    visit_AsyncFunctionDef = visit_FunctionDef

class _Loader(importlib.machinery.SourceFileLoader):
    def source_to_code(self, data, path, *, _optimize=-1):
        tree = _Marks(self.name).visit(ast.parse(data))
        return compile(tree, path, "exec", dont_inherit=True, optimize=_optimize)

class _Finder(importlib.machinery.PathFinder):
    @classmethod
    def find_spec(cls, name, path=None, target=None):
        if name.partition(".")[0] not in _packages:
            return None
        spec = super().find_spec(name, path, target)
        if spec is not None and type(spec.loader) is importlib.machinery.SourceFileLoader:
            spec.loader = _Loader(spec.loader.name, spec.loader.path)
        return spec

sys.meta_path.insert(0, _Finder)
"""
"""As sitecustomize.py, in each process"""


class Function(NamedTuple):
    """A function of the folder.

    Attributes:
        path: of its file, below the project's folder.
        module: that holds it.
        first_line: with its decorators, as Python counts.
        lines: how many lines it has, with those of the functions in it.
        name: with that of its class.
    """

    path: str
    module: str
    first_line: int
    lines: int
    name: str

    @property
    def key(self) -> str:
        """As records have it."""
        return f"{self.module}:{self.name}"


def packages(folder: Path) -> list[Path]:
    """Return the folders of a folder's packages, without those of its tests."""
    found = [path.parent for path in folder.rglob("__init__.py")]
    outermost = (path for path in found if path.parent not in found)
    return sorted(path for path in outermost if "tests" not in path.relative_to(folder).parts)


def functions(folder: Path) -> Iterator[Function]:
    """All functions of a folder's packages that do something."""
    for package in packages(folder):
        for path in sorted(package.rglob("*.py")):
            names = path.relative_to(package.parent).with_suffix("").parts
            module = ".".join(names).removesuffix(".__init__")
            tree = ast.parse(path.read_text("utf-8"))
            yield from _functions_in(tree, path.relative_to(folder.parent).as_posix(), module, "")


def _functions_in(node: ast.AST, path: str, module: str, within: str) -> Iterator[Function]:
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.ClassDef):
            if not _has(child.bases, "Protocol"):
                yield from _functions_in(child, path, module, f"{within}{child.name}.")
        elif isinstance(child, (ast.FunctionDef, ast.AsyncFunctionDef)):
            first = min([child.lineno, *(each.lineno for each in child.decorator_list)])
            name = f"{within}{child.name}"
            if not _has(child.decorator_list, "abstractmethod", "overload"):
                lines = (child.end_lineno or first) - first + 1
                yield Function(path, module, first, lines, name)
                yield from _functions_in(child, path, module, f"{name}.")
        else:
            yield from _functions_in(child, path, module, within)


def _has(nodes: list[ast.expr], *names: str) -> bool:
    return any(isinstance(node, ast.Name) and node.id in names for node in nodes)


def record(folder: Path, records: Path, command: list[str]) -> int:
    """Run a command and record what it calls; returns its exit code."""
    records.mkdir(parents=True, exist_ok=True)
    number = len(list(records.iterdir()))
    with tempfile.TemporaryDirectory() as customized:
        (Path(customized) / "sitecustomize.py").write_text(_RECORDER, "utf-8")
        places = os.pathsep.join([customized, *filter(None, [os.environ.get("PYTHONPATH")])])
        environment = {**os.environ}
        environment.pop("PYTHONDONTWRITEBYTECODE", None)
        environment |= {
            "PYTHONPATH": places,
            "PYTHONPYCACHEPREFIX": f"{customized}/marked",
            "CALLED_FILE": str((records / f"{number}.txt").resolve()),
            "CALLED_PACKAGES": " ".join(path.name for path in packages(folder)),
        }
        return subprocess.run(command, env=environment, check=False).returncode


def uncalled(folder: Path, records: Path) -> list[Function]:
    """The functions that no recorded run called."""
    called = {
        line for path in records.glob("*.txt") for line in path.read_text("utf-8").splitlines()
    }
    return [each for each in functions(folder) if each.key not in called]


def kept(folder: Path) -> dict[str, str]:
    """The reason of each function that stays uncalled, by its `Function.key`."""
    path = folder / "tests" / "data" / "kept_functions.yaml"
    if not path.is_file():
        return {}
    groups = yaml.safe_load(path.read_text("utf-8"))
    return {key: group["reason"] for group in groups for key in group["functions"]}


def main() -> int:
    """Record or list.

    The exit code is that of the command; of a list 0 when it is empty, 1 when not, 2 without a
    record.
    """
    parser = argparse.ArgumentParser(
        prog="python -m tests.unused",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("folder", choices=("src", "sitl"), help="whose functions")
    parser.add_argument("command", nargs="*", help="to run and record")
    options = parser.parse_args()
    folder, records = _TOP / options.folder, Path(f"out/called_{options.folder}")
    if options.command:
        return record(folder, records, options.command)
    if not records.is_dir():
        print(f"{records} has no record: run the users of {folder} first.", file=sys.stderr)
        return 2
    reasons, unused = kept(folder), uncalled(folder, records)
    found = [each for each in unused if each.key not in reasons]
    for each in found:
        print(f"{each.path}:{each.first_line}: {each.name}, {each.lines} lines")
    everything = sum(1 for _ in functions(folder))
    lines = sum(each.lines for each in found)
    print(f"{len(found)} of {everything} functions are not called, {lines} lines.")
    called = reasons.keys() - {each.key for each in unused}
    print(f"{len(reasons)} more stay for a reason; {len(called)} of them were called.")
    return 1 if found else 0


if __name__ == "__main__":
    raise SystemExit(main())
