"""The vehicle's own fence, from its parameters and its uploaded items."""

from __future__ import annotations

import pytest

from mavlink_vehicle.mission_items import MissionItem
from mavlink_vehicle.profiles import Profile, ardupilot, px4
from navigation_bridge.goals.admitted import FlightPlan
from navigation_bridge.vehicle.fence import NO_FENCE, areas_of, fence_of, has_areas
from navigation_core.geometry import Vector3
from navigation_core.safety.fences import CircleArea, PolygonArea

HOME = (3.0, 4.0, 1.0)
ARDUPILOT = {
    "FENCE_ENABLE": 1.0, "FENCE_TYPE": 15.0, "FENCE_RADIUS": 50.0, "FENCE_ALT_MAX": 30.0,
    "FENCE_ALT_MIN": 2.0,
}  # fmt: skip
AREAS = (CircleArea((0.0, 0.0), 10.0), CircleArea((9.0, 0.0), 1.0, False))


def test_the_bits_of_fence_type_say_what_counts() -> None:
    fence = fence_of(ardupilot.COPTER, ARDUPILOT, HOME, AREAS)
    assert fence is not None
    assert fence.areas == (*AREAS, CircleArea((3.0, 4.0), 50.0, name="circle about home"))
    assert (fence.altitude_min_m, fence.altitude_max_m) == (2.0, 30.0)
    only_height = fence_of(ardupilot.COPTER, {**ARDUPILOT, "FENCE_TYPE": 1.0}, HOME, AREAS)
    assert only_height is not None
    assert only_height.areas == ()
    assert only_height.altitude_min_m is None


def test_a_fence_that_enables_itself_counts_before_it_does() -> None:
    off = {**ARDUPILOT, "FENCE_ENABLE": 0.0}
    assert fence_of(ardupilot.COPTER, off, HOME) == NO_FENCE
    assert fence_of(ardupilot.COPTER, {**off, "FENCE_AUTOENABLE": 3.0}, HOME) != NO_FENCE


def test_with_the_option_for_it_one_inclusion_is_enough() -> None:
    fence = fence_of(ardupilot.COPTER, {**ARDUPILOT, "FENCE_OPTIONS": 2.0}, HOME, AREAS)
    assert fence is not None
    assert fence.alternatives == AREAS[:1]
    assert AREAS[1] in fence.areas


def test_px4_counts_its_distances_always_and_one_inclusion_is_enough() -> None:
    values = {"GF_ACTION": 3.0, "GF_MAX_HOR_DIST": 80.0, "GF_MAX_VER_DIST": 25.0}
    fence = fence_of(px4.COPTER, values, HOME, AREAS)
    assert fence is not None
    assert fence.alternatives == AREAS[:1]
    assert fence.areas[-1] == CircleArea((3.0, 4.0), 80.0, name="circle about home")
    assert fence.altitude_max_m == 25.0
    assert fence_of(px4.COPTER, {**values, "GF_ACTION": 0.0}, HOME, AREAS) == NO_FENCE
    off = {"GF_ACTION": 2.0, "GF_MAX_HOR_DIST": 0.0, "GF_MAX_VER_DIST": 0.0}
    assert fence_of(px4.COPTER, off, None) == NO_FENCE


@pytest.mark.parametrize("profile", [ardupilot.COPTER, px4.COPTER])
def test_unread_parameters_are_unknown(profile: Profile) -> None:
    assert fence_of(profile, {}, HOME) is None
    assert has_areas(profile, {})


def test_a_rover_has_no_heights_and_a_circle_needs_home() -> None:
    assert fence_of(ardupilot.COPTER, ARDUPILOT, None) is None
    rover = {"FENCE_ENABLE": 1.0, "FENCE_TYPE": 6.0, "FENCE_RADIUS": 20.0}
    fence = fence_of(ardupilot.ROVER, rover, HOME)
    assert fence is not None
    assert fence.altitude_max_m is None
    assert len(fence.areas) == 1


def _enu(place: Vector3) -> Vector3:
    return (1000.0 * place[1], 1000.0 * place[0], place[2])


def test_items_become_areas_and_broken_groups_are_left_out() -> None:
    def corner(command: int, count: float, x: int, y: int) -> MissionItem:
        return MissionItem(command, params=(count, 0.0, 0.0, 0.0), x=x, y=y)

    ring = [corner(5001, 3.0, 0, 0), corner(5001, 3.0, 10**7, 0), corner(5001, 3.0, 0, 10**7)]
    hole = corner(5004, 7.5, 10**7, 2 * 10**7)
    line = [corner(5002, 2.0, 0, 0), corner(5002, 2.0, 1, 1)]
    back = corner(5000, 0.0, 0, 0)
    assert areas_of([back, *ring, hole, *line], _enu) == (
        PolygonArea(((0.0, 0.0), (0.0, 1000.0), (1000.0, 0.0))),
        CircleArea((2000.0, 1000.0), 7.5, False),
    )
    assert areas_of([], _enu) == ()
    assert areas_of([corner(5001, float("nan"), 0, 0)], _enu) == ()


def test_a_plan_takes_its_laps_holds_and_speeds() -> None:
    a, b = (10.0, 0.0, 0.0), (10.0, 20.0, 0.0)
    assert FlightPlan((a,), (2.0,)).duration_s((0.0, 0.0, 0.0)) == 5.0
    plan = FlightPlan((a, b), (2.0, 4.0), laps=2, hold_s=3.0)
    assert plan.duration_s((0.0, 0.0, 0.0)) == 5.0 + 2 * (5.0 + 3.0) + 10.0
