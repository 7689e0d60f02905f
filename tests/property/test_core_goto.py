"""Flights to a point under any schedule of rejections, losses, interventions and cancels."""

from __future__ import annotations

import math
from collections.abc import Callable

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from navigation_core.outcomes import OutcomeCode
from navigation_core.tasks.flying.flight import SetpointFlight
from navigation_core.tasks.flying.goto import GotoConfig, GotoGoal, fly_to
from navigation_core.tasks.intents import Fly, Outcome
from navigation_core.tasks.leading.flight_terms import FlightTerms
from navigation_core.tasks.observation import OperationStatus, TaskOperation
from tests.support.models.core_strategies import limits
from tests.support.models.point_mass import Flight, PointMass, fly

_TIME_MAX_S = 600.0

times = st.floats(0.0, 30.0)
durations = st.floats(0.05, 6.0)
targets = st.tuples(st.floats(-30.0, 30.0), st.floats(-30.0, 30.0), st.floats(0.0, 20.0))
kinds = st.sampled_from(list(TaskOperation))
final = st.sampled_from(
    [state for state in OperationStatus if state is not OperationStatus.PENDING]
)


def _disarm(vehicle: PointMass, active: bool) -> None:
    if active:
        vehicle.armed = False


def _take_over(vehicle: PointMass, active: bool) -> None:
    if active:
        vehicle.in_control = False


def _blind(vehicle: PointMass, active: bool) -> None:
    vehicle.position_known = not active


def _age(vehicle: PointMass, active: bool) -> None:
    vehicle.position_age_s = vehicle.position_age_s + 0.05 if active else 0.0


def _cut(vehicle: PointMass, active: bool) -> None:
    vehicle.connected = not active


def _touch_down(vehicle: PointMass, active: bool) -> None:
    if vehicle.position[2] > 0.3:
        vehicle.airborne = not active


# A gust this short before the end moves a vehicle that has stood for its dwell.
_CALM_S = 1.0


def _blow(vehicle: PointMass, active: bool) -> None:
    vehicle.wind = (4.0, -3.0, 0.5) if active else (0.0, 0.0, 0.0)


def _jump(vehicle: PointMass, active: bool) -> None:
    if active:
        vehicle.position = (vehicle.position[0] + 0.5, *vehicle.position[1:])


disturbances = st.tuples(
    st.sampled_from([_disarm, _take_over, _blind, _age, _cut, _touch_down, _blow, _jump]),
    times,
    durations,
)


def _disturb(
    vehicle: PointMass,
    task: SetpointFlight,
    schedule: list[tuple[Callable[[PointMass, bool], None], float, float]],
    cancel_s: float | None,
) -> Callable[[float], None]:
    def each_step(elapsed_s: float) -> None:
        for change, begin_s, duration_s in schedule:
            if begin_s <= elapsed_s < begin_s + duration_s + 0.05:
                change(vehicle, elapsed_s < begin_s + duration_s)
        if cancel_s is not None and elapsed_s >= cancel_s:
            task.cancel(vehicle.now)

    return each_step


def _is_calm(flight: Flight, schedule: list[tuple[Callable[..., None], float, float]]) -> bool:
    """Return whether no gust blew shortly before the end."""
    end_s = flight.steps[-1][0] - flight.steps[0][0]
    return not any(
        change is _blow and begin_s <= end_s + _CALM_S and begin_s + duration_s >= end_s - _CALM_S
        for change, begin_s, duration_s in schedule
    )


def _assert_honest(flight: Flight, vehicle: PointMass, config: GotoConfig, calm: bool) -> None:
    outcome = flight.outcome  # exactly one, and the last
    assert outcome.message
    assert outcome.message[0].isupper() or outcome.message[0].isdigit()
    for _, observation, answer in flight.steps:
        if not isinstance(answer, Fly):
            continue
        setpoint = answer.setpoint
        numbers = (
            *setpoint.position_enu_m,
            *setpoint.velocity_enu_m_s,
            *setpoint.acceleration_enu_m_s2,
            setpoint.yaw_enu_rad,
        )
        assert all(math.isfinite(number) for number in numbers)
        assert observation.armed
        assert observation.in_control
        stands = answer.by_velocity and setpoint.velocity_enu_m_s == (0.0, 0.0, 0.0)
        assert observation.airborne is not False or stands
    if outcome.code is OutcomeCode.SUCCESS:
        assert outcome.final_error_m is not None
        assert outcome.final_error_m <= config.arrival_radius_m
        assert vehicle.speed <= config.arrival_speed_m_s or not calm
    if outcome.code is OutcomeCode.CANCELED and "has stopped" in outcome.message:
        assert vehicle.speed <= config.stop_speed_m_s or not calm


@pytest.mark.wide
@settings(max_examples=200, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(
    target=targets,
    bounds=limits,
    speed=st.none() | st.floats(0.3, 12.0),
    yaw=st.none() | st.floats(-math.pi, math.pi),
    may_arm=st.booleans(),
    begins=st.sampled_from(["ground", "armed", "hover", "other mode", "unknown"]),
    results=st.dictionaries(kinds, final, max_size=2),
    delays=st.dictionaries(kinds, st.floats(0.0, 8.0), max_size=3),
    schedule=st.lists(disturbances, max_size=4),
    cancel_s=st.none() | times,
)
def test_every_flight_ends_once_and_honestly(
    target: tuple[float, float, float],
    bounds: object,
    speed: float | None,
    yaw: float | None,
    may_arm: bool,
    begins: str,
    results: dict[TaskOperation, OperationStatus],
    delays: dict[TaskOperation, float],
    schedule: list[tuple[Callable[[PointMass, bool], None], float, float]],
    cancel_s: float | None,
) -> None:
    config = GotoConfig(limits=bounds, may_arm=may_arm)  # type: ignore[arg-type]
    vehicle = PointMass(results=results, delays=delays, reason="for a test")
    if begins in ("hover", "other mode"):
        vehicle.position, vehicle.airborne, vehicle.armed = (0.0, 0.0, 5.0), True, True
        vehicle.in_control = begins == "hover"
    elif begins != "ground":
        vehicle.armed = True
        vehicle.airborne = None if begins == "unknown" else False
    task = fly_to(GotoGoal(target, yaw, speed), FlightTerms(config))
    flight = fly(
        task,
        vehicle,
        _disturb(vehicle, task, schedule, cancel_s),
        time_max_s=_TIME_MAX_S,
        dt_s=0.05,
    )
    _assert_honest(flight, vehicle, config, _is_calm(flight, schedule))
    again = task.step(vehicle.observe(), vehicle.now + 1.0)
    assert isinstance(again, Outcome)
    assert again is flight.outcome
