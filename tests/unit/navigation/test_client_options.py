"""The command line of navigation_client: its commands, and what is rejected with a sentence."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from custom_interfaces.action import Follow, NavigateWaypoints, Orbit
from drone_navigation.client.client_goal import make_client_goal, make_point_client_goal
from drone_navigation.client.options import (
    ACTION_COMMANDS,
    COMMANDS,
    SERVICE_COMMANDS,
    make_parser,
    parse_options,
)
from drone_navigation.server.conversions import request_from_waypoints

FOLLOWED = ["--topic", "/target", "--offset=-6,0,4"]
WORDS = {
    "follow": FOLLOWED,
    "mode": ["MODE"],
    "parameters": ["list"],
    "orbit": ["30", "-10", "--radius", "-8"],
    "point": ["--release"],
    "survey": ["--boundary", "0,0 9,0 9,9", "--height", "5", "--spacing", "3"],
}
"""The arguments that a command needs"""


def refusal(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    with pytest.raises(SystemExit) as ended:
        parse_options(list(arguments))
    assert ended.value.code == 2
    return capsys.readouterr().err


def test_command_lines_without_a_command_still_work() -> None:
    options = parse_options(["--goal", "1", "2", "-3", "--update", "t=8: 5 5 2", "--avoid"])
    assert (options.command, options.goal, options.laps) == ("", [1.0, 2.0, -3.0], 1)
    assert len(options.update) == 1
    assert parse_options(["--plan", "a.plan", "--laps", "2", "--mission"]).laps == 2


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_takes_the_options_of_all(command: str) -> None:
    words = WORDS.get(command, [])
    common = ["--vehicle", "a/b", "--json", "--server-timeout", "3"]
    options = parse_options([command, *words, *common])
    assert (options.command, options.vehicle, options.json) == (command, "a/b", True)
    assert options.server_timeout == 3.0


@pytest.mark.parametrize("command", ACTION_COMMANDS)
def test_goal_commands_take_the_options_of_goals(command: str) -> None:
    words = [command, *WORDS.get(command, [])]
    options = parse_options([*words, "--cancel-after", "2", "--lost-timeout", "9"])
    assert (options.cancel_after, options.lost_timeout, options.update) == (2.0, 9.0, [])
    assert parse_options(words).cancel_after == math.inf
    # Another goal may be typed while it is under way.
    goal = make_point_client_goal(options, (1.0, 2.0, 3.0)).goal
    assert (goal.max_speed, goal.avoid_obstacles) == (0.0, False)


@pytest.mark.parametrize("command", SERVICE_COMMANDS)
def test_other_commands_reject_the_options_of_goals(
    command: str, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["MODE"] if command == "mode" else []
    assert "--cancel-after" in refusal(capsys, command, *words, "--cancel-after", "2")


def test_a_circle_is_named_by_its_centre_and_radius(capsys: pytest.CaptureFixture[str]) -> None:
    plain = make_client_goal(parse_options(["orbit", "30", "-10", "--radius", "-8"]))
    goal = plain.goal
    assert isinstance(goal, Orbit.Goal)
    place = goal.centre.pose.position
    assert (plain.name, place.x, place.y, goal.radius, goal.laps) == ("orbit", 30.0, -10.0, -8, 1)
    assert math.isnan(goal.height)
    assert plain.description == "circle of -8 m about (30, -10) in frame map, 1 laps"
    more = ["--height", "6", "--laps", "0", "--speed", "4", "--yaw-mode", "keep", "--avoid"]
    words = ["orbit", "1", "2", "--radius", "9", "--frame", "base_link", *more]
    goal = make_client_goal(parse_options(words)).goal
    assert isinstance(goal, Orbit.Goal)
    assert (goal.height, goal.laps, goal.max_speed, goal.yaw_mode) == (6, 0, 4, goal.YAW_KEEP)
    assert (goal.avoid_obstacles, goal.centre.header.frame_id) == (True, "base_link")
    assert "--radius" in refusal(capsys, "orbit", "30", "10")
    assert "'wide' is not a number" in refusal(capsys, "orbit", "1", "2", "--radius", "wide")


def test_a_turn_rate_is_that_of_a_route(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    plan = tmp_path / "a.waypoints"
    rows = ("0 1 0 16 0 0 0 0 47 8 0 1", "1 0 3 16 0 0 0 0 47.001 8 10 1")
    plan.write_text("\n".join(("QGC WPL 110", *(row.replace(" ", "\t") for row in rows))))
    goal = make_client_goal(parse_options(["--plan", str(plan), "--yaw-rate", "-0.5"])).goal
    assert isinstance(goal, NavigateWaypoints.Goal)
    assert request_from_waypoints(goal).yaw_rate_rad_s == -0.5
    words = refusal(capsys, "--goal", "1", "2", "3", "--yaw-rate", "0.5")
    assert "--yaw-rate needs a route; give --plan or --waypoints as well." in words


def test_a_target_is_named_by_its_source_and_an_offset(capsys: pytest.CaptureFixture[str]) -> None:
    plain = make_client_goal(parse_options(["follow", *FOLLOWED]))
    goal = plain.goal
    assert isinstance(goal, Follow.Goal)
    assert (plain.name, plain.description) == ("follow_target", "following /target")
    assert (goal.pose_topic, goal.tracked_frame, goal.target_system) == ("/target", "", 0)
    assert (goal.offset.x, goal.offset.y, goal.offset.z) == (-6.0, 0.0, 4.0)
    assert (goal.offset_frame, goal.yaw_mode) == (goal.OFFSET_TARGET, goal.YAW_TARGET)
    more = ["--least-distance", "3", "--speed", "4", "--duration", "60", "--target-timeout", "5"]
    words = ["follow", "--system", "9", *FOLLOWED[2:], "--offset-frame", "map", *more]
    goal = make_client_goal(parse_options([*words, "--yaw-mode", "keep"])).goal
    assert isinstance(goal, Follow.Goal)
    assert (goal.target_system, goal.offset_frame, goal.yaw_mode) == (9, 1, goal.YAW_KEEP)
    assert (goal.least_distance, goal.max_speed) == (3.0, 4.0)
    assert (goal.max_duration, goal.lost_timeout) == (60.0, 5.0)
    assert "one of the arguments" in refusal(capsys, "follow", "--offset=1,2,3")
    assert "not allowed with" in refusal(capsys, "follow", *FOLLOWED, "--tf", "tag")
    assert "is not X,Y,Z in metres" in refusal(capsys, "follow", *FOLLOWED, "--offset=1,2")
    assert "is not a number from 1 to 255" in refusal(
        capsys, "follow", "--system", "300", *FOLLOWED[2:]
    )


def test_takeoff_takes_a_height_and_mode_a_name(capsys: pytest.CaptureFixture[str]) -> None:
    assert parse_options(["takeoff", "--height", "5"]).height == 5.0
    assert parse_options(["takeoff"]).height == 0.0
    assert parse_options(["mode", "GUIDED"]).mode == "GUIDED"
    for height in ("0", "-3", "nan", "inf", "high"):
        assert f"'{height}' is not a height above 0 m" in refusal(
            capsys, "takeoff", f"--height={height}"
        )
    assert "MODE" in refusal(capsys, "mode")


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["lnad"], "'lnad' is not a command; did you mean 'land'?"),
        (["xyzzy"], "give one of follow, orbit, survey, takeoff, land"),
        (["--laps", "2"], "--laps needs a route; give --plan or --waypoints as well."),
        (["--goal", "1", "2", "3", "--mission"], "--mission needs a route"),
        (["--plan", "a.plan", "--laps", "-1"], "--laps is -1"),
        (["--cancel-after", "nan"], "--cancel-after is nan"),
        (["status", "--server-timeout", "-1"], "--server-timeout is -1"),
        (["land", "--vehicle", "a b"], "'a b' is not a valid vehicle name"),
    ],
)
def test_invalid_options_are_rejected_with_a_message(
    arguments: list[str], sentence: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert sentence in refusal(capsys, *arguments)


def test_the_help_names_every_command() -> None:
    text = make_parser().format_help()
    width = max(map(len, COMMANDS))
    for command, what in COMMANDS.items():
        assert f"{command:<{width}} {what}" in text


@pytest.mark.parametrize("command", COMMANDS)
def test_options_of_all_commands_may_precede_them(command: str) -> None:
    words = WORDS.get(command, [])
    options = parse_options(["--vehicle", "land", "--json", command, *words])
    assert (options.command, options.vehicle, options.json) == (command, "land", True)


def test_the_value_of_another_option_is_no_command() -> None:
    assert parse_options(["--plan", "land"]).command == ""
    assert parse_options(["--vehicle", "land", "--goal", "1", "2", "3"]).command == ""


@pytest.mark.parametrize("flight", [["--speed", "2"], ["--update", "t=9: 1 1 1"], ["--avoid"]])
def test_no_target_is_guessed(flight: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert parse_options(["--vehicle", "a", "--json"]).goal is None
    assert f"{flight[0]} needs a target; give --goal X Y Z" in refusal(capsys, *flight)


def test_obstacles_are_avoided_by_choice_or_as_the_vehicle_knows_any() -> None:
    assert parse_options([]).avoid is None
    goal = ["--goal", "1", "2", "3"]
    assert parse_options([*goal, "--avoid"]).avoid is True
    assert parse_options([*goal, "--straight"]).avoid is False
