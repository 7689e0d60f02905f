"""The autopilot's text that explains the end of a goal is selected."""

from __future__ import annotations

import pytest

from mavlink_vehicle.codec import mavlink
from mavlink_vehicle.events import OperationFinished, OperationKind, OperationResult
from mavlink_vehicle.state.status_text import StatusText
from navigation_bridge.reporting import RECENT_S, answers_in, worst_text
from navigation_core.outcomes import OutcomeCode

CRASH = StatusText(99.8, mavlink.MAV_SEVERITY_CRITICAL, "Crash: hit scaffold at 0.9 m/s")
# Observed on ArduCopter 4.7 with this severity.
NOISE = StatusText(99.9, mavlink.MAV_SEVERITY_INFO, "No ap_message for mavlink id (136)")
WARNING = StatusText(99.95, mavlink.MAV_SEVERITY_WARNING, "Battery 1 is low 10.60V used 163 mAh")
REFUSAL = StatusText(99.0, mavlink.MAV_SEVERITY_CRITICAL, "Arm: Gyros not healthy")


def quoted(
    *texts: StatusText, code: OutcomeCode = OutcomeCode.DISARMED, since_s: float = 0.0,
    heard_s: float = 100.0,
) -> str:  # fmt: skip
    return worst_text(texts, code, since_s, heard_s)


def test_the_worst_comes_before_the_latest() -> None:
    assert quoted(CRASH, NOISE, WARNING) == CRASH.text
    assert quoted(NOISE, WARNING) == WARNING.text


def test_of_equally_bad_ones_the_latest_counts() -> None:
    earlier = StatusText(95.0, CRASH.severity, "EKF variance")
    assert quoted(earlier, CRASH) == CRASH.text


def test_an_answer_to_a_request_for_messages_is_not_quoted_even_if_it_stands_alone() -> None:
    assert quoted(NOISE) == ""


@pytest.mark.parametrize("code", [OutcomeCode.SUCCESS, OutcomeCode.CANCELED, OutcomeCode.PREEMPTED])
def test_a_requested_end_quotes_nothing(code: OutcomeCode) -> None:
    assert quoted(CRASH, code=code) == ""


def test_old_texts_and_those_before_the_goal_are_not_quoted() -> None:
    assert quoted(CRASH, heard_s=CRASH.time_s + RECENT_S + 0.1) == ""
    assert quoted(CRASH, since_s=CRASH.time_s + 0.1) == ""


def test_a_rejection_is_not_quoted_for_another_end() -> None:
    event = OperationFinished(
        1, OperationKind.ARM, OperationResult.REFUSED, f'Rejected; autopilot: "{REFUSAL.text}"'
    )  # fmt: skip
    answers = answers_in(event, [REFUSAL, CRASH])
    assert answers == {REFUSAL}
    code = OutcomeCode.LINK_LOST
    assert worst_text([REFUSAL, WARNING], code, 0.0, 100.0, answers) == WARNING.text


def test_a_crash_during_a_take_off_is_no_answer() -> None:
    event = OperationFinished(
        1, OperationKind.TAKE_OFF, OperationResult.REFUSED, f'Ended; autopilot: "{CRASH.text}"'
    )  # fmt: skip
    assert answers_in(event, [CRASH]) == frozenset()
