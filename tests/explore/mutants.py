"""Planted defects: the exploration must find them.

`python -m tests.explore.mutants` plants those written by hand, one after another and in memory
only, and flies the seeds that reach them until a policy is violated. `--tool 300` plants as many
that a tool made. `--table` prints the results of the last runs.
"""

from __future__ import annotations

import argparse
import json
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import asdict
from pathlib import Path

from tests.explore.coverage import OUT
from tests.explore.defects import MUTANTS, REASONS, TOGETHER, Mutant, planted
from tests.explore.hunt import BUDGET, GROUNDS, Defect, Fate, Verdict, hunt, sound_flights
from tests.explore.mutation_tool import generate
from tests.explore.planting import source_of

BY_HAND, BY_TOOL = OUT / "mutants_by_hand.jsonl", OUT / "mutants_by_tool.jsonl"


def main(arguments: Sequence[str] | None = None) -> int:
    """Hunt them; 0: all of those written by hand were found, 1: some were not."""
    parser = argparse.ArgumentParser(prog="python -m tests.explore.mutants", description=__doc__)
    parser.add_argument("names", nargs="*", help="which (default: all written by hand)")
    parser.add_argument("--budget", type=int, default=BUDGET, help="seeds that each is hunted with")
    parser.add_argument("--map", type=int, default=GROUNDS, help="seeds to choose these from")
    parser.add_argument("--jobs", type=int, default=1, help="processes at once")
    parser.add_argument("--tool", type=int, metavar="N", help="hunt N mutants of the tool instead")
    together_help = "plant those that mask each other, all at once"
    parser.add_argument("--together", action="store_true", help=together_help)
    parser.add_argument("--go-on", action="store_true", help="only those without a result")
    fates = [fate.name for fate in Fate]
    again_help = "and, with --go-on, those with this result"
    parser.add_argument("--again", action="append", default=[], choices=fates, help=again_help)
    parser.add_argument("--table", action="store_true", help="print the tables of the last runs")
    options = parser.parse_args(arguments)
    if options.table:
        print(tables())
        return 0
    if options.tool is not None:
        made, path = generate(options.tool), BY_TOOL
    elif options.together:
        made, path = [defect_of_several(names) for names in TOGETHER], BY_HAND
    else:
        chosen = [m for m in MUTANTS if not options.names or m.name in options.names]
        made, path = [defect_of(mutant) for mutant in chosen], BY_HAND
    done = {verdict.name: verdict for verdict in load(path)}
    if options.go_on:
        again = {Fate[name] for name in options.again}
        made = [m for m in made if m.name not in done or done[m.name].fate in again]
    verdicts = []
    flights = sound_flights(options.map, options.jobs)
    for verdict in hunt(made, flights, options.budget, options.jobs):
        verdicts.append(verdict)
        print(_line(verdict), flush=True)
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("a") as file:
            file.write(json.dumps({**asdict(verdict), "fate": verdict.fate.name}) + "\n")
    counts = Counter(verdict.fate for verdict in verdicts)
    print(", ".join(f"{count} {fate.name.lower()}" for fate, count in counts.items()))
    return 0 if counts[Fate.FOUND] == len(verdicts) else 1


def defect_of(mutant: Mutant) -> Defect:
    """Return a mutant with its whole source."""
    return Defect(mutant.name, mutant.module, planted(source_of(mutant.module), mutant))


def defect_of_several(names: Sequence[str]) -> Defect:
    """Return several mutants, planted together."""
    named = {mutant.name: mutant for mutant in MUTANTS}
    sources: dict[str, str] = {}
    for mutant in (named[name] for name in names):
        sources[mutant.module] = planted(
            sources.get(mutant.module, source_of(mutant.module)), mutant
        )
    (module, source), *others = sources.items()
    return Defect(" + ".join(names), module, source, tuple(others))


def load(path: Path) -> list[Verdict]:
    """Return the last verdict on each mutant."""
    found: dict[str, Verdict] = {}
    for line in path.read_text().splitlines() if path.exists() else ():
        row = json.loads(line)
        found[row["name"]] = Verdict(**{**row, "fate": Fate[row["fate"]]})
    return list(found.values())


def _line(verdict: Verdict) -> str:
    how = verdict.fate.value
    if verdict.policy:
        how = f"found by {verdict.policy} with the {verdict.flights}. seed ({verdict.seed})"
    return f"{verdict.name} [{verdict.module}]: {how}; {verdict.cpu_s:.1f} s"


def tables() -> str:
    """Return the tables of docs/explore_mutants.md."""
    done = {verdict.name: verdict for verdict in load(BY_HAND)}
    rows = ["| Defect | Module | Found by | Seeds |", "|---|---|---|---|"]
    for verdict in (done[mutant.name] for mutant in MUTANTS if mutant.name in done):
        how = "an exception" if ":" in verdict.policy else f"`{verdict.policy}`"
        if verdict.fate is not Fate.FOUND:
            how = f"not found: {REASONS.get(verdict.name, verdict.fate.value)}"
        rows.append(f"| {verdict.name} | `{_short(verdict)}` | {how} | {verdict.flights} |")
    return "\n".join([*rows, "", *_tool_rows(load(BY_TOOL))])


def _short(verdict: Verdict) -> str:
    return verdict.module.rpartition(".")[2]


def _tool_rows(verdicts: Iterable[Verdict]) -> list[str]:
    by_module: dict[str, Counter[Fate]] = {}
    for verdict in verdicts:
        by_module.setdefault(verdict.module, Counter())[verdict.fate] += 1
    rows = ["| Module | Mutants | " + " | ".join(_HEADS) + " |", "|---|---|---|---|---|---|"]
    for module, counts in sorted(by_module.items()):
        cells = " | ".join(str(counts[fate]) for fate in Fate)
        rows.append(f"| `{module}` | {counts.total()} | {cells} |")
    total = sum(by_module.values(), Counter[Fate]())
    cells = " | ".join(str(total[fate]) for fate in Fate)
    return [*rows, f"| all | {total.total()} | {cells} |"]


_HEADS = ("Found", "Tolerated", "No effect", "Never reached")


if __name__ == "__main__":
    raise SystemExit(main())
