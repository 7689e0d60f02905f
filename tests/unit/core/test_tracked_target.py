"""The filter of a target's samples: what it believes, and what it rejects."""

from __future__ import annotations

import math

import numpy as np
import pytest

from navigation_core.geometry import ZERO, Vector3
from navigation_core.tasks.inputs.tracked_target import PREDICTED_S, TargetFilter, TargetSample


def fed(rate_hz: float = 10.0, seconds: float = 10.0, noise_m: float = 0.0) -> TargetFilter:
    """A filter that has measured a target at 5 m/s to the east."""
    known, random = TargetFilter(), np.random.default_rng(1)
    for number in range(round(rate_hz * seconds) + 1):
        time_s = number / rate_hz
        x, y, z = random.normal((5.0 * time_s, 0.0, 1.0), noise_m)
        assert not known.take(TargetSample(time_s, (x, y, z)), ZERO, time_s)
    return known


@pytest.mark.parametrize("rate_hz", [1.0, 10.0, 50.0])
def test_a_constant_velocity_is_found_and_continued(rate_hz: float) -> None:
    target = fed(rate_hz).tracked
    assert target.velocity_enu_m_s == pytest.approx((5.0, 0.0, 0.0), abs=0.05)
    assert target.position_at(11.0) == pytest.approx((55.0, 0.0, 1.0), abs=0.1)
    assert target.yaw_enu_rad == pytest.approx(0.0, abs=0.01)


def test_it_is_continued_for_a_bounded_time() -> None:
    target = fed().tracked
    assert not target.is_lost(10.0 + PREDICTED_S)
    assert target.is_lost(10.1 + PREDICTED_S)
    assert target.position_at(100.0) == target.position_at(10.0 + PREDICTED_S)


def test_noise_is_smoothed() -> None:
    target = fed(noise_m=0.3).tracked
    assert target.velocity_enu_m_s == pytest.approx((5.0, 0.0, 0.0), abs=1.0)
    assert target.position_at(10.0) == pytest.approx((50.0, 0.0, 1.0), abs=0.5)


def test_the_velocity_and_the_yaw_of_the_source_are_used() -> None:
    known = TargetFilter()
    sample = TargetSample(0.0, ZERO, (0.0, 2.0, 0.0), 1.0)
    known.take(sample, ZERO, 0.0)
    assert known.tracked.velocity_enu_m_s == (0.0, 2.0, 0.0)
    assert known.tracked.yaw_enu_rad == 1.0


@pytest.mark.parametrize(
    ("position", "velocity", "age_s", "words"),
    [
        ((math.nan, 0.0, 0.0), None, 0.0, "not finite"),
        ((50.5, 0.0, math.inf), None, 0.0, "not finite"),
        ((50.5, 0.0, 1.0), (math.nan, 0.0, 0.0), 0.0, "not finite"),
        ((50.5, 0.0, 1.0), None, 3600.0, "3600.0 s ago"),
        ((50.5, 0.0, 1.0), None, -5.0, "5.0 s in the future"),
        ((50.5, 0.0, 1.0), None, 0.2, "not newer"),
        ((90.0, 0.0, 1.0), None, 0.0, "moves at 370 m/s"),
        ((50.5, 0.0, 1.0), (0.0, 300.0, 0.0), 0.0, "moves at 300 m/s"),
        ((1e5, 0.0, 1.0), None, 0.0, "100 km away"),
    ],
)
def test_what_cannot_be_true_is_rejected_with_a_reason_and_counted(
    position: Vector3, velocity: Vector3 | None, age_s: float, words: str
) -> None:
    known = fed()
    before, now = known.tracked, 10.1
    fault = known.take(TargetSample(now - age_s, position, velocity), ZERO, now)
    assert words in fault
    assert known.tracked.fault == fault
    assert known.tracked.rejected == 1
    assert known.tracked.position_at(now) == before.position_at(now)


def test_a_target_that_stays_where_it_jumped_to_is_believed_after_a_while() -> None:
    known = fed()
    rejected = [
        number
        for number in range(1, 31)
        if known.take(TargetSample(10.0 + 0.1 * number, (100.0, 0.0, 1.0)), ZERO, 10 + 0.1 * number)
    ]
    assert rejected == list(range(1, 10))
    assert known.tracked.position_at(13.0) == pytest.approx((100.0, 0.0, 1.0), abs=1.0)
