"""Mutants made by a tool: mutmut changes one node of a module's syntax tree at a time.

Only its generator is used; it is no requirement of this project.
"""

from __future__ import annotations

import ast
import importlib
import json
import random
from collections.abc import Iterator, Sequence
from itertools import islice
from typing import Any

from tests.explore.coverage import OUT, modules, sources_version, statement_lines
from tests.explore.hunt import Defect
from tests.explore.planting import source_of

VERSION = "3.8.1"
INSTALL = f"python -m pip install mutmut=={VERSION}"
_SEED = 17
GROUPS: dict[str, tuple[str, ...]] = {
    "bridge": ("navigation_bridge.bridge", "navigation_bridge.engine", "navigation_bridge.effects",
               "navigation_bridge.vehicle_events", "navigation_bridge.goals.active_goal",
               "navigation_bridge.reporting"),
    "rules": ("navigation_bridge.rules.", "navigation_bridge.supervision.preflight",
              "navigation_core.safety."),
    "admission": ("navigation_bridge.tasks.", "navigation_bridge.goals.point_requests",
                  "navigation_bridge.goals.route_requests"),
    "stations": ("navigation_bridge.supervision.s", "navigation_bridge.supervision.p",
                 "navigation_bridge.vehicle.takeover", "mavlink_vehicle.protocols.stations."),
    "missions": ("mavlink_vehicle.protocols.mission.", "navigation_bridge.goals.mission_plan",
                 "navigation_core.tasks.watching."),
    "planner": ("navigation_core.planning.", "navigation_core.tasks.leading."),
    "vehicle": ("mavlink_vehicle.vehicle", "mavlink_vehicle.protocols.operations.",
                "mavlink_vehicle.protocols.streams.setpoint_stream",
                "mavlink_vehicle.protocols.monitoring.heartbeat",
                "mavlink_vehicle.protocols.operation_slot", "navigation_core.tasks.flying."),
}  # fmt: skip
"""Groups of modules that are mutated, each with the beginnings of their names"""
# Texts meant for people; what depends on none of them.
_TELLING = frozenset({"log", "note", "remark", "text", "_tell"})


def generate(count: int) -> list[Defect]:
    """Return mutants, the same share of each group, chosen by a fixed seed.

    They are kept under out/explore for the same sources.

    Raises:
        SystemExit: the tool is not installed; says how to install it.
    """
    path = OUT / f"mutants_{sources_version()}_{count}.json"
    if not path.exists():
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(json.dumps([vars(defect) for defect in _generated(count)]))
    return [Defect(**row) for row in json.loads(path.read_text())]


def _generated(count: int) -> list[Defect]:
    try:
        tool = importlib.import_module("mutmut.mutation.file_mutation")
    except ImportError as error:
        raise SystemExit(f"This needs mutmut {VERSION}: {INSTALL}") from error
    rng = random.Random(_SEED)
    most = -(-count // len(GROUPS))
    shares = [list(islice(_share(tool, starts, rng), most)) for starts in GROUPS.values()]
    chosen = [share[place] for place in range(most) for share in shares if place < len(share)]
    return chosen[:count]


def _share(tool: Any, starts: Sequence[str], rng: random.Random) -> Iterator[Defect]:
    names = [name for name in modules() if name.startswith(tuple(starts))]
    made = [(name, parts) for name in names for parts in _changes(tool, name)]
    rng.shuffle(made)
    return _distinct(made)


def _changes(tool: Any, module: str) -> Iterator[tuple[Any, Any]]:
    """Yield the parsed module with each mutation; texts are left alone."""
    parsed, mutations, *_ = tool.create_mutations(f"{module}.py", source_of(module))
    for mutation in mutations:
        if not _is_text(mutation.original_node) and mutation.contained_by_top_level_function:
            yield parsed, mutation


def _is_text(node: Any) -> bool:
    kind = type(node).__name__
    if kind in ("SimpleString", "ConcatenatedString", "FormattedString"):
        return True
    if kind != "Call":
        return False
    name = getattr(node.func, "attr", node.func)
    return getattr(name, "value", "") in _TELLING


def _distinct(made: Sequence[tuple[str, tuple[Any, Any]]]) -> Iterator[Defect]:
    """Yield what changes the code, one mutant a statement."""
    seen: set[tuple[str, int]] = set()
    for module, (parsed, mutation) in made:
        sound = source_of(module)
        source = parsed.deep_replace(mutation.original_node, mutation.mutated_node).code
        if not _compiles(source) or ast.dump(ast.parse(source)) == ast.dump(ast.parse(sound)):
            continue
        defect = Defect("", module, source)
        line = statement_lines(sound)[defect.line]
        if line and (module, line) not in seen:
            seen.add((module, line))
            yield Defect(f"{module}:{defect.line}: {_change(defect, sound)}", module, source)


def _compiles(source: str) -> bool:
    try:
        compile(source, "mutant", "exec")
    except SyntaxError:
        return False
    return True


def _change(defect: Defect, sound: str) -> str:
    lines = sound.split("\n"), defect.source.split("\n")
    before, after = (text[defect.line - 1].strip() for text in lines)
    return f"{before} -> {after}"
