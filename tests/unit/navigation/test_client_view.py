"""The output of navigation_client: on a terminal, in a pipe, for a script."""

from __future__ import annotations

import io
import json
import math
import re

import pytest
from rich.console import Console

from drone_navigation.client.events import (
    Accepted,
    Ended,
    Event,
    Exit,
    Rejected,
    Said,
    Sending,
    Telemetry,
)
from drone_navigation.client.terminal.live import LiveView
from drone_navigation.client.terminal.output import ClientView, JsonView, PlainView

UNKNOWN = (math.nan, math.nan, math.nan)
SENDING = Sending(1, "navigate_to_waypoint", "goal (10, 5, 2) m in frame map")


def telemetry(
    distance_left_m: float = 6.0,
    status: str = "NAVIGATING",
    goal: int = 1,
    replans: int = 0,
    waypoint: int | None = None,
) -> Telemetry:
    return Telemetry(
        goal=goal,
        status=status,
        position_enu_m=(1.0, 2.0, 3.0),
        distance_left_m=distance_left_m,
        time_left_s=72.0,
        battery_percent=87.0,
        replans=replans,
        waypoint=waypoint,
        waypoints=None if waypoint is None else 3,
        lap=None if waypoint is None else 1,
    )


def ended(state: str = "SUCCEEDED", code: str = "SUCCESS", *, replaced: bool = False) -> Ended:
    return Ended(1, state, code, f"{code}: So it was.", replaced, (1.0, 2.0, 3.0), 9.5, 0.04)


def console(width: int = 100, *, terminal: bool = True, colour: bool = True) -> Console:
    return Console(
        file=io.StringIO(),
        width=width,
        height=24,
        force_terminal=terminal,
        no_color=not colour,
        color_system="standard" if terminal else None,
        legacy_windows=False,
    )


def printed(where: Console) -> str:
    assert isinstance(where.file, io.StringIO)
    return where.file.getvalue()


def block(width: int, *feedback: Telemetry, t_s: float = 5.0) -> list[str]:
    """Return the lines that the live view draws last."""
    view = LiveView(console(width), keys=True)
    view.tell(SENDING, 0.0)
    for one in feedback:
        view.show(one, t_s)
    view.close()
    paper = Console(file=io.StringIO(), width=width)
    paper.print(view.block(t_s))
    return printed(paper).splitlines()


def test_the_block_shows_status_position_path_battery_and_time() -> None:
    text = "\n".join(block(100, telemetry(10.0), telemetry(2.5, replans=2)))
    for words in (
        "NAVIGATING  1: goal (10, 5, 2) m in frame map",
        "east 1.00  north 2.00  up 3.00 m",
        "replans 2",
        "75 %  2.5 m left",
        "87 %",
        "0:05, ETA in 1:12",
    ):
        assert words in text


@pytest.mark.parametrize("width", [20, 40, 60, 80, 200])
def test_every_line_of_the_block_fits_the_terminal(width: int) -> None:
    lines = block(width, telemetry(10.0, "LINK_LOST", waypoint=2))
    assert len(lines) == 7
    assert all(len(line) <= width for line in lines)
    assert "LINK_LOST" in lines[1]
    assert "━" in lines[4]


def test_a_route_shows_its_waypoint() -> None:
    assert "waypoint 2 of 3" in block(100, telemetry(waypoint=2))[1]


def test_the_path_of_a_new_goal_starts_at_zero_percent() -> None:
    lines = block(100, telemetry(10.0), telemetry(1.0), telemetry(4.0, goal=2))
    assert "  0 %  4.0 m left" in "\n".join(lines)


def test_a_longer_path_moves_the_bar_back_but_not_below_zero() -> None:
    assert " 0 %  20.0 m left" in "\n".join(block(100, telemetry(10.0), telemetry(20.0)))


def test_a_stop_is_no_progress() -> None:
    lines = block(100, telemetry(10.0), telemetry(6.0), telemetry(0.5, "CANCELLING"))
    assert "40 %  6.0 m left" in "\n".join(lines)


@pytest.mark.parametrize(
    ("waypoint", "shown"), [(None, " 89 %  1.1 m left"), (2, " 40 %  6.0 m left")]
)
def test_the_last_panel_agrees_with_where_the_goal_ended(waypoint: int | None, shown: str) -> None:
    # From where a route ended to its last waypoint is not what was left of it.
    where = console(colour=False)
    view = LiveView(where)
    view.show(telemetry(10.0, waypoint=waypoint), 1.0)
    view.show(telemetry(6.0, waypoint=waypoint), 2.0)
    place = (1.0, 2.0, 3.0)
    view.tell(Ended(1, "CANCELED", "CANCELED", "CANCELED: So.", False, place, 9.5, 1.06), 3.0)
    last = "\n".join(line.plain for line in view.block(3.0).renderables)  # type: ignore[union-attr]
    view.close()
    assert shown in last
    bar = next(line for line in last.splitlines() if line.startswith("path"))
    full, empty = bar.count("━"), bar.count("╌")
    assert full / (full + empty) == pytest.approx(
        float(shown.split(maxsplit=1)[0]) / 100.0, abs=0.05
    )


def test_unknown_values_are_shown_as_unknown() -> None:
    unknown = Telemetry(1, "PREPARING", UNKNOWN, math.nan, math.nan, math.nan)
    text = "\n".join(block(100, unknown))
    assert text.count("unknown") == 2
    assert "ETA in ?" in text
    assert "nan" not in text


def test_silence_is_shown_and_the_end_is_not_silence() -> None:
    where = console()
    view = LiveView(where)
    view.show(telemetry(), 1.0)
    view.tick(9.0)
    assert "no feedback for 8 s" in printed(where)
    view.tell(ended(), 10.0)
    view.tick(60.0)
    view.close()
    assert "no feedback for 5" not in printed(where)
    assert "\x1b[1;30;42m SUCCESS " in printed(where)


@pytest.mark.parametrize(
    ("status", "style"),
    [("NAVIGATING", "1;30;42"), ("BLOCKED", "1;33;41"), ("PAUSED", "1;30;43")],
)
def test_the_status_has_its_colour(status: str, style: str) -> None:
    where = console()
    view = LiveView(where)
    view.show(telemetry(status=status), 1.0)
    view.close()
    assert f"\x1b[{style}m {status} " in printed(where)


@pytest.mark.parametrize(
    ("state", "code", "style"),
    [
        ("SUCCEEDED", "SUCCESS", "1;30;42"),
        ("CANCELED", "CANCELED", "1;30;43"),
        ("ABORTED", "NO_PATH", "1;37;41"),
    ],
)
def test_an_end_takes_the_place_of_the_status(state: str, code: str, style: str) -> None:
    where = console()
    view = LiveView(where)
    view.show(telemetry(), 1.0)
    view.tell(ended(state, code), 2.0)
    view.close()
    assert f"\x1b[{style}m {code} " in printed(where)


def test_no_color_is_respected() -> None:
    where = console(colour=False)
    view = LiveView(where, keys=True)
    view.show(telemetry(status="BLOCKED"), 1.0)
    view.close()
    assert "BLOCKED" in printed(where)
    assert not re.search(r"\x1b\[[\d;]*[34]\dm", printed(where))
    assert re.search(r"━\x1b\[2m╌", printed(where))  # the bars can be read all the same


def test_the_prompt_stands_where_the_keys_were_and_goes_again() -> None:
    where = console()
    view = LiveView(where, keys=True)
    view.show(telemetry(), 1.0)
    view.prompt("x y z in map: ", "5 5")
    prompted = printed(where)
    assert "x y z in map:" in prompted
    assert "5 5" in prompted
    view.prompt("x y z in map: ", None)
    assert "p pause" in printed(where)[len(prompted) :]
    view.close()


def test_plain_lines_are_printed_every_second_and_on_change() -> None:
    where = console(40, terminal=False)
    view = PlainView(where)
    for t_s, shown in (
        (0.0, telemetry(9.0)),
        (0.5, telemetry(8.0)),
        (0.6, telemetry(7.9, "BLOCKED")),
        (0.7, telemetry(7.8, "BLOCKED", replans=1)),
        (0.8, telemetry(7.7, "BLOCKED", replans=1)),
        (1.8, telemetry(7.6, "BLOCKED", replans=1)),
        (1.9, telemetry(7.6, "BLOCKED", goal=2)),
    ):
        view.show(shown, t_s)
    lines = printed(where).splitlines()
    assert [line.split()[0] for line in lines] == ["0.0", "0.6", "0.7", "1.8", "1.9"]
    assert "replans 1" in lines[2]
    assert "\x1b" not in printed(where)


def test_feedback_does_not_write_into_a_plain_prompt() -> None:
    where = console(terminal=False)
    view = PlainView(where, keys=True)
    for typed in ("", "5", "5 5", "5 5", "5"):
        view.prompt("x y z: ", typed)
        view.show(telemetry(), 1.0)
    assert printed(where).splitlines()[-1].endswith("x y z: 5")
    view.prompt("x y z: ", None)
    view.show(telemetry(), 1.0)
    assert "NAVIGATING" in printed(where).splitlines()[-1]


EVENTS: tuple[Event, ...] = (
    Said("A remark"),
    SENDING,
    Accepted(1, "ab"),
    Rejected(2, "BUSY", "BUSY: No."),
    ended("ABORTED", "PREEMPTED", replaced=True),
    ended(),
    Exit(0),
)


@pytest.mark.parametrize("make", [LiveView, PlainView])
def test_every_event_but_the_exit_is_shown(make: type[LiveView] | type[PlainView]) -> None:
    where = console(200, terminal=make is LiveView, colour=False)
    view: ClientView = make(where)
    for event in EVENTS:
        view.tell(event, 1.0)
    view.close()
    for words in (
        "A remark",
        "Sending goal (10, 5, 2) m in frame map",
        "Goal accepted",
        "Goal rejected: BUSY: No.",
        "Goal 1 ended: PREEMPTED after 9.5 s",
        "SUCCESS: So it was. (9.5 s, at (1.00, 2.00, 3.00) m)",
    ):
        assert words in printed(where)


def test_json_is_one_object_per_line_and_unknown_values_are_null() -> None:
    where = console(20, terminal=False)  # too narrow for anything but unbroken lines
    view = JsonView(where)
    for event in EVENTS:
        view.tell(event, 1.23456)
    view.show(Telemetry(1, "PREPARING", UNKNOWN, math.inf, 3.0, math.nan), 2.0)
    objects = [json.loads(line) for line in printed(where).splitlines()]
    names = ["said", "sending", "accepted", "rejected", "ended", "ended", "exit", "feedback"]
    assert [each["event"] for each in objects] == names
    assert objects[0] == {"event": "said", "t_s": 1.235, "text": "A remark", "bad": False}
    assert objects[4]["replaced"]
    assert objects[5]["position_enu_m"] == [1.0, 2.0, 3.0]
    assert objects[7]["position_enu_m"] == [None, None, None]
    assert objects[7]["distance_left_m"] is objects[7]["battery_percent"] is None
    assert objects[7]["waypoint"] is None
