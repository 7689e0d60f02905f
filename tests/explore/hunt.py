"""Hunts defects: flies the seeds that reach the changed statement, until a policy is violated.

Each defect has a process of its own, which parts from one that has imported all but the product.
Its flights are compared with those of the sound sources: equal hashes mean that the defect changed
nothing that was sent or reported.
"""

from __future__ import annotations

import ast
import importlib
import multiprocessing
import signal
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from functools import cache
from itertools import chain, zip_longest
from multiprocessing.connection import Connection, wait
from multiprocessing.context import ForkProcess
from pathlib import Path
from types import CodeType

from tests.explore.coverage import Reached, import_what_stays, reach, statement_lines
from tests.explore.generate import SHARING_FROM, scenario_of
from tests.explore.more_situations import MORE_SITUATIONS_FROM, more_situation_of
from tests.explore.planting import plant, source_of
from tests.explore.scenario import Scenario
from tests.explore.situations import SITUATIONS_FROM, TRAJECTORIES_FROM, situation_of

BUDGET = 12
GROUNDS = 160
_SITUATIONS, _TRAJECTORIES, _MORE = 72, 24, 62
_SHORT_S = 60.0
_CALM_FROM, _SHARING = 6000, 100
_GOALS = ("navigate", "route", "takeoff", "land", "go_home")
_LED = ("navigate", "route")
_SOON_S = (3.0, 15.0)
_ALONE_S = 13.0
# A flight that takes this many times as long as the sound one is cut off.
_PATIENCE = 4.0
_PATIENCE_S = 3.0
# Worth of a line that another kind of vehicle executed, and of one elsewhere in the module.
_KIND, _BESIDE, _LITTLE = 0.03, 0.01, 0.05
# Of a situation that was not flown yet.
_SITUATION = 1.0
_BY_TIME = "takes four times as long"
_BY_IMPORT = "cannot be imported"


@dataclass(frozen=True)
class Defect:
    """A changed module, or several.

    Attributes:
        name: what is wrong.
        module: where.
        source: its whole source, changed.
        others: other changed modules, with their sources.
    """

    name: str
    module: str
    source: str
    others: tuple[tuple[str, str], ...] = ()

    @property
    def line(self) -> int:
        """The first line that differs, from 1."""
        pairs = zip_longest(source_of(self.module).split("\n"), self.source.split("\n"))
        return next(n for n, (sound, broken) in enumerate(pairs, start=1) if sound != broken)


class Fate(Enum):
    """The fate of a defect."""

    FOUND = "found"
    TOLERATED = "has an effect within the policies' tolerances"
    WITHOUT_EFFECT = "changes nothing that is sent or reported"
    UNREACHED = "is never reached"


@dataclass(frozen=True)
class Verdict:
    """The judgement of a defect.

    Attributes:
        name: of the defect.
        module: where it is.
        fate: what became of it.
        policy: what found it, or nothing.
        flights: how many seeds were flown.
        seed: the last one, or -1.
        cpu_s: processor time.
    """

    name: str
    module: str
    fate: Fate
    policy: str = ""
    flights: int = 0
    seed: int = -1
    cpu_s: float = 0.0


@cache
def grounds(count: int = GROUNDS) -> tuple[int, ...]:
    """Return situations, and short seeds in which many different things happen to goals.

    Of the first seeds whose scenario has one vehicle, or vehicles that share traffic, and is over
    within a minute, each one is the next that has the most coincidences that those before did not
    have; in the last third what happens to a goal is left alone by everything else.
    """
    situations = range(SITUATIONS_FROM, SITUATIONS_FROM + _SITUATIONS)
    calm = count // 3
    sharing = range(SHARING_FROM, SHARING_FROM + _SHARING)
    found = _various(chain(range(_CALM_FROM), sharing), _coincidences, count - calm)
    trajectories = range(TRAJECTORIES_FROM, TRAJECTORIES_FROM + _TRAJECTORIES)
    return (
        *situations,
        *trajectories,
        *range(MORE_SITUATIONS_FROM, MORE_SITUATIONS_FROM + _MORE),
        *found,
        *_various(range(_CALM_FROM, 36000), _calm_coincidences, calm),
    )


def _various(
    seeds: Iterable[int], features: Callable[[Scenario], set[tuple[str, ...]]], count: int
) -> list[int]:
    left = {}
    for seed in seeds if count else ():
        scenario = scenario_of(seed)
        times = [event.time_s for event in scenario.events]
        alone = len(scenario.crafts) == 1 or scenario.shares_traffic
        if alone and max(times, default=0.0) <= _SHORT_S:
            left[seed] = features(scenario)
    found: list[int] = []
    seen: set[tuple[str, ...]] = set()
    while left and len(found) < count:
        best = max(left, key=lambda seed: len(left[seed] - seen))
        seen |= left.pop(best)
        found.append(best)
    return found


def _calm_coincidences(scenario: Scenario) -> set[tuple[str, ...]]:
    """Return what others do to goals that nothing else happens to for some time."""
    if scenario.shares_traffic:
        return set()
    craft, found = scenario.crafts[0], set()
    for goal, event, after in zip(
        scenario.events, scenario.events[1:], (*scenario.events[2:], None), strict=False
    ):
        soon = _SOON_S[0] < event.time_s - goal.time_s < _SOON_S[1]
        alone = after is None or after.time_s - event.time_s > _ALONE_S
        if goal.what in _LED and goal.how.get("frame", "map") == "map" and soon and alone:
            details = [f"{k} {v}" for k, v in event.how.items() if isinstance(v, str | bool)]
            if event.what not in (*_GOALS, "cancel", "pause", "resume", "start"):
                found.add((craft.kind, craft.autopilot, event.what, *details))
    return found


def _coincidences(scenario: Scenario) -> set[tuple[str, ...]]:
    """Return what happens soon after a goal, and which settings each kind of goal has."""
    craft = scenario.crafts[0]
    if scenario.shares_traffic:
        return {("shares traffic", craft.autopilot, str(len(scenario.crafts)))}
    kind = f"{craft.kind} {craft.autopilot}"
    settings = [f"{n} {v}" for n, v in (*craft.server.items(), *craft.onboard.items())]
    found: set[tuple[str, ...]] = set()
    for goal in scenario.events:
        if goal.what not in _GOALS or goal.how.get("frame", "map") != "map":
            continue
        name = f"{goal.what} {goal.how.get('mission', '')}"
        found |= {(name, setting) for setting in settings}
        for event in scenario.events:
            if _SOON_S[0] < event.time_s - goal.time_s < _SOON_S[1]:
                details = [f"{k} {v}" for k, v in event.how.items() if isinstance(v, str | bool)]
                found.add((kind, name, event.what, *details))
    return found


def sound_flights(count: int = GROUNDS, jobs: int = 1) -> dict[int, Reached]:
    """Return the flights of the sound sources that defects are hunted with."""
    return {seed: r for seed, r in reach(grounds(count), jobs).items() if not r.violations}


def reaching(defect: Defect, flights: Mapping[int, Reached], count: int) -> list[Reached]:
    """Return the flights that execute a defect, in the order in which they are worth flying.

    Situations and drawn seeds take turns: neither shows what the other does.
    """
    sound = source_of(defect.module)
    line = statement_lines(sound)[defect.line]
    left = [f for f in flights.values() if defect.module in f.lines]
    if line:
        left = [f for f in left if line in f.lines[defect.module]]
    function = function_about(sound, defect.line)
    situations = [f for f in left if f.seed >= SITUATIONS_FROM]
    drawn = [f for f in left if f.seed < SITUATIONS_FROM]
    turns = zip_longest(*(_ordered(f, defect.module, function, count) for f in (situations, drawn)))
    return [flight for flight in chain(*turns) if flight is not None][:count]


def _ordered(
    flights: Iterable[Reached], module: str, function: tuple[int, int], count: int
) -> list[Reached]:
    """Order flights by their worth.

    The next is always the one that executes most of the function about the defect that those
    before did not, for its price: what a defect leads to shows where that function ends otherwise.
    """
    left, found = list(flights), list[Reached]()
    seen: set[tuple[int, str]] = set()
    while left and len(found) < count:
        worth = {f: _worth(f, module, *function, seen) for f in left}
        best = max(left, key=lambda f: worth[f])
        if worth[best] < _LITTLE and seen:
            seen = set()  # once more, with the others
            continue
        seen |= _seen(best, module)
        left.remove(best)
        found.append(best)
    return found


def _seen(flight: Reached, module: str) -> set[tuple[int, str]]:
    """The executed lines of a module, for the kind of vehicle, and for any."""
    craft = scenario_of(flight.seed).crafts[0]
    lines = flight.lines[module]
    seen = {(line, kind) for line in lines for kind in ("", f"{craft.kind} {craft.autopilot}")}
    if flight.seed >= SITUATIONS_FROM:
        is_more = flight.seed >= MORE_SITUATIONS_FROM
        situation = more_situation_of(flight.seed) if is_more else situation_of(flight.seed)
        seen.add((0, situation.__name__))
    return seen


def _worth(
    flight: Reached, module: str, first: int, last: int, seen: set[tuple[int, str]]
) -> float:
    new = _seen(flight, module) - seen
    within = [kind for line, kind in new if first <= line <= last]
    lines = within.count("") + _SITUATION * any(line == 0 for line, _ in new)
    return (lines + _KIND * (len(within) - lines) + _BESIDE * len(new)) / (flight.cpu_s + 1.0)


def function_about(source: str, line: int) -> tuple[int, int]:
    """Return the lines of the function that a line belongs to; of the module, if to none."""
    found = (1, source.count("\n") + 1)
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.FunctionDef):
            end = node.end_lineno or node.lineno
            if node.lineno <= line <= end:
                found = (node.lineno, end)
    return found


def hunt(
    defects: Iterable[Defect],
    flights: Mapping[int, Reached],
    budget: int = BUDGET,
    jobs: int = 1,
) -> Iterator[Verdict]:
    """Hunt them, each in a process of its own; yield the verdicts as they come.

    Args:
        defects: what is planted, one at a time.
        flights: of the sound sources.
        budget: seeds that each is hunted with.
        jobs: processes at once.
    """
    import_what_stays()
    context = multiprocessing.get_context("fork")
    hunting: dict[Connection, ForkProcess] = {}
    for defect in defects:
        seeds = reaching(defect, flights, budget)
        if not seeds:
            yield Verdict(defect.name, defect.module, Fate.UNREACHED)
            continue
        if len(hunting) == jobs:
            yield _next_verdict(hunting)
        ours, theirs = context.Pipe(duplex=False)
        process = context.Process(target=_hunt_one, args=(defect, seeds, theirs))
        process.start()
        theirs.close()
        hunting[ours] = process
    while hunting:
        yield _next_verdict(hunting)


def _next_verdict(hunting: dict[Connection, ForkProcess]) -> Verdict:
    """Wait for the first that ends.

    Raises:
        EOFError: its process ended without a verdict.
    """
    pipe = next(p for p in wait(list(hunting)) if isinstance(p, Connection))
    try:
        verdict: Verdict = pipe.recv()
        return verdict
    finally:
        hunting.pop(pipe).join()
        pipe.close()


class _TooLongError(BaseException):
    """Nothing on the way may catch it."""


def _give_up(*_: object) -> None:
    raise _TooLongError


def _hunt_one(defect: Defect, seeds: Sequence[Reached], pipe: Connection) -> None:
    begun_s = time.process_time()
    fate, policy, flown, seed = _fate(defect, seeds)
    spent_s = time.process_time() - begun_s
    pipe.send(Verdict(defect.name, defect.module, fate, policy, flown, seed, spent_s))


def _fate(defect: Defect, seeds: Sequence[Reached]) -> tuple[Fate, str, int, int]:
    def compiled(name: str, _: str, path: Path) -> tuple[CodeType, dict[str, object]] | None:
        if name not in sources:
            return None
        return compile(ast.parse(sources[name]), str(path), "exec"), {}

    sources = {defect.module: defect.source, **dict(defect.others)}
    plant(compiled)
    try:
        explorer = importlib.import_module("tests.explore.explorer")
    except Exception:
        return Fate.FOUND, _BY_IMPORT, 0, -1
    signal.signal(signal.SIGPROF, _give_up)
    same = True
    for count, sound in enumerate(seeds, start=1):
        signal.setitimer(signal.ITIMER_PROF, _PATIENCE * sound.cpu_s + _PATIENCE_S)
        try:
            flown = explorer.explore_scenario(explorer.scenario_of(sound.seed), True)
        except _TooLongError:
            return Fate.FOUND, _BY_TIME, count, sound.seed
        finally:
            signal.setitimer(signal.ITIMER_PROF, 0.0)
        if flown.violations:
            return Fate.FOUND, flown.violations[0].policy, count, sound.seed
        if flown.error:
            return Fate.FOUND, flown.error.strip().splitlines()[-1][:60], count, sound.seed
        same = same and flown.digest == sound.digest
    return Fate.WITHOUT_EFFECT if same else Fate.TOLERATED, "", len(seeds), seeds[-1].seed
