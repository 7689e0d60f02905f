"""Prints how far one turn of the bridge goes through the code: ``python -m tests.shape``.

A simulated flight is traced where one thing happens: a setpoint goes out, a position becomes
feedback, a goal is checked and started, a station's MISSION_CLEAR_ALL ends a mission's goal. For
each, how many functions were called, how many different ones, in how many files, and how often a
call went from one package into another. Then figures of the source itself. The figures are the same
on any machine; ``--json`` prints them for comparison. ``--trace setpoint`` prints the calls of the
flows whose name has that word instead, in order and indented by depth, then the calls of each file.
"""

from __future__ import annotations

import argparse
import ast
import json
import re
import sys
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from types import CodeType, FrameType
from typing import Any

from rich.console import Console
from rich.table import Table

from mavlink_vehicle.codec import make, with_source
from navigation_bridge.goals.requests import Request
from tests.support.flights.simulated_flight import SimulatedFlight
from tests.support.flights.station_flight import StationFlight

_SOURCES = Path(__file__).resolve().parent.parent / "src"
# How a comment that asks for a second reading begins.
_RIDDLE = re.compile(r"(?:What|Who|Whose|So many|As near|So far|So long)\b(?!.*\?$)")


@dataclass
class Turn:
    """The functions that were called during one event.

    Attributes:
        calls: of functions of the product, all.
        functions: the different ones.
        crossings: calls from one package into another.
        trace: the calls in order, each with its depth.
    """

    calls: int = 0
    functions: set[CodeType] = field(default_factory=set)
    crossings: int = 0
    trace: list[tuple[int, CodeType]] = field(default_factory=list)

    @property
    def files(self) -> set[str]:
        """Files of the functions."""
        return {code.co_filename for code in self.functions}

    def figures(self) -> dict[str, int]:
        """Return the figures by name."""
        return {
            "calls": self.calls,
            "functions": len(self.functions),
            "files": len(self.files),
            "changes of package": self.crossings,
        }


@contextmanager
def traced() -> Iterator[Turn]:
    """Count the calls of the product's functions inside the context."""
    turn = Turn()

    def note(frame: FrameType, event: str, _: object) -> None:
        package = _package(frame.f_code) if event == "call" else None
        if package is None:
            return
        turn.calls += 1
        turn.functions.add(frame.f_code)
        caller = frame.f_back
        while caller is not None and _package(caller.f_code) is None:
            caller = caller.f_back
        turn.crossings += caller is not None and _package(caller.f_code) != package
        turn.trace.append((_depth(frame), frame.f_code))

    sys.setprofile(note)
    try:
        yield turn
    finally:
        sys.setprofile(None)


def _depth(frame: FrameType) -> int:
    """Return how many functions of the product wait for this one."""
    depth = 0
    caller = frame.f_back
    while caller is not None:
        depth += _package(caller.f_code) is not None
        caller = caller.f_back
    return depth


_packages: dict[str, str | None] = {}


def _package(code: CodeType) -> str | None:
    """Return the package of the product that holds a function, or None."""
    if code.co_name in ("<genexpr>", "<listcomp>", "<dictcomp>", "<setcomp>", "<lambda>"):
        return None
    if code.co_filename not in _packages:
        path = Path(code.co_filename).resolve()
        inside = path.is_relative_to(_SOURCES)
        names = path.relative_to(_SOURCES).parts[1:2] if inside else ()
        _packages[code.co_filename] = names[0] if names else None
    return _packages[code.co_filename]


# --- flows -----------------------------------------------------------------------------------


def a_setpoint() -> Turn:
    """One further setpoint of a goal under way, to its bytes; nothing else is due."""
    flight = SimulatedFlight().ready()
    flight.run_to_status(flight.send(60.0, 0.0, 5.0), "NAVIGATING")
    flight.run_for(3.0)
    turns = []
    for _ in range(200):
        sent = len(flight.sent)
        with _at(flight.bridge, "receive", _untraced), traced() as turn:
            flight.tick()
        names = [message.get_type() for _, message in flight.sent[sent:]]
        if names == ["SET_POSITION_TARGET_LOCAL_NED"]:
            turns.append(turn)
    return _usual(turns)


def a_feedback() -> Turn:
    """A GLOBAL_POSITION_INT to feedback."""
    flight = SimulatedFlight().ready()
    goal_id = flight.send(60.0, 0.0, 5.0)
    flight.run_to_status(goal_id, "NAVIGATING")
    turns: list[Turn] = []

    def receive(plain: Callable[..., None], message: Any, now: float) -> None:
        before = len(flight.feedback(goal_id))
        with traced() as turn:
            plain(message, now)
        flight._collect()
        if message.get_type() == "GLOBAL_POSITION_INT" and len(flight.feedback(goal_id)) > before:
            turns.append(turn)

    with _at(flight.bridge, "receive", receive):
        flight.run_for(3.0)
    return _usual(turns)


def a_check() -> Turn:
    """A goal that is checked."""
    flight = SimulatedFlight().ready()
    request: Request = flight.request(60.0, 0.0, 5.0)
    flight.check(request)
    with traced() as turn:
        flight.bridge.goals.check(request, flight.now)
    return turn


def a_start() -> Turn:
    """A goal that is checked and started."""
    flight = SimulatedFlight().ready()
    request: Request = flight.request(60.0, 0.0, 5.0)
    with traced() as turn:
        flight.bridge.goals.check(request, flight.now)
        flight.bridge.goals.start("0" * 32, request, flight.now)
    return turn


def a_cancel_by_clearing() -> Turn:
    """A station's MISSION_CLEAR_ALL, overheard, and its ACK, to the goal's cancelling."""
    flight = StationFlight("ardupilot", "copter")
    flight.begin(by_mission=True)
    message = make("MISSION_CLEAR_ALL", target_system=1, target_component=1)
    answer = make("MISSION_ACK", target_system=255, target_component=190, type=0, mission_type=0)
    with_source(answer, 1, 1)
    with traced() as turn:
        flight.bridge.overhear(message, flight.now)
        flight.bridge.receive(answer, flight.now)
    return turn


FLOWS: dict[str, Callable[[], Turn]] = {
    "a further setpoint": a_setpoint,
    "a position to feedback": a_feedback,
    "a goal checked": a_check,
    "a goal checked and started": a_start,
    "MISSION_CLEAR_ALL to a cancel": a_cancel_by_clearing,
}


@contextmanager
def _at(owner: object, name: str, wrapper: Callable[..., Any]) -> Iterator[None]:
    """Call ``wrapper`` with the method and its arguments instead of the method."""
    plain = getattr(owner, name)
    setattr(owner, name, lambda *arguments: wrapper(plain, *arguments))
    try:
        yield
    finally:
        delattr(owner, name)


def _untraced(plain: Callable[..., Any], *arguments: Any) -> Any:
    profile = sys.getprofile()
    sys.setprofile(None)
    try:
        return plain(*arguments)
    finally:
        sys.setprofile(profile)


def _usual(turns: list[Turn]) -> Turn:
    """Return the one in the middle, by calls."""
    return sorted(turns, key=lambda turn: turn.calls)[len(turns) // 2]


# --- source ----------------------------------------------------------------------------------


def figures_of_source() -> dict[str, int]:
    """Return figures of the product without the simulator."""
    lines = narrowing = anything = riddles = 0
    largest, methods, writers = 0, 0, set()
    for path in sorted(_SOURCES.glob("*/*/**/*.py")):
        text = path.read_text(encoding="utf-8")
        tree = ast.parse(text)
        lines += _code_lines(text, tree)
        riddles += sum(1 for comment in _comments(text, tree) if _RIDDLE.match(comment))
        for node in ast.walk(tree):
            if isinstance(node, ast.ClassDef):
                own = [each for each in node.body if isinstance(each, ast.FunctionDef)]
                largest = max(largest, (node.end_lineno or 0) - node.lineno + 1)
                methods = max(methods, len(own))
            narrowing += isinstance(node, ast.Assert) and _narrows(node.test)
            anything += isinstance(node, ast.Name) and node.id == "Any"
            if isinstance(node, ast.Attribute) and isinstance(node.ctx, ast.Store):
                owner = node.value
                name = owner.attr if isinstance(owner, ast.Attribute) else getattr(owner, "id", "")
                if name in ("goal", "_goal") and "navigation_bridge" in path.parts:
                    writers.add(path)
    return {
        "lines of code": lines,
        "largest class, lines": largest,
        "most methods of a class": methods,
        "modules that write a goal": len(writers),
        "narrowing asserts": narrowing,
        "uses of Any": anything,
        "riddles": riddles,
    }


def _narrows(test: ast.expr) -> bool:
    """Tell whether an assertion only says that something is not None, or of a type."""
    if isinstance(test, ast.Compare):
        return isinstance(test.ops[0], ast.IsNot)
    return isinstance(test, ast.Call) and getattr(test.func, "id", "") == "isinstance"


def _code_lines(text: str, tree: ast.AST) -> int:
    """Return how many lines are neither empty nor comment nor docstring."""
    documented: set[int] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            documented.update(range(node.lineno, (node.end_lineno or node.lineno) + 1))
    return sum(
        1
        for number, line in enumerate(text.splitlines(), 1)
        if line.strip() and not line.lstrip().startswith("#") and number not in documented
    )


def _comments(text: str, tree: ast.AST) -> Iterator[str]:
    """Yield the first line of each comment and docstring, and of each of its sentences' lines."""
    before = ""
    for line in text.splitlines():
        stripped = line.strip()
        if stripped.startswith("# ") and not before.startswith("#"):
            yield stripped[2:]
        before = stripped
    for node in ast.walk(tree):
        value = node.value if isinstance(node, ast.Expr) else None
        if isinstance(value, ast.Constant) and isinstance(value.value, str):
            yield from (line.strip() for line in value.value.splitlines())


def print_trace(turn: Turn) -> None:
    """Print the calls of a turn in order, then how many fell to each file and function."""
    for depth, code in turn.trace:
        name = Path(code.co_filename).stem
        print(f"{'  ' * depth}{name}:{code.co_firstlineno} {code.co_qualname}")
    counts = Counter(code for _, code in turn.trace)
    for file in sorted(turn.files, key=lambda file: -_calls_in(counts, file)):
        print(f"\n{_calls_in(counts, file):5} {Path(file).resolve().relative_to(_SOURCES)}")
        for code, count in counts.most_common():
            if code.co_filename == file:
                print(f"{count:10} {code.co_qualname}")


def _calls_in(counts: Counter[CodeType], file: str) -> int:
    return sum(count for code, count in counts.items() if code.co_filename == file)


def main() -> int:
    """Print the figures."""
    parser = argparse.ArgumentParser(prog="python -m tests.shape", description=__doc__)
    parser.add_argument("--json", action="store_true", help="print JSON instead of tables")
    parser.add_argument("--trace", metavar="WORD", help="print the calls of these flows instead")
    options = parser.parse_args()
    if options.trace:
        for name, flow in FLOWS.items():
            if options.trace in name:
                print(name)
                print_trace(flow())
        return 0
    turns = {name: flow().figures() for name, flow in FLOWS.items()}
    source = figures_of_source()
    if options.json:
        print(json.dumps({"turns": turns, "source": source}, indent=2))
        return 0
    console = Console()
    table = Table("one vehicle, traced", *next(iter(turns.values())))
    for name, figures in turns.items():
        table.add_row(name, *map(str, figures.values()))
    console.print(table)
    table = Table("source, without the simulator", "")
    for name, figure in source.items():
        table.add_row(name, str(figure))
    console.print(table)
    return 0


if __name__ == "__main__":
    sys.exit(main())
