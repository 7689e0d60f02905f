"""Values that tasks read from an observation."""

import math

import pytest

from navigation_core.tasks.conditions import (
    is_airborne,
    is_located,
    measured_speed,
    measured_state,
)
from tests.support.models.point_mass import PointMass


def test_an_old_position_is_carried_on_at_the_measured_velocity() -> None:
    vehicle = PointMass(position=(1.0, 2.0, 3.0), velocity=(4.0, 0.0, -2.0), position_age_s=0.5)
    state = measured_state(vehicle.observe())
    assert state.position_enu_m == (3.0, 2.0, 2.0)
    assert state.velocity_enu_m_s == (4.0, 0.0, -2.0)


def test_an_unknown_position_cannot_be_read() -> None:
    observation = PointMass(position_known=False).observe()
    assert measured_speed(observation) is None
    with pytest.raises(ValueError, match="no position"):
        measured_state(observation)


@pytest.mark.parametrize(
    ("age_s", "yaw", "expected"),
    [
        (0.0, 0.0, True),
        (1.0, 0.0, True),
        (1.1, 0.0, False),
        (math.nan, 0.0, False),
        (0.0, math.nan, False),
    ],
)
def test_located_means_known_recent_and_finite(age_s: float, yaw: float, expected: bool) -> None:
    vehicle = PointMass(position_age_s=age_s, yaw=yaw)
    assert is_located(vehicle.observe(), 1.0) is expected


def test_flying_is_what_the_vehicle_says_or_else_its_height() -> None:
    assert is_airborne(PointMass(airborne=True).observe(), 0.5)
    assert not is_airborne(PointMass(airborne=False, position=(0.0, 0.0, 9.0)).observe(), 0.5)
    assert is_airborne(PointMass(airborne=None, position=(0.0, 0.0, 0.6)).observe(), 0.5)
    assert not is_airborne(PointMass(airborne=None, position=(0.0, 0.0, 0.4)).observe(), 0.5)
    assert not is_airborne(PointMass(airborne=None, position_known=False).observe(), 0.5)
