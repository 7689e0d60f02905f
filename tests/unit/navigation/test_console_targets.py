"""Targets that a page names, as goals of the actions, and their feedback as the page's value."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from custom_interfaces.action import Follow, Land
from drone_navigation.console.goals.goal_messages import action_goal, landing
from drone_navigation.console.messages import PageCommand, PageFollow
from drone_navigation.console.page_values import feedback
from navigation_bridge.names import FOLLOW_ACTION_NAME


@pytest.mark.parametrize(
    ("source", "name", "sent"),
    [
        ("topic", "/target", ("/target", "", 0)),
        ("frame", "tag", ("", "tag", 0)),
        ("system", "12", ("", "", 12)),
    ],
)
def test_each_source_is_sent_with_its_offset(
    source: str, name: str, sent: tuple[str, str, int]
) -> None:
    asked = PageFollow("/", source, name, -10.0, 2.0, 5.0, 3.0, 4.0, in_map=False)
    action, goal, waypoints = action_goal(asked)
    assert (action, waypoints) == (FOLLOW_ACTION_NAME, ())
    assert isinstance(goal, Follow.Goal)
    assert (goal.pose_topic, goal.tracked_frame, goal.target_system) == sent
    assert (goal.offset.x, goal.offset.y, goal.offset.z) == (-10.0, 2.0, 5.0)
    assert goal.offset_frame == Follow.Goal.OFFSET_TARGET
    assert (goal.least_distance, goal.max_speed) == (3.0, 4.0)
    _, goal, _ = action_goal(replace(asked, in_map=True))
    assert isinstance(goal, Follow.Goal)
    assert goal.offset_frame == Follow.Goal.OFFSET_MAP


def test_a_landing_has_its_target_or_nothing_at_all() -> None:
    asked = PageCommand("/", "land", 0.0, " /target ", target_required=True, retries=2)
    goal = landing(asked)
    assert (goal.target_topic, goal.target_required, goal.retries) == ("/target", True, 2)
    # The server rejects retries without a target.
    assert landing(replace(asked, target_topic=" ")) == Land.Goal()


def test_the_feedback_has_the_state_and_the_distance_of_the_target() -> None:
    told = Follow.Feedback(distance=math.nan, target_age=math.inf, current_status="NAVIGATING")
    told.target_position.x = math.nan
    shown = feedback(FOLLOW_ACTION_NAME, told)
    assert shown["target"] == {"state": "ACQUIRING", "at": None, "distance": None, "age": None}
    assert shown["distance"] is None
    told = Follow.Feedback(state=Follow.Feedback.LOST, distance=6.84, target_age=3.2)
    told.target_position.x, told.target_position.y = 4.0, -2.5
    assert feedback(FOLLOW_ACTION_NAME, told)["target"] == {
        "state": "LOST",
        "at": [4.0, -2.5, 0.0],
        "distance": 6.8,
        "age": 3.2,
    }
