"""Result of a benchmark for ``run.py``: one row of its table."""

from __future__ import annotations

import re
from typing import Any

NO_GOAL = "-"


def row(
    name: str,
    value: tuple[float, str],
    reference: tuple[str, float],
    goal: str,
    met: bool | None = None,
) -> dict[str, Any]:
    """Return a row. A goal such as "< 50 ms" or "<= 3 x" is judged as its text reads.

    Args:
        name: what is measured. It is the same in the short form.
        value: how much, and its unit.
        reference: what it is held against, and how much that is in the same unit.
        goal: what it should be, for people; :data:`NO_GOAL` for a figure that is only to be seen.
        met: whether it is, for a goal in other words.

    Raises:
        ValueError: the goal is in other words and has no verdict, or the verdict is not the text's.
    """
    ratio = value[0] / reference[1] if reference[1] else None
    judged = True if goal == NO_GOAL else _judged(goal, value, ratio)
    if judged is None and met is None:
        raise ValueError(f"{name}: whether '{goal}' is met cannot be read from it")
    if None not in (judged, met) and judged != met:
        raise ValueError(f"{name}: {value[0]:g} {value[1]} and '{goal}' are judged differently")
    return {
        "name": name,
        "value": value[0],
        "unit": value[1],
        "reference": reference[0],
        "reference_value": reference[1],
        "ratio": ratio,
        "goal": goal,
        "met": met if judged is None else judged,
    }


def bound_of(goal: str, unit: str) -> tuple[str, float, bool] | None:
    """Read a goal: its comparison, its number, and whether that is a value and not a ratio."""
    parts = re.fullmatch(r"([<>]=?) *([\d,.]+) *(.*)", goal)
    if parts is None or ", " in parts[3] or "(" in parts[3]:
        return None
    return parts[1], float(parts[2].replace(",", "")), parts[3] in ("", unit)


def _judged(goal: str, value: tuple[float, str], ratio: float | None) -> bool | None:
    bound = bound_of(goal, value[1])
    if bound is None:
        return None
    comparison, limit, is_value = bound
    measured = value[0] if is_value else ratio
    if measured is None:
        return None
    below = comparison[0] == "<"
    return (measured < limit if below else measured > limit) or (
        comparison[1:] == "=" and measured == limit
    )
