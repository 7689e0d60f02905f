"""Bounds are compared with the resolution of targets, and rejections show the difference."""

from __future__ import annotations

import struct

import pytest

from navigation_core.safety.fences import CircleArea, Fence
from navigation_core.safety.target_checks import FlightVolume, MapBounds, beside, check_target

BOX = MapBounds((-30.1, -30.1, 0.0), (30.1, 30.1, 50.0))
VOLUME = FlightVolume(40.7, 2.0, 30.0, BOX)


def as_float32(value: float) -> float:
    return float(struct.unpack("f", struct.pack("f", value))[0])


@pytest.mark.parametrize(
    ("target", "ground_m"),
    [
        ((0.0, 0.0, 2.0), 0.01),
        ((0.0, 0.0, 2.1), 0.1 + 1e-12),
        ((0.0, 0.0, 30.0), -0.05),
        ((as_float32(30.1), as_float32(-30.1) * 0.0, 5.0), 0.0),
        ((0.0, -as_float32(30.1), 5.0), 0.0),
    ],
)
def test_a_target_on_a_bound_is_accepted(target: tuple[float, ...], ground_m: float) -> None:
    assert check_target(target, None, ground_m, VOLUME) is None  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("target", "said"),
    [
        ((0.0, 0.0, 1.85), "is 1.85 m above the ground; the flight volume reaches from 2 m"),
        ((0.0, 0.0, 30.2), "is 30.20 m above the ground"),
        ((30.104, 0.0, 5.0), "(30.104, 0.0, 5.0) m is outside the box"),
    ],
)
def test_a_target_beyond_it_is_rejected(target: tuple[float, ...], said: str) -> None:
    rejection = check_target(target, None, 0.0, VOLUME)  # type: ignore[arg-type]
    assert rejection is not None
    assert said in rejection.message


def test_the_radius_is_told_with_the_digits_that_show_it() -> None:
    volume = FlightVolume(40.0, 0.0, 30.0)
    assert check_target((40.0009, 0.0, 5.0), None, 0.0, volume) is None
    rejection = check_target((40.002, 0.0, 5.0), None, 0.0, volume)
    assert rejection is not None
    assert "is 40.002 m from the map origin; the flight volume ends at 40 m" in rejection.message


def test_a_fence_is_compared_in_the_same_way() -> None:
    fence = Fence((CircleArea((0.0, 0.0), 50.0),), altitude_max_m=20.0)
    assert fence.check_target((as_float32(49.0000001), 0.0, 19.0005), 0.0, 1.0) is None
    near = fence.check_target((49.003, 0.0, 10.0), 0.0, 1.0)
    assert near is not None
    assert "is 0.997 m from the boundary" in near.message
    high = fence.check_target((0.0, 0.0, 19.002), 0.0, 1.0)
    assert high is not None
    assert "is 19.002 m above home" in high.message


def test_digits_are_added_until_they_differ() -> None:
    assert [beside(value, 2.0) for value in (1.5, 1.996, 2.0000004)] == [
        "1.50",
        "1.996",
        "2.0000004",
    ]
