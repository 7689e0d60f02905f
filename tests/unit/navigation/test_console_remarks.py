"""The console's sentences about a goal do not outlive their cause."""

from __future__ import annotations

from drone_navigation.console.remarks import Remarks

WALL = "An obstacle would come within 1 m before the vehicle could stop."
STATION = "Ground station 255/190 paused the vehicle."
WARNING = "Obstacles are not avoided."


def test_the_reason_of_a_status_goes_with_it() -> None:
    remarks = Remarks()
    remarks.hear("NAVIGATING", "")
    remarks.hear("BLOCKED", WALL)
    assert remarks.sentences() == [WALL]
    remarks.hear("NAVIGATING", "")
    assert remarks.sentences() == []


def test_what_led_to_a_status_stays_until_that_ends() -> None:
    remarks = Remarks()
    remarks.hear("NAVIGATING", "")
    remarks.hear("NAVIGATING", STATION)
    remarks.hear("PAUSED", "")
    assert remarks.sentences() == [STATION]
    remarks.hear("NAVIGATING", "")
    assert remarks.sentences() == []


def test_a_note_stays_and_is_said_once() -> None:
    remarks = Remarks()
    remarks.hear("PREPARING", WARNING)
    remarks.notes = (WARNING,)
    for status in ("PREPARING", "ARMING", "NAVIGATING", "BLOCKED", "NAVIGATING"):
        remarks.hear(status, WALL if status == "BLOCKED" else "")
    assert remarks.sentences() == [WARNING]
