"""The speed that the bounds of the flight allow."""

from __future__ import annotations

import itertools
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from navigation_core.geometry import Vector3, add, scale
from navigation_core.safety.fences import CircleArea, Fence, PolygonArea
from navigation_core.safety.speed_at_bounds import Braking, SpeedAtBounds
from navigation_core.safety.target_checks import FlightVolume, MapBounds

pytestmark = pytest.mark.wide_but_first


VOLUME = FlightVolume(radius_max_m=100.0, altitude_min_m=0.5, altitude_max_m=30.0)
BRAKING = Braking(horizontal_m_s2=2.0, vertical_m_s2=1.0, reaction_s=0.7)
SQUARE = PolygonArea(((-20.0, -20.0), (20.0, -20.0), (20.0, 20.0), (-20.0, 20.0)))
HOLE = CircleArea((10.0, 0.0), 3.0, inclusion=False)
NOTCHED = PolygonArea(
    ((-20.0, -20.0), (20.0, -20.0), (20.0, 20.0), (2.0, 20.0), (0.0, 0.0), (-2.0, 20.0), (-20, 20))
)
FENCES = {
    "none": None,
    "square": Fence((SQUARE,), altitude_max_m=20.0),
    "circle with a hole": Fence((CircleArea((0.0, 0.0), 40.0), HOLE)),
    "notched": Fence((NOTCHED,)),
    "two circles": Fence((), (CircleArea((0.0, 0.0), 15.0), CircleArea((20.0, 0.0), 15.0))),
}


def room(
    fence: Fence | None = None,
    flies: bool = True,
    volume: FlightVolume = VOLUME,
    home_z_enu_m: float = 0.0,
) -> SpeedAtBounds:
    return SpeedAtBounds(volume, fence, home_z_enu_m, 1.0, flies)


def test_the_heights_of_a_fence_count_from_home_and_those_of_the_volume_from_the_ground() -> None:
    up = (0.0, 0.0, 2.0)
    below_home = room(FENCES["square"], home_z_enu_m=30.0)
    assert below_home.reduced(up, (0.0, 0.0, 22.0), 0.0, BRAKING) == up
    assert room(FENCES["square"]).reduced(up, (0.0, 0.0, 22.0), 0.0, BRAKING)[2] == 0.0


def test_far_from_every_bound_the_velocity_is_as_asked() -> None:
    wanted = (3.0, -2.0, 1.0)
    assert room(FENCES["square"]).reduced(wanted, (0.0, 0.0, 10.0), 0.0, BRAKING) == wanted


@pytest.mark.parametrize(("north_m", "share"), [(80.0, 1.0), (94.0, 0.5), (96.0, 0.0)])
def test_a_vehicle_that_turns_back_by_itself_has_room_for_its_turn(
    north_m: float, share: float
) -> None:
    """A turn of 4 m, begun after a second at 4 m/s: the bound is at 100 m."""
    braking = Braking(1000.0, 1.0, 0.0, turn_m=4.0, turn_after_s=1.0)
    volume = FlightVolume(100.0, 0.5, 50.0)
    outwards, place = (0.0, 4.0, 0.0), (0.0, north_m, 0.0)
    kept = room(None, False, volume).reduced(outwards, place, 0.0, braking)
    assert kept[1] == pytest.approx(4.0 * share)
    back = room(None, False, volume).reduced((0.0, -4.0, 0.0), place, 0.0, braking)
    assert back == (0.0, -4.0, 0.0)


@pytest.mark.parametrize("fence", FENCES)
@given(
    heading=st.floats(-math.pi, math.pi),
    turn=st.floats(-0.3, 0.3),
    climb=st.floats(-3.0, 3.0),
    ground=st.floats(-50.0, 50.0),
)
def test_who_flies_on_and_on_stops_inside(
    fence: str, heading: float, turn: float, climb: float, ground: float
) -> None:
    bounds = room(FENCES[fence], home_z_enu_m=ground)
    position: Vector3 = (1.0, -3.0, ground + 10.0)
    velocity: Vector3 = (0.0, 0.0, 0.0)
    for _ in range(600):
        wanted = (8.0 * math.cos(heading), 8.0 * math.sin(heading), climb)
        told = bounds.reduced(wanted, position, ground, BRAKING)
        # A vehicle that reacts with a lag of a third of a second.
        velocity = add(velocity, scale(add(told, scale(velocity, -1.0)), 0.05 / 0.35))
        position = add(position, scale(velocity, 0.05))
        heading += turn * 0.05
        assert math.hypot(position[0], position[1]) < VOLUME.radius_max_m
        assert VOLUME.altitude_min_m < position[2] - ground < VOLUME.altitude_max_m
        allowed = FENCES[fence]
        if allowed is not None:
            assert allowed.allows(position[:2]), position
            if allowed.altitude_max_m is not None:
                assert position[2] - ground < allowed.altitude_max_m


@pytest.mark.parametrize("fence", [name for name in FENCES if name != "none"])
def test_who_is_outside_may_only_come_back(fence: str) -> None:
    outside = (60.0, 0.0, 10.0)
    bounds = room(FENCES[fence])
    assert bounds.reduced((2.0, 0.0, 0.0), outside, 0.0, BRAKING)[:2] == (0.0, 0.0)
    assert bounds.reduced((-2.0, 0.0, 0.0), outside, 0.0, BRAKING) == (-2.0, 0.0, 0.0)


def test_too_low_it_may_only_climb_and_too_high_only_descend() -> None:
    low, high = (0.0, 0.0, 0.3), (0.0, 0.0, 31.0)
    assert room().reduced((1.0, 0.0, -1.0), low, 0.0, BRAKING) == (1.0, 0.0, 0.0)
    assert room().reduced((1.0, 0.0, 1.0), low, 0.0, BRAKING) == (1.0, 0.0, 1.0)
    assert room().reduced((1.0, 0.0, 1.0), high, 0.0, BRAKING) == (1.0, 0.0, 0.0)
    assert room().reduced((1.0, 0.0, -1.0), high, 0.0, BRAKING) == (1.0, 0.0, -1.0)


def test_what_drives_has_no_heights_and_keeps_its_direction() -> None:
    near = (19.5, 0.0, 0.0)
    assert room(FENCES["square"], flies=False).reduced((1.0, 1.0, 0.0), near, 0.0, BRAKING) == (
        0.0,
        0.0,
        0.0,
    )
    along = room(FENCES["square"], flies=False).reduced((0.0, 3.0, 0.0), near, 0.0, BRAKING)
    assert along[0] == 0.0
    assert 0.3 < along[1] < 1.0
    back = room(FENCES["square"], flies=False).reduced((-3.0, 1.0, 0.0), near, 0.0, BRAKING)
    assert back == (-3.0, 1.0, 0.0)


def test_a_box_bounds_every_side() -> None:
    box = MapBounds((-10.0, -10.0, 0.0), (10.0, 10.0, 8.0))
    bounds = room(volume=FlightVolume(100.0, 0.5, 30.0, box))
    for direction in ((1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)):
        near = (9.6 * direction[0], 9.6 * direction[1], 5.0)
        outwards = (2.0 * direction[0], 2.0 * direction[1], 0.0)
        assert bounds.reduced(outwards, near, 0.0, BRAKING)[:2] == (0.0, 0.0)
        assert bounds.reduced(scale(outwards, -1.0), near, 0.0, BRAKING) == scale(outwards, -1.0)
    assert bounds.reduced((0.0, 0.0, 1.0), (0.0, 0.0, 7.8), 0.0, BRAKING)[2] == 0.0


def test_from_the_very_centre_of_a_zone_that_is_closed_every_direction_leads_out() -> None:
    fence = Fence((CircleArea((0.0, 0.0), 5.0, inclusion=False),))
    told = room(fence).reduced((1.0, 1.0, 0.0), (0.0, 0.0, 10.0), 0.0, BRAKING)
    assert told == pytest.approx((1.0, 1.0, 0.0))


@pytest.mark.parametrize("name", FENCES)
@given(
    st.floats(-110.0, 110.0), st.floats(-110.0, 110.0), st.floats(-math.pi, math.pi),
    st.floats(1.0, 150.0), st.floats(0.0, 20.0),
)  # fmt: skip
def test_the_farthest_point_ahead_has_room_and_no_bound_before_it(
    name: str, x: float, y: float, angle: float, length_m: float, inset_m: float
) -> None:
    bounds, way = room(FENCES[name]), (math.cos(angle), math.sin(angle))

    def room_m(along_m: float) -> float:
        return bounds.room_m((x + along_m * way[0], y + along_m * way[1]))

    found_m = bounds.farthest_m((x, y), way, length_m, inset_m)
    along = [length_m * step / 300 for step in range(301)]
    if found_m is None:
        # A point with room for its surroundings, too, is not missed from inside.
        inside = itertools.takewhile(lambda along_m: room_m(along_m) >= 0.0, along)
        assert all(room_m(along_m) < inset_m + 1.0 for along_m in inside)
        return
    assert 0.0 <= found_m <= length_m
    assert room_m(found_m) >= inset_m
    if room_m(0.0) >= 1.0:
        before = [along_m for along_m in along if along_m <= found_m]
        assert min(map(room_m, before)) >= -1.0
