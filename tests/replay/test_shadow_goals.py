"""Goals worked on against a recording: what would have become of them, with nothing sent."""

from __future__ import annotations

import json
from pathlib import Path

import jsonschema
import pytest
import yaml

from drone_navigation.navigation_server import main
from mavlink_vehicle.io.tlog import TlogReader
from navigation_bridge.configuration.make_config import make_config
from navigation_bridge.configuration.parameter_table import ParameterValue
from navigation_bridge.goals.requests import LandRequest, NavigateRequest, WaypointsRequest
from navigation_bridge.recording.shadow_file import FILE, ShadowGoal, read_shadow_goals
from navigation_bridge.recording.shadow_goals import ShadowResult, work_shadow_goals
from tests.support.flights.recorded_flight import Recorder
from tests.support.flights.simulated_flight import SimulatedFlight
from tests.support.logs.recordings import SMALL

pytestmark = pytest.mark.wide_but_first


ROOT = Path(__file__).resolve().parents[2]


def shadowed(path: Path, *goals: ShadowGoal, **parameters: ParameterValue) -> list[ShadowResult]:
    config = make_config({"arming": "auto", **parameters})
    return work_shadow_goals(TlogReader(path), config, goals)


@pytest.fixture(scope="module")
def flown(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, SimulatedFlight, list[float]]:
    """A recorded flight with two goals, and when they were sent."""
    path = tmp_path_factory.mktemp("shadow") / "flown.tlog"
    flight = SimulatedFlight()
    recorder = Recorder(flight, path)
    flight.ready()
    flight.fly_up()
    sent_s = [flight.now]
    flight.run_to_end(flight.send(6.0, 3.0, 3.0))
    sent_s.append(flight.now)
    gone = flight.send(-6.0, 3.0, 3.0)
    flight.run_to_status(gone, "NAVIGATING")
    flight.run_for(1.0)
    flight.bridge.goals.cancel(gone, flight.now)
    flight.run_to_end(gone)
    recorder.close()
    return path, flight, sent_s


def begin_s(path: Path) -> float:
    """The recorded flight's own time when the recording begins."""
    return next(iter(TlogReader(path)))[0] - 1_700_000_000.0


def test_the_goal_that_was_flown_ends_as_it_did(
    flown: tuple[Path, SimulatedFlight, list[float]],
) -> None:
    path, flight, sent_s = flown
    at_s = sent_s[0] - begin_s(path)
    goal = ShadowGoal(at_s, "navigate_to_waypoint", flight.request(6.0, 3.0, 3.0))
    (result,) = shadowed(path, goal)
    live = flight.ends(f"{2:032x}")[0]
    assert result.end == live.code.value == "SUCCESS"
    assert result.ended_s is not None
    assert result.ended_s - at_s == pytest.approx(live.elapsed_s, abs=0.3)
    assert result.final_error_m == pytest.approx(live.final_error_m, abs=0.05)
    assert [status for _, status, _ in result.statuses] == ["NAVIGATING", "SETTLING"]
    live_m = [feedback.distance_remaining_m for feedback in flight.feedback(f"{2:032x}")]
    shadow_m = [feedback.distance_remaining_m for _, feedback in result.feedback]
    assert len(shadow_m) == pytest.approx(len(live_m), abs=3)
    assert shadow_m[0] == pytest.approx(live_m[0], abs=0.1)


def test_a_goal_elsewhere_is_not_reached_and_one_too_late_is_not_sent(
    flown: tuple[Path, SimulatedFlight, list[float]],
) -> None:
    path, flight, sent_s = flown
    at_s = sent_s[0] - begin_s(path)
    elsewhere = ShadowGoal(at_s, "navigate_to_waypoint", flight.request(40.0, 0.0, 3.0))
    late = ShadowGoal(1e6, "navigate_to_waypoint", flight.request(1.0, 0.0, 3.0))
    early = ShadowGoal(0.0, "navigate_to_waypoint", flight.request(1.0, 0.0, 3.0))
    rejected, open_, unsent = shadowed(path, early, elsewhere, late)
    assert rejected.end == "REJECTED"
    assert open_.end == "OPEN"
    assert "The recording ended while the goal was NAVIGATING" in open_.message
    assert unsent.end == "NOT_SENT"


def test_a_cancel_stops_as_far_as_the_recorded_vehicle_did(
    flown: tuple[Path, SimulatedFlight, list[float]],
) -> None:
    path, flight, sent_s = flown
    at_s = sent_s[1] - begin_s(path)
    goal = ShadowGoal(
        at_s, "navigate_to_waypoint", flight.request(-6.0, 3.0, 3.0), cancel_at_s=at_s + 1.0
    )
    (result,) = shadowed(path, goal)
    assert result.end == "CANCELED"
    assert "has stopped" in result.message


def test_goals_end_by_what_was_recorded_with_its_reason() -> None:
    """A battery failsafe, and a landing that nobody but the goal asked for."""
    request = NavigateRequest("map", (200.0, 0.0, 10.0), (0.0, 0.0, 0.0, 1.0), False, 0.0)
    goals = (
        ShadowGoal(45.0, "navigate_to_waypoint", request),
        ShadowGoal(70.0, "land", LandRequest()),
    )
    flight, landing = shadowed(ROOT / "tests/data/copter_lowbatt.tlog", *goals)
    assert flight.end == "FAILSAFE_BATTERY"
    assert "Battery Failsafe" in flight.message
    warning, *others = flight.statuses
    assert warning[1] == "PREPARING"
    assert "fence is not known" in warning[2]
    assert {status for _, status, _ in others} == {"NAVIGATING"}
    assert landing.end == "MODE_REFUSED"
    assert "GUIDED meanwhile" in landing.message


def test_a_route_in_a_file_has_its_yaw_rate(tmp_path: Path) -> None:
    path = tmp_path / "goals.yaml"
    waypoints = "waypoints: [{position: {x: 1, y: 2, z: 5}}]"
    goal = f"{{at_s: 2, action: navigate_waypoints, goal: {{{waypoints}, yaw_rate: -0.4}}}}"
    path.write_text(f"goals: [{goal}]")
    (found,) = read_shadow_goals(path)
    assert isinstance(found.request, WaypointsRequest)
    assert found.request.yaw_rate_rad_s == -0.4


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("goals: []", "goals has 0 items; it must have 1 to 1000"),
        ("{}", "goals is missing"),
        ("3", "goals.yaml: it must be an object, not 3"),
        ("goals: [{at_s: 1}]", "goals[0].action is missing; give one of navigate_to_waypoint, "),
        ("goals: [{action: land}]", "goals[0] (land): at_s is missing"),
        ("goals: [{at_s: -1, action: land}]", "at_s is -1; it must be at least 0"),
        ("goals: [{at_s: .nan, action: land}]", "at_s is nan; it must be at least 0"),
        ("goals: [{at_s: 2, cancel_at_s: 1, action: land}]", "cancel_at_s is before at_s"),
        (
            "goals: [{at_s: 2, action: takeoff, goal: {hight: 3}}]",
            "(takeoff): goal.hight is unknown; did you mean 'height'?",
        ),
        (
            "goals: [{at_s: 2, action: navigate_waypoints, goal: {waypoints: []}}]",
            "goal.waypoints has 0 items",
        ),
        ("goals: [{at_s: 2, at_s: 3, action: land}]", "duplicate key 'at_s'"),
        ("goals: [", "expected the node content"),
        ("\0", "goals.yaml: "),
    ],
)
def test_a_bad_file_of_goals_is_one_sentence(
    text: str, sentence: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "goals.yaml"
    path.write_text(text)
    arguments = ["--link", f"tlog:{SMALL / 'copter_guided.tlog'}", "--shadow-goals", str(path)]
    assert main(arguments) == 2
    said = capsys.readouterr().err
    assert sentence in said
    assert said.count("\n") == 1
    assert "Traceback" not in said


def test_a_link_that_is_no_recording_and_a_recording_that_is_none_are_rejected(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    goals = str(ROOT / "bridge_config/shadow_goals/square.yaml")
    (tmp_path / "empty.tlog").write_bytes(b"")
    (tmp_path / "text.tlog").write_bytes(b"no telemetry at all")
    for link, sentence in (
        ("udpin://127.0.0.1:14550", "give --link tlog:PATH"),
        (f"tlog:{tmp_path}/missing.tlog", "No such file"),
        (f"tlog:{tmp_path}/text.tlog", "is not a tlog"),
        (f"tlog:{tmp_path}/empty.tlog", "contains no MAVLink packet"),
    ):
        assert main(["--link", link, "--shadow-goals", goals]) == 2, link
        said = capsys.readouterr().err
        assert sentence in said
        assert said.count("\n") == 1


def test_the_table_and_the_json_tell_the_same(
    flown: tuple[Path, SimulatedFlight, list[float]],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    path, _, sent_s = flown
    goals = {
        "goals": [
            {
                "at_s": sent_s[0] - begin_s(path),
                "action": "navigate_to_waypoint",
                "goal": {"target_pose": {"pose": {"position": {"x": 6, "y": 3, "z": 3}}}},
            }
        ]
    }
    file = tmp_path / "goals.yaml"
    file.write_text(yaml.safe_dump(goals))
    arguments = ["--link", f"tlog:{path}", "--arming", "auto", "--shadow-goals", str(file)]
    assert main(arguments) == 0
    table = capsys.readouterr().out
    assert main([*arguments, "--json"]) == 0
    (told,) = json.loads(capsys.readouterr().out)
    assert told["end"] == "SUCCESS"
    assert "SUCCESS" in table
    assert f" {len(told['feedback'])} " in table
    assert told["message"].removeprefix("SUCCESS: ")[:30] in table


def test_the_example_matches_the_schema() -> None:
    example = ROOT / "bridge_config/shadow_goals/square.yaml"
    jsonschema.validate(yaml.safe_load(example.read_text("utf-8")), FILE.schema)
    first, second, third = read_shadow_goals(example)
    assert (first.at_s, second.cancel_at_s, third.action) == (20.0, 90.0, "return_to_launch")
