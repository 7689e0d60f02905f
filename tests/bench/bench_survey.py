"""Surveys: the way that covers an area, beside the best of all angles in small steps.

Also the share that is left, by ground truth, and the time of a plan beside that of its geometry
alone: one cut of the area into the strips.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from typing import Any

from navigation_core.surveys.area import SurveyArea, area_of
from navigation_core.surveys.lines import lines_at
from navigation_core.surveys.survey import plan_survey
from tests.bench.rows import row
from tests.unit.core.test_survey import ANGLED, FIELD, FORKED, LAKES, LAND, uncovered

_AREAS = {
    "a field": area_of(FIELD),
    "an angled field": area_of(ANGLED),
    "a forked field": area_of(FORKED),
    "land with three lakes": area_of(LAND, LAKES),
}
_SPACING_M, _STEP_DEG, _TIMES = 12.0, 2, 5


def measures(short: bool = False) -> Iterator[dict[str, Any]]:
    """Plan for each area."""
    for name, area in list(_AREAS.items())[: 1 if short else None]:
        best = plan_survey(area, _SPACING_M, (0.0, 0.0))
        steps = range(0, 180, 60 if short else _STEP_DEG)
        tried_m = (
            plan_survey(area, _SPACING_M, (0.0, 0.0), math.radians(degrees)).length_m
            for degrees in steps
        )
        yield row(
            f"{name}: length of the way",
            (best.length_m, "m"),
            (f"best angle in steps of {_STEP_DEG} degrees", min(tried_m)),
            "<= 1.05 x",
        )
        yield row(
            f"{name}: share that no line covers",
            (uncovered(area, best), "1"),
            ("area", 1.0),
            "<= 0.001 x",
        )
    whole_s, cut_s = _times(area)
    yield row("time of a plan", (whole_s, "s"), ("one cut into strips", cut_s), "<= 400 x")


def _times(area: SurveyArea) -> tuple[float, float]:
    whole_s, cut_s = math.inf, math.inf
    for _ in range(_TIMES):
        begun_s = time.process_time()
        plan_survey(area, _SPACING_M, (0.0, 0.0))
        planned_s = time.process_time()
        lines_at(area, 0.3, _SPACING_M, 0.0)
        whole_s = min(whole_s, planned_s - begun_s)
        cut_s = min(cut_s, time.process_time() - planned_s)
    return whole_s, cut_s
