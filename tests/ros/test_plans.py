"""Plans of steps over DDS: rehearsed as a whole, interrupted, continued after a restart."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from action_msgs.msg import GoalStatus
from rclpy.action import ActionClient

from custom_interfaces.action import ExecutePlan
from custom_interfaces.msg import GoalCode
from tests.support.processes import Process
from tests.support.ros.ros_flight import READY_TIMEOUT_S, Flight, GoalRecord

pytestmark = [pytest.mark.wide, pytest.mark.xdist_group("ros_plans")]

SQUARE = """
name: square
on_failure: land
steps:
- takeoff: {height: 3}
- goto: {position: [4, 0, 3], speed: 3}
- wait: {seconds: 1}
- orbit: {centre: [4, 4], radius: 3, laps: 0.5}
- survey: {area: [[0, 0], [8, 0], [8, 6], [0, 6]], height: 4, spacing: 4, speed: 4}
- land: {}
"""


class Plans:
    """A flight, and navigation_plans beside its server."""

    def __init__(self, flight: Flight, folder: Path) -> None:
        """Start it."""
        self.flight, self._folder = flight, folder
        self.process = self.start()
        self._client = ActionClient(flight.node, ExecutePlan, "execute_plan")
        assert self._client.wait_for_server(timeout_sec=READY_TIMEOUT_S)

    def start(self) -> Process:
        """Start the process."""
        command = ["python", "-m", "mavbridge_trees.navigation_plans", "--progress"]
        process = Process(
            "navigation_plans", [*command, str(self._folder)], self.flight.environment
        )
        process.wait_for("Ready for plans", READY_TIMEOUT_S)
        return process

    def restart(self) -> None:
        """Kill it, and start it again."""
        self.process.signal(signal.SIGKILL)
        self.process.wait(10.0)
        self.process = self.start()
        self._client.destroy()
        # DDS takes a killed process for alive until its lease ends.
        self.flight.renew_client()
        self._client = ActionClient(self.flight.node, ExecutePlan, "execute_plan")
        assert self._client.wait_for_server(timeout_sec=READY_TIMEOUT_S)

    def send(self, plan: str, resume: bool = False) -> GoalRecord:
        """Send a plan, which is always accepted."""
        record = GoalRecord()
        future = self._client.send_goal_async(
            ExecutePlan.Goal(plan=plan, resume=resume),
            feedback_callback=lambda message: record.feedback.append(message.feedback),
        )
        self.flight.wait(future.done, 20.0, "an answer")
        record.handle = future.result()
        assert record.handle is not None
        assert record.handle.accepted

        def end(done: Any) -> None:
            record.status, record.result = done.result().status, done.result().result

        record.handle.get_result_async().add_done_callback(end)
        return record

    def result(self, record: GoalRecord, timeout_s: float = 120.0) -> Any:
        """Wait for its end."""
        self.flight.wait(lambda: record.result is not None, timeout_s, "the end of the plan")
        return record.result

    def wait_for_step(self, record: GoalRecord, step: int) -> None:
        """Wait until a step has begun."""
        self.flight.wait(
            lambda: record.result is not None
            or any(f.step >= step and f.current_status == "NAVIGATING" for f in record.feedback),
            90.0, f"step {step}",
        )  # fmt: skip
        assert record.result is None, record.result

    def close(self) -> None:
        """End it."""
        self.process.stop()


@pytest.fixture(scope="module")
def plans(flight: Flight, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Plans]:
    plans = Plans(flight, tmp_path_factory.mktemp("plans"))
    yield plans
    plans.close()


def test_a_plan_is_rehearsed_and_flown_step_by_step(plans: Plans) -> None:
    record = plans.send(SQUARE)
    result = plans.result(record, 240.0)
    assert (result.success, result.steps_done, result.failed_step) == (True, 6, 0), result.message
    assert record.status == GoalStatus.STATUS_SUCCEEDED
    assert record.statuses[0] == ExecutePlan.Feedback.PHASE_REHEARSING
    kinds = list(dict.fromkeys(f.kind for f in record.feedback if f.step))
    assert kinds == ["takeoff", "goto", "wait", "orbit", "survey", "land"]
    assert not plans.flight.is_armed


@pytest.mark.parametrize(
    ("plan", "code", "step"),
    [
        ("steps: [{fly: {}}]", GoalCode.INVALID_PLAN, 0),
        ("steps: [{land: {}}]", GoalCode.NOT_FLYING, 1),
        ("steps: [{takeoff: {height: 3}}, {goto: {position: [0, 0, -9]}}]",
         GoalCode.BELOW_GROUND, 2),
    ],
)  # fmt: skip
def test_a_plan_that_would_not_succeed_moves_nothing(
    plans: Plans, plan: str, code: int, step: int
) -> None:
    plans.flight.ground()
    result = plans.result(plans.send(plan))
    assert (result.error_code, result.failed_step, result.steps_done) == (code, step, 0)
    assert not plans.flight.is_armed


def test_a_cancelled_plan_holds_and_is_continued_after_a_restart(plans: Plans) -> None:
    plans.flight.ground()
    plan = SQUARE.replace("name: square", "name: continued")
    record = plans.send(plan)
    plans.wait_for_step(record, 2)
    plans.flight.wait(record.handle.cancel_goal_async().done, 20.0, "an answer")
    result = plans.result(record)
    assert (record.status, result.steps_done) == (GoalStatus.STATUS_CANCELED, 1), result.message
    assert plans.flight.is_armed
    plans.restart()
    assert plans.result(plans.send(SQUARE, resume=True)).error_code == GoalCode.INVALID_PLAN
    again = plans.send(plan, resume=True)
    result = plans.result(again, 240.0)
    assert (result.success, result.steps_done) == (True, 6), result.message
    assert next(f.kind for f in again.feedback if f.step) == "goto"


def test_a_pilot_ends_a_plan_and_nothing_more_is_sent(plans: Plans) -> None:
    plans.flight.ground()
    record = plans.send(SQUARE)
    plans.wait_for_step(record, 2)
    plans.flight.relay.set_mode(9)  # LAND
    result = plans.result(record)
    assert result.error_code == GoalCode.PILOT_OVERRIDE, result.message
    assert result.failed_step == 2
    plans.flight.wait(lambda: not plans.flight.is_armed, 60.0, "the pilot's landing")


LEGS = """
return_below: 0.5
on_resume: next
steps:
- takeoff: {height: 4}
- wait: {seconds: 60}
- goto: {position: [3, 0, 4]}
- land: {}
"""


@pytest.mark.night  # by day the tree of test_trees.py changes its battery
def test_below_its_charge_a_plan_returns_and_is_continued_with_another_battery(
    tmp_path: Path,
) -> None:
    """A PX4's simulator empties the battery in the air, and fills it on the ground."""
    parameters = {"SIM_BAT_DRAIN": 40, "SIM_BAT_MIN_PCT": 35, "RTL_RETURN_ALT": 5,
                  "COM_LOW_BAT_ACT": 0}  # fmt: skip
    options = [text for k, v in parameters.items() for text in ("--param", f"{k}={v}")]
    flight = Flight(
        tmp_path, "--ros-args", "-p", "battery_policy:=warn", "--",
        simulator=("--autopilot", "px4", *options),
    )  # fmt: skip
    plans = Plans(flight, tmp_path)
    try:
        result = plans.result(plans.send(LEGS))
        assert (result.error_code, result.steps_done) == (GoalCode.LOW_BATTERY, 1), result.message
        assert not flight.is_armed
        flight.spin_for(8.0)
        again = plans.send(LEGS, resume=True)
        result = plans.result(again)
        assert (result.success, result.steps_done) == (True, 4), result.message
        assert [f.kind for f in again.feedback if f.step][-1] == "land"
    finally:
        plans.close()
        flight.close()


def test_a_plan_ends_when_its_server_is_killed(plans: Plans) -> None:
    plans.flight.ground()
    record = plans.send(SQUARE)
    plans.wait_for_step(record, 2)
    assert plans.flight.server is not None
    plans.flight.server.signal(signal.SIGKILL)
    result = plans.result(record)
    assert result.error_code == GoalCode.NO_VEHICLE, result.message
    assert "silent" in result.message
