"""Targets and straight lines that keep to the vehicle's own fence, and those that do not."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from navigation_core.geometry import Vector3
from navigation_core.outcomes import OutcomeCode
from navigation_core.safety.fences import CircleArea, Fence, PolygonArea, check_route

# A U, open to the North: between its arms is outside.
U = PolygonArea(((0, 0), (30, 0), (30, 30), (20, 30), (20, 10), (10, 10), (10, 30), (0, 30)))
HERE: Vector3 = (0.0, 0.0, 0.0)


def refused(
    fence: Fence, *targets: Vector3, start: Vector3 = HERE, margin_m: float = 0.0,
    closed: bool = False,
) -> str:  # fmt: skip
    rejection = check_route(fence, start, targets, 0.0, margin_m, closed)
    if rejection is None:
        return ""
    assert rejection.code is OutcomeCode.OUTSIDE_FENCE
    return rejection.message


def test_a_target_beyond_the_circle_is_rejected_with_both_numbers() -> None:
    fence = Fence((CircleArea((1.0, 0.0), 50.0),))
    assert not refused(fence, (50.0, 0.0, 5.0))
    text = refused(fence, (61.0, 0.0, 5.0))
    assert "60.00 m" in text
    assert "50 m" in text


def test_heights_count_from_home() -> None:
    fence = Fence(altitude_min_m=2.0, altitude_max_m=30.0)
    assert fence.check_target((0.0, 0.0, 35.0), 10.0) is None
    for z, words in ((41.0, "31.00 m above home"), (11.0, "1.00 m above home")):
        rejection = fence.check_target((0.0, 0.0, z), 10.0)
        assert rejection is not None
        assert words in rejection.message


def test_a_path_around_a_corner_is_rejected_though_both_ends_are_inside() -> None:
    fence = Fence((U,))
    text = refused(fence, (25.0, 25.0, 5.0), start=(5.0, 25.0, 5.0))
    assert "(10.00, 25.00) m" in text
    around = ((5.0, 5.0, 5.0), (25.0, 5.0, 5.0), (25.0, 25.0, 5.0))
    assert not refused(fence, *around, start=(5.0, 25.0, 5.0))


def test_the_return_to_the_first_waypoint_counts_when_there_are_laps() -> None:
    fence = Fence((U,))
    route = ((5.0, 25.0, 5.0), (5.0, 5.0, 5.0), (25.0, 5.0, 5.0), (25.0, 25.0, 5.0))
    assert not refused(fence, *route, start=(5.0, 25.0, 5.0))
    assert refused(fence, *route, start=(5.0, 25.0, 5.0), closed=True)


@pytest.mark.parametrize(
    "area", [CircleArea((50.0, 0.0), 5.0, False), PolygonArea(((45, -5), (55, -5), (50, 5)), False)]
)
def test_a_path_through_an_exclusion_is_rejected(area: CircleArea | PolygonArea) -> None:
    assert refused(Fence((area,)), (100.0, 0.0, 5.0))
    assert not refused(Fence((area,)), (100.0, 60.0, 5.0))
    assert refused(Fence((area,)), (50.0, -1.0, 5.0))


def test_one_of_several_inclusions_is_enough_for_px4_but_not_for_ardupilot() -> None:
    areas = (CircleArea((0.0, 0.0), 10.0), CircleArea((15.0, 0.0), 10.0))
    assert not refused(Fence(alternatives=areas), (20.0, 0.0, 5.0))
    assert refused(Fence(areas), (20.0, 0.0, 5.0))
    apart = (CircleArea((0.0, 0.0), 10.0), CircleArea((25.0, 0.0), 10.0))
    assert "leaves" in refused(Fence(alternatives=apart), (25.0, 0.0, 5.0))


def test_a_vehicle_outside_may_come_back_in() -> None:
    fence = Fence((CircleArea((0.0, 0.0), 10.0),))
    assert not refused(fence, (5.0, 0.0, 5.0), start=(30.0, 0.0, 5.0))
    assert refused(fence, (20.0, 0.0, 5.0), start=(30.0, 0.0, 5.0))


def test_a_margin_keeps_targets_away_from_the_boundary() -> None:
    fence = Fence((CircleArea((0.0, 0.0), 10.0),), altitude_max_m=20.0)
    assert "1.00 m from the boundary" in refused(fence, (9.0, 0.0, 5.0), margin_m=2.0)
    assert "fence_margin_m" in refused(fence, (0.0, 0.0, 19.0), margin_m=2.0)
    assert not refused(fence, (7.0, 0.0, 17.0), margin_m=2.0)


def test_a_margin_in_height_is_its_own() -> None:
    fence = Fence((CircleArea((0.0, 0.0), 500.0),), altitude_min_m=20.0, altitude_max_m=120.0)
    margins = {"margin_m": 161.0, "height_margin_m": 9.0}
    assert fence.check_target((0.0, 0.0, 111.0), 0.0, **margins) is None
    assert fence.check_target((0.0, 0.0, 29.0), 0.0, **margins) is None
    for target, words in (
        ((0.0, 0.0, 111.1), "a margin of 9 m"),
        ((0.0, 0.0, 28.9), "begins at 20 m, with a margin of 9 m"),
        ((400.0, 0.0, 60.0), "keep 161 m away"),
    ):
        rejection = fence.check_target(target, 0.0, **margins)
        assert rejection is not None
        assert words in rejection.message


def test_a_waypoint_is_named_by_its_number() -> None:
    fence = Fence((CircleArea((0.0, 0.0), 10.0),))
    assert refused(fence, (5.0, 0.0, 5.0), (15.0, 0.0, 5.0)).startswith("Waypoint 2: ")


COORDINATE = st.integers(-40, 40).map(float)
POINT = st.tuples(COORDINATE, COORDINATE)


@given(
    POINT,
    POINT,
    st.lists(POINT, min_size=3, max_size=6, unique=True),
    POINT,
    st.booleans(),
    st.booleans(),
)
def test_a_path_is_accepted_only_if_no_point_of_it_is_outside(
    start: tuple[float, float],
    end: tuple[float, float],
    corners: list[tuple[float, float]],
    centre: tuple[float, float],
    inclusion: bool,
    alternatives: bool,
) -> None:
    areas = (PolygonArea(tuple(corners), inclusion), CircleArea(centre, 12.5, not inclusion))
    both = (PolygonArea(tuple(corners)), CircleArea(centre, 12.5))
    fence = Fence(alternatives=both) if alternatives else Fence(areas)
    rejection = fence.check_leg((*start, 0.0), (*end, 0.0))
    step = ((end[0] - start[0]) / 199.0, (end[1] - start[1]) / 199.0)
    points = [(start[0] + n * step[0], start[1] + n * step[1]) for n in range(200)]
    free_m = min(area.margin_m(p) for p in points for area in areas)
    outside = [p for p in points if not fence.allows(p)]
    if any(min(area.margin_m(p) for area in areas) > 1e-6 for p in outside):
        assert rejection is not None
    elif not outside and free_m > math.dist(points[0], points[1]):
        assert rejection is None
