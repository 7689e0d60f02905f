"""A recording of one link of several: what was sent on the others is not in it."""

from __future__ import annotations

from dataclasses import replace

import pytest
from pymavlink.dialects.v20 import all as mav

from comparison import other_links
from comparison.recording import Recording, read
from comparison.start import start_of
from sitl_support.recorded_flights import DATA, PATHS


def without(recording: Recording, *commands: int) -> Recording:
    sent = [(t, m) for t, m in recording.sent if getattr(m, "command", 0) not in commands]
    return replace(recording, sent=sent)


@pytest.mark.parametrize("name", PATHS)
def test_whole_recordings_are_commanded_from_within(name: str) -> None:
    for recording in read(PATHS[name]):
        assert not other_links.commanded_elsewhere(recording)
        assert other_links.NOTE not in start_of(recording).notes


@pytest.mark.parametrize("name", ["copter_guided", "px4_mission_clear", "rover_auto"])
def test_an_answer_to_a_command_that_nobody_sent_is_noticed_and_said(name: str) -> None:
    (recording,) = read(DATA / f"{name}.tlog")
    silent = without(recording, mav.MAV_CMD_COMPONENT_ARM_DISARM)
    assert other_links.commanded_elsewhere(silent)
    assert other_links.NOTE in start_of(silent).notes


def test_arming_that_nobody_asked_for_is_noticed_where_no_answers_are_heard() -> None:
    (recording,) = read(DATA / "px4_mission_clear.tlog")
    quiet = [(t, m) for t, m in recording.real if m.get_type() != "COMMAND_ACK"]
    beats = [(t, m) for t, m in recording.sent if m.get_type() == "HEARTBEAT"]
    assert other_links.commanded_elsewhere(replace(recording, sent=beats, real=quiet))
