"""Poses of Nav2's clients as targets: frames, headings, and the height that z = 0 means."""

from __future__ import annotations

import math

import pytest
from action_msgs.msg import GoalStatus

from custom_interfaces.action import Navigate
from custom_interfaces.msg import GoalCode
from drone_navigation.client.events import Ended
from drone_navigation.nav2.outcomes import aborted, ended, result
from drone_navigation.nav2.targets import HeightRule, Present, TargetError, map_target, turns
from mavlink_vehicle.profiles.profile import VehicleKind

COPTER = HeightRule.of(VehicleKind.COPTER, 0.0)
EAST = (0.0, 0.0, 0.0, 1.0)
NORTH = (0.0, 0.0, math.sqrt(0.5), math.sqrt(0.5))
NONE = (0.0, 0.0, 0.0, 0.0)


def at(z: float, *, ground_m: float = 0.0, target_m: float | None = None) -> Present:
    return Present((1.0, 2.0, z), math.pi / 2.0, ground_m, target_m)


# --- the height -----------------------------------------------------------------------


@pytest.mark.parametrize(
    ("present", "wanted_m", "height_m"),
    [
        (at(12.0), 0.0, 12.0),  # in flight: its own
        (at(12.0), 20.0, 20.0),  # three-dimensional clients are taken at their word
        (at(12.0), 1.0, 3.0),  # but not below the least
        (at(12.0), -5.0, 3.0),
        (at(0.1), 0.0, 3.0),  # on the ground: it takes off
        (at(42.0, ground_m=40.0), 0.0, 43.0),  # counted from the ground, not from the map's zero
        (at(-8.0, ground_m=-10.0), 0.0, -7.0),
        (at(11.8, target_m=12.0), 0.0, 12.0),  # goals in a row do not let it drift
        (at(8.0, target_m=12.0), 0.0, 8.0),  # but one on its way up or down stays where it is
    ],
)
def test_a_goal_without_a_height_keeps_it_and_never_leads_to_the_ground(
    present: Present, wanted_m: float, height_m: float
) -> None:
    assert COPTER.height_m(wanted_m, present) == pytest.approx(height_m)


def test_a_hundred_goals_without_a_height_do_not_let_a_vehicle_drift() -> None:
    target_m: float | None = None
    own_m = 10.0
    for number in range(100):
        target_m = COPTER.height_m(0.0, at(own_m, target_m=target_m))
        own_m = target_m + (-0.3 if number % 3 else 0.2)
    assert target_m == 10.0


def test_the_least_height_is_a_parameter_and_higher_for_planes() -> None:
    assert HeightRule.of(VehicleKind.COPTER, 7.0).height_m(0.0, at(0.0)) == 7.0
    assert HeightRule.of(VehicleKind.PLANE, 0.0).height_m(0.0, at(0.0)) == 30.0
    assert HeightRule.of(VehicleKind.OTHER, 0.0).height_m(0.0, at(0.0)) == 3.0


@pytest.mark.parametrize("kind", [VehicleKind.ROVER, VehicleKind.BOAT])
def test_what_drives_stays_on_the_ground(kind: VehicleKind) -> None:
    rule = HeightRule.of(kind, 0.0)
    assert rule.height_m(0.0, at(40.3, ground_m=40.0)) == 40.0
    assert rule.height_m(5.0, at(40.3, ground_m=40.0)) == 5.0  # the server rejects it


@pytest.mark.parametrize("wrong", [math.nan, math.inf, -math.inf])
def test_what_is_not_finite_is_left_to_the_server_to_reject(wrong: float) -> None:
    height_m = COPTER.height_m(wrong, at(5.0))
    assert not math.isfinite(height_m)


# --- frames and headings --------------------------------------------------------------


@pytest.mark.parametrize("frame", ["map", ""])
def test_a_pose_in_the_map_is_taken_as_it_is(frame: str) -> None:
    target = map_target(frame, (5.0, 6.0, 7.0), NORTH, at(4.0), COPTER)
    assert target.position_enu_m == (5.0, 6.0, 7.0)
    assert target.yaw_enu_rad == pytest.approx(math.pi / 2.0)


def test_a_pose_ahead_of_a_vehicle_that_faces_north_is_north_of_it() -> None:
    target = map_target("base_link", (5.0, 1.0, 0.0), NORTH, at(4.0), COPTER)
    assert target.position_enu_m == pytest.approx((0.0, 7.0, 4.0))
    assert abs(target.yaw_enu_rad or 0.0) == pytest.approx(math.pi)
    above = map_target("base_link", (0.0, 0.0, 2.0), EAST, at(4.0), COPTER)
    assert above.position_enu_m == pytest.approx((1.0, 2.0, 6.0))
    below = map_target("base_link", (0.0, 0.0, -50.0), EAST, at(4.0), COPTER)
    assert below.position_enu_m[2] == 3.0


def test_no_rotation_means_the_direction_of_travel() -> None:
    assert map_target("map", (1.0, 1.0, 5.0), NONE, at(4.0), COPTER).yaw_enu_rad is None


@pytest.mark.parametrize(
    ("frame", "orientation", "code"),
    [
        ("odometry", EAST, "UNKNOWN_FRAME"),
        ("wgs84", EAST, "UNKNOWN_FRAME"),
        ("map", (0.0, 0.0, 0.0, 2.0), "INVALID_ORIENTATION"),
        ("map", (0.0, math.sqrt(0.5), 0.0, math.sqrt(0.5)), "INVALID_ORIENTATION"),
        ("map", (math.nan, 0.0, 0.0, 1.0), "INVALID_ORIENTATION"),
    ],
)
def test_what_is_no_pose_is_rejected_with_a_sentence(
    frame: str, orientation: tuple[float, float, float, float], code: str
) -> None:
    with pytest.raises(TargetError, match=f"^{code}: .*; send .*\\.$"):
        map_target(frame, (1.0, 1.0, 5.0), orientation, at(4.0), COPTER)


@pytest.mark.parametrize("turn_rad", [0.1, 1.57, -1.57, 3.2, -6.28, 15.0])
def test_a_turn_of_any_size_goes_its_way_round(turn_rad: float) -> None:
    before, turned = 2.5, 0.0
    for yaw in turns(2.5, turn_rad):
        step = math.remainder(yaw - before, 2.0 * math.pi)
        assert step * turn_rad > 0.0
        turned, before = turned + step, yaw
    assert turned == pytest.approx(turn_rad)


# --- ends -----------------------------------------------------------------------------


def end(state: str, code: str) -> Ended:
    return Ended(1, state, code, f"{code}: Words.", False, (0.0, 0.0, 0.0), 1.0, 0.1, None, None)


@pytest.mark.parametrize(
    ("state", "code", "cancelled", "status"),
    [
        ("SUCCEEDED", "SUCCESS", False, GoalStatus.STATUS_SUCCEEDED),
        ("SUCCEEDED", "SUCCESS", True, GoalStatus.STATUS_SUCCEEDED),  # it was there first
        ("CANCELED", "CANCELED", True, GoalStatus.STATUS_CANCELED),
        ("CANCELED", "CANCELED", False, GoalStatus.STATUS_ABORTED),  # a station cancelled it
        ("ABORTED", "PILOT_OVERRIDE", False, GoalStatus.STATUS_ABORTED),
        ("ABORTED", "PILOT_OVERRIDE", True, GoalStatus.STATUS_ABORTED),
        ("ABORTED", "FAILSAFE_BATTERY", False, GoalStatus.STATUS_ABORTED),
    ],
)
def test_an_end_of_the_server_is_reported_with_its_code_and_sentence(
    state: str, code: str, cancelled: bool, status: int
) -> None:
    outcome = ended(end(state, code), cancelled=cancelled)
    assert outcome.status == status
    assert outcome.code == getattr(GoalCode, code)
    assert outcome.message == ("" if code == "SUCCESS" else f"{code}: Words.")


def test_a_rejection_has_the_code_of_its_sentence_or_one_of_nav2() -> None:
    assert aborted("OUTSIDE_VOLUME", "Too far.").code == GoalCode.OUTSIDE_VOLUME
    assert aborted("NO_PATH", "None.", 208).code == 208
    codes = [v for k, v in vars(type(GoalCode)).items() if k.isupper() and isinstance(v, int)]
    assert all(code < 100 for code in codes), "Nav2's own begin at 100"


def test_a_result_carries_code_and_sentence() -> None:
    class Result:
        error_code, error_msg, success = 0, "", True

    message = result(Result, aborted("BUSY", "Busy."))
    assert (message.error_code, message.error_msg) == (GoalCode.BUSY, "BUSY: Busy.")
    assert not message.success
    assert not hasattr(Navigate.Result(), "error_msg"), "the server's own is called message"
