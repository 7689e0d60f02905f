"""Judgement of this computer: its limits, its sentences, its row, and trials that fail."""

from __future__ import annotations

import json
import sys
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import pytest

from drone_navigation.check import this_computer as judged
from drone_navigation.check.this_computer import (
    ROW_HEAD,
    Computer,
    Speed,
    computer_section,
    judge,
    table_row,
)
from drone_navigation.check.trial_flight import TrialFailedError, tried_section, try_computer
from flight_rehearsal.trial import Trial
from mavlink_vehicle.io.this_computer import Heat
from tests.support.processes import patient_s

TRIAL = Trial(
    seconds=10.0,
    vehicles=1,
    setpoint_rate_hz=20.0,
    setpoints=200,
    late_p50_ms=0.4,
    late_p99_ms=3.0,
    late_worst_ms=9.0,
    plans=4,
    plan_p50_ms=40.0,
    plan_worst_ms=90.0,
    simulator_late_s=0.02,
    processor_share=0.2,
    others_cores=0.1,
    memory_bytes=130_000_000,
    ended="",
)
GOOD = Computer(
    model="Raspberry Pi 5 Model B Rev 1.0",
    architecture="aarch64",
    python="3.12.3",
    cores=4,
    memory_bytes=8_000_000_000,
    available_bytes=6_500_000_000,
    heat=Heat(55.0, "cpu-thermal", 85.0, False),
    trial=TRIAL,
)


def with_trial(**changes: Any) -> Computer:
    return replace(GOOD, trial=replace(TRIAL, **changes))


def test_a_fast_computer_is_fast_enough() -> None:
    assert judge(GOOD) == (Speed.YES, ())
    unknown = replace(GOOD, memory_bytes=None, available_bytes=None, heat=Heat(), model="")
    assert judge(unknown) == (Speed.YES, ())


@pytest.mark.parametrize(
    ("computer", "speed", "reason"),
    [
        (with_trial(late_p99_ms=25.0, late_worst_ms=50.0), Speed.YES, ""),
        (with_trial(late_p99_ms=26.0), Speed.MARGINAL, "99 of 100 setpoints are within 26 ms (up"),
        (with_trial(late_p99_ms=51.0), Speed.NO, "51 ms (up to 25 ms is enough, more than 50 ms"),
        (with_trial(late_worst_ms=51.0), Speed.MARGINAL, "the worst setpoint is 51 ms late"),
        (with_trial(late_worst_ms=251.0), Speed.NO, "the worst setpoint is 251 ms late"),
        (with_trial(late_worst_ms=51.0, setpoint_rate_hz=10.0), Speed.YES, ""),
        (with_trial(late_p99_ms=26.0, setpoint_rate_hz=40.0), Speed.NO, "more than 25 ms too much"),
        (with_trial(plan_worst_ms=301.0), Speed.MARGINAL, "the longest plan takes 301 ms"),
        (with_trial(plan_worst_ms=601.0), Speed.NO, "the longest plan takes 601 ms"),
        (with_trial(simulator_late_s=0.3), Speed.NO, "simulated time was 0.3 s behind"),
        (with_trial(ended="SERVER_LATE"), Speed.NO, "the goal ended early with SERVER_LATE"),
        (replace(GOOD, available_bytes=500_000_000), Speed.MARGINAL, "only 500 MB of memory"),
        (replace(GOOD, available_bytes=200_000_000), Speed.NO, "only 200 MB of memory"),
        (replace(GOOD, cores=1), Speed.MARGINAL, "it has one core"),
        (replace(GOOD, heat=Heat(70.0, "cpu", 85.0, True)), Speed.MARGINAL, "slowed down"),
        (replace(GOOD, heat=Heat(76.0, "cpu", 85.0, False)), Speed.MARGINAL, "76 °C already"),
    ],
)
def test_each_limit_has_its_reason(computer: Computer, speed: Speed, reason: str) -> None:
    found, reasons = judge(computer)
    assert found is speed
    assert len(reasons) == bool(reason)
    assert reason in "".join(reasons)


def test_other_programs_are_named_beside_a_bad_result_only() -> None:
    assert judge(with_trial(others_cores=1.5)) == (Speed.YES, ())
    _, reasons = judge(with_trial(others_cores=1.5, late_worst_ms=99.0))
    assert reasons[-1] == "other programs took 150 % of a core meanwhile: end them and try again"


def test_the_worst_reason_comes_first() -> None:
    _, reasons = judge(replace(with_trial(ended="NO_PATH"), cores=1))
    assert "NO_PATH" in reasons[0]
    (verdict, *_) = computer_section(replace(with_trial(ended="NO_PATH"), cores=1)).lines
    assert verdict.value == "no"
    assert verdict.warning == ("The goal ended early with NO_PATH; it has one core (2 are enough).")


def test_the_section_has_all_that_was_measured_and_the_limits() -> None:
    section = computer_section(GOOD)
    assert section.title == "This computer"
    lines = {line.name: line.value for line in section.lines}
    assert lines["fast enough"] == "yes"
    assert lines["setpoints late"] == "0.4 ms (p50), 3.0 ms (p99), 9.0 ms (worst), at 20 Hz"
    assert lines["time of a plan"] == "40 ms (p50), 90 ms (worst), 4 in all"
    assert lines["temperature"] == "55 °C of 85 °C (cpu-thermal), not slowed down"
    assert "6.5 GB of 8.0 GB" in lines["memory"]
    assert "aarch64, 4 cores, Python 3.12.3" in lines["computer"]
    for limit in ("25 ms (p99)", "50 ms (worst)", "plan 300 ms", "512 MB", "2 cores"):
        assert limit in lines["limits"]
    assert all(line.warning is None for line in section.lines)


def test_a_limit_of_no_is_beyond_that_of_marginal() -> None:
    assert judged.LATE_P99_PERIODS < judged.TOO_LATE_P99_PERIODS
    assert judged.LATE_WORST_PERIODS / 20.0 < judged.TOO_LATE_WORST_S
    assert judged.PLAN_S < judged.PLAN_TOO_LONG_S
    assert judged.MEMORY_TOO_LITTLE_BYTES < judged.MEMORY_BYTES


def test_a_row_fits_the_head() -> None:
    for computer in (GOOD, replace(GOOD, model="a | b", memory_bytes=None, heat=Heat())):
        assert table_row(computer).count("|") == ROW_HEAD.count("|")
    assert "| yes |" in table_row(GOOD)
    assert "Raspberry Pi 5" in table_row(GOOD)


# --- the process --------------------------------------------------------------------------


def program(text: str) -> list[str]:
    return [sys.executable, "-c", text]


def test_progress_and_result_come_from_the_process() -> None:
    said: list[str] = []
    answers = [{"left_s": 9.6}, {"trial": asdict(TRIAL)}]
    text = "import sys; print(sys.stdin.readline()[:0], end='')\n"
    text += "".join(f"print({json.dumps(json.dumps(answer))})\n" for answer in answers)
    found = try_computer([{"setpoint_rate_hz": 20.0}], said.append, 10.0, program(text))
    assert found.trial == TRIAL
    assert found.cores >= 1
    assert said[-1] == "  10 s left, trying this computer"


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("raise SystemExit('No module named mavlink_sitl.')", "No module named mavlink_sitl"),
        ("import no_such_module", "ModuleNotFoundError: No module named 'no_such_module'"),
        ('print(\'{"error": "the goal was rejected"}\', flush=True)', "the goal was rejected"),
        ("pass", "the simulator has ended unexpectedly"),
    ],
)
def test_a_trial_that_fails_is_one_sentence_in_its_section(text: str, reason: str) -> None:
    with pytest.raises(TrialFailedError) as raised:
        try_computer([{}], lambda _: None, 1.0, program(text), patient_s(20.0))
    assert str(raised.value) == reason


def test_a_process_that_hangs_is_ended() -> None:
    text = "import threading; threading.Event().wait()"
    with pytest.raises(TrialFailedError, match="does not answer"):
        try_computer([{}], lambda _: None, 0.0, program(text), 0.5)


def test_a_program_that_is_missing_is_one_sentence(tmp_path: Path) -> None:
    with pytest.raises(TrialFailedError, match="it cannot be started: No such file"):
        try_computer([{}], lambda _: None, 0.0, [str(tmp_path / "none")], 0.5)


def test_a_failure_is_a_warning_of_the_section(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object) -> Computer:
        raise TrialFailedError("the goal was rejected")

    monkeypatch.setattr("drone_navigation.check.trial_flight.try_computer", fail)
    (line,) = tried_section([{}], lambda _: None).lines
    assert line.value == "unknown"
    assert line.warning == "Not tried: the goal was rejected. --no-computer leaves it out."
