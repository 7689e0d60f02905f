"""Acts at waypoints of a page: checked, sent, written into plans and read from them."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from typing import Any

import pytest

from custom_interfaces.action import NavigateWaypoints
from custom_interfaces.msg import ImageCaptured, WaypointAct
from drone_navigation.console import plans
from drone_navigation.console.goals.goal_messages import action_goal
from drone_navigation.console.messages import PageGoal, RejectedError, parse
from drone_navigation.console.page_types import HomeValue
from drone_navigation.console.payload.photos import Photos
from drone_navigation.console.shown_values import ShownValues
from tests.support.messages.random_console_messages import FLY

HOME = HomeValue(latitude=-35.3632621, longitude=149.1652374, altitude=584.0, at=[1.0, 2.0, 0.5])
ACTS: list[dict[str, Any]] = [
    {"kind": "photo"},
    {"kind": "distance", "metres": 5.0},
    {"kind": "point", "up": -45.0, "right": 30.0},
    {"kind": "neutral"},
    {"kind": "wait", "seconds": 2.5},
    {"kind": "grab"},
    {"kind": "release"},
]


def ordered(acts: list[Any]) -> PageGoal:
    waypoint = {"x": 1.0, "y": 2.0, "z": 5.0, "hold": 0.0, "acts": acts}
    order = parse(json.dumps({**FLY, "waypoints": [waypoint], "radius": 0.0}))
    assert isinstance(order, PageGoal)
    return order


def test_a_single_waypoint_with_acts_is_a_route_that_has_them_in_order() -> None:
    _, goal, _ = action_goal(ordered(ACTS))
    assert isinstance(goal, NavigateWaypoints.Goal)
    photo, distance, point, neutral, wait, grab, release = goal.waypoints[0].acts
    assert photo.kind == WaypointAct.PHOTO
    assert (distance.kind, distance.distance) == (WaypointAct.TRIGGER_DISTANCE, 5.0)
    assert (point.kind, point.point) == (WaypointAct.POINT, WaypointAct.POINT_ANGLE)
    # To the right is clockwise.
    assert (point.pitch, point.yaw) == pytest.approx((math.radians(-45.0), math.radians(-30.0)))
    assert not point.yaw_locked
    assert (neutral.kind, neutral.point) == (WaypointAct.POINT, WaypointAct.POINT_NEUTRAL)
    assert (wait.kind, wait.duration) == (WaypointAct.WAIT, 2.5)
    assert (grab.kind, grab.gripper) == (WaypointAct.GRIPPER, WaypointAct.GRIPPER_GRAB)
    assert release.gripper == WaypointAct.GRIPPER_RELEASE
    assert not any(act.required for act in goal.waypoints[0].acts)


def test_a_route_turns_to_the_right_and_a_circle_does_not() -> None:
    order = replace(ordered([]), turn_deg_s=20.0)
    _, goal, _ = action_goal(order)
    assert isinstance(goal, NavigateWaypoints.Goal)
    assert goal.yaw_rate == pytest.approx(-math.radians(20.0))
    asked = parse(json.dumps({**FLY, "turn": -90.0}))
    assert isinstance(asked, PageGoal)
    assert asked.turn_deg_s == -90.0
    for wrong in ({"turn": 181.0}, {"turn": "fast"}, {"turn": 5.0, "radius": 8.0}):
        with pytest.raises(RejectedError):
            parse(json.dumps({**FLY, **wrong}))


@pytest.mark.parametrize(
    "act",
    [
        {}, {"kind": "jump"}, {"kind": "photo", "metres": 1.0}, {"kind": "distance"},
        {"kind": "distance", "metres": -1.0}, {"kind": "point", "up": -91.0, "right": 0.0},
        {"kind": "point", "up": 0.0}, {"kind": "wait", "seconds": 0.0}, "photo", None,
    ],
    ids=str,
)  # fmt: skip
def test_a_bad_act_is_rejected(act: Any) -> None:
    with pytest.raises(RejectedError, match=r"acts\[0\]"):
        ordered([act])


def test_more_acts_than_a_waypoint_may_have_are_rejected() -> None:
    with pytest.raises(RejectedError, match="21 items"):
        ordered(21 * [{"kind": "photo"}])


@pytest.mark.parametrize("autopilot", ["ArduCopter", "PX4 multicopter"])
def test_acts_are_written_into_a_plan_and_read_again(autopilot: str) -> None:
    (waypoint,) = ordered(ACTS).waypoints
    text = plans.make_plan([waypoint, waypoint], autopilot, HOME)
    items = json.loads(text)["mission"]["items"]
    assert [item["doJumpId"] for item in items] == list(range(1, len(items) + 1))
    found, notes = plans.map_waypoints(text, autopilot, HOME)
    assert [each["acts"] for each in found] == [ACTS, ACTS]
    assert not notes


def test_acts_that_the_page_has_not_are_reported() -> None:
    text = plans.make_plan(ordered(ACTS[:1]).waypoints, "ArduCopter", HOME)
    plan = json.loads(text)
    servo = {**plan["mission"]["items"][1], "command": 183, "params": [9, 1500, 0, 0, 0, 0, 0]}
    plan["mission"]["items"].append({**servo, "doJumpId": 3})
    found, notes = plans.map_waypoints(json.dumps(plan), "ArduCopter", HOME)
    assert found[0]["acts"] == ACTS[:1]
    assert any(note.startswith("Servo outputs, ") for note in notes)


def test_photos_are_shown_where_they_were_taken() -> None:
    board = ShownValues()
    photos = Photos(board, "/")
    taken = ImageCaptured(success=True, latitude=-35.3632621, longitude=149.1652374, altitude=590.0)
    photos.hear(taken)  # nobody knows yet where the map lies
    assert board.get("/", "photos") is None
    board.put("/", "status", {"autopilot": "ArduCopter"})
    board.put("/", "home", HOME)
    photos.hear(taken)
    photos.hear(ImageCaptured(success=False, latitude=-35.0, longitude=149.0))
    photos.hear(ImageCaptured(success=True, latitude=math.nan, longitude=149.0))
    assert board.get("/", "photos") == [[1.0, 2.0]]
