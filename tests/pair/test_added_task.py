"""The task that docs/tasks.md adds: flown from the page."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Any

import pytest

from custom_interfaces.action import Navigate
from drone_navigation.server.actions import action_of
from navigation_bridge.goals.lifecycle import GoalState
from navigation_bridge.tasks.registry import TASKS, task_of
from navigation_bridge.tasks.task_kind import TaskKind
from navigation_core.outcomes import OutcomeCode
from tests.support.flights.simulated_flight import SimulatedFlight

PAGE = Path(__file__).parents[2] / "docs" / "tasks.md"
LINES_MAX = 28
CENTRE = (20.0, 5.0, 10.0)
AWAY_M = 8.0


@pytest.fixture(scope="module")
def inspect() -> TaskKind[Any]:
    """The task as the page has it."""
    code = re.findall(r"```python\n(.*?)```", PAGE.read_text("utf-8"), re.DOTALL)[0]
    written = [line for line in code.splitlines() if line.strip()]
    assert len(written) <= LINES_MAX
    names: dict[str, Any] = {"__name__": "inspect"}
    exec(compile(code, str(PAGE), "exec"), names)
    kind = names["INSPECT"]
    assert isinstance(kind, TaskKind)
    return kind


def goal() -> Navigate.Goal:
    message = Navigate.Goal()
    message.target_pose.header.frame_id = "map"
    position = message.target_pose.pose.position
    position.x, position.y, position.z = CENTRE
    message.max_speed = 3.0
    return message


def test_it_is_served_as_an_action_of_its_own(inspect: TaskKind[Any]) -> None:
    action = action_of(inspect)
    assert (action.name, action.type) == ("inspect", Navigate)
    request = action.request(goal())
    assert type(request) is inspect.request
    assert task_of(request, (*TASKS, inspect)) is inspect


def test_it_looks_at_the_point_from_all_sides(inspect: TaskKind[Any]) -> None:
    flight = SimulatedFlight(tasks=(*TASKS, inspect)).ready()
    goal_id = flight.start(action_of(inspect).request(goal()))
    flight.run_to_status(goal_id, "NAVIGATING")
    sides: dict[int, float] = {}
    while not flight.ends(goal_id):
        flight.run_for(0.25)
        pose = flight.bridge.pose
        assert pose is not None
        east_m, north_m = pose.position_enu_m[0] - CENTRE[0], pose.position_enu_m[1] - CENTRE[1]
        if flight.truth()[1] > 0.2 or abs(math.hypot(east_m, north_m) - AWAY_M) > 0.7:
            continue  # on its way there
        outward = math.atan2(north_m, east_m)
        off_rad = abs(math.remainder(pose.yaw_enu_rad - outward - math.pi, math.tau))
        side = round(math.degrees(outward) / 90.0) % 4
        sides[side] = min(sides.get(side, math.inf), off_rad)
    end = flight.ends(goal_id)[0]
    assert (end.state, end.code) == (GoalState.SUCCEEDED, OutcomeCode.SUCCESS), end.message
    assert len(sides) == 4, "it did not look from each side"
    assert max(sides.values()) < math.radians(10.0)


def test_what_it_may_not_do_is_rejected(inspect: TaskKind[Any]) -> None:
    flight = SimulatedFlight(tasks=(*TASKS, inspect)).ready()
    far = goal()
    far.target_pose.pose.position.x = 1e5
    rejection = flight.check(action_of(inspect).request(far))
    assert rejection is not None
    assert rejection.code is OutcomeCode.OUTSIDE_VOLUME
