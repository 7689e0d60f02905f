"""The tables of docs/parameters.md: which parameters act, and whose defaults differ."""

from __future__ import annotations

import math
from collections.abc import Iterable
from textwrap import wrap

from mavlink_sitl.autopilot.personality import Personality
from mavlink_sitl.autopilot.personality.parameters import whole_list

WIDTH = 100


def acting(personality: Personality) -> list[str]:
    """The names of the parameters that have an effect."""
    return list(personality.parameter_table.acting)


def other_defaults(personality: Personality) -> list[tuple[str, float, float]]:
    """Parameters whose default is not the real simulator's: name, ours, theirs."""
    ours = personality.parameter_table.specs
    return [
        (spec.name, ours[spec.name].default, spec.default)
        for spec in whole_list(personality.whole)
        if not math.isclose(ours[spec.name].default, spec.default, rel_tol=1e-6)
    ]


def tables(personalities: Iterable[Personality]) -> str:
    """One section for each personality."""
    return "\n".join(line for each in personalities for line in _section(each))


def _section(personality: Personality) -> list[str]:
    names, table = acting(personality), personality.parameter_table
    others = other_defaults(personality)
    lines = [f"## {personality.name}", ""]
    lines += wrap(f"Of {len(table.listed)} act {len(names)}: {', '.join(names)}.", WIDTH)
    rows = [f"| {name} | {ours:g} | {theirs:g} |" for name, ours, theirs in others]
    return [*lines, "", "| Other default | Here | Real |", "|---|---|---|", *rows, ""]
