"""Rejected targets and their messages."""

import math

import pytest

from navigation_core.outcomes import OutcomeCode
from navigation_core.safety.target_checks import FlightVolume, MapBounds, VolumeError, check_target

VOLUME = FlightVolume(radius_max_m=100.0, altitude_min_m=0.5, altitude_max_m=50.0)


def test_a_sound_target_is_accepted() -> None:
    assert check_target((10.0, 5.0, 2.0), None, 0.0, VOLUME) is None
    assert check_target((10.0, 5.0, 2.0), 0.0, 0.0, VOLUME) is None
    assert check_target((0.0, 100.0, 50.0), 3.0, 0.0, VOLUME, yaw_enu_rad=1.0) is None


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_every_coordinate_must_be_finite(axis: int, bad: float) -> None:
    target = [10.0, 5.0, 2.0]
    target[axis] = bad
    rejection = check_target((target[0], target[1], target[2]), None, 0.0, VOLUME)
    assert rejection is not None
    assert rejection.code is OutcomeCode.INVALID_NUMBER


@pytest.mark.parametrize(
    ("position", "speed", "yaw", "code", "words"),
    [
        ((1.0, 2.0, 3.0), math.nan, None, OutcomeCode.INVALID_NUMBER, ["nan m/s"]),
        ((1.0, 2.0, 3.0), math.inf, None, OutcomeCode.INVALID_NUMBER, ["inf m/s"]),
        ((1.0, 2.0, 3.0), None, math.nan, OutcomeCode.INVALID_NUMBER, ["nan rad"]),
        ((1.0, 2.0, 3.0), -1.5, None, OutcomeCode.NEGATIVE_SPEED, ["-1.5 m/s"]),
        (
            (1.0, 2.0, -3.0),
            None,
            None,
            OutcomeCode.BELOW_GROUND,
            ["(1.00, 2.00, -3.00) m", "2.00 m below the ground", "z = -1.00 m"],
        ),
        ((80.0, 80.0, 3.0), None, None, OutcomeCode.OUTSIDE_VOLUME, ["113.14 m", "100 m"]),
        (
            (1.0, 2.0, -0.9),
            None,
            None,
            OutcomeCode.OUTSIDE_VOLUME,
            ["0.10 m above", "0.5 m", "50 m"],
        ),
        ((1.0, 2.0, 60.0), None, None, OutcomeCode.OUTSIDE_VOLUME, ["61.00 m above", "50 m"]),
    ],
)
def test_a_rejection_has_a_code_and_all_numbers(
    position: tuple[float, float, float],
    speed: float | None,
    yaw: float | None,
    code: OutcomeCode,
    words: list[str],
) -> None:
    rejection = check_target(position, speed, -1.0, VOLUME, yaw)
    assert rejection is not None
    assert rejection.code is code
    for word in words:
        assert word in rejection.message
    assert rejection.message.endswith(".")


def test_altitudes_are_above_the_ground_and_not_above_the_origin() -> None:
    assert check_target((0.0, 0.0, -8.0), None, -10.0, VOLUME) is None
    below = check_target((0.0, 0.0, 8.0), None, 10.0, VOLUME)
    assert below is not None
    assert below.code is OutcomeCode.BELOW_GROUND


def test_a_box_narrows_the_volume() -> None:
    volume = FlightVolume(100.0, 0.5, 50.0, MapBounds((-5.0, -5.0, 0.0), (20.0, 20.0, 30.0)))
    assert check_target((20.0, 20.0, 30.0), None, 0.0, volume) is None
    outside = check_target((-6.0, 0.0, 3.0), None, 0.0, volume)
    assert outside is not None
    assert outside.code is OutcomeCode.OUTSIDE_VOLUME
    assert "outside the box" in outside.message


@pytest.mark.parametrize(
    ("radius", "low", "high"),
    [(0.0, 0.0, 1.0), (math.nan, 0.0, 1.0), (1.0, 2.0, 1.0), (1.0, 1.0, 1.0), (1.0, math.nan, 1.0)],
)
def test_an_empty_volume_is_a_configuration_error(radius: float, low: float, high: float) -> None:
    with pytest.raises(VolumeError, match="give a"):
        FlightVolume(radius, low, high)


def test_an_empty_box_is_a_configuration_error() -> None:
    with pytest.raises(VolumeError, match="is empty"):
        MapBounds((0.0, 0.0, 0.0), (1.0, 0.0, 1.0))
    with pytest.raises(VolumeError, match="is empty"):
        MapBounds((0.0, 0.0, math.nan), (1.0, 1.0, 1.0))
