"""Consumption: measured, rejected when implausible, and a safe default before it is known."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from navigation_core.safety.energy import ConsumptionEstimator

PRIOR = 1.0 / 900.0


def fly(
    estimator: ConsumptionEstimator, start: float, rate_per_s: float, seconds: int, from_s: int = 0
) -> None:
    """Report whole percents, as autopilots do, twice a second."""
    for step in range(2 * seconds):
        remaining = round(max(start - rate_per_s * 0.5 * step, 0.0), 2)
        estimator.observe(from_s + 0.5 * step, remaining, under_way=True)


def test_before_anything_is_measured_the_configured_endurance_counts() -> None:
    estimator = ConsumptionEstimator(900.0)
    assert estimator.predict(10.0, 10.0) is None
    estimator.observe(0.0, 0.9, under_way=False)
    prediction = estimator.predict(90.0, 45.0)
    assert prediction is not None
    assert prediction.at_end == pytest.approx(0.8)
    assert prediction.back == pytest.approx(0.75)
    assert not prediction.measured
    assert "battery_endurance_s" in prediction.describe()


@pytest.mark.parametrize("endurance_s", [300.0, 600.0, 1800.0])
def test_what_is_measured_takes_over(endurance_s: float) -> None:
    estimator = ConsumptionEstimator(900.0)
    fly(estimator, 1.0, 1.0 / endurance_s, 280)
    weight = 270.0 / (270.0 + 120.0)
    expected = weight / endurance_s + (1.0 - weight) * PRIOR
    assert estimator.rate_per_s == pytest.approx(expected, rel=0.15)


def test_standing_on_the_ground_measures_nothing() -> None:
    estimator = ConsumptionEstimator(900.0)
    for second in range(300):
        estimator.observe(float(second), 1.0, under_way=False)
    assert estimator.rate_per_s == pytest.approx(PRIOR)


def test_the_simulated_battery_of_px4_is_not_taken_for_consumption() -> None:
    """It falls from 100 to 50 % within 30 s of arming and then stands still."""
    estimator = ConsumptionEstimator(900.0)
    fly(estimator, 1.0, 0.5 / 30.0, 30)
    assert estimator.rate_per_s < 1.6 * PRIOR
    fly(estimator, 0.5, 0.0, 600, from_s=30)
    assert estimator.rate_per_s >= PRIOR / 3.0
    assert estimator.remaining == 0.5


@pytest.mark.parametrize("unknown", [None, math.nan, -0.01, 2.55])
def test_an_unknown_battery_predicts_nothing(unknown: float | None) -> None:
    estimator = ConsumptionEstimator(900.0)
    estimator.observe(0.0, 0.8, under_way=True)
    estimator.observe(1.0, unknown, under_way=True)
    assert estimator.remaining is None
    assert estimator.predict(10.0, 10.0) is None


def test_a_swapped_battery_restarts_the_estimate() -> None:
    estimator = ConsumptionEstimator(900.0)
    fly(estimator, 1.0, 1.0 / 300.0, 200)
    assert estimator.rate_per_s > 1.5 * PRIOR
    estimator.observe(1000.0, 1.0, under_way=False)
    assert estimator.rate_per_s == pytest.approx(PRIOR)


def test_a_jump_and_a_silence_are_no_consumption() -> None:
    estimator = ConsumptionEstimator(900.0)
    estimator.observe(0.0, 1.0, under_way=True)
    estimator.observe(10.0, 0.7, under_way=True)
    assert estimator.rate_per_s == pytest.approx(PRIOR)
    estimator.observe(200.0, 0.6, under_way=True)
    assert estimator.rate_per_s == pytest.approx(PRIOR)


READING = st.none() | st.floats(0.0, 1.0) | st.just(math.nan)


@given(st.lists(st.tuples(st.floats(0.0, 60.0), READING, st.booleans()), max_size=60))
def test_whatever_the_gauge_says_the_rate_stays_believable(
    readings: list[tuple[float, float | None, bool]],
) -> None:
    estimator = ConsumptionEstimator(900.0)
    time_s = 0.0
    for step_s, remaining, under_way in readings:
        time_s += step_s
        estimator.observe(time_s, remaining, under_way)
        assert PRIOR / 3.0 <= estimator.rate_per_s <= 1.0 / 120.0
        prediction = estimator.predict(10.0, 10.0)
        if prediction is not None:
            assert prediction.back < prediction.at_end < prediction.now
