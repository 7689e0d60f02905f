"""The goals that `--update` and the prompt of navigation_client take."""

from __future__ import annotations

import pytest

from drone_navigation.client.options import parse_options
from drone_navigation.client.updates import Update, UpdateError, parse_point, parse_update


@pytest.mark.parametrize("text", ["t=8: 5 -5 2.5", "t=8:5 -5 2.5", " t = 8s : 5, -5, 2.5 "])
def test_an_update_is_a_time_and_a_point(text: str) -> None:
    assert parse_update(text) == Update(8.0, (5.0, -5.0, 2.5))


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("", "write it like"),
        ("8: 5 5 2", "write it like"),
        ("t=8 5 5 2", "write it like"),
        ("t=8: 5 5", "'5 5' is not a point; give three numbers"),
        ("t=8: 5 5 2 1", "three numbers"),
        ("t=8: 5 five 2", "'five' is not a number"),
        ("t=soon: 5 5 2", "'soon' is not a number"),
        ("t=-1: 5 5 2", "must not be negative"),
        ("t=nan: 5 5 2", "'nan' is not a finite number"),
        ("t=8: 5 5 inf", "'inf' is not a finite number"),
    ],
)
def test_a_malformed_update_is_an_error(text: str, sentence: str) -> None:
    with pytest.raises(UpdateError, match=sentence):
        parse_update(text)


def test_a_typed_point_may_have_commas() -> None:
    assert parse_point(" 5,5, 2 ") == (5.0, 5.0, 2.0)


def test_updates_come_in_the_order_of_their_times() -> None:
    goal = ["--goal", "1", "2", "3"]
    options = parse_options([*goal, "--update", "t=9: 1 1 1", "--update", "t=3: 2 2 2"])
    assert [update.at_s for update in options.update] == [3.0, 9.0]


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["--update", "t=8: 5 5"], "argument --update: '5 5' is not a point"),
        (["--goal", "1", "2", "3", "--plan", "a.plan"], "not allowed with argument --goal"),
        (["--waypoints", "a.txt", "--plan", "a.plan"], "not allowed with"),
        (["--json", "--plain"], "not allowed with"),
        (["--cancel-after", "nan"], "--cancel-after is nan"),
        (["--server-timeout", "-1"], "--server-timeout is -1"),
        (["--mission"], "--mission needs a route"),
        (["--laps", "-1"], "--laps needs a route"),
        (["--plan", "x.plan", "--laps", "-1"], "--laps is -1"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_an_invalid_command_line_is_a_message_and_exit_code_2(
    arguments: list[str], sentence: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as ended:
        parse_options(arguments)
    assert ended.value.code == 2
    printed = capsys.readouterr()
    assert sentence in printed.err
    assert printed.out == ""
