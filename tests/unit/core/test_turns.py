"""Turns of intruders: estimated from reports as they really come, and flown on as arcs."""

from __future__ import annotations

import math
import random
from collections.abc import Sequence

import numpy as np
import pytest

from navigation_core.tasks.traffic.intruders import STRAIGHT, Intruder, Intruders, Turn, TurnWatch
from navigation_core.tasks.traffic.volumes import Separation


def velocity(speed_m_s: float, course_deg: float) -> np.ndarray:
    """Return a velocity, level, shape (3,)."""
    course = math.radians(course_deg)
    return speed_m_s * np.array([math.cos(course), math.sin(course), 0.0])


def watched(reports: Sequence[tuple[float, float]], speed_m_s: float = 30.0) -> Turn:
    """Return the turn after reports of times and courses in degrees."""
    watch, turn = TurnWatch(), STRAIGHT
    for time_s, course_deg in reports:
        turn = watch.watch(velocity(speed_m_s, course_deg), time_s)
    return turn


@pytest.mark.parametrize("rate_deg_s", [-20.0, -3.0, 3.0, 20.0])
@pytest.mark.parametrize("times_s", [range(8), [0, 1, 1, 2, 2, 5, 6, 6, 7], np.arange(0, 7.1, 0.1)])
def test_a_turn_is_seen_across_north_though_reports_are_lost_or_doubled(
    rate_deg_s: float, times_s: Sequence[float]
) -> None:
    rate, observed_s = watched([(t, 85.0 + rate_deg_s * t) for t in times_s])
    assert math.degrees(rate) == pytest.approx(rate_deg_s, abs=0.1)
    assert observed_s == pytest.approx(7.0, abs=0.5)


def test_a_turn_that_has_just_begun_is_no_older_than_that_and_one_that_ends_is_over() -> None:
    courses = [0.0, 0.0, 0.0, 0.0, 6.0, 12.0, 18.0]
    rate, observed_s = watched(list(enumerate(courses)))
    assert math.degrees(rate) == pytest.approx(6.0, abs=2.0)
    assert 2.0 <= observed_s <= 4.0
    ended = [*courses, 18.0, 18.0, 18.0]
    rate, observed_s = watched(list(enumerate(ended)))
    assert abs(math.degrees(rate) * observed_s) < 2.0


def test_a_course_that_jumps_is_no_turn_once_it_stays_or_is_back() -> None:
    for after in (40.0, 170.0):
        courses = [40.0] * 5 + [170.0] + [after] * 3
        assert watched(list(enumerate(courses)))[0] == pytest.approx(0.0, abs=1e-9)
    assert watched([(t, 40.0) for t in range(5)] + [(5.0, 170.0)]) == STRAIGHT


def test_who_hovers_with_noise_does_not_turn_nor_who_was_silent() -> None:
    draw = random.Random(1)
    hovers = [(float(t), draw.uniform(0.0, 360.0)) for t in range(20)]
    assert watched(hovers, speed_m_s=0.6) == STRAIGHT
    assert watched([(0.0, 0.0), (1.0, 5.0), (20.0, 90.0)]) == STRAIGHT


def test_noise_leaves_a_turn_what_it_is_and_makes_no_lasting_one() -> None:
    draw = random.Random(1)
    for rate_deg_s in (0.0, 6.0):
        turned = [
            watched([(float(t), rate_deg_s * t + draw.gauss(0.0, 1.0)) for t in range(8)])
            for _ in range(200)
        ]
        degrees = [math.degrees(rate) * observed_s for rate, observed_s in turned]
        assert np.percentile(degrees, 10) >= rate_deg_s * 5.0 - 4.0
        assert np.percentile(degrees, 90) <= rate_deg_s * 7.0 + 4.0


def test_a_prediction_follows_the_circle_while_it_turns_and_goes_straight_on_behind() -> None:
    speed, rate = 20.0, 0.1
    intruder = Intruder(np.zeros(3), np.array([speed, 0.0, 1.0]), 0.0, 1.0, 1.0, turn=(rate, 5.0))
    times_s = np.array([0.0, 4.0, 10.0, 14.0])
    straight, arc = intruder.paths(times_s)
    assert straight[:, 0] == pytest.approx(speed * times_s)
    circle = speed / rate * np.stack([np.sin(rate * times_s), 1.0 - np.cos(rate * times_s)], axis=1)
    assert arc[:3, :2] == pytest.approx(circle[:3])
    assert arc[3, :2] == pytest.approx(arc[2, :2] + 80.0 * np.array([math.cos(1), math.sin(1)]))
    assert arc[:, 2] == pytest.approx(times_s)


def test_the_worse_of_arc_and_straight_counts() -> None:
    intruder = Intruder(np.zeros(3), np.array([20.0, 0.0, 0.0]), 0.0, 0.0, 0.0, turn=(0.1, 5.0))
    intruders = Intruders.of([("a", intruder)], Separation(5.0, 3.0, 2.0), (0.0, 0.0), 0.0)
    after_s = np.linspace(0.0, 8.0, 17)
    ends = np.array([intruder.paths(np.array([8.0]))[path, 0] for path in (0, 1)] + [[0, -99, 0]])
    motions = np.broadcast_to(ends[:, None], (3, 17, 3))
    shares = intruders.passage(motions, after_s).shares
    assert (shares[:2] < 0.1).all()
    assert shares[2] > 1.0
