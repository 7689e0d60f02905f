"""Acts at waypoints as clients send them: checked, and resolved into the map frame."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import pytest

from drone_navigation.message_forms.waypoint_messages import waypoint_message
from drone_navigation.server.conversions import _waypoint
from mavlink_vehicle.profiles import Profile, ardupilot, px4
from navigation_bridge.goals.act_requests import check_equipment, resolve_acts
from navigation_bridge.goals.requests import (
    ActKind,
    ActRequest,
    AltitudeReference,
    PointMode,
    WaypointRequest,
)
from navigation_bridge.goals.route_requests import check_waypoint
from navigation_core.outcomes import OutcomeCode
from navigation_core.tasks.inputs.waypoint_acts import (
    PointAngle,
    PointNeutral,
    PointPosition,
    SetServo,
    TakePhoto,
    TriggerDistance,
    UseGripper,
    WaitHere,
    WaypointAct,
)

PLACE = WaypointRequest((47.0, 8.0, 30.0), AltitudeReference.AMSL)
POINT = ActRequest(ActKind.POINT, pitch_rad=-0.5, yaw_rad=1.25, yaw_locked=True)
EACH = (
    ActRequest(ActKind.PHOTO, required=True),
    ActRequest(ActKind.TRIGGER_DISTANCE, distance_m=12.5),
    POINT,
    ActRequest(ActKind.POINT, point=PointMode.POSITION, target=(47.25, 8.5, 400.0)),
    ActRequest(ActKind.POINT, point=PointMode.NEUTRAL),
    ActRequest(ActKind.GRIPPER, grabs=True),
    ActRequest(ActKind.SERVO, channel=9, pulse_us=1500),
    ActRequest(ActKind.WAIT, duration_s=2.5),
)


def test_each_act_reaches_the_core_as_it_was_sent() -> None:
    sent = _waypoint(waypoint_message(replace(PLACE, acts=EACH)))
    assert sent.acts == EACH
    assert check_waypoint(sent) is None
    assert resolve_acts(sent, lambda place: (place[0] + 1.0, place[1], place[2])) == (
        WaypointAct(TakePhoto(), required=True),
        WaypointAct(TriggerDistance(12.5)),
        WaypointAct(PointAngle(-0.5, 1.25, yaw_locked=True)),
        WaypointAct(PointPosition((48.25, 8.5, 400.0))),
        WaypointAct(PointNeutral()),
        WaypointAct(UseGripper(grabs=True)),
        WaypointAct(SetServo(9, 1500)),
        WaypointAct(WaitHere(2.5)),
    )


@pytest.mark.parametrize(
    ("act", "code", "text"),
    [
        (ActRequest(None), OutcomeCode.INVALID_WAYPOINTS, "act 1 has an unknown kind"),
        (replace(EACH[1], distance_m=math.nan), OutcomeCode.INVALID_NUMBER, "distance is nan"),
        (replace(EACH[1], distance_m=-1.0), OutcomeCode.INVALID_WAYPOINTS, "distance is -1 m"),
        (replace(POINT, pitch_rad=math.inf), OutcomeCode.INVALID_NUMBER, "pitch is inf"),
        (replace(POINT, yaw_rad=math.nan), OutcomeCode.INVALID_NUMBER, "yaw is nan"),
        (replace(POINT, pitch_rad=1.6), OutcomeCode.INVALID_WAYPOINTS, "pitch is 1.6 rad"),
        (replace(POINT, yaw_rad=7.0), OutcomeCode.INVALID_WAYPOINTS, "yaw is 7 rad"),
        (replace(POINT, point=None), OutcomeCode.INVALID_WAYPOINTS, "point is unknown"),
        (
            replace(EACH[3], target=(47.0, math.nan, 1.0)),
            OutcomeCode.INVALID_NUMBER,
            "target.y is nan",
        ),
        (
            replace(EACH[3], target=(147.0, 8.0, 1.0)),
            OutcomeCode.INVALID_NUMBER,
            "not a position on earth",
        ),
        (replace(EACH[5], grabs=None), OutcomeCode.INVALID_WAYPOINTS, "gripper is unknown"),
        (replace(EACH[6], channel=0), OutcomeCode.INVALID_WAYPOINTS, "channel is 0"),
        (replace(EACH[6], pulse_us=3000), OutcomeCode.INVALID_WAYPOINTS, "pulse is 3000 us"),
        (replace(EACH[7], duration_s=math.nan), OutcomeCode.INVALID_NUMBER, "duration is nan"),
        (replace(EACH[7], duration_s=0.0), OutcomeCode.INVALID_WAYPOINTS, "duration is 0 s"),
    ],
)
def test_a_bad_act_is_rejected_with_its_number_and_field(
    act: ActRequest, code: OutcomeCode, text: str
) -> None:
    rejection = check_waypoint(replace(PLACE, acts=(act,)))
    assert rejection is not None
    assert rejection.code is code
    assert text in rejection.message
    assert rejection.message.startswith("act 1")


def test_ten_thousand_acts_at_a_waypoint_are_rejected() -> None:
    rejection = check_waypoint(replace(PLACE, acts=(EACH[0],) * 10_000))
    assert rejection is not None
    assert rejection.code is OutcomeCode.INVALID_WAYPOINTS
    assert "it has 10000 acts; send at most 20" in rejection.message


@pytest.mark.parametrize(
    ("profile", "act", "by_mission", "text"),
    [
        (px4.COPTER, EACH[6], False, "PX4 multicopter has 4 outputs"),
        (px4.COPTER, replace(EACH[6], channel=2), True, "by setpoints only"),
        (px4.COPTER, EACH[0], True, "required is for setpoints"),
        (ardupilot.PLANE, EACH[1], True, ""),
    ],
)
def test_what_a_kind_of_vehicle_cannot_do_is_rejected(
    profile: Profile, act: ActRequest, by_mission: bool, text: str
) -> None:
    waypoint = replace(PLACE, acts=(act,))
    rejection = check_equipment(waypoint, profile, {}, by_mission=by_mission)
    assert (rejection is None) == (not text)
    if rejection is not None:
        assert rejection.code is OutcomeCode.UNSUPPORTED_VEHICLE
        assert text in rejection.message


@pytest.mark.parametrize(
    ("act", "parameters", "text"),
    [
        (EACH[0], {"CAM1_TYPE": 0.0}, "no camera (CAM1_TYPE is 0)"),
        (POINT, {"MNT1_TYPE": 0.0}, "no gimbal (MNT1_TYPE is 0)"),
        (EACH[5], {"GRIP_ENABLE": 0.0}, "no gripper (GRIP_ENABLE is 0)"),
        (EACH[0], {"CAM1_TYPE": 1.0}, ""),
        (POINT, {}, ""),
        (EACH[6], {"CAM1_TYPE": 0.0, "MNT1_TYPE": 0.0, "GRIP_ENABLE": 0.0}, ""),
    ],
)
def test_what_the_vehicle_says_that_it_lacks_is_rejected(
    act: ActRequest, parameters: dict[str, Any], text: str
) -> None:
    rejection = check_equipment(replace(PLACE, acts=(act,)), ardupilot.COPTER, parameters)
    assert (rejection is None) == (not text)
    if rejection is not None:
        assert rejection.code is OutcomeCode.UNSUPPORTED_VEHICLE
        assert text in rejection.message
