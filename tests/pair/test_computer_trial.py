"""The trial of this computer flies round obstacles, in real time."""

from __future__ import annotations

import json
import subprocess
import sys

import pytest

from flight_rehearsal.computer_trial import COSTLY, TrialError, fly
from navigation_bridge.configuration.parameter_table import SPECS
from tests.support.processes import HANGS_AFTER_S

pytestmark = pytest.mark.wide

COMMAND = [sys.executable, "-m", "flight_rehearsal.computer_trial"]


@pytest.mark.parametrize("rate_hz", [20.0, 50.0])
def test_setpoints_and_plans_are_measured_at_the_rates_that_are_configured(rate_hz: float) -> None:
    trial = fly([{"setpoint_rate_hz": rate_hz, "volume_radius_m": 10.0}], 3.0)
    assert trial.setpoint_rate_hz == pytest.approx(rate_hz)
    # A starved machine sends fewer; the path is planned before the first.
    assert 1 <= trial.setpoints <= 3.0 * rate_hz + 5
    assert trial.plans >= 1
    assert 0.0 < trial.plan_p50_ms <= trial.plan_worst_ms
    assert 0.0 <= trial.late_p50_ms <= trial.late_p99_ms <= trial.late_worst_ms
    assert trial.processor_share > 0.0
    assert trial.memory_bytes > 10_000_000
    assert trial.ended in {"", "SERVER_LATE"}


def test_several_vehicles_fly_at_once() -> None:
    trial = fly([{}, {}, {}], 2.0)
    assert trial.vehicles == 3
    assert trial.plans >= 3


def test_a_setting_that_cannot_be_used_is_one_sentence() -> None:
    with pytest.raises(TrialError, match="setpoint_rate_hz"):
        fly([{"setpoint_rate_hz": -1.0}], 1.0)


def test_the_costly_parameters_exist() -> None:
    assert set(COSTLY) <= set(SPECS)


def test_the_program_reports_and_ends() -> None:
    order = json.dumps({"vehicles": [{}], "seconds": 1.0}) + "\n"
    with subprocess.Popen(COMMAND, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        process.stdin.write(order.encode())
        process.stdin.flush()
        lines = [json.loads(line) for line in process.stdout]
        assert process.wait(HANGS_AFTER_S) == 0
    assert "left_s" in lines[0]
    assert lines[-1]["trial"]["vehicles"] == 1


def test_the_program_ends_with_the_one_that_started_it() -> None:
    with subprocess.Popen(COMMAND, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        process.stdin.write(b'{"vehicles": [{}], "seconds": 3000}\n')
        process.stdin.flush()
        assert "left_s" in json.loads(process.stdout.readline())
        process.stdin.close()
        assert process.wait(HANGS_AFTER_S) == 1
