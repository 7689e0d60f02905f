"""Items for cameras, gimbals, grippers and outputs in files of ground stations."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import pytest

from navigation_bridge.goals.requests import ActKind, ActRequest, PointMode
from navigation_bridge.plan_files.items import PlanError
from navigation_bridge.plan_files.routes import PlannedRoute, parse_route

PHOTO = ActRequest(ActKind.PHOTO)
NAN = math.nan
HOME_ROW = "0\t1\t0\t16\t0\t0\t0\t0\t47.3977\t8.5456\t488\t1"
PLACE = (47.398, 8.546, 12.0)


def row(command: int, *params: float, frame: int = 3) -> tuple[int, int, tuple[float, ...]]:
    return command, frame, (*params, *([0.0] * (7 - len(params))))


WAYPOINT = row(16, 0, 0, 0, 0, *PLACE)


def route(*rows: tuple[int, int, Sequence[float]]) -> PlannedRoute:
    lines = ["QGC WPL 110", HOME_ROW]
    for number, (command, frame, params) in enumerate(rows, start=1):
        numbers = "\t".join(str(value) for value in params)
        lines.append(f"{number}\t0\t{frame}\t{command}\t{numbers}\t1")
    return parse_route("\n".join(lines))


@pytest.mark.parametrize(
    ("item", "act"),
    [
        (row(203, 0, 0, 0, 0, 1), PHOTO),
        (row(2000, 0, 0, 1), PHOTO),
        (row(206, 12.5, 0, 1), ActRequest(ActKind.TRIGGER_DISTANCE, distance_m=12.5)),
        (row(206, 0), ActRequest(ActKind.TRIGGER_DISTANCE)),
        (
            row(1000, -90, 90, NAN, NAN, 12),
            ActRequest(ActKind.POINT, pitch_rad=-math.pi / 2, yaw_rad=-math.pi / 2),
        ),
        (
            row(1000, -45, 90, 0, 0, 28),
            ActRequest(ActKind.POINT, pitch_rad=-math.pi / 4, yaw_rad=0.0, yaw_locked=True),
        ),
        (row(1000, 0, 0, NAN, NAN, 2), ActRequest(ActKind.POINT, point=PointMode.NEUTRAL)),
        (row(205, -90, 0, 0, 0, 0, 0, 2), ActRequest(ActKind.POINT, pitch_rad=-math.pi / 2)),
        (row(205, 0, 0, 0, 0, 0, 0, 1), ActRequest(ActKind.POINT, point=PointMode.NEUTRAL)),
        (
            row(195, 0, 0, 0, 0, 47.4, 8.5, 3),
            ActRequest(ActKind.POINT, point=PointMode.POSITION, target=(47.4, 8.5, 3.0)),
        ),
        (row(197), ActRequest(ActKind.POINT, point=PointMode.NEUTRAL)),
        (row(211, 1, 1), ActRequest(ActKind.GRIPPER, grabs=True)),
        (row(183, 9, 1500), ActRequest(ActKind.SERVO, channel=9, pulse_us=1500)),
    ],
)
def test_an_item_is_an_act_of_the_waypoint_before_it(
    item: tuple[int, int, tuple[float, ...]], act: ActRequest
) -> None:
    read = route(WAYPOINT, item, WAYPOINT)
    first, last = read.waypoints
    (found,) = first.acts
    assert last.acts == ()
    assert read.notes == ()
    assert (found.pitch_rad, found.yaw_rad) == pytest.approx((act.pitch_rad, act.yaw_rad))
    assert replace(found, pitch_rad=act.pitch_rad, yaw_rad=act.yaw_rad) == act


def test_one_before_the_first_waypoint_is_done_there_and_said() -> None:
    read = route(row(22, 0, 0, 0, 0, 0, 0, 30), row(2000, 0, 0, 1), WAYPOINT, row(206, 3))
    (waypoint,) = read.waypoints
    assert waypoint.acts == (PHOTO, ActRequest(ActKind.TRIGGER_DISTANCE, distance_m=3.0))
    assert "line 4: IMAGE_START_CAPTURE is done at the first waypoint." in read.notes


def test_a_delay_between_acts_keeps_its_place() -> None:
    (waypoint,) = route(WAYPOINT, row(93, 4), row(2000, 0, 0, 1), row(93, 6)).waypoints
    assert waypoint.hold_time_s == 4.0
    assert waypoint.acts == (PHOTO, ActRequest(ActKind.WAIT, duration_s=6.0))


@pytest.mark.parametrize(
    "item",
    [
        row(203, 1),
        row(2000, 0, 2, 0),
        row(2001),
        row(1000, -90, NAN, NAN, NAN, 12),
        row(1000, -90, 0, 5, 5, 12),
        row(205, 0, 0, 0, 0, 0, 0, 4),
        row(1001, -2, -2, -1, -1),
    ],
)
def test_what_no_act_expresses_is_left_out_and_counted(
    item: tuple[int, int, tuple[float, ...]],
) -> None:
    read = route(WAYPOINT, item, WAYPOINT)
    assert read.waypoints[0].acts == ()
    assert read.notes == ("1 camera and gimbal items are skipped.",)


def test_one_after_a_return_and_one_at_a_gate_are_left_out() -> None:
    photo = row(2000, 0, 0, 1)
    read = route(WAYPOINT, row(4501), photo, WAYPOINT, row(20), photo)
    assert [waypoint.acts for waypoint in read.waypoints] == [(), ()]
    assert "3 camera and gimbal items are skipped." in read.notes


@pytest.mark.parametrize(
    ("item", "text"),
    [
        (row(206, -3), "line 4: the distance (param 1) is -3"),
        (row(206, NAN), "line 4: DO_SET_CAM_TRIGG_DIST: the distance (param 1) is nan"),
        (row(211, 1, 7), "line 4: DO_GRIPPER has action 7"),
        (row(183, 0, 1500), "line 4: DO_SET_SERVO of output 0"),
        (row(183, 9, NAN), "line 4: DO_SET_SERVO: the pulse (param 2) is nan"),
        (row(195, 0, 0, 0, 0, NAN, 8, 1), "line 4: DO_SET_ROI_LOCATION has no position"),
        (row(195, 0, 0, 0, 0, 47, 8, 1, frame=0), "line 4: its MAV_FRAME 0 is not that of the way"),
    ],
)
def test_an_act_without_a_meaning_is_rejected_by_line(
    item: tuple[int, int, tuple[float, ...]], text: str
) -> None:
    with pytest.raises(PlanError) as caught:
        route(WAYPOINT, item, WAYPOINT)
    assert text in str(caught.value)
