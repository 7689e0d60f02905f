"""Landing and return, judged by the vehicle's reports and measurements."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from navigation_core.outcomes import OutcomeCode
from navigation_core.tasks.goto_config import GotoConfig
from navigation_core.tasks.intents import Intent, Outcome, Perform, Wait
from navigation_core.tasks.observation import (
    Observation,
    OperationReport,
    OperationStatus,
    TaskOperation,
    VehicleMode,
)
from navigation_core.tasks.progress import Status
from navigation_core.tasks.traits import COPTER, Traits
from navigation_core.tasks.watching.vehicle_led import (
    LAND,
    RETURN_TO_LAUNCH,
    VehicleLed,
    VehicleLedGoal,
)
from tests.support.models.observations import HOVERING

ROVER = Traits(name="rover", flies=False, lands_itself=False)
PLANE = Traits(name="plane", hovers=False, circle_radius_m=80.0)

FLYING = replace(
    HOVERING,
    position_enu_m=(30.0, 40.0, 12.0),
    in_control=False,
    ground_enu_m=2.0,
    home_enu_m=(0.0, 0.0, 2.0),
)


def report(kind: TaskOperation, state: OperationStatus, reason: str = "") -> Observation:
    return replace(FLYING, operation=OperationReport(kind, state, reason))


def under_way(
    goal: VehicleLedGoal, traits: Traits = COPTER, config: GotoConfig | None = None
) -> VehicleLed:
    task = VehicleLed(goal, config or GotoConfig(), traits)
    task.start(FLYING, 0.0)
    assert task.step(FLYING, 0.0) == Perform(goal.operation)
    assert isinstance(task.step(report(goal.operation, OperationStatus.ACHIEVED), 1.0), Wait)
    return task


def sure(task: VehicleLed, observation: Observation, now: float) -> Intent | Outcome:
    """Have it look twice, as long apart as two HEARTBEATs take; return the second answer."""
    assert isinstance(task.step(observation, now), Wait)
    return task.step(observation, now + 2.3)


def test_a_rejection_ends_it_with_the_vehicles_reason() -> None:
    task = VehicleLed(LAND, GotoConfig(), COPTER)
    task.start(FLYING, 0.0)
    task.step(FLYING, 0.0)
    answer = task.step(report(TaskOperation.LAND, OperationStatus.REFUSED, "no position"), 1.0)
    assert isinstance(answer, Outcome)
    assert answer.code is OutcomeCode.MODE_REFUSED
    assert "no position" in answer.message


@pytest.mark.parametrize("goal", [LAND, RETURN_TO_LAUNCH])
def test_an_armed_vehicle_on_the_ground_is_not_asked(goal: VehicleLedGoal) -> None:
    task = VehicleLed(goal, GotoConfig(), COPTER)
    standing = replace(FLYING, position_enu_m=(30.0, 40.0, 2.0), airborne=False)
    task.start(standing, 0.0)
    answer = task.step(standing, 0.0)
    assert isinstance(answer, Outcome)
    assert answer.code is OutcomeCode.NOT_FLYING


@pytest.mark.parametrize("goal", [LAND, RETURN_TO_LAUNCH])
def test_on_the_ground_and_disarmed_is_success(goal: VehicleLedGoal) -> None:
    task = under_way(goal)
    place = (0.5, 0.5, 2.0) if goal is RETURN_TO_LAUNCH else FLYING.position_enu_m
    standing = replace(FLYING, position_enu_m=place, airborne=False)
    assert isinstance(task.step(standing, 2.0), Wait)  # still armed
    answer = sure(task, replace(standing, armed=False), 3.0)
    assert isinstance(answer, Outcome)
    assert answer.code is OutcomeCode.SUCCESS
    assert task.step(FLYING, 6.0) == answer  # the end is the end


@pytest.mark.parametrize("goal", [LAND, RETURN_TO_LAUNCH])
def test_a_landing_that_is_denied_is_none(goal: VehicleLedGoal) -> None:
    """Somebody on the link can send a landing, but the vehicle's own HEARTBEATs deny it."""
    task = under_way(goal)
    down = replace(FLYING, position_enu_m=(0.5, 0.5, 9.0), airborne=False, armed=False)
    for second in range(3, 9):
        assert isinstance(task.step(down, float(second)), Wait)
        assert isinstance(task.step(FLYING, second + 0.9), Wait)


def test_a_return_that_comes_down_where_it_began_is_none() -> None:
    """It was asked for as the vehicle touched down: in its return mode it just disarmed."""
    landed = replace(FLYING, position_enu_m=(30.0, 41.0, 2.0), armed=False, airborne=False)
    answer = under_way(RETURN_TO_LAUNCH).step(landed, 3.0)
    assert isinstance(answer, Outcome)
    assert answer.code is OutcomeCode.LANDED
    assert "50.8 m from the launch point" in answer.message
    # A rally point elsewhere is as good as the launch point.
    at_rally = replace(landed, position_enu_m=(90.0, 40.0, 2.0))
    answer = sure(under_way(RETURN_TO_LAUNCH), at_rally, 60.0)
    assert isinstance(answer, Outcome)
    assert answer.code is OutcomeCode.SUCCESS


@pytest.mark.parametrize("goal", [LAND, RETURN_TO_LAUNCH])
def test_who_is_disarmed_at_speed_has_not_landed(goal: VehicleLedGoal) -> None:
    """A PX4 that has hit something on its return says that it is on the ground."""
    task = under_way(goal)
    task.step(replace(FLYING, velocity_enu_m_s=(4.5, 0.0, 0.0)), 2.0)
    answer = task.step(replace(FLYING, armed=False, airborne=False), 2.1)
    assert isinstance(answer, Outcome)
    assert answer.code is OutcomeCode.DISARMED
    assert "at 4.5 m/s" in answer.message


def test_what_is_left_shrinks_to_nothing() -> None:
    task = under_way(RETURN_TO_LAUNCH)
    far = task.progress(FLYING, 1.0)
    near = task.progress(replace(FLYING, position_enu_m=(3.0, 4.0, 12.0)), 2.0)
    assert far.distance_remaining_m == pytest.approx(50.0 + 10.0)
    assert near.distance_remaining_m == pytest.approx(5.0 + 10.0)
    assert far.time_remaining_s > near.time_remaining_s > 10.0
    assert far.status is Status.RETURNING


def test_a_landing_that_was_seen_stays_one_until_the_end() -> None:
    task = under_way(RETURN_TO_LAUNCH)
    assert task.progress(replace(FLYING, landing=True), 2.0).status is Status.LANDING
    assert task.progress(replace(FLYING, airborne=False), 3.0).status is Status.LANDING


def test_a_rover_returns_when_it_stands_at_the_launch_point() -> None:
    task = under_way(RETURN_TO_LAUNCH, ROVER)
    home = replace(FLYING, position_enu_m=(1.0, 1.0, 2.0), mode=VehicleMode.RETURN)
    assert isinstance(task.step(replace(home, velocity_enu_m_s=(1.0, 0.0, 0.0)), 2.0), Wait)
    assert isinstance(task.step(home, 3.0), Wait)
    answer = task.step(home, 5.0)
    assert isinstance(answer, Outcome)
    assert answer.code is OutcomeCode.SUCCESS
    assert answer.final_error_m == pytest.approx(2**0.5)


@pytest.mark.parametrize("traits", [ROVER, PLANE])
def test_an_old_position_at_the_launch_point_is_no_return(traits: Traits) -> None:
    task = under_way(RETURN_TO_LAUNCH, traits)
    home = replace(
        FLYING, position_enu_m=(1.0, 1.0, 2.0), mode=VehicleMode.RETURN, position_age_s=3.0
    )
    assert all(isinstance(task.step(home, 2.0 + second), Wait) for second in range(60))
    home = replace(home, position_age_s=0.1)
    answers = [task.step(home, 70.0 + second) for second in range(20)]
    assert isinstance(answers[-1], Outcome)
    assert answers[-1].code is OutcomeCode.SUCCESS


@pytest.mark.parametrize("age_s", [0.1, 9.0])
def test_an_old_speed_is_not_that_of_a_fall(age_s: float) -> None:
    task = under_way(LAND)
    fast = replace(FLYING, velocity_enu_m_s=(4.5, 0.0, 0.0), position_age_s=age_s)
    task.step(fast, 2.0)
    down = replace(fast, armed=False, airborne=False)
    answer = task.step(down, 2.1) if age_s < 1.0 else sure(task, down, 2.1)
    assert isinstance(answer, Outcome)
    assert answer.code is (OutcomeCode.DISARMED if age_s < 1.0 else OutcomeCode.SUCCESS)


def test_a_vehicle_that_has_come_down_is_located_before_a_return_is_judged() -> None:
    task = under_way(RETURN_TO_LAUNCH)
    down = replace(
        FLYING, position_enu_m=(30.0, 41.0, 2.0), position_age_s=9.0, armed=False, airborne=False
    )
    assert isinstance(task.step(down, 30.0), Wait)
    answer = task.step(replace(down, position_enu_m=(0.5, 0.5, 2.0), position_age_s=0.1), 33.0)
    assert isinstance(answer, Outcome)
    assert answer.code is OutcomeCode.SUCCESS


@pytest.mark.parametrize(
    ("east_m", "code"), [(1.0, OutcomeCode.SUCCESS), (8.0, OutcomeCode.DISARMED)]
)
def test_a_rover_that_disarms_in_its_return_ends_it(east_m: float, code: OutcomeCode) -> None:
    """A PX4 does so at the end; nearer than RTL_MIN_DIST it does not even move."""
    task = under_way(RETURN_TO_LAUNCH, ROVER)
    there = replace(FLYING, position_enu_m=(east_m, 0.0, 2.0), armed=False, airborne=False)
    answer = task.step(replace(there, mode=VehicleMode.HOLD), 2.0)
    assert isinstance(answer, Outcome)
    assert answer.code is code
    assert answer.final_error_m == pytest.approx(east_m)


def test_a_plane_returns_when_it_circles_the_launch_point() -> None:
    task = under_way(RETURN_TO_LAUNCH, PLANE)
    circling = replace(
        FLYING,
        position_enu_m=(80.0, 0.0, 90.0),
        velocity_enu_m_s=(0.0, 20.0, 0.0),
        mode=VehicleMode.RETURN,
    )
    assert isinstance(task.step(circling, 2.0), Wait)
    assert isinstance(task.step(circling, 9.0), Wait)  # it may only be passing
    answer = task.step(circling, 15.0)
    assert isinstance(answer, Outcome)
    assert answer.code is OutcomeCode.SUCCESS
    assert "circles" in answer.message


def circled(east_m: float, radius_m: float, rad_s: float, until_s: int) -> tuple[Outcome, int]:
    """How a plane's return ends, and when, that circles east of the launch point."""
    task = under_way(RETURN_TO_LAUNCH, PLANE)
    for second in range(2, until_s):
        turn = rad_s * second
        place = (east_m + radius_m * math.cos(turn), radius_m * math.sin(turn), 90.0)
        answer = task.step(
            replace(FLYING, position_enu_m=place, mode=VehicleMode.RETURN), float(second)
        )
        if isinstance(answer, Outcome):
            break
    assert isinstance(answer, Outcome)
    return answer, second


def test_a_plane_that_goes_round_the_launch_point_further_off_has_returned_too() -> None:
    answer, second = circled(east_m=0.0, radius_m=200.0, rad_s=0.1, until_s=200)  # 20 m/s
    assert answer.code is OutcomeCode.SUCCESS
    assert second > 2 + math.pi / 0.1, "half a round, at least"


def test_a_plane_that_circles_elsewhere_has_not_returned() -> None:
    answer, _ = circled(east_m=600.0, radius_m=80.0, rad_s=0.2, until_s=600)
    assert answer.code is OutcomeCode.TIMEOUT
    assert answer.final_error_m is not None


def test_only_a_planes_return_may_become_its_mission() -> None:
    assert under_way(RETURN_TO_LAUNCH, PLANE).accepts_mode(VehicleMode.MISSION)
    assert not under_way(RETURN_TO_LAUNCH, COPTER).accepts_mode(VehicleMode.MISSION)
    assert not under_way(LAND, PLANE).accepts_mode(VehicleMode.MISSION)
    assert under_way(RETURN_TO_LAUNCH, COPTER).accepts_mode(VehicleMode.LAND)


def test_a_vehicle_that_is_stuck_ends_it() -> None:
    task = under_way(LAND)
    for second in range(2, 70):
        answer = task.step(FLYING, float(second))
        if isinstance(answer, Outcome):
            break
    assert isinstance(answer, Outcome)
    assert answer.code is OutcomeCode.TIMEOUT
    assert second > 50


def test_a_cancel_asks_for_hold_and_ends_at_a_standstill() -> None:
    task = under_way(LAND)
    task.cancel(2.0)
    assert task.step(FLYING, 2.0) == Perform(TaskOperation.HOLD)
    held = report(TaskOperation.HOLD, OperationStatus.ACHIEVED)
    for step in range(7):
        height_m = 10.0 - 0.3 * step
        moving = replace(held, time_s=2.0 + 0.2 * step, position_enu_m=(0.0, 0.0, height_m))
        assert isinstance(task.step(moving, 2.0 + 0.2 * step), Wait)
    assert isinstance(task.step(replace(moving, time_s=4.0), 4.0), Wait)
    answer = task.step(replace(moving, time_s=5.1), 5.1)
    assert isinstance(answer, Outcome)
    assert answer.code is OutcomeCode.CANCELED
    assert "has stopped" in answer.message


def test_a_cancel_says_when_the_vehicle_does_not_stop() -> None:
    task = under_way(LAND, config=GotoConfig(cancel_timeout_s=5.0))
    task.cancel(2.0)
    task.step(FLYING, 2.0)
    held = report(TaskOperation.HOLD, OperationStatus.ACHIEVED)
    for step in range(13):
        place = (0.0, 1.5 * step, 10.0)
        answer = task.step(
            replace(held, time_s=2.0 + 0.5 * step, position_enu_m=place), 2.0 + 0.5 * step
        )
    assert isinstance(answer, Outcome)
    assert answer.code is OutcomeCode.CANCELED
    assert "3.00 m/s" in answer.message


def test_it_cannot_be_paused_and_says_so() -> None:
    rejection = under_way(LAND).pause(2.0)
    assert rejection is not None
    assert "landing cannot be paused" in rejection.message
