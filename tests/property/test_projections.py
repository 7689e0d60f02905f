"""Projections of local frames: round trips, against the ellipsoid, and measured."""

from __future__ import annotations

import math
from itertools import pairwise

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from mavlink_sitl import geodesy as simulated
from mavlink_vehicle.positions.frame_finder import FrameFinder
from mavlink_vehicle.positions.frames import (
    AzimuthalEquidistant,
    Geodetic,
    LocalFrame,
    MeanLatitude,
    Projection,
    Vector3,
    equidistant_at,
)
from mavlink_vehicle.profiles import Profile, ardupilot, px4
from tests.support.models import ellipsoid

FIRMWARES = [(ardupilot.PROJECTION, simulated.ARDUPILOT), (px4.PROJECTION, simulated.PX4)]
BY_NAME: dict[str, Projection] = {"ArduPilot": ardupilot.PROJECTION, "PX4": px4.PROJECTION}
LATITUDE = st.floats(-85.0, 85.0)
ORIGIN = st.tuples(LATITUDE, st.floats(-180.0, 180.0), st.floats(-400.0, 9000.0))
WAY = st.floats(-3500.0, 3500.0)
NED = st.tuples(WAY, WAY, st.floats(-500.0, 500.0))


@pytest.mark.parametrize("profile", [p for p in vars(ardupilot).values() if isinstance(p, Profile)])
def test_all_that_ardupilot_flies_measures_alike(profile: Profile) -> None:
    assert profile.projection is ardupilot.PROJECTION


@pytest.mark.parametrize("profile", [p for p in vars(px4).values() if isinstance(p, Profile)])
def test_all_that_px4_flies_measures_alike(profile: Profile) -> None:
    assert profile.projection is px4.PROJECTION


@given(st.sampled_from(list(BY_NAME.values())), ORIGIN, NED)
def test_there_and_back_is_within_a_hundredth_of_a_millimetre(
    projection: Projection, origin: Geodetic, ned: Vector3
) -> None:
    frame = LocalFrame(origin, projection)
    place = frame.geodetic(ned)
    assert abs(place[0]) <= 90.0
    assert abs(place[1]) <= 180.0
    assert frame.ned_m(place) == pytest.approx(ned, abs=1e-5)


@given(st.sampled_from(FIRMWARES), ORIGIN, NED)
def test_the_simulator_measures_the_same_by_formulas_of_its_own(
    firmware: tuple[Projection, simulated.Projection], origin: Geodetic, ned: Vector3
) -> None:
    ours = LocalFrame(origin, firmware[0])
    theirs = simulated.LocalFrame(simulated.GeoPoint(*origin), firmware[1])
    place = theirs.to_geodetic(*ned)
    assert ours.ned_m(place) == pytest.approx(ned, abs=1e-4)
    assert theirs.to_local(simulated.GeoPoint(*ours.geodetic(ned))) == pytest.approx(ned, abs=1e-4)


@given(st.sampled_from(list(BY_NAME.values())), ORIGIN, NED)
def test_the_origin_is_found_from_a_place_and_its_position(
    projection: Projection, place: Geodetic, ned: Vector3
) -> None:
    assume(abs(place[0]) <= 85.0)
    frame = LocalFrame.through(place, ned, projection)
    assert frame.ned_m(place) == pytest.approx(ned, abs=1e-4)


@given(
    st.sampled_from(list(BY_NAME.values())),
    st.sampled_from([-90.0, 90.0, 89.999, 0.0]),
    st.sampled_from([180.0, -180.0, 0.0]),
    NED,
)
def test_poles_and_the_date_line_give_numbers(
    projection: Projection, latitude: float, longitude: float, ned: Vector3
) -> None:
    frame = LocalFrame((latitude, longitude, 100.0), projection)
    place = frame.geodetic(ned)
    assert all(map(math.isfinite, (*place, *frame.ned_m(place))))
    if abs(latitude) < 45.0:
        assert frame.ned_m(place) == pytest.approx(ned, abs=1e-4)


def test_signs() -> None:
    for projection in BY_NAME.values():
        north, east, down = LocalFrame((47.0, 8.0, 500.0), projection).ned_m((47.001, 8.002, 510.0))
        assert north == pytest.approx(111.3, abs=0.2)
        assert east == pytest.approx(151.8, abs=0.2)
        assert down == -10.0


# Against the ellipsoid


@pytest.mark.parametrize(
    ("origin", "place", "expected"),
    [
        # A degree of latitude at the equator and at the pole, a degree of longitude at 60 N
        # (published lengths of arcs: 110 574 m, 111 694 m, 55 800 m), cut down to 0.01 degree.
        ((0.0, 0.0, 0.0), (0.01, 0.0, 0.0), (1105.74, 0.0)),
        ((89.9, 0.0, 0.0), (89.91, 0.0, 0.0), (1116.94, 0.0)),
        ((60.0, 10.0, 0.0), (60.0, 10.01, 0.0), (0.0, 558.00)),
    ],
)
def test_the_reference_has_the_lengths_of_arcs(
    origin: Geodetic, place: Geodetic, expected: tuple[float, float]
) -> None:
    assert ellipsoid.to_ned(place, origin)[:2] == pytest.approx(expected, abs=0.1)
    assert equidistant_at(origin[0]).to_local(*place[:2], origin) == pytest.approx(
        expected, abs=0.1
    )


@given(ORIGIN, st.floats(0.0, math.tau), st.floats(1.0, 5000.0))
def test_true_to_scale_is_true_to_two_centimetres(
    origin: Geodetic, bearing: float, distance_m: float
) -> None:
    way = distance_m * math.cos(bearing), distance_m * math.sin(bearing)
    place = ellipsoid.on_ground(*way, (origin[0], origin[1], 0.0))
    assert ellipsoid.to_ned(place, (origin[0], origin[1], 0.0))[:2] == pytest.approx(way, abs=1e-4)
    told = equidistant_at(origin[0]).to_local(*place[:2], origin)
    assert math.dist(told, way) < 0.025


# Measured


def flight(frame: LocalFrame, far_m: float) -> list[Geodetic]:
    """Places on a way out from a frame's origin, with the resolution of MAVLink's messages."""
    steps = [(far_m * k / 20, 0.7 * far_m * k / 20, -10.0) for k in range(21)]
    places = [frame.geodetic(step) for step in steps]
    return [(round(a * 1e7) * 1e-7, round(b * 1e7) * 1e-7, c) for a, b, c in places]


@given(
    ORIGIN,
    st.floats(0.995, 1.005),
    st.floats(0.995, 1.005),
    st.floats(20.0, 3000.0),
    st.booleans(),
)
def test_an_unknown_projection_is_measured(
    origin: Geodetic, north: float, east: float, far_m: float, told: bool
) -> None:
    """So that what is told in degrees is in the map where the vehicle itself would put it."""
    assumed = equidistant_at(origin[0])
    real = LocalFrame(
        origin,
        AzimuthalEquidistant(assumed.radius_north_m * north, assumed.radius_east_m * east),
    )
    finder = FrameFinder(None)
    if told:
        finder.take_origin(origin)
    places = flight(real, far_m)
    for place in places:
        finder.pair(place, real.ned_m(place))
    assert finder.frame is not None
    for place in places:
        apart = math.dist(finder.frame.ned_m(place), real.ned_m(place))
        assert apart < 0.05 + 1e-5 * far_m


@pytest.mark.parametrize("latitude", [-60.0, 1.3, 47.4])
@pytest.mark.parametrize("name", BY_NAME)
def test_what_is_measured_of_a_known_firmware_is_its_projection(name: str, latitude: float) -> None:
    real = LocalFrame((latitude, 8.5, 500.0), BY_NAME[name])
    finder = FrameFinder(None)
    for place in flight(real, 400.0):
        finder.pair(place, real.ned_m(place))
    assert finder.frame is not None
    for away_m in (100.0, 400.0):
        place = real.geodetic((away_m, away_m / 2, 0.0))
        assert math.dist(finder.frame.ned_m(place), real.ned_m(place)) < 0.1


def test_the_frame_moves_seldom_while_it_is_measured() -> None:
    real = LocalFrame((47.4, 8.5, 500.0), ardupilot.PROJECTION)
    finder = FrameFinder(None)
    frames = []
    for k in range(3000):
        place = real.geodetic((0.1 * k, 0.05 * k, 0.0))
        finder.pair(place, real.ned_m(place))
        frames.append(finder.frame)
    assert sum(a is not b for a, b in pairwise(frames)) < 150


@pytest.mark.parametrize(
    "turned", [lambda n, e: (-e, n), lambda n, e: (n + 1000.0, e), lambda _n, _e: (0.0, 0.0)]
)
def test_positions_that_are_no_projection_teach_nothing(turned: object) -> None:
    """An unknown vehicle's local frame need not lie on the earth at all, such as odometry's."""
    assert callable(turned)
    real = LocalFrame((47.4, 8.5, 500.0), equidistant_at(47.4))
    finder = FrameFinder(None)
    finder.take_origin(real.origin)
    before = finder.frame
    for place in flight(real, 400.0)[1:]:
        north_m, east_m, down_m = real.ned_m(place)
        finder.pair(place, (*turned(north_m, east_m), down_m))
    assert before is not None
    assert finder.frame is not None
    far = real.geodetic((400.0, 280.0, 0.0))
    assert math.dist(finder.frame.ned_m(far), before.ned_m(far)) < 0.5


def test_a_known_projection_is_not_measured() -> None:
    finder = FrameFinder(MeanLatitude(100_000.0))
    assert finder.wants_pairs
    finder.pair((47.4, 8.5, 500.0), (0.0, 0.0, 0.0))
    assert not finder.wants_pairs
    finder.pair((47.5, 8.5, 500.0), (11_119.5, 0.0, 0.0))
    assert finder.frame == LocalFrame((47.4, 8.5, 500.0), MeanLatitude(100_000.0))
