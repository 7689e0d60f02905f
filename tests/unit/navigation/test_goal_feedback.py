"""The messages with a goal's feedback."""

from __future__ import annotations

import pytest
from builtin_interfaces.msg import Time

from drone_navigation.server.actions import ACTIONS, ActionKind
from navigation_bridge.goals.goal import GoalFeedback
from navigation_bridge.vehicle.map_frame import MapPose
from navigation_core.tasks.progress import (
    FollowProgress,
    FollowState,
    OrbitProgress,
    RouteProgress,
    Status,
)

_POSE = MapPose((1.0, 2.0, 3.0), 0.5, (0.0, 0.0, 0.25, 0.97))
_FULL = GoalFeedback(
    "0" * 32, _POSE, 12.0, 6.0, 0.8, Status.NAVIGATING, 3.0,
    RouteProgress(1, 1, 2, 1), OrbitProgress(0.5, 0.1),
    FollowProgress(FollowState.LOST, 4.0, 1.5, (5.0, 6.0, 7.0)), 3, 0.2, (1.0, 2.0, 0.5), "fence",
)  # fmt: skip
_EMPTY = GoalFeedback("0" * 32, None, 0.0, 0.0, None, Status.HOLDING)


@pytest.mark.parametrize("kind", ACTIONS, ids=lambda kind: kind.name)
def test_a_message_that_is_written_again_keeps_nothing(kind: ActionKind) -> None:
    again, fresh = kind.type.Feedback(), kind.type.Feedback()
    kind.feedback(again, _FULL, Time(sec=1), "map")
    assert again != fresh
    kind.feedback(again, _EMPTY, Time(sec=2), "odom")
    kind.feedback(fresh, _EMPTY, Time(sec=2), "odom")
    # Numbers that are unknown are NaN, which equals nothing.
    assert str(again) == str(fresh)
