"""Results and feedback have all that the installed nav2_msgs defines, in any of its forms."""

from __future__ import annotations

import math
from typing import Any

import pytest
from action_msgs.msg import GoalStatus
from geometry_msgs.msg import PoseStamped

from custom_interfaces.msg import GoalCode
from drone_navigation.nav2.outcomes import SUCCEEDED, Nav2Outcome, aborted, result

pytest.importorskip("nav2_msgs", reason="nav2_msgs is not built: run make setup-nav2")

from nav2_msgs import action

from drone_navigation.nav2 import forms
from tests.support.ros.nav2_client import route

MISSED = Nav2Outcome(
    GoalStatus.STATUS_ABORTED, GoalCode.WAYPOINT_MISSED, "WAYPOINT_MISSED: Two were.", (1,)
)


def poses(count: int = 3) -> list[PoseStamped]:
    """Different poses."""
    found = [PoseStamped() for _ in range(count)]
    for index, each in enumerate(found):
        each.pose.position.x = float(index)
    return found


def test_the_installed_form_is_served() -> None:
    assert forms.too_old() is None


def test_poses_of_a_route_are_those_that_were_sent() -> None:
    for kind, field in (
        (action.NavigateThroughPoses, "poses"),
        (action.ComputePathThroughPoses, "goals"),
    ):
        goal = kind.Goal(**{field: route(poses())})
        assert list(forms.poses_of(getattr(goal, field))) == poses()


@pytest.mark.parametrize("kind", [action.FollowWaypoints, action.FollowGPSWaypoints])
def test_a_missed_waypoint_has_its_index_and_the_code_of_the_goal(kind: Any) -> None:
    message = kind.Result()
    pose = poses()[2] if kind is action.FollowWaypoints else None
    forms.add_missed(message, 2, MISSED, pose)
    (missed,) = message.missed_waypoints
    fields = missed.get_fields_and_field_types()
    values = {name.removeprefix("waypoint_"): getattr(missed, name) for name in fields}
    assert (values["index"], values["error_code"]) == (2, GoalCode.WAYPOINT_MISSED)
    assert values.get("status", 3) == 3
    assert values.get("error_msg", MISSED.message) == MISSED.message
    assert (values["pose"] if "pose" in values else values["goal"]) == (pose or PoseStamped())


@pytest.mark.parametrize(
    ("passed", "outcome", "states"),
    [
        (1, None, ["COMPLETED", "PENDING", "PENDING"]),
        (2, SUCCEEDED, ["COMPLETED", "COMPLETED", "COMPLETED"]),
        (2, aborted("LINK_LOST", "It was."), ["COMPLETED", "COMPLETED", "FAILED"]),
        (3, MISSED, ["COMPLETED", "FAILED", "COMPLETED"]),
    ],
)
def test_each_pose_of_a_route_has_its_state_where_the_messages_have_room(
    passed: int, outcome: Nav2Outcome | None, states: list[str]
) -> None:
    kind = action.NavigateThroughPoses
    message = kind.Feedback() if outcome is None else kind.Result()
    forms.show_waypoints(message, poses(), passed, outcome)
    fields = message.get_fields_and_field_types()
    found = getattr(message, "waypoint_statuses", None)
    assert (found is None) == ("waypoint_statuses" not in fields)
    for each, state in zip(found or (), states, strict=found is not None):
        assert each.waypoint_status == getattr(each, state)
        assert bool(each.error_msg) == (state == "FAILED")


def test_errors_of_tracking_are_given_where_the_feedback_has_them() -> None:
    feedback = action.NavigateToPose.Feedback()
    has_them = "position_tracking_error" in feedback.get_fields_and_field_types()
    path = [(0.0, 0.0, 5.0), (10.0, 0.0, 5.0)]
    # Beside the path to the left, and turned to the right of it.
    forms.show_tracking(feedback, (4.0, 0.5, 5.0), math.radians(-10.0), lambda: path)
    found = [getattr(feedback, f"{what}_tracking_error", None) for what in ("position", "heading")]
    assert found == ([0.5, pytest.approx(math.radians(10.0))] if has_them else [None, None])


def test_numbers_that_nav2_uses_itself_become_its_unknown() -> None:
    made = result(action.NavigateToPose.Result, aborted("PREEMPTED", "By another."))
    own = hasattr(action.NavigateToPose.Result, "GOAL_REJECTED")
    assert made.error_code == (made.UNKNOWN if own else GoalCode.PREEMPTED)
    assert made.error_msg == "PREEMPTED: By another."
    made = result(action.NavigateToPose.Result, aborted("NO_PATH", "None."))
    assert made.error_code == GoalCode.NO_PATH
    assert result(action.NavigateToPose.Result, SUCCEEDED).error_code == 0
