"""A rover drives by its own parameters."""

from __future__ import annotations

import math

import pytest

from mavlink_vehicle.profiles import ardupilot, px4
from navigation_bridge.vehicle.traits import Driving, driving_of, limits_of, traits_of
from navigation_core.limits import Limits

# The parameters of the firmwares' own simulated rovers.
ARDUROVER = {
    "TURN_RADIUS": 0.9,
    "ATC_STR_RAT_MAX": 120.0,
    "ATC_ACCEL_MAX": 1.0,
    "ATC_DECEL_MAX": 0.0,
    "WP_SPEED": 5.0,
}
PX4_ROVER = {
    "RA_WHEEL_BASE": 0.321,
    "RA_MAX_STR_ANG": 0.5236,
    "RO_YAW_RATE_LIM": 180.0,
    "RO_SPEED_LIM": 3.0,
    "RO_ACCEL_LIM": 3.0,
    "RO_DECEL_LIM": 3.0,
}


def test_driving_characteristics_are_read_from_both_firmwares() -> None:
    assert driving_of(ARDUROVER) == Driving(0.9, math.radians(120.0), 5.0, 1.0, 1.0)
    ours = driving_of(PX4_ROVER)
    assert ours.turning_radius_m == pytest.approx(0.556, abs=0.001)
    assert ours[1:] == (math.radians(180.0), 3.0, 3.0, 3.0)


def test_a_deceleration_of_its_own_counts() -> None:
    assert driving_of({**ARDUROVER, "ATC_DECEL_MAX": 0.4}).braking_m_s2 == 0.4


@pytest.mark.parametrize("value", [0.0, -1.0, math.nan, math.inf])
def test_unlimited_or_invalid_parameters_are_ignored(value: float) -> None:
    assert driving_of(dict.fromkeys(ARDUROVER | PX4_ROVER, value)) == Driving()
    assert driving_of({}) == Driving()


def test_a_steering_angle_of_a_right_angle_is_no_radius() -> None:
    assert driving_of({"RA_WHEEL_BASE": 0.3, "RA_MAX_STR_ANG": 1.6}).turning_radius_m is None


def test_a_radius_counts_where_it_is_wider_than_its_kind_at_least_needs() -> None:
    """TURN_RADIUS is 0.9 m until somebody has measured it."""
    assert traits_of(ardupilot.ROVER, {"TURN_RADIUS": 3.2}).turning_radius_m == 3.2
    assert traits_of(ardupilot.ROVER, {"TURN_RADIUS": 0.2}).turning_radius_m == 0.9
    assert traits_of(ardupilot.BOAT, {"TURN_RADIUS": 0.9}).turning_radius_m == 4.0
    assert traits_of(ardupilot.BOAT, {"TURN_RADIUS": 12.0}).turning_radius_m == 12.0
    assert traits_of(px4.ROVER, {**PX4_ROVER, "RA_WHEEL_BASE": 2.5}).turning_radius_m > 4.0


def test_the_deceleration_of_a_boat_is_limited() -> None:
    assert traits_of(ardupilot.ROVER, ARDUROVER).braking_m_s2 == pytest.approx(0.6)
    assert traits_of(ardupilot.BOAT, ARDUROVER).braking_m_s2 == pytest.approx(0.4)


def test_the_servers_limits_are_kept_where_they_are_lower() -> None:
    limits = Limits(speed_horizontal_m_s=4.0, acceleration_horizontal_m_s2=2.0)
    slow = limits_of(traits_of(px4.ROVER, PX4_ROVER), limits)
    assert (slow.speed_horizontal_m_s, slow.acceleration_horizontal_m_s2) == (3.0, 2.0)
    slow = limits_of(traits_of(ardupilot.ROVER, ARDUROVER), limits)
    assert (slow.speed_horizontal_m_s, slow.acceleration_horizontal_m_s2) == (4.0, 1.0)
    assert limits_of(traits_of(ardupilot.COPTER), limits) == limits


@pytest.mark.parametrize("profile", [ardupilot.ROVER, ardupilot.BOAT, px4.ROVER, px4.BOAT])
def test_driving_parameters_are_read(profile: object) -> None:
    wanted = set(profile.wanted_parameters)
    assert wanted >= set(ARDUROVER) or wanted >= set(PX4_ROVER)
