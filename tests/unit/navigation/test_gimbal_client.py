"""The command line of `navigation_client point`."""

from __future__ import annotations

import math

import pytest

from drone_navigation.client.options import make_command_parser
from drone_navigation.client.payload.gimbal import point_goal


def test_each_way_to_point_is_a_mode_of_the_goal() -> None:
    down = point_goal(make_command_parser("point").parse_args(["--angle", "-90", "45"]))
    assert (down.mode, down.yaw_locked) == (down.ANGLE, False)
    assert (down.pitch, down.yaw) == pytest.approx((-math.pi / 2, math.pi / 4))
    at = point_goal(make_command_parser("point").parse_args(["--at", "1", "2", "3"]))
    assert (at.mode, at.target.header.frame_id) == (at.POINT, "map")
    assert (at.target.point.x, at.target.point.y, at.target.point.z) == (1.0, 2.0, 3.0)
    other = point_goal(make_command_parser("point").parse_args(["--system", "7"]))
    assert (other.mode, other.system_id) == (other.VEHICLE, 7)
    none = point_goal(make_command_parser("point").parse_args(["--release"]))
    assert none.mode == none.NONE


@pytest.mark.parametrize(
    "arguments",
    [[], ["--angle", "nan", "0"], ["--system", "0"], ["--angle", "1", "2", "--release"]],
)
def test_a_bad_command_line_is_rejected(arguments: list[str]) -> None:
    with pytest.raises(SystemExit):
        make_command_parser("point").parse_args(arguments)
