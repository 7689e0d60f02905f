"""Driving to a point: no target makes a car or a boat circle it."""

from __future__ import annotations

import itertools
import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from navigation_core.limits import Limits
from navigation_core.tasks.flying.goto import GotoConfig, GotoGoal, fly_to
from navigation_core.tasks.intents import Fly, Outcome, Perform
from navigation_core.tasks.leading.flight_terms import FlightTerms
from navigation_core.tasks.observation import Observation
from navigation_core.tasks.traits import Traits

_DT_S = 0.05
CAR = Traits(name="rover", flies=False, turning_radius_m=0.9)
BOAT = Traits(
    name="boat", flies=False, turning_radius_m=4.0, arrival_radius_m=2.0, braking_m_s2=0.2
)


class Car:
    """Turns no tighter than its radius, and follows the commanded speed with a lag."""

    def __init__(self, radius_m: float, yaw_rad: float, lag_s: float) -> None:
        self.x = self.y = self.speed_m_s = 0.0
        self.yaw_rad, self._radius_m, self._lag_s = yaw_rad, radius_m, lag_s
        self.turned_rad = 0.0

    def follow(self, velocity: tuple[float, float, float]) -> None:
        wanted = math.hypot(velocity[0], velocity[1])
        self.speed_m_s += (wanted - self.speed_m_s) * _DT_S / self._lag_s
        if wanted > 0.0:
            away = math.remainder(math.atan2(velocity[1], velocity[0]) - self.yaw_rad, math.tau)
            most = self.speed_m_s / self._radius_m
            turn = max(min(2.0 * away, most), -most) * _DT_S
            self.yaw_rad += turn
            self.turned_rad += abs(turn)
        self.x += self.speed_m_s * math.cos(self.yaw_rad) * _DT_S
        self.y += self.speed_m_s * math.sin(self.yaw_rad) * _DT_S

    def observe(self, now: float) -> Observation:
        velocity = (
            self.speed_m_s * math.cos(self.yaw_rad), self.speed_m_s * math.sin(self.yaw_rad), 0.0
        )  # fmt: skip
        return Observation(
            now, (self.x, self.y, 0.0), velocity, self.yaw_rad,
            armed=True, in_control=True, airborne=None, ground_enu_m=0.0,
            position_age_s=0.0, connected=True, operation=None,
        )  # fmt: skip


def drive(
    traits: Traits, car: Car, x: float, y: float, speed_m_s: float
) -> tuple[Outcome, list[float]]:
    """Drive to the end, and return it with all commanded speeds."""
    task = fly_to(
        GotoGoal((x, y, 0.0), None, speed_m_s),
        FlightTerms(GotoConfig(limits=Limits()), traits=traits),
    )
    task.start(car.observe(0.0), 0.0)
    told: list[float] = []
    now = 0.0
    while now < 300.0:
        now += _DT_S
        answer = task.step(car.observe(now), now)
        if isinstance(answer, Outcome):
            return answer, told
        assert not isinstance(answer, Perform)
        if isinstance(answer, Fly):
            velocity = answer.setpoint.velocity_enu_m_s
            told.append(math.hypot(velocity[0], velocity[1]))
            car.follow(velocity)
    raise AssertionError(f"not in 300 s; it is at {car.x:.1f}, {car.y:.1f}")


@pytest.mark.wide
@settings(max_examples=40, deadline=None)
@given(
    distance_m=st.floats(0.1, 40.0),
    bearing_rad=st.floats(-math.pi, math.pi),
    yaw_rad=st.floats(-math.pi, math.pi),
    speed_m_s=st.floats(0.3, 3.0),
    is_boat=st.booleans(),
)
def test_any_target_is_reached_without_circles(
    distance_m: float, bearing_rad: float, yaw_rad: float, speed_m_s: float, is_boat: bool
) -> None:
    traits = BOAT if is_boat else CAR
    car = Car(0.6 * traits.turning_radius_m, yaw_rad, 1.0 if is_boat else 0.3)
    x, y = distance_m * math.cos(bearing_rad), distance_m * math.sin(bearing_rad)
    end, told = drive(traits, car, x, y, speed_m_s)
    assert end.code.value == "SUCCESS", end.message
    assert math.hypot(car.x - x, car.y - y) <= max(0.5, traits.arrival_radius_m)
    assert car.turned_rad < 1.7 * math.tau
    assert max(told) <= speed_m_s


@settings(max_examples=40, deadline=None)
@given(
    times_known=st.floats(1.0, 3.0),
    distance_m=st.floats(0.6, 6.0),
    bearing_rad=st.floats(-math.pi, math.pi),
)
def test_a_circle_that_is_wider_than_the_parameters_say_is_learned(
    times_known: float, distance_m: float, bearing_rad: float
) -> None:
    """ArduRover's TURN_RADIUS is 0.9 m as it comes, and its simulated car turned with 1.6."""
    car = Car(times_known * CAR.turning_radius_m, 0.0, 0.3)
    x, y = distance_m * math.cos(bearing_rad), distance_m * math.sin(bearing_rad)
    end, _ = drive(CAR, car, x, y, 2.0)
    assert end.code.value == "SUCCESS", end.message
    assert car.turned_rad < 3.0 * math.tau


def test_the_speed_is_raised_gently_and_lowered_at_once() -> None:
    _, told = drive(CAR, Car(0.5, 0.0, 0.3), 30.0, 0.0, 2.0)
    steps = [b - a for a, b in itertools.pairwise(told)]
    assert max(steps) <= 2.0 / 1.5 * _DT_S + 1e-6, "the acceleration of a goal of 2 m/s"
    assert max(told) > 1.9


def test_it_stands_where_it_is_near_enough_until_it_has_drifted_away() -> None:
    end, told = drive(BOAT, Car(2.0, 0.0, 1.0), 15.0, 0.0, 2.0)
    assert end.code.value == "SUCCESS"
    assert told[-1] <= 0.001, "next to nothing, along the nose, while it still rolls"
    assert end.final_error_m == pytest.approx(1.0, abs=1.0)
