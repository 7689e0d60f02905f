"""Files of ground stations, and what is said about those that cannot be flown."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from navigation_bridge.goals.requests import AltitudeReference, WaypointRequest
from navigation_bridge.plan_files.items import PlanError
from navigation_bridge.plan_files.routes import PlannedRoute, read_route

AMSL, HOME, GROUND = AltitudeReference.AMSL, AltitudeReference.HOME, AltitudeReference.GROUND
WAYPOINT, LOITER_TIME, RTL, LAND, TAKEOFF, DELAY = 16, 19, 20, 21, 22, 93
YAW, JUMP, SPEED, MOUNT, LOITER_UNLIM = 115, 177, 178, 205, 17


def simple(
    command: int = WAYPOINT,
    *params: float | None,
    frame: int = 3,
    place: tuple[float, float, float] = (47.3977, 8.5456, 20.0),
) -> dict[str, Any]:
    first = [*params, *([None] * (4 - len(params)))]
    return {"type": "SimpleItem", "command": command, "frame": frame, "autoContinue": True,
            "params": [*first, *place], "doJumpId": 1}  # fmt: skip


def plan(*items: object, firmware: int = 12, **more: object) -> str:
    return json.dumps(
        {"fileType": "Plan", "version": 1, "groundStation": "QGroundControl",
         "mission": {"version": 2, "firmwareType": firmware, "items": items}, **more}
    )  # fmt: skip


def read(path: Path, text: str) -> PlannedRoute:
    path.write_text(text, encoding="utf-8")
    return read_route(path)


def rows(*lines: str, version: int = 110) -> str:
    """A waypoint file of rows with blanks between their columns."""
    return f"QGC WPL {version}\n" + "\n".join("\t".join(line.split()) for line in lines) + "\n"


def numbered(*lines: str) -> str:
    """The same, with home, and the other rows numbered from 1."""
    items = (f"{number} {line.split(maxsplit=1)[1]}" for number, line in enumerate(lines, start=1))
    return rows(HOME_ROW, *items)


HOME_ROW = "0 1 0 16 0 0 0 0 47.3977 8.5456 488 1"
FIRST_ROW = "1 0 3 16 0 0 0 0 47.398 8.546 12 1"
SECOND_ROW = "2 0 3 16 0 0 0 0 47.399 8.546 12 1"


def rejection(path: Path, text: str) -> str:
    """The one sentence with which a file is rejected."""
    with pytest.raises(PlanError) as caught:
        read(path, text)
    sentence = str(caught.value)
    assert sentence.startswith(f"{path}: ")
    assert sentence.endswith(".")
    assert "\n" not in sentence
    return sentence


@pytest.fixture
def plan_file(tmp_path: Path) -> Path:
    return tmp_path / "mine.plan"


@pytest.fixture
def wpl_file(tmp_path: Path) -> Path:
    return tmp_path / "mine.waypoints"


def test_waypoints_come_with_their_height_time_radius_heading_and_speed(plan_file: Path) -> None:
    route = read(
        plan_file,
        plan(
            simple(TAKEOFF),
            simple(WAYPOINT, 5.0, 2.0, None, 90.0, frame=0, place=(47.1, 8.1, 500.0)),
            simple(SPEED, 1.0, 3.5, -1.0, 0.0, frame=2, place=(0.0, 0.0, 0.0)),
            simple(WAYPOINT, 0.0, 0.0, 0.0, None, frame=3),
            simple(WAYPOINT, frame=10),
            simple(RTL, frame=2),
        ),
    )
    first, second, third = route.waypoints
    assert first.position == (47.1, 8.1, 500.0)
    assert (first.altitude_reference, first.hold_time_s, first.acceptance_radius_m) == (AMSL, 5, 2)
    assert first.yaw_enu_rad == pytest.approx(0.0)
    assert (first.max_speed_m_s, second.max_speed_m_s) == (0.0, 3.5)
    assert (second.altitude_reference, second.yaw_enu_rad) == (HOME, None)
    assert third.altitude_reference is GROUND
    assert len(route.notes) == 2
    assert "take-off" in route.notes[0]
    assert "RETURN_TO_LAUNCH is skipped" in route.notes[1]


def test_a_heading_of_zero_is_north_on_a_px4_and_nothing_on_an_ardupilot(plan_file: Path) -> None:
    item = simple(WAYPOINT, 0.0, 0.0, 0.0, 0.0)
    (north,) = read(plan_file, plan(item, firmware=12)).waypoints
    assert north.yaw_enu_rad == pytest.approx(math.pi / 2)
    (free,) = read(plan_file, plan(item, firmware=3)).waypoints
    assert free.yaw_enu_rad is None


def test_delays_turns_and_loitering_belong_to_waypoints(plan_file: Path) -> None:
    route = read(
        plan_file,
        plan(
            simple(YAW, 180.0, 0.0, 0.0, 0.0, frame=2),
            simple(),
            simple(DELAY, 4.0, frame=2),
            simple(LOITER_TIME, 7.0),
            simple(MOUNT, frame=2),
        ),
    )
    assert [waypoint.hold_time_s for waypoint in route.waypoints] == [4.0, 7.0]
    assert route.waypoints[0].yaw_enu_rad == pytest.approx(-math.pi / 2)
    assert route.waypoints[1].yaw_enu_rad is None
    assert route.notes == ("1 camera and gimbal items are skipped.",)


@pytest.mark.parametrize("kind", ["survey", "CorridorScan", "StructureScan"])
def test_a_survey_is_flown_by_the_items_it_contains(plan_file: Path, kind: str) -> None:
    transects = {"Items": [simple(), simple(MOUNT), simple()]}
    survey = {
        "type": "ComplexItem",
        "complexItemType": kind,
        "TransectStyleComplexItem": transects,
    }
    assert len(read(plan_file, plan(survey)).waypoints) == 2


def test_fence_and_rally_points_are_reported_as_not_sent(plan_file: Path) -> None:
    text = plan(simple(), geoFence={"circles": [1]}, rallyPoints={"points": []})
    note = "The plan's geoFence is not sent to the vehicle; the command fence does that."
    assert read(plan_file, text).notes == (note,)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("", "it is empty"),
        ('{\n"a": }', "line 2: not valid JSON"),
        ("[" * 100_000, "not valid JSON"),
        ("[]", "not a QGroundControl plan"),
        ('{"fileType": "Plan"}', "not a QGroundControl plan"),
        ('{"fileType": "Plan", "mission": {"items": 3}}', "no item list"),
        (plan(), "no waypoint"),
        (plan(simple(RTL)), "no waypoint"),
        (plan(simple(), 3), "item 2 is not an object"),
        (plan(simple(), simple(JUMP, 1, 2)), "item 2: DO_JUMP is not supported"),
        (plan(simple(), simple(LAND), simple()), "item 2: NAV_LAND is not supported"),
        (plan(simple(9999)), "item 1: MAV_CMD 9999 is not supported"),
        (plan(simple(), simple(frame=1)), "item 2: MAV_FRAME 1 is not supported"),
        (plan(simple(place=(0.0, 0.0, 5.0))), "item 1: the waypoint is at 0, 0"),
        (plan({**simple(), "params": [0, 0, 0, 0, None, 8.0, 5.0]}), "has no position"),
        (plan({**simple(), "params": [0, 0, 0]}), "seven params"),
        (plan({**simple(), "params": [0, "x", 0, 0, 1, 1, 1]}), "param 2 is 'x'"),
        (plan({**simple(), "params": [0, 10**400, 0, 0, 1, 1, 1]}), "param 2"),
        (plan(simple()).replace("47.3977", "9" * 5000), "not valid JSON"),
        (plan({**simple(), "command": "16"}), "must be integers"),
        (plan({**simple(), "command": True}), "must be integers"),
        (plan({"type": "Mystery"}), "item 1 is a 'Mystery'"),
        (plan({"type": "ComplexItem", "complexItemType": "fwLandingPattern"}), "fwLandingPattern"),
        (
            plan({"type": "ComplexItem", "complexItemType": "survey",
                  "TransectStyleComplexItem": {"Items": [4]}}),
            "(survey), its item 1 is not a SimpleItem",
        ),
    ],
)  # fmt: skip
def test_an_unusable_plan_is_rejected_in_one_sentence(
    plan_file: Path, text: str, sentence: str
) -> None:
    assert sentence in rejection(plan_file, text)


WPL = (
    "QGC WPL 110\n"
    "0\t1\t0\t16\t0\t0\t0\t0\t47.3977\t8.5456\t488\t1\n"
    "1\t0\t3\t22\t0\t0\t0\t0\t0\t0\t10\t1\n"
    "2\t0\t3\t16\t3\t0\t0\t0\t47.398\t8.546\t12.5\t1\n"
    "\n"
    "3\t0\t3\t16\t0\t0\t0\t270\t47.399\t8.546\t12.5\t1\n"
)


def test_a_waypoint_file_has_home_first(wpl_file: Path) -> None:
    first, second = read(wpl_file, WPL).waypoints
    assert first.position == (47.398, 8.546, 12.5)
    assert (first.altitude_reference, first.hold_time_s, first.yaw_enu_rad) == (HOME, 3.0, None)
    assert second.yaw_enu_rad == pytest.approx(-math.pi)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("\n", "it is empty"),
        ("# a comment\n", "neither a .plan of QGroundControl nor a file"),
        ("47.1 8.1\n", "line 1: this is neither a .plan of QGroundControl nor a file"),
        ("QGC WPL 100\n", "line 1: version 100 is not supported; open the file in"),
        ("QGC WPL PB 110\n", "line 1: version PB 110 is not supported"),
        ("QGC WPL 110\n", "no waypoint"),
        ("QGC WPL 120\n", "no waypoint"),
        (f"{WPL}4\t0\t3\n", "line 7: 3 columns instead of 12"),
        (WPL.replace("\t270\t", "\tx\t"), "line 6: param 4, 'x', is not a number."),
        (WPL.replace("\t270\t", "\tnan\t").replace("47.399", "nan"), "line 6: the waypoint has no"),
        (HOME_ROW, "line 1: a waypoint file must begin with 'QGC WPL 110'; add this line"),
        (rows(FIRST_ROW, SECOND_ROW), "line 2: the first row has number 1, but version 110 has"),
        (rows("0 0 0 5001 4 0 0 0 47 8 0 0", FIRST_ROW), "line 2: NAV_FENCE_POLYGON_VERTEX_INC"),
        ("RALLY 47.1 8.1 30 40 0 0\n", "it has rally points; the command rally sends them"),
    ],
)
def test_an_unusable_waypoint_file_is_rejected_in_one_sentence(
    wpl_file: Path, text: str, sentence: str
) -> None:
    assert sentence in rejection(wpl_file, text)


@pytest.mark.parametrize(
    "home",
    [
        HOME_ROW,
        "0 0 3 16 0 0 0 0 47.3977 8.5456 488 1",
        "0 0 10 16 0 0 0 0 47.3977 8.5456 488 1",
        "0 0 3 0 0 0 0 0 47.3977 8.5456 488 0",
        "0 1 0 16 0 0 0 0 0 0 0 1",
        "0 0 0 0 0 0 0 0 0 0 0 0",
        "0 1 0 16 nan nan nan nan nan nan nan 1",
    ],
)
def test_row_0_is_home_whatever_its_frame_and_command(wpl_file: Path, home: str) -> None:
    route = read(wpl_file, rows(home, FIRST_ROW, SECOND_ROW))
    assert [waypoint.position for waypoint in route.waypoints] == [
        (47.398, 8.546, 12.0),
        (47.399, 8.546, 12.0),
    ]
    assert route.notes == ()


def test_an_item_in_the_row_of_home_is_reported(wpl_file: Path) -> None:
    takeoff = "0 1 5 22 0 0 0 0 47.3977 8.5456 15 1"
    route = read(wpl_file, rows(takeoff, FIRST_ROW))
    assert len(route.waypoints) == 1
    assert route.notes == ("line 2: row 0 is the planned home; NAV_TAKEOFF there is not flown.",)


def test_version_120_has_no_home(wpl_file: Path) -> None:
    text = rows("0 0 3 16 0 0 0 0 47.3977 8.5456 12 1", FIRST_ROW, version=120)
    assert len(read(wpl_file, text).waypoints) == 2


@pytest.mark.parametrize(
    "text",
    [
        rows(HOME_ROW, FIRST_ROW, SECOND_ROW).replace("\n", "\r\n"),
        "\ufeff" + rows(HOME_ROW, FIRST_ROW, SECOND_ROW),
        rows(HOME_ROW, FIRST_ROW, SECOND_ROW).replace("\t", "   "),
        "# of MAVProxy\n" + rows(HOME_ROW, FIRST_ROW, "# the last one", SECOND_ROW, "", "  "),
        rows(HOME_ROW, FIRST_ROW.replace(" 16 ", " 16.0 "), "7 " + SECOND_ROW[2:]),
        rows(HOME_ROW, FIRST_ROW, f"{SECOND_ROW} # ours"),
        rows(HOME_ROW, FIRST_ROW.replace("1 0 3", "1 1 3"), SECOND_ROW.replace("12 1", "1.2e1 1")),
    ],
    ids=["CRLF", "mark", "blanks", "comments", "gap", "comment in a line", "current"],
)
def test_variants_of_waypoint_files_are_one_route(wpl_file: Path, text: str) -> None:
    wpl_file.write_bytes(text.encode())
    route = read_route(wpl_file)
    assert route == read(wpl_file, rows(HOME_ROW, FIRST_ROW, SECOND_ROW))
    assert len(route.waypoints) == 2


def test_rows_are_flown_in_the_order_of_the_file(wpl_file: Path) -> None:
    route = read(wpl_file, rows(HOME_ROW, SECOND_ROW, FIRST_ROW))
    assert [waypoint.position[0] for waypoint in route.waypoints] == [47.399, 47.398]
    assert "line 4: number 1 comes after 2" in route.notes[0]


def item_row(command: int, *params: float, frame: int = 3, autocontinue: int = 1) -> str:
    first = [*params, *([0.0] * (7 - len(params)))]
    return f"1 0 {frame} {command} {' '.join(f'{value:g}' for value in first)} {autocontinue}"


PLACE = (47.398, 8.546, 12.0)


@pytest.mark.parametrize(
    ("line", "sentence"),
    [
        (item_row(WAYPOINT, -1.0, 0, 0, 0, *PLACE), "the hold time (param 1) is -1"),
        (item_row(WAYPOINT, 0, -2.0, 0, 0, *PLACE), "the acceptance radius (param 2) is -2"),
        (item_row(WAYPOINT, 0, 0, 7.0, 0, *PLACE), "with a pass radius (param 3 is 7)"),
        (item_row(WAYPOINT, 0, 0, 0, 0, 47.0, 8.0, math.nan), "the waypoint has no altitude"),
        (item_row(WAYPOINT, 0, 0, 0, 0, 91.0, 8.0, 5.0), "91, 8 is not a latitude and a longitude"),
        (item_row(WAYPOINT, 0, 0, 0, 0, 4.7e8, 8.5e7, 5.0), "is not a latitude and a longitude"),
        (item_row(WAYPOINT, 0, 0, 0, 0, *PLACE, frame=2), "MAV_FRAME 2 is not supported"),
        (item_row(WAYPOINT, 0, 0, 0, 0, *PLACE, autocontinue=0), "NAV_WAYPOINT has autocontinue 0"),
        (item_row(LOITER_TIME, 5, 1, 0, 0, *PLACE), "a required heading (param 2 is 1)"),
        (item_row(LOITER_TIME, 5, 0, -30, 0, *PLACE), "a loiter radius (param 3 is -30)"),
        (item_row(LOITER_TIME, 5, 0, 0, 1, *PLACE), "an exit location (param 4 is 1)"),
        (item_row(LOITER_TIME, 5), "at 0, 0, which means no position"),
        (item_row(LOITER_UNLIM, 0, 0, 0, 0, *PLACE), "the vehicle would never leave it"),
        (item_row(18, 2, 0, 30, 0, *PLACE), "NAV_LOITER_TURNS is not supported"),
        (item_row(31, 0, 0, 0, 0, *PLACE), "NAV_LOITER_TO_ALT is not supported"),
        (item_row(82, 0, 0, 0, 0, *PLACE), "NAV_SPLINE_WAYPOINT is not supported"),
        (item_row(LAND, 0, 0, 0, 0, *PLACE), "NAV_LAND is not supported"),
        (item_row(YAW, 90, 20), "CONDITION_YAW with a turn rate (param 2 is 20)"),
        (item_row(YAW, 90, 0, -1), "CONDITION_YAW with a turn direction (param 3 is -1)"),
        (item_row(YAW, 90, 0, 0, 1), "CONDITION_YAW with a relative angle (param 4 is 1)"),
        (item_row(YAW, math.nan), "CONDITION_YAW has no angle (param 1)"),
        (item_row(SPEED, 2, 8), "DO_CHANGE_SPEED of the climb speed (param 1 is 2)"),
        (item_row(SPEED, 3, 8), "DO_CHANGE_SPEED of the descent speed (param 1 is 3)"),
        (item_row(SPEED, 7, 8), "DO_CHANGE_SPEED of a type (param 1 is 7)"),
        (item_row(SPEED, 1, 8, 50), "a throttle of 50 % (param 3)"),
        (item_row(SPEED, 1, 8, -1, 1), "a relative speed (param 4 is 1)"),
        (item_row(SPEED, 1, 0), "to 0 m/s (param 2) is not a speed"),
        (item_row(SPEED, 1, -3), "to -3 m/s (param 2) is not a speed"),
        (item_row(SPEED, 1, math.nan), "to nan m/s (param 2) is not a speed"),
        (item_row(DELAY, 5), "NAV_DELAY before the first waypoint"),
        (item_row(112, 5), "CONDITION_DELAY is not supported"),
        (item_row(114, 5), "CONDITION_DISTANCE is not supported"),
        (item_row(179, 1), "DO_SET_HOME is not supported"),
        (item_row(201, 0, 0, 0, 0, *PLACE), "DO_SET_ROI is not supported"),
        (item_row(JUMP, 1, -1), "DO_JUMP is not supported in a route; remove it, and give --laps"),
        (item_row(5001, 4, 0, 0, 0, *PLACE), "is not part of a route; the command fence sends it"),
        (item_row(5100, 0, 0, 0, 0, *PLACE), "is not part of a route; the command rally sends it"),
        ("1 0 3 16 0 0 0 0 47,398 8,546 12 1", "param 5, '47,398', is not a number; write a "),
        ("1 0 3 16 0 0 0 0 4_7 8.546 12 1", "param 5, '4_7', is not a number"),
        ("1 0 3 16.5 0 0 0 0 47 8 12 1", "the command, '16.5', is not an integer"),
        ("1 0 3 16 0 0 0 0 47 8 12 1 0", "13 columns instead of 12"),
    ],
)  # fmt: skip
def test_what_a_route_does_not_have_is_rejected_by_line_and_name(
    wpl_file: Path, line: str, sentence: str
) -> None:
    said = rejection(wpl_file, rows(HOME_ROW, line, SECOND_ROW))
    assert f"{wpl_file}: line 3: " in said
    assert sentence in said


def test_delays_of_other_meanings_are_rejected(wpl_file: Path) -> None:
    for lines, sentence in (
        ((item_row(DELAY, -1, 12, 30, 0),), "line 4: NAV_DELAY until a time of day"),
        ((item_row(DELAY, 0, 0, 0, 0),), "line 4: NAV_DELAY until a time of day"),
        ((item_row(YAW, 90), item_row(DELAY, 5)), "line 5: NAV_DELAY after CONDITION_YAW"),
        ((item_row(4501), item_row(SPEED, 1, 3)), "line 5: DO_CHANGE_SPEED at a CONDITION_GATE"),
    ):
        assert sentence in rejection(wpl_file, rows(HOME_ROW, FIRST_ROW, *lines, SECOND_ROW))


def test_speeds_are_changed_kept_and_set_back(wpl_file: Path) -> None:
    waypoint = item_row(WAYPOINT, 0, 0, 0, 0, *PLACE)
    route = read(
        wpl_file,
        numbered(
            waypoint, item_row(SPEED, 0, 3, -1), waypoint, item_row(SPEED, 1, -1, 0),
            waypoint, item_row(SPEED, 1, 4.5, math.nan, math.nan), waypoint,
            item_row(SPEED, 1, -2), waypoint, item_row(SPEED, 2, 8),
        ),
    )  # fmt: skip
    assert [waypoint.max_speed_m_s for waypoint in route.waypoints] == [0.0, 3.0, 3.0, 4.5, 0.0]
    assert route.notes == ("line 12: DO_CHANGE_SPEED after the last waypoint is skipped.",)


@pytest.mark.parametrize(
    ("items", "places"),
    [
        # As in plans of the UAV Testing Competition.
        ([(TAKEOFF, 47.3977, 8.5456, 10.0), (LAND, 47.3977, 8.5463, 0.0)], [(8.5463, 10.0)]),
        (
            [(WAYPOINT, 47.3977, 8.5456, 20.0), (LAND, 47.3977, 8.5463, 0.0)],
            [(8.5456, 20.0), (8.5463, 20.0)],
        ),
        ([(WAYPOINT, 47.3977, 8.5456, 20.0), (LAND, 47.3977, 8.5456, 0.0)], [(8.5456, 20.0)]),
        ([(WAYPOINT, 47.3977, 8.5456, 20.0), (LAND, 0.0, 0.0, 0.0)], [(8.5456, 20.0)]),
        ([(WAYPOINT, 47.3977, 8.5456, 20.0), (RTL, 47.3977, 8.5463, 0.0)], [(8.5456, 20.0)]),
    ],
    ids=["take-off", "elsewhere", "the same place", "no place", "return"],
)
def test_a_landing_elsewhere_is_flown_to(
    tmp_path: Path,
    items: list[tuple[int, float, float, float]],
    places: list[tuple[float, float]],
) -> None:
    text = plan(*(simple(command, place=place) for command, *place in items))  # type: ignore[arg-type]
    route = read(tmp_path / "a.plan", text)
    assert [waypoint.position[1:] for waypoint in route.waypoints] == places
    flown_to = "NAV_LAND is flown to, at the height before it; the vehicle holds at the end."
    assert (f"item 2: {flown_to}" in route.notes) is (len(places) == 2 or items[0][0] == TAKEOFF)


def test_a_route_may_end_with_loitering_landing_and_what_follows_it(wpl_file: Path) -> None:
    text = numbered(
        item_row(TAKEOFF, 0, 0, 0, 0, 0, 0, 30), FIRST_ROW,
        item_row(LOITER_UNLIM, 0, 0, 0, 90, *PLACE, autocontinue=0), item_row(4501),
        item_row(LAND), item_row(DELAY, 20), item_row(YAW, 90, 5),
    )  # fmt: skip
    first, last = read(wpl_file, text).waypoints
    assert (first.hold_time_s, last.hold_time_s) == (0.0, 0.0)
    assert last.yaw_enu_rad == pytest.approx(0.0)
    assert read(wpl_file, text).notes == (
        "line 3: take-off to 30 m skipped; on the ground the server takes off to takeoff_height_m.",
        "line 7: NAV_LAND is skipped; the vehicle holds at the end.",
        "line 8: NAV_DELAY after the last waypoint is skipped.",
        "line 9: CONDITION_YAW after the last waypoint is skipped.",
        "1 camera and gimbal items are skipped.",
    )


def test_the_content_of_a_file_decides_and_not_its_name(plan_file: Path, wpl_file: Path) -> None:
    assert read(plan_file, rows(HOME_ROW, FIRST_ROW)) == read(wpl_file, rows(HOME_ROW, FIRST_ROW))
    assert read(wpl_file, plan(simple())) == read(plan_file, plan(simple()))


def old_item(command: int = WAYPOINT, frame: int = 3) -> dict[str, Any]:
    """An item as QGroundControl 3.0 wrote it."""
    return {"type": "SimpleItem", "command": command, "frame": frame, "autoContinue": True,
            "params": [4, 0, 0, None], "coordinate": [47.1, 8.1, 20], "doJumpId": 1}  # fmt: skip


def test_items_with_a_coordinate_are_read(plan_file: Path) -> None:
    fence = {"polygon": [], "version": 1}
    text = plan(old_item(TAKEOFF), old_item(), old_item(RTL, frame=2), geoFence=fence)
    (waypoint,) = read(plan_file, text).waypoints
    assert (waypoint.position, waypoint.hold_time_s) == ((47.1, 8.1, 20.0), 4.0)
    assert len(read(plan_file, text).notes) == 2
    corners = {"polygon": [[47.0, 8.0], [47.0, 8.1], [47.1, 8.1]], "version": 1}
    assert "geoFence is not sent" in read(plan_file, plan(old_item(), geoFence=corners)).notes[0]


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        (plan({**old_item(), "coordinate": [47.1, 8.1]}), "item 1 does not have seven params, or"),
        (plan({**old_item(), "coordinate": [47.1, "x", 1]}), "item 1: param 6 is 'x'"),
        (plan({**old_item(), "coordinate": [47.1, 8.1, None]}), "item 1: the waypoint has no alti"),
        (plan({**simple(), "autoContinue": False}, simple()), "item 1: NAV_WAYPOINT has autocont"),
        (plan({**simple(), "autoContinue": 1}), "item 1: autoContinue is neither true nor false"),
        (plan(simple(SPEED, 2, 3), simple()), "item 1: DO_CHANGE_SPEED of the climb speed"),
        (
            plan({**simple(), "AltitudeMode": 3, "params": [0, 0, 0, None, 47.1, 8.1, None]}),
            "item 1: the waypoint has no altitude",
        ),
        (json.dumps({"MAV_AUTOPILOT": 3, "items": []}), "a mission file of QGroundControl 3.0"),
    ],
)
def test_a_plan_that_says_something_else_is_rejected(
    plan_file: Path, text: str, sentence: str
) -> None:
    assert sentence in rejection(plan_file, text)


def test_an_unreadable_file_is_rejected_in_one_sentence(tmp_path: Path) -> None:
    for path in (tmp_path / "none.plan", tmp_path):
        with pytest.raises(PlanError, match=str(path)):
            read_route(path)
    binary = tmp_path / "binary.plan"
    binary.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(PlanError, match="not a text file"):
        read_route(binary)
    large = tmp_path / "large.plan"
    with large.open("wb") as file:
        file.truncate(20_000_000)
    with pytest.raises(PlanError, match="larger than"):
        read_route(large)


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=8) | st.dictionaries(
        st.sampled_from(["type", "command", "frame", "params", "Items", "complexItemType",
                         "TransectStyleComplexItem"]), inner, max_size=5),
    max_leaves=20,
)  # fmt: skip


@given(items=JSON, kind=st.sampled_from(["SimpleItem", "ComplexItem"]))
def test_any_plan_gives_a_route_or_one_sentence(
    items: Any, kind: str, tmp_path_factory: pytest.TempPathFactory
) -> None:
    if isinstance(items, dict):
        items = [{"type": kind, **items}]
    path = tmp_path_factory.getbasetemp() / "any.plan"
    document = {"fileType": "Plan", "mission": {"items": items}}
    try:
        sentence = f"{len(read(path, json.dumps(document)).waypoints)} waypoints"
    except PlanError as error:
        sentence = str(error)
    assert sentence != "0 waypoints"
    assert "\n" not in sentence


CELLS = st.sampled_from(
    ["0", "1", "3", "16", "22", "93", "115", "178", "-1", "nan", "47.4", "8.5", "1e999", "x", "4,5"]
)


@given(lines=st.lists(st.lists(CELLS, min_size=11, max_size=13), max_size=4))
def test_any_waypoint_file_gives_a_route_or_one_sentence(
    lines: list[list[str]], tmp_path_factory: pytest.TempPathFactory
) -> None:
    path = tmp_path_factory.getbasetemp() / "any.waypoints"
    waypoints: tuple[WaypointRequest, ...] = ()
    sentence = ""
    try:
        waypoints = read(path, rows(HOME_ROW, *(" ".join(line) for line in lines))).waypoints
    except PlanError as error:
        sentence = str(error)
    assert bool(waypoints) != bool(sentence)
    assert "\n" not in sentence
    for waypoint in waypoints:
        numbers = (*waypoint.position, waypoint.hold_time_s, waypoint.max_speed_m_s)
        assert all(math.isfinite(number) for number in numbers)
