"""Fences and rally points in degrees: what is rejected, and the items that are sent."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mavlink_vehicle.codec import mavlink
from mavlink_vehicle.mission_items import AMSL, RELATIVE_ALT, TERRAIN_ALT
from navigation_bridge.goals.requests import AltitudeReference
from navigation_bridge.storage.geographic import (
    CORNERS_MAX,
    Degrees,
    GeoArea,
    GeoFence,
    RallyPoint,
    fence_items,
    fence_of_items,
    fence_problem,
    rally_items,
    rally_of_items,
    rally_problem,
)

SQUARE = ((47.0, 8.0), (47.0, 8.01), (47.01, 8.01), (47.01, 8.0))
NAN = math.nan


def of(*points: Degrees, radius_m: float | None = None) -> GeoFence:
    return GeoFence((GeoArea(points, radius_m),))


@pytest.mark.parametrize(
    "fence",
    [
        of(*SQUARE),
        of(*SQUARE[::-1]),
        of((47.0, 8.0), (47.0, 8.02), (47.002, 8.01), (47.01, 8.01)),  # not convex
        of((47.0, 8.0), (47.0, 8.005), (47.0, 8.01), (47.01, 8.0)),  # a corner on an edge
        of((-10.0, 179.99), (-10.0, -179.99), (-9.9, 180.0)),  # across the date line
        of((47.0, 8.0), radius_m=0.5),
        GeoFence((*of(*SQUARE).areas, *of((47.0, 8.0), radius_m=3.0).areas), (47.0, 8.0)),
        GeoFence(),
    ],
)
def test_a_fence_that_can_be_sent(fence: GeoFence) -> None:
    assert fence_problem(fence) is None
    again = fence_of_items(fence_items(fence))
    assert len(again.areas) == len(fence.areas)
    for ours, theirs in zip(fence.areas, again.areas, strict=True):
        assert theirs.inclusion == ours.inclusion
        assert theirs.radius_m == ours.radius_m
        assert theirs.points_deg == tuple(pytest.approx(p, abs=1e-7) for p in ours.points_deg)
    assert (again.return_point_deg is None) == (fence.return_point_deg is None)


@pytest.mark.parametrize(
    ("fence", "part"),
    [
        (of(*SQUARE[:2]), "at least 3 corners, not 2"),
        (of(), "at least 3 corners, not 0"),
        (of(SQUARE[0], SQUARE[2], SQUARE[1], SQUARE[3]), "cross"),
        (of(*SQUARE, SQUARE[0]), "corners 5 and 1 are the same"),
        (of(SQUARE[0], SQUARE[0], *SQUARE[1:]), "corners 1 and 2 are the same"),
        (of((47.0, 8.0), (47.0, 8.01), (47.0, 8.02)), "turns back"),
        (of((47.0, 8.0), (47.0, 8.02), (47.0, 8.01), (47.01, 8.01)), "turns back"),
        # An edge that ends on another.
        (of((0.1, 0.0), (0.1, 2.0), (1.0, 2.0), (0.1, 1.0), (1.0, 0.0)), "cross"),
        (of((10.0, 0.0), (10.0, 170.0), (20.0, -20.0)), "half of the earth"),
        (of((NAN, 8.0), *SQUARE[1:]), "point 1: latitude nan"),
        (of((47.0, math.inf), *SQUARE[1:]), "point 1: longitude inf"),
        (of((90.1, 8.0), *SQUARE[1:]), "latitude 90.1"),
        (of((47.0, -180.5), *SQUARE[1:]), "longitude -180.5"),
        (of((0.0, 0.0), *SQUARE[1:]), "0, 0 means no position"),
        (of((47.0, 8.0), radius_m=0.0), "radius 0 m"),
        (of((47.0, 8.0), radius_m=-2.0), "radius -2 m"),
        (of((47.0, 8.0), radius_m=NAN), "radius nan m"),
        (of((47.0, 8.0), radius_m=math.inf), "radius inf m"),
        (of(*SQUARE, radius_m=3.0), "one centre, not 4"),
        (GeoFence(of(*SQUARE).areas, (47.0, NAN)), "Return point: longitude nan"),
        (GeoFence((), (47.0, 8.0)), "not a fence"),
        (GeoFence(of((47.0, 8.0), radius_m=1.0).areas * 2001), "at most 2000"),
    ],
)
def test_a_fence_that_is_not_sent(fence: GeoFence, part: str) -> None:
    problem = fence_problem(fence)
    assert problem is not None
    assert part in problem
    assert problem.endswith(".")


def test_a_polygon_has_as_many_corners_as_one_byte_counts() -> None:
    def ring(count: int) -> GeoFence:
        angles = [2.0 * math.pi * i / count for i in range(count)]
        return of(*((47.0 + math.sin(a), 8.0 + math.cos(a)) for a in angles))

    assert fence_problem(ring(CORNERS_MAX)) is None
    assert "at most 255" in (fence_problem(ring(CORNERS_MAX + 1)) or "")


@given(
    st.lists(st.tuples(st.integers(-9, 9), st.integers(-9, 9)), min_size=3, max_size=9, unique=True)
)
def test_a_polygon_is_simple_whichever_corner_is_first(places: list[tuple[int, int]]) -> None:
    """A star-shaped ring about a place is simple; its corners in another order often are not."""
    points = [(40.0 + 0.001 * north, 8.0 + 0.001 * east) for north, east in places]
    verdicts = {
        fence_problem(of(*points[turn:], *points[:turn])) is None for turn in range(len(points))
    }
    assert len(verdicts) == 1
    assert (fence_problem(of(*points[::-1])) is None) in verdicts


def test_each_corner_carries_the_number_of_corners() -> None:
    fence = GeoFence(
        (GeoArea(SQUARE, None, False), GeoArea(((47.0, 8.0),), 4.5, True)), (47.005, 8.005)
    )
    items = fence_items(fence)
    assert [(item.command, item.params[0]) for item in items] == [
        (mavlink.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_EXCLUSION, 4.0)
    ] * 4 + [
        (mavlink.MAV_CMD_NAV_FENCE_CIRCLE_INCLUSION, 4.5),
        (mavlink.MAV_CMD_NAV_FENCE_RETURN_POINT, 0.0),
    ]
    assert (items[1].x, items[1].y) == (470000000, 80100000)
    assert fence_of_items(items) == fence


def test_rally_points_have_their_frames() -> None:
    points = [
        RallyPoint((47.0, 8.0), 30.0),
        RallyPoint((47.0, 8.1), 500.5, AltitudeReference.AMSL),
        RallyPoint((47.0, 8.2), 20.0, AltitudeReference.GROUND),
    ]
    assert rally_problem(points) is None
    items = rally_items(points)
    assert [item.frame for item in items] == [RELATIVE_ALT, AMSL, TERRAIN_ALT]
    assert rally_of_items(items) == tuple(points)


@pytest.mark.parametrize(
    ("point", "part"),
    [
        (RallyPoint((NAN, 8.0), 1.0), "latitude nan"),
        (RallyPoint((0.0, 0.0), 1.0), "no position"),
        (RallyPoint((47.0, 8.0), NAN), "altitude nan m"),
        (RallyPoint((47.0, 8.0), 20_000.0), "altitude 20000 m"),
    ],
)
def test_a_rally_point_that_is_not_sent(point: RallyPoint, part: str) -> None:
    problem = rally_problem([RallyPoint((47.0, 8.0), 1.0), point])
    assert problem is not None
    assert problem.startswith("Rally point 2: ")
    assert part in problem
