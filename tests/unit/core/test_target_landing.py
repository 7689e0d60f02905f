"""The state machine of a landing on a target, by observations made up here."""

from __future__ import annotations

from dataclasses import replace

import pytest

from navigation_core.outcomes import OutcomeCode
from navigation_core.tasks.flying.target_landing import OFF_MAX_M, TargetLanding, TargetLandingGoal
from navigation_core.tasks.goto_config import GotoConfig
from navigation_core.tasks.inputs.tracked_target import TrackedTarget
from navigation_core.tasks.intents import Intent, Outcome, Perform
from navigation_core.tasks.leading.flight_terms import FlightTerms
from navigation_core.tasks.observation import (
    Observation,
    OperationReport,
    OperationStatus,
    TaskOperation,
    VehicleMode,
)

PERIOD_S = 0.1


class Descent:
    """A vehicle at 8 m that does at once what is asked for."""

    def __init__(self, required: bool = True, retries: int = 0) -> None:
        self.observation = Observation(
            time_s=0.0,
            position_enu_m=(0.0, 0.0, 8.0),
            velocity_enu_m_s=(0.0, 0.0, 0.0),
            yaw_enu_rad=0.0,
            armed=True,
            in_control=False,
            airborne=True,
            ground_enu_m=0.0,
            position_age_s=0.0,
            connected=True,
            operation=None,
            mode=VehicleMode.HOLD,
        )
        self.task = TargetLanding(TargetLandingGoal(required, retries), FlightTerms(GotoConfig()))
        self.task.start(self.observation, 0.0)
        self.asked: list[TaskOperation] = []

    @property
    def now(self) -> float:
        return self.observation.time_s

    def see(self, place: tuple[float, float, float] = (1.0, 1.0, 0.0)) -> None:
        self.put(followed=TrackedTarget(self.now, place))

    def put(self, **facts: object) -> None:
        self.observation = replace(self.observation, **facts)  # type: ignore[arg-type]

    def step(self) -> Intent | Outcome:
        self.put(time_s=self.now + PERIOD_S)
        answer = self.task.step(self.observation, self.now)
        if isinstance(answer, Perform) and (not self.asked or self.asked[-1] is not answer.kind):
            self.asked.append(answer.kind)
            report = OperationReport(answer.kind, OperationStatus.ACHIEVED, "")
            self.put(operation=report)
        return answer

    def run(self, seconds: float, seen: bool = False) -> Intent | Outcome:
        answer: Intent | Outcome = self.step()
        for _ in range(round(seconds / PERIOD_S)):
            if isinstance(answer, Outcome):
                break
            if seen:
                self.see()
            answer = self.step()
        return answer

    def touch_down(self, place: tuple[float, float, float]) -> Outcome:
        self.put(position_enu_m=place, armed=False, airborne=False)
        answer = self.run(3.0)
        assert isinstance(answer, Outcome)
        return answer


def test_it_holds_until_the_target_is_seen_and_then_lands_on_it() -> None:
    descent = Descent()
    descent.run(5.0)
    assert descent.asked == [TaskOperation.HOLD]
    descent.run(2.0, seen=True)
    assert descent.asked == [TaskOperation.HOLD, TaskOperation.LAND_ON_TARGET]
    outcome = descent.touch_down((1.0, 1.2, 0.0))
    assert outcome.code is OutcomeCode.SUCCESS
    assert outcome.final_error_m == pytest.approx(0.2)


def test_beside_a_required_target_is_no_success() -> None:
    descent = Descent()
    descent.run(2.0, seen=True)
    outcome = descent.touch_down((1.0, 1.0 + OFF_MAX_M + 0.1, 0.0))
    assert outcome.code is OutcomeCode.NO_LANDING_TARGET
    assert "1.10 m beside the target" in outcome.message


@pytest.mark.parametrize("required", [True, False])
def test_a_target_that_is_never_seen(required: bool) -> None:
    descent = Descent(required)
    answer = descent.run(12.0)
    if required:
        assert isinstance(answer, Outcome)
        assert answer.code is OutcomeCode.NO_LANDING_TARGET
        assert descent.asked == [TaskOperation.HOLD]
    else:
        assert descent.asked == [TaskOperation.HOLD, TaskOperation.LAND]


def test_a_lost_target_is_not_waited_for_near_the_ground() -> None:
    descent = Descent()
    descent.run(2.0, seen=True)
    descent.put(position_enu_m=(1.0, 1.0, 0.8))
    descent.run(5.0)
    assert descent.asked[-1] is TaskOperation.LAND_ON_TARGET


@pytest.mark.parametrize(
    ("up_m", "target_up_m", "lands"),
    [
        (-6.0, 0.0, False),  # far below the target: its height was wrong
        (-23.5, 0.0, True),
        (0.3, -6.0, False),  # the target is lower than where the vehicle stood before
        (10.4, 10.0, True),  # on a roof
    ],
)
def test_a_lost_target_is_waited_for_by_its_height_or_the_ground(
    up_m: float, target_up_m: float, lands: bool
) -> None:
    descent = Descent(retries=1)
    descent.put(ground_enu_m=-24.0)
    descent.see((1.0, 1.0, target_up_m))
    descent.run(0.5)
    descent.put(position_enu_m=(1.0, 1.0, up_m))
    descent.run(5.0)
    assert (descent.asked[-1] is TaskOperation.LAND_ON_TARGET) is lands


def test_a_vehicle_that_stands_does_not_search() -> None:
    descent = Descent(retries=1)
    descent.see((1.0, 1.0, -9.0))
    descent.run(0.5)
    descent.put(position_enu_m=(1.0, 1.0, 0.0), airborne=False)
    descent.run(5.0)
    assert descent.asked[-1] is TaskOperation.LAND_ON_TARGET


def test_a_lost_target_has_it_hold_for_good_without_retries() -> None:
    descent = Descent()
    descent.run(2.0, seen=True)
    answer = descent.run(5.0)
    assert isinstance(answer, Outcome)
    assert answer.code is OutcomeCode.NO_LANDING_TARGET
    assert descent.asked[-1] is TaskOperation.HOLD


def test_with_a_retry_it_takes_control_to_climb() -> None:
    descent = Descent(retries=1)
    descent.run(2.0, seen=True)
    descent.put(position_enu_m=(1.0, 1.0, 3.0))
    descent.run(5.0)
    assert descent.asked[-1] is TaskOperation.TAKE_CONTROL


def test_a_cancel_while_it_waits_ends_in_a_hold() -> None:
    descent = Descent()
    descent.run(1.0)
    descent.task.cancel(descent.now)
    answer = descent.run(1.0)
    assert isinstance(answer, Outcome)
    assert answer.code is OutcomeCode.CANCELED
