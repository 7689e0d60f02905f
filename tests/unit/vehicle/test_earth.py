"""The earth frame, against places whose coordinates are known otherwise."""

from __future__ import annotations

import math

import pytest

from mavlink_vehicle.positions import frames
from mavlink_vehicle.positions.earth import earth_position_m, enu_in_earth
from tests.support.models import ellipsoid

PLACES = [(0.0, 0.0), (-35.363262, 149.165237), (47.397742, 8.545594), (89.9, -120.0), (-60, 179)]


def test_positions_at_the_axes_are_the_radii_of_the_ellipsoid() -> None:
    assert earth_position_m(0.0, 0.0, 10.0) == pytest.approx((6378147.0, 0.0, 0.0))
    assert earth_position_m(0.0, 90.0, 0.0) == pytest.approx((0.0, 6378137.0, 0.0), abs=1e-6)
    assert earth_position_m(90.0, 0.0, 0.0) == pytest.approx((0.0, 0.0, 6356752.3142), abs=1e-3)


@pytest.mark.parametrize(("latitude_deg", "longitude_deg"), PLACES)
def test_east_north_and_up_lead_to_neighbouring_places(
    latitude_deg: float, longitude_deg: float
) -> None:
    origin = (latitude_deg, longitude_deg, 500.0)
    turn = enu_in_earth(latitude_deg, longitude_deg)
    start = earth_position_m(*origin)
    w, x, y, z = turn
    for enu_m in ((10.0, 0.0, 0.0), (0.0, 10.0, 0.0), (0.0, 0.0, 10.0), (3.0, -4.0, 5.0)):
        turned = frames.quaternion_multiply(
            frames.quaternion_multiply(turn, (0.0, *enu_m)), (w, -x, -y, -z)
        )[1:]
        east, north, up = enu_m
        place = ellipsoid.on_ground(north, east, origin)
        there = earth_position_m(place[0], place[1], place[2] + up)
        moved = tuple(b - a for a, b in zip(start, there, strict=True))
        assert math.dist(moved, turned) < 1e-4
