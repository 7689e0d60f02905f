"""The server's goal for one of `follow_object`."""

from __future__ import annotations

import pytest

pytest.importorskip("nav2_msgs", reason="nav2_msgs is not built: run make setup-nav2")

from nav2_msgs import action

from custom_interfaces.action import Follow
from drone_navigation.nav2.behaviours import follow_client_goal
from drone_navigation.nav2.navigators import Preferences
from drone_navigation.nav2.targets import TargetError

pytestmark = pytest.mark.skipif(
    not hasattr(action, "FollowObject"), reason="nav2_msgs 1.5 has it: --nav2-form 1.5"
)
PREFERENCES = Preferences(0.0, 3.0, True, 0.2, 5.0, 4.0)


def test_the_object_is_followed_behind_and_above_it() -> None:
    request = action.FollowObject.Goal(pose_topic="/person", tracked_frame="unused")
    request.max_duration.sec = 60
    goal = follow_client_goal(request, PREFERENCES).goal
    assert isinstance(goal, Follow.Goal)
    assert (goal.pose_topic, goal.tracked_frame) == ("/person", "")
    assert (goal.max_duration, goal.max_speed) == (60.0, 3.0)
    assert (goal.offset.x, goal.offset.z, goal.offset_frame) == (-5.0, 4.0, goal.OFFSET_TARGET)
    request.pose_topic = ""
    goal = follow_client_goal(request, PREFERENCES).goal
    assert isinstance(goal, Follow.Goal)
    assert goal.tracked_frame == "unused"


def test_a_negative_duration_is_rejected() -> None:
    request = action.FollowObject.Goal(tracked_frame="person")
    request.max_duration.sec = -1
    with pytest.raises(TargetError):
        follow_client_goal(request, PREFERENCES)
