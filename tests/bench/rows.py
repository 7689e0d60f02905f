"""Result of a benchmark for ``run.py``: one row of its table."""

from __future__ import annotations

from typing import Any


def row(
    name: str, value: tuple[float, str], reference: tuple[str, float], goal: str, met: bool
) -> dict[str, Any]:
    """Return a row.

    Args:
        name: what is measured.
        value: how much, and its unit.
        reference: what it is held against, and how much that is in the same unit.
        goal: what it should be, for people.
        met: whether it is.
    """
    return {
        "name": name,
        "value": value[0],
        "unit": value[1],
        "reference": reference[0],
        "reference_value": reference[1],
        "ratio": value[0] / reference[1] if reference[1] else None,
        "goal": goal,
        "met": met,
    }
