"""Surveys: every part of an area is covered, no hole is entered, and the way is short."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely
from hypothesis import example, given, settings
from hypothesis import strategies as st

from navigation_core.surveys.area import Corners, SurveyArea, SurveyAreaError, area_of
from navigation_core.surveys.survey import Survey, plan_survey

FIELD: Corners = ((0.0, 0.0), (100.0, 0.0), (100.0, 60.0), (0.0, 60.0))
ANGLED: Corners = (
    (0.0, 0.0), (100.0, 0.0), (100.0, 40.0), (40.0, 40.0), (40.0, 100.0), (0.0, 100.0),
)  # fmt: skip
FORKED: Corners = (
    (0.0, 0.0), (120.0, 0.0), (120.0, 100.0), (80.0, 100.0),
    (80.0, 30.0), (40.0, 30.0), (40.0, 100.0), (0.0, 100.0),
)  # fmt: skip
LAND: Corners = ((0.0, 0.0), (200.0, 10.0), (220.0, 120.0), (100.0, 160.0), (-10.0, 110.0))


def circle(east_m: float, north_m: float, radius_m: float, corners: int = 24) -> Corners:
    angles = [math.tau * i / corners for i in range(corners)]
    return tuple(
        (east_m + radius_m * math.cos(a), north_m + radius_m * math.sin(a)) for a in angles
    )


LAKES = (circle(50.0, 45.0, 12.0), circle(130.0, 90.0, 20.0), ((90, 30), (110, 35), (105, 60)))


def uncovered(area: SurveyArea, survey: Survey) -> float:
    """Return the share that no strip along a line covers."""
    half_m = survey.spacing_m / 2.0 + 1e-3
    strips = [
        shapely.LineString(leg.points_m).buffer(half_m, cap_style="flat", join_style="mitre")
        for leg in survey.legs
        if leg.covers
    ]
    left = shapely.difference(area.outline, shapely.union_all([*strips, *area.holes]))
    return float(left.area / area.area_m2)


def way(survey: Survey) -> shapely.LineString:
    return shapely.LineString(np.concatenate([leg.points_m for leg in survey.legs]))


@pytest.mark.parametrize("spacing_m", [5.0, 12.0])
@pytest.mark.parametrize(
    ("boundary", "holes"),
    [(FIELD, ()), (ANGLED, ()), (FORKED, ()), (LAND, LAKES), (circle(0.0, 0.0, 50.0), ())],
    ids=["field", "angled", "forked", "lakes", "round"],
)
def test_everything_is_covered_and_no_hole_is_entered(
    boundary: Corners, holes: tuple[Corners, ...], spacing_m: float
) -> None:
    area = area_of(boundary, holes)
    survey = plan_survey(area, spacing_m, (-20.0, -20.0))
    assert uncovered(area, survey) < 1e-6
    assert survey.spacing_m <= spacing_m
    for hole in area.holes:
        assert shapely.distance(hole, way(survey)) > 0.3 * spacing_m
    for before, leg in zip(survey.legs, survey.legs[1:], strict=False):
        assert np.allclose(before.points_m[-1], leg.points_m[0], atol=1e-3)
    # A way that covers every part once is as long as the area is wide in strips.
    assert survey.length_m < 1.6 * area.area_m2 / survey.spacing_m


@example([20.0] * 5, 0.0, 5.0, 14.0).via("a hole nearer to the border than a line's half width")
@given(
    radii=st.lists(st.floats(20.0, 80.0), min_size=5, max_size=12),
    angle_rad=st.floats(0.0, math.pi),
    spacing_m=st.floats(3.0, 20.0),
    hole_m=st.floats(2.0, 15.0),
)
@settings(max_examples=25, deadline=None)
def test_any_outline_around_a_hole_is_covered(
    radii: list[float], angle_rad: float, spacing_m: float, hole_m: float
) -> None:
    corners = tuple(
        (r * math.cos(math.tau * i / len(radii)), r * math.sin(math.tau * i / len(radii)))
        for i, r in enumerate(radii)
    )
    area = area_of(corners, (circle(0.0, 0.0, min(hole_m, 0.7 * min(radii)), 12),))
    survey = plan_survey(area, spacing_m, (0.0, -100.0), angle_rad)
    assert uncovered(area, survey) < 1e-5


@pytest.mark.parametrize("boundary", [FIELD, ANGLED], ids=["field", "angled"])
def test_the_best_angle_is_as_good_as_that_of_a_search_in_small_steps(boundary: Corners) -> None:
    area = area_of(boundary)
    best_m = plan_survey(area, 12.0, (0.0, 0.0)).length_m
    tried_m = [
        plan_survey(area, 12.0, (0.0, 0.0), math.radians(degrees)).length_m
        for degrees in range(0, 180, 3)
    ]
    assert best_m <= 1.05 * min(tried_m)


def test_lines_begin_and_end_farther_out_where_no_hole_is() -> None:
    area = area_of(FIELD, (circle(50.0, 30.0, 10.0),))
    survey = plan_survey(area, 6.0, (0.0, 0.0), 0.0, overrun_m=8.0)
    places = shapely.get_coordinates(way(survey))
    assert places[:, 0].min() == pytest.approx(-8.0)
    assert places[:, 0].max() == pytest.approx(108.0)
    assert shapely.distance(area.holes[0], way(survey)) > 2.0


def test_the_survey_begins_where_the_vehicle_comes_from() -> None:
    area = area_of(FIELD)
    for corner in FIELD:
        start = plan_survey(area, 10.0, corner).legs[0].points_m[0]
        assert math.dist(start, corner) < 10.0


@pytest.mark.parametrize(
    ("boundary", "holes", "reason"),
    [
        (((0.0, 0.0), (9.0, 9.0), (9.0, 0.0), (0.0, 9.0)), (), "no simple polygon"),
        (((0.0, 0.0), (9.0, 9.0)), (), "2 different corners"),
        (((0.0, 0.0), (9.0, 0.0), (4.0, 0.0)), (), "no simple polygon"),
        (((0.0, 0.0), (0.5, 0.0), (0.5, 0.5)), (), "m2 are surveyed"),
        (((0.0, 0.0), (math.nan, 0.0), (9.0, 9.0)), (), "not a finite number"),
        (FIELD, ((),), "Hole 1 has 0 different corners"),
        (FIELD, (circle(0.0, 0.0, 5.0),), "Hole 1 is not inside"),
        (FIELD, (circle(50.0, 30.0, 5.0), circle(52.0, 30.0, 5.0)), "Holes 1 and 2 overlap"),
        (FIELD, (circle(50.0, 30.0, 0.1, 3),) * 51, "51 holes"),
        (circle(0.0, 0.0, 500.0, 10_001), (), "10001 corners"),
    ],
)
def test_what_is_no_area_is_rejected_with_a_reason(
    boundary: Corners, holes: tuple[Corners, ...], reason: str
) -> None:
    with pytest.raises(SurveyAreaError, match=reason):
        area_of(boundary, holes)


def test_too_many_lines_are_rejected() -> None:
    with pytest.raises(SurveyAreaError, match="at most 2000"):
        plan_survey(area_of(FIELD), 0.01, (0.0, 0.0))


def test_ten_thousand_corners_are_planned_for() -> None:
    area = area_of(circle(0.0, 0.0, 200.0, 10_000))
    survey = plan_survey(area, 20.0, (0.0, 0.0))
    assert uncovered(area, survey) < 1e-6
