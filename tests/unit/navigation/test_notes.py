"""The notes in a recording hold all that a report or a bag needs of a goal."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mavlink_vehicle.codec import Codec, Message, with_source
from mavlink_vehicle.io.tlog import TlogReader
from navigation_bridge import notes
from navigation_bridge.goals.goal import GoalFeedback, GoalFinished, GoalHappened
from navigation_bridge.goals.lifecycle import GoalState
from navigation_bridge.goals.requests import LandRequest
from navigation_bridge.recording.recorded_notes import NotesReader
from navigation_core.outcomes import OutcomeCode
from navigation_core.tasks.progress import (
    FollowProgress,
    FollowState,
    OrbitProgress,
    Progress,
    RouteProgress,
    Status,
)
from tests.support.flights.recorded_flight import EPOCH_S, Recorder
from tests.support.flights.simulated_flight import SimulatedFlight

GOAL = "0123456789abcdef0123456789abcdef"


def written_and_read(messages: list[Message]) -> NotesReader:
    """Notes as they come back from a recording, a tenth of a second apart."""
    writer, codec, reader = Codec(1, notes.COMPONENT_ID), Codec(255, 190), NotesReader()
    for number, message in enumerate(messages):
        data = writer.encode(with_source(message, 1, notes.COMPONENT_ID))
        for read in codec.decode(data):
            reader.take(0.1 * number, read)
    return reader


WORDS = st.text(st.characters(min_codepoint=32, max_codepoint=126), max_size=300).map(str.strip)


@given(WORDS, st.sampled_from(["STATUS", "ENDED", "REJECTED", "ACCEPTED"]))
def test_an_event_of_any_length_is_read_back_as_it_was(message: str, event: str) -> None:
    what = "" if event == "ACCEPTED" else "NO_PATH"
    happened = GoalHappened("" if event == "REJECTED" else GOAL, event, what, message)
    chunks = notes.long_text(notes.event(happened, "land"), 7)
    ((_, noted),) = written_and_read(chunks).events
    assert noted.happened == happened
    assert noted.kind == ("land" if event == "ACCEPTED" else "")


@pytest.mark.parametrize(("reached", "missed"), [(0, ()), (4, ()), (2, (1,)), (0, (0, 12, 345))])
def test_the_waypoints_of_a_route_that_ended_are_read_back(
    reached: int, missed: tuple[int, ...]
) -> None:
    code = OutcomeCode.WAYPOINT_MISSED if missed else OutcomeCode.SUCCESS
    text = "Flew them, missed 7: all."
    end = GoalFinished(
        GOAL,
        GoalState.ABORTED,
        code,
        text,
        None,
        9.5,
        0.25,
        reached,
        missed,
        reached,
        4_000_000_001,
    )
    happened = GoalHappened(GOAL, "ENDED", code.value, text)
    ((_, noted),) = written_and_read(notes.long_text(notes.event(happened, "", end), 7)).events
    assert noted.happened == happened
    assert (noted.elapsed_s, noted.final_error_m) == (9.5, 0.25)
    assert (noted.waypoints_reached, noted.waypoints_missed) == (reached, missed)
    assert (noted.next_index, noted.route_id) == (reached, 4_000_000_001)


@pytest.mark.parametrize("length", [49, 50, 51, 99, 100, 101, 150])
def test_a_text_that_fills_its_last_chunk_is_complete(length: int) -> None:
    reader = written_and_read(notes.long_text("x" * length, 65_535))
    assert [text for _, text in reader.remarks] == ["x" * length]


@pytest.mark.parametrize("length", [12_799, 12_800, 100_000])
def test_a_text_that_no_chunks_can_hold_is_cut_off(length: int) -> None:
    chunks = notes.long_text("x" * length, 7)
    assert [chunk.chunk_seq for chunk in chunks] == list(range(256))
    whole = "".join(chunk.text for chunk in chunks)
    assert whole == ("x" * 12_796 + "..." if length > 12_799 else "x" * 12_799)


def test_a_lost_chunk_costs_that_text_only() -> None:
    first = notes.long_text(f"first {'x' * 100}", 1)
    second = notes.long_text(f"second {'y' * 100}", 2)
    reader = written_and_read([first[0], *first[2:], *second, *[notes.text("z")] * 20])
    texts = [text for _, text in reader.remarks]
    assert f"second {'y' * 100}" in texts
    assert not any(text == f"first {'x' * 100}" for text in texts)


@pytest.mark.parametrize("laps", [0.0, 1.25, 1000.0, 0.001])
def test_the_laps_of_a_circle_that_ended_are_read_back(laps: float) -> None:
    text = "Went round 7 laps: all."
    end = GoalFinished(
        GOAL, GoalState.SUCCEEDED, OutcomeCode.SUCCESS, text, None, 9.5, 0.25, laps_flown=laps
    )
    happened = GoalHappened(GOAL, "ENDED", "SUCCESS", text)
    ((_, noted),) = written_and_read(notes.long_text(notes.event(happened, "", end), 7)).events
    assert noted.happened == happened
    assert noted.laps_flown == laps


def test_a_feedback_has_the_laps_of_a_circle() -> None:
    orbit = OrbitProgress(1.25, -0.5)
    reader = written_and_read(
        notes.progress(Progress(Status.NAVIGATING, 1.5, 2.5, orbit=orbit), 9.0)
    )
    assert reader.figures == {"laps": 1.25, "radius_err": -0.5}
    assert reader.counts == {"replans": 0}


@pytest.mark.parametrize("state", FollowState)
def test_a_feedback_has_the_target_that_is_followed(state: FollowState) -> None:
    follow = FollowProgress(state, 4.5, 0.25)
    reader = written_and_read(notes.progress(Progress(Status.NAVIGATING, 0, 0, follow=follow), 9.0))
    assert notes.follow_progress(reader.counts, reader.figures) == follow
    del reader.counts["following"]
    assert notes.follow_progress(reader.counts, reader.figures) is None


def test_a_feedback_has_the_waypoint_and_the_lap() -> None:
    route = RouteProgress(current=2, lap=1, remaining=4, reached=5)
    reader = written_and_read(notes.progress(Progress(Status.NAVIGATING, 1.5, 2.5, route, 3), 9.0))
    assert reader.counts == {"waypoint": 2, "lap": 1, "left": 4, "reached": 5, "replans": 3}
    assert (reader.distance_m[0][1], reader.time_left_s[0][1]) == (1.5, 2.5)
    assert reader.feedbacks == 1


def test_notes_of_older_versions_are_still_read() -> None:
    reader = written_and_read(
        [
            notes.goal_accepted("abcdef12", (1.0, 2.0, 3.0)),
            notes.text("goal abcdef12 NAVIGATING"),
            notes.text("mode GUIDED"),
            notes.text("goal abcdef12 ended NO_PATH"),
            notes.text("goal fedcba98 take off to 5 m"),
        ]
    )
    (goal,) = reader.goals
    assert (goal.goal_id, goal.targets_enu_m, goal.code) == (
        "abcdef12", ((1.0, 2.0, 3.0),), "NO_PATH",
    )  # fmt: skip
    assert goal.statuses == [(0.1, "NAVIGATING", "")]
    assert goal.ended_s == pytest.approx(0.3)
    assert [text for _, text in reader.status] == [
        "NAVIGATING", "ended NO_PATH", "take off to 5 m",
    ]  # fmt: skip
    assert reader.remarks == [(0.2, "mode GUIDED")]
    assert not reader.events


def test_a_recorded_flight_contains_all_of_its_goals(tmp_path: Path) -> None:
    flight = SimulatedFlight()
    recorder = Recorder(flight, tmp_path / "a.tlog")
    flight.ready()
    flight.check(flight.request(9e5, 0.0, 3.0))
    first = flight.send(4.0, 0.0, 3.0)
    first_end = flight.run_to_end(first)
    second = flight.start(LandRequest())
    flight.run_to_end(second)
    recorder.close()
    reader, codec = NotesReader(), Codec(255, 190)
    for time_s, data in TlogReader(tmp_path / "a.tlog"):
        for message in codec.decode(data):
            if message.get_srcComponent() == notes.COMPONENT_ID:
                reader.take(time_s - EPOCH_S, message)
    told = [output for _, output in flight.outputs if isinstance(output, GoalHappened)]
    assert [noted.happened for _, noted in reader.events] == told
    assert told[0].event == "REJECTED"
    goal, landing = reader.goals
    assert (goal.goal_id, goal.kind) == (first, "navigate_to_waypoint")
    assert (landing.goal_id, landing.kind) == (second, "land")
    assert goal.targets_enu_m == ((4.0, 0.0, 3.0),)
    assert (goal.code, goal.message) == ("SUCCESS", first_end.message)
    assert goal.elapsed_s == pytest.approx(first_end.elapsed_s, abs=1e-3)
    assert goal.final_error_m == pytest.approx(first_end.final_error_m, abs=1e-3)
    assert goal.ended_s == pytest.approx(goal.accepted_s + first_end.elapsed_s, abs=0.02)
    assert goal.statuses[0][1] == "ARMING"
    assert reader.feedbacks == len(flight.all(GoalFeedback))
