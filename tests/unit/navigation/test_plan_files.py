"""Files of ground stations, and what is said about those that cannot be flown."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from navigation_bridge.goals.plan_files import PlanError, PlannedRoute, read_plan, read_waypoints
from navigation_bridge.goals.requests import AltitudeReference

AMSL, HOME, GROUND = AltitudeReference.AMSL, AltitudeReference.HOME, AltitudeReference.GROUND
WAYPOINT, LOITER_TIME, RTL, LAND, TAKEOFF, DELAY = 16, 19, 20, 21, 22, 93
YAW, JUMP, SPEED, MOUNT = 115, 177, 178, 205


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
    return read_plan(path) if path.suffix == ".plan" else read_waypoints(path)


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


def test_a_survey_is_flown_by_the_items_it_contains(plan_file: Path) -> None:
    transects = {"Items": [simple(), simple(MOUNT), simple()]}
    survey = {
        "type": "ComplexItem",
        "complexItemType": "survey",
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
        ("", "line 1: not valid JSON"),
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
    with pytest.raises(PlanError) as caught:
        read(plan_file, text)
    message = str(caught.value)
    assert sentence in message
    assert str(plan_file) in message
    assert message.endswith(".")
    assert "\n" not in message


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
        ("", "line 1: a waypoint file must begin with 'QGC WPL 110'"),
        ("QGC WPL 120\n", "line 1"),
        ("QGC WPL 110\n", "no waypoint"),
        (f"{WPL}4\t0\t3\n", "line 7: 3 columns instead of 12"),
        (WPL.replace("\t270\t", "\tx\t"), "line 6: could not convert"),
        (WPL.replace("\t270\t", "\tnan\t").replace("47.399", "nan"), "line 6: the waypoint has no"),
    ],
)
def test_an_unusable_waypoint_file_is_rejected_in_one_sentence(
    wpl_file: Path, text: str, sentence: str
) -> None:
    with pytest.raises(PlanError, match=r"^[^\n]*$") as caught:
        read(wpl_file, text)
    assert sentence in str(caught.value)


def test_an_unreadable_file_is_rejected_in_one_sentence(tmp_path: Path) -> None:
    for path in (tmp_path / "none.plan", tmp_path):
        with pytest.raises(PlanError, match=str(path)):
            read_plan(path)
    binary = tmp_path / "binary.plan"
    binary.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(PlanError, match="not a text file"):
        read_plan(binary)
    large = tmp_path / "large.plan"
    with large.open("wb") as file:
        file.truncate(20_000_000)
    with pytest.raises(PlanError, match="larger than"):
        read_plan(large)


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
