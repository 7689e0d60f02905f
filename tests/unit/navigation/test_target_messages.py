"""LANDING_TARGET of a camera as a pose for ROS."""

from __future__ import annotations

import math
from typing import Any

import pytest

from drone_navigation.navigation_target import main, target_pose
from mavlink_vehicle.codec import make, mavlink

NOW_NS = 1_700_000_000_500_000_000
PICTURE_US = 1_700_000_000_400_000


def report(**changed: Any) -> mavlink.MAVLink_landing_target_message:
    fields: dict[str, Any] = {
        "time_usec": PICTURE_US,
        "frame": mavlink.MAV_FRAME_BODY_FRD,
        "x": 1.0,
        "y": 2.0,
        "z": 3.0,
        "position_valid": 1,
    }
    message = make("LANDING_TARGET", **{**fields, **changed})
    assert isinstance(message, mavlink.MAVLink_landing_target_message)
    return message


def test_a_position_is_along_forward_left_and_up_at_the_time_of_the_picture() -> None:
    pose = target_pose(report(), "base_link", NOW_NS)
    assert pose is not None
    place, turn = pose.pose.position, pose.pose.orientation
    assert (place.x, place.y, place.z) == (1.0, -2.0, -3.0)
    assert (turn.w, turn.x, turn.y, turn.z) == (0.0, 0.0, 0.0, 0.0)
    assert pose.header.frame_id == "base_link"
    assert (pose.header.stamp.sec, pose.header.stamp.nanosec) == (1_700_000_000, 400_000_000)


@pytest.mark.parametrize("time_usec", [0, 5_000_000, PICTURE_US + 200_000])
def test_a_time_of_another_clock_is_replaced_by_that_of_the_arrival(time_usec: int) -> None:
    pose = target_pose(report(time_usec=time_usec), "base_link", NOW_NS)
    assert pose is not None
    assert (pose.header.stamp.sec, pose.header.stamp.nanosec) == (1_700_000_000, 500_000_000)


@pytest.mark.parametrize(
    "changed",
    [
        {"position_valid": 0},
        {"frame": mavlink.MAV_FRAME_LOCAL_NED},
        {"x": math.nan},
        {"z": math.inf},
    ],
    ids=str,
)
def test_what_has_no_position_of_the_vehicle_is_not_published(changed: dict[str, Any]) -> None:
    assert target_pose(report(**changed), "base_link", NOW_NS) is None


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["--system", "0"], "a MAVLink system id is 1 to 255, not '0'"),
        (["--system", "x"], "a MAVLink system id is 1 to 255, not 'x'"),
        (["--link", "nonsense"], "'nonsense' is not a link."),
    ],
)
def test_a_wrong_option_gets_a_sentence(
    words: list[str], sentence: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as ending:
        main(words)
    assert ending.value.code == 2
    assert sentence in capsys.readouterr().err
