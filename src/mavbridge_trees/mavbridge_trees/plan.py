"""A plan: steps that are flown one after another. Pure.

It is YAML, and `plan.schema.json` beside this file says what it may have. Positions are metres in
`map` (ENU), heights metres above the ground, speeds m/s.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any

import yaml
from jsonschema import Draft202012Validator
from jsonschema.exceptions import best_match

__all__ = ["Plan", "PlanStep", "PlanTextError", "read_plan"]

_TEXT_MAX = 1_000_000


class PlanTextError(ValueError):
    """A plan cannot be read; the text says why."""


@dataclass(frozen=True)
class PlanStep:
    """One step.

    Attributes:
        kind: "takeoff", "goto", "orbit", "survey", "photo", "wait", "return" or "land".
        values: its members.
    """

    kind: str
    values: Mapping[str, Any]


@dataclass(frozen=True)
class Plan:
    """A plan.

    Attributes:
        name: for people.
        steps: at least one.
        on_failure: what follows a step that fails: "hold", "return", "land" or "continue".
        on_resume: what follows an interruption: the same step again ("repeat") or the one after it
            ("next").
        return_below: share of the battery, 0 to 1, below which the vehicle returns; 0: never.
        digest: the same for equal plans.
    """

    name: str
    steps: tuple[PlanStep, ...]
    on_failure: str = "hold"
    on_resume: str = "repeat"
    return_below: float = 0.0
    digest: str = ""


@cache
def _validator() -> Any:
    text = files("mavbridge_trees").joinpath("plan.schema.json").read_text("utf-8")
    return Draft202012Validator(json.loads(text))


def read_plan(text: str) -> Plan:
    """Return the plan that a text has.

    Raises:
        PlanTextError: it is no YAML, or no plan.
    """
    if len(text) > _TEXT_MAX:
        raise PlanTextError(f"The plan is longer than {_TEXT_MAX} characters.")
    try:
        document = yaml.safe_load(text)
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        where = str(error).replace("\n", " ")
        raise PlanTextError(f"The plan is no YAML: {where}") from error
    try:
        wrong = best_match(_validator().iter_errors(document))
    except RecursionError as nested:
        raise PlanTextError("The plan is nested too deeply.") from nested
    if wrong is not None:
        raise PlanTextError(f"{_place(wrong.absolute_path)}: {wrong.message[:300]}")
    if not _is_finite(document):
        raise PlanTextError("The plan has a number that is NaN or infinite.")
    steps = tuple(PlanStep(kind, each[kind]) for each in document["steps"] for kind in each)
    return Plan(
        document.get("name", ""),
        steps,
        document.get("on_failure", "hold"),
        document.get("on_resume", "repeat"),
        float(document.get("return_below", 0.0)),
        hashlib.sha256(json.dumps(document, sort_keys=True).encode()).hexdigest()[:16],
    )


def _place(path: Any) -> str:
    """Return where something is, for people, who count from 1."""
    parts = [str(part + 1) if isinstance(part, int) else str(part) for part in path]
    return f"The plan's {' '.join(parts)}" if parts else "The plan"


def _is_finite(value: Any) -> bool:
    if isinstance(value, dict):
        return all(map(_is_finite, value.values()))
    if isinstance(value, list):
        return all(map(_is_finite, value))
    return not isinstance(value, float) or math.isfinite(value)
