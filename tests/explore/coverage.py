"""Coverage of the exploration: the statements of the product that each seed executes.

`python -m tests.explore.coverage --seeds 120` flies them and lists the functions that none of them
reached, or why an exploration cannot reach a module. Marks are compiled into the modules as they
are imported; they cost little and need no tool. The map of all seeds is kept under out/explore for
the same sources.
"""

from __future__ import annotations

import argparse
import ast
import gc
import hashlib
import importlib
import json
import multiprocessing
import sys
import time
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path
from types import CodeType

from tests.explore.generate import LYING, SHARING_FROM, UNSAFE
from tests.explore.more_situations import MORE_SITUATIONS_FROM
from tests.explore.planting import PRODUCT, plant, source_of
from tests.explore.situations import SITUATIONS_FROM, TRAJECTORIES_FROM

OUT = Path("out/explore")
_HERE = Path(__file__).parent
_SOURCES = (*("src/" + name for name in PRODUCT), "sitl/mavlink_sitl")
_BESIDE_FLIGHTS = (
    "boxes.py",
    "coverage.py",
    "defects.py",
    "hunt.py",
    "mutants.py",
    "mutation_tool.py",
    "picture.py",
    "planting.py",
    "shrink.py",
    "test_boxes.py",
    "test_explore.py",
    "test_transitions.py",
    "transitions.py",
)
_MARKS = "__reached__"
# Every kind of seed takes its turn: shared traffic, situations, more of them, liars, sequences that
# are unsafe.
_KINDS = 8

OUTSIDE = {
    "sockets, serial ports, files, threads and clocks": ("tests/interop", "mavlink_vehicle.io"),
    "logs, which move nothing": (
        "tests/pair/test_log_requests.py",
        "mavlink_vehicle.protocols.logs",
        "navigation_bridge.requests.log_requests",
    ),
    "what is stored, which moves nothing": (
        "tests/pair/test_storage.py",
        "mavlink_vehicle.storage",
        "navigation_bridge.storage",
    ),
    "programs that ask": ("tests/ros", "navigation_bridge.clients"),
    "files and addresses that are read at the start": (
        "tests/unit/navigation",
        "navigation_bridge.configuration",
        "navigation_bridge.network",
        "navigation_bridge.plan_files",
    ),
    "vehicles in one process; here each has its own": ("tests/fleets", "navigation_bridge.fleet"),
    "recorded flights": (
        "tests/replay",
        "navigation_bridge.recording.replay",
        "navigation_bridge.recording.replay_driver",
        "navigation_bridge.recording.noted_outputs",
        "navigation_bridge.recording.shadow_command",
        "navigation_bridge.recording.shadow_file",
        "navigation_bridge.recording.shadow_goals",
    ),
    "surveys, which are computed and move nothing": (
        "tests/unit/core/test_survey.py",
        "navigation_bridge.goals.surveys",
        "navigation_core.surveys",
    ),
    "what is shown, not flown": (
        "tests/ros/test_topics.py",
        "navigation_bridge.scene",
        "navigation_bridge.vehicle.sample_times",
        "navigation_core.mapping.occupancy",
    ),
    "a thread; here searches take simulated time": (
        "tests/unit/core/test_late_searches.py",
        "navigation_bridge.search_thread",
    ),
    "what is passed on to the vehicle, and moves nothing": (
        "tests/pair/test_rtcm.py",
        "mavlink_vehicle.protocols.streams.computer_status",
        "mavlink_vehicle.protocols.streams.external_position",
        "mavlink_vehicle.protocols.streams.remote_id",
        "mavlink_vehicle.protocols.streams.rtcm",
    ),
    "positions of other programs": (
        "tests/pair/test_odom.py",
        "navigation_bridge.vehicle.odom_frame",
    ),
    "machines without Ruckig": (
        "tests/unit/core/test_trajectory.py",
        "navigation_core.trajectories.profiles",
        "navigation_core.trajectories.python_solver",
    ),
}
"""For each reason not to be reached: the tests instead, and modules and packages of the product"""


@dataclass(frozen=True, eq=False)
class Reached:
    """The lines that one seed reached in the sound sources.

    Attributes:
        seed: its number.
        digest: hash of its log.
        cpu_s: processor time.
        violations: names of policies; to be empty.
        lines: of each module, the first lines of the statements that were executed.
    """

    seed: int
    digest: str
    cpu_s: float
    violations: tuple[str, ...]
    lines: dict[str, frozenset[int]]


@dataclass(frozen=True)
class Function:
    """A function: its module, qualified name, and the first line of its body."""

    module: str
    name: str
    line: int


def compile_marked(source: str, path: Path) -> CodeType:
    """Compile a module so that its statements within functions mark themselves."""
    tree = ast.parse(source)
    for function in ast.walk(tree):
        if isinstance(function, ast.FunctionDef):
            _mark(function)
    return compile(ast.fix_missing_locations(tree), str(path), "exec")


def _mark(function: ast.FunctionDef) -> None:
    for node in [function, *_within(function)]:
        for block in _blocks(node):
            block[:] = [each for statement in block for each in _marked(statement)]


def _within(function: ast.AST) -> list[ast.AST]:
    """All nodes of a function, but not those of functions within it."""
    found: list[ast.AST] = []
    for child in ast.iter_child_nodes(function):
        if not isinstance(child, ast.FunctionDef | ast.Lambda | ast.expr):
            found += [child, *_within(child)]
    return found


def _blocks(node: ast.AST) -> Iterator[list[ast.stmt]]:
    for name in ("body", "orelse", "finalbody"):
        block = getattr(node, name, None)
        if isinstance(block, list) and block:
            yield block


def _marked(statement: ast.stmt) -> list[ast.stmt]:
    if isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant):
        return [statement]
    mark = ast.parse(f"{_MARKS}[{statement.lineno}] = 1").body[0]
    for node in ast.walk(mark):
        ast.copy_location(node, statement)
    return [mark, statement]


def functions(module: str) -> list[Function]:
    """Return the functions of a module that do anything."""
    found: list[Function] = []

    def look(node: ast.AST, within: str) -> None:
        for child in ast.iter_child_nodes(node):
            if isinstance(child, ast.FunctionDef):
                body = child.body[1:] if ast.get_docstring(child) else child.body
                if body and not isinstance(body[0], ast.Raise | ast.Pass):
                    found.append(Function(module, within + child.name, body[0].lineno))
            named = isinstance(child, ast.FunctionDef | ast.ClassDef)
            look(child, f"{within}{child.name}." if named else within)

    look(ast.parse(source_of(module)), "")
    return found


@cache
def statement_lines(source: str) -> tuple[int, ...]:
    """Return of each line of a source (from 1) the first line of its statement.

    A line outside all functions has 0: it is executed by the import.
    """
    first = [0] * (source.count("\n") + 2)
    for function in ast.walk(ast.parse(source)):
        if isinstance(function, ast.FunctionDef):
            nodes = [node for node in _within(function) if isinstance(node, ast.stmt)]
            for node in nodes:
                assert node.end_lineno is not None
                first[node.lineno : node.end_lineno + 1] = [node.lineno] * (
                    node.end_lineno + 1 - node.lineno
                )
    return tuple(first)


def modules() -> list[str]:
    """Return the names of the product's modules."""
    found = []
    for package in PRODUCT:
        root = _HERE.parents[1] / "src" / package
        paths = sorted((root / package).rglob("*.py"))
        found += [".".join(path.relative_to(root).with_suffix("").parts) for path in paths]
    return [name.removesuffix(".__init__") for name in found]


# --- the map ---------------------------------------------------------------------------------


def reach(seeds: Iterable[int], jobs: int = 1) -> dict[int, Reached]:
    """Return what seeds reach: from the map of these sources, or by flying them.

    Args:
        seeds: their numbers.
        jobs: processes that fly.
    """
    path = OUT / f"reached_{sources_version()}.json"
    known = _load(path)
    missing = [seed for seed in seeds if seed not in known]
    if missing:
        import_what_stays()
        OUT.mkdir(parents=True, exist_ok=True)
        context = multiprocessing.get_context("fork")
        with ProcessPoolExecutor(jobs, mp_context=context) as executor:
            for reached in executor.map(_fly_marked, missing):
                known[reached.seed] = reached
                _progress(reached, len(missing))
                with path.open("a") as file:
                    file.write(json.dumps(_plain(reached)) + "\n")
    return {seed: known[seed] for seed in seeds}


def _progress(reached: Reached, count: int) -> None:
    wrong = f", violates {', '.join(reached.violations)}" if reached.violations else ""
    print(f"seed {reached.seed} of {count}: {reached.cpu_s:.1f} s{wrong}", file=sys.stderr)


def import_what_stays() -> None:
    """Import what does not depend on the product before the processes part."""
    for name in ("numpy", "pymavlink.dialects.v20.all", "mavlink_sitl.simulation"):
        importlib.import_module(name)
    gc.freeze()


def _plain(reached: Reached) -> dict[str, object]:
    plain = asdict(reached)
    plain["lines"] = {name: sorted(lines) for name, lines in reached.lines.items()}
    return plain


def _load(path: Path) -> dict[int, Reached]:
    known = {}
    for text in path.read_text().splitlines() if path.exists() else ():
        row = json.loads(text)
        lines = {name: frozenset(lines) for name, lines in row["lines"].items()}
        known[row["seed"]] = Reached(
            row["seed"], row["digest"], row["cpu_s"], tuple(row["violations"]), lines
        )
    return known


def sources_version() -> str:
    """Return a hash of all sources that a flight depends on."""
    root = _HERE.parents[1]
    paths = [path for source in _SOURCES for path in (root / source).rglob("*.py")]
    digest = hashlib.sha256()
    scripts = [path for path in _HERE.glob("*.py") if path.name not in _BESIDE_FLIGHTS]
    for path in sorted([*paths, *scripts]):
        digest.update(path.read_bytes())
    return digest.hexdigest()[:12]


_marks: dict[str, bytearray] = {}
_at_import: dict[str, bytes] = {}


def _fly_marked(seed: int) -> Reached:
    if not _marks:
        plant(_compile_with_marks)
    explorer = importlib.import_module("tests.explore.explorer")
    for name, marks in _marks.items():
        marks[:] = _at_import.setdefault(name, bytes(marks))
    flown = explorer.explore_seed(seed)
    lines = {
        name: frozenset(place for place, mark in enumerate(marks) if mark)
        for name, marks in _marks.items()
        if any(marks)
    }
    found = [violation.policy for violation in flown.violations]
    return Reached(seed, flown.digest, flown.cpu_s, tuple(found), lines)


def _compile_with_marks(name: str, source: str, path: Path) -> tuple[CodeType, dict[str, object]]:
    _marks[name] = bytearray(source.count("\n") + 2)
    return compile_marked(source, path), {_MARKS: _marks[name]}


# --- the command -----------------------------------------------------------------------------


def main(arguments: Sequence[str] | None = None) -> int:
    """Fly seeds and list what none of them reached."""
    parser = argparse.ArgumentParser(prog="python -m tests.explore.coverage", description=__doc__)
    parser.add_argument("--seeds", type=int, default=120, help="number of seeds (default: 120)")
    parser.add_argument("--first", type=int, default=0, help="the first seed (default: 0)")
    options = parser.parse_args(arguments)
    begun_s = time.monotonic()
    numbers = range(options.first, options.first + options.seeds)
    reached = reach([_of_all_kinds(number) for number in numbers])
    print(f"{len(reached)} seeds, {time.monotonic() - begun_s:.0f} s\n")
    print(table(reached.values()))
    return 0


def _of_all_kinds(number: int) -> int:
    """Return a seed of the kind whose turn it is."""
    turn, kind = divmod(number, _KINDS)
    if kind == 0:
        return (number + SHARING_FROM) | (LYING if turn % 2 else 0)
    if kind == 1 and turn % 2:
        return turn // 2 + TRAJECTORIES_FROM
    if kind in (2, 6):
        return 2 * turn + kind // 6 + SITUATIONS_FROM
    if kind in (4, 5):
        return 2 * turn + kind - 4 + MORE_SITUATIONS_FROM
    return number | {3: LYING, 7: UNSAFE}.get(kind, 0)


def _outside(module: str) -> str:
    """Return why no exploration reaches a module; empty if one should."""
    for reason, (_, *names) in OUTSIDE.items():
        if any(f"{module}.".startswith(f"{name}.") for name in names):
            return reason
    return ""


def table(flights: Iterable[Reached]) -> str:
    """Return Markdown: the functions that no flight reached, and the modules that none can."""
    lines: dict[str, set[int]] = {}
    for reached in flights:
        for name, own in reached.lines.items():
            lines.setdefault(name, set()).update(own)
    rows = ["| Module | Functions | Reached | Never reached |", "|---|---|---|---|"]
    outside: dict[str, int] = {}
    totals = {package: [0, 0, 0] for package in PRODUCT}
    for module in modules():
        known = functions(module)
        missing = [f.name for f in known if f.line not in lines.get(module, ())]
        counts, reason = totals[module.partition(".")[0]], _outside(module)
        counts[0] += len(known)
        if reason:
            counts[1] += len(missing)
            outside[reason] = outside.get(reason, 0) + len(missing)
            continue
        counts[2] += len(missing)
        if missing:
            names = ", ".join(f"`{name}`" for name in missing)
            told = "all" if len(missing) == len(known) else names
            rows.append(f"| `{module}` | {len(known)} | {len(known) - len(missing)} | {told} |")
    rows += ["", "| Not reached on purpose | Functions | Tests |", "|---|---|---|"]
    rows += [f"| {why} | {count} | `{OUTSIDE[why][0]}` |" for why, count in outside.items()]
    rows += [
        "",
        "| Package | Functions | On purpose | Never reached | Share |",
        "|---|---|---|---|---|",
    ]
    for package, (count, purpose, never) in totals.items():
        rows.append(f"| `{package}` | {count} | {purpose} | {never} | {never / count:.0%} |")
    return "\n".join(rows)


if __name__ == "__main__":
    raise SystemExit(main())
