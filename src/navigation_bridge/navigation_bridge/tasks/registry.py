"""The tasks that the server offers. A new one is added to :data:`TASKS`, and nowhere else."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from navigation_bridge.goals.requests import Request
from navigation_bridge.tasks.follow_target import FOLLOW_TARGET
from navigation_bridge.tasks.follow_trajectory import FOLLOW_TRAJECTORY
from navigation_bridge.tasks.follow_velocity import FOLLOW_VELOCITY
from navigation_bridge.tasks.land_and_return import LAND, RETURN_TO_LAUNCH
from navigation_bridge.tasks.navigate import NAVIGATE, TAKEOFF
from navigation_bridge.tasks.navigate_waypoints import NAVIGATE_WAYPOINTS
from navigation_bridge.tasks.orbit import ORBIT
from navigation_bridge.tasks.task_kind import TaskKind

TASKS: tuple[TaskKind[Any], ...] = (
    NAVIGATE,
    NAVIGATE_WAYPOINTS,
    ORBIT,
    TAKEOFF,
    LAND,
    RETURN_TO_LAUNCH,
    FOLLOW_TARGET,
    FOLLOW_VELOCITY,
    FOLLOW_TRAJECTORY,
)


def task_of(request: Request, tasks: Sequence[TaskKind[Any]]) -> TaskKind[Any]:
    """Return the task of a request.

    Raises:
        LookupError: no task has requests of this type.
    """
    for task in tasks:
        if task.request is type(request):
            return task
    raise LookupError(f"No task is registered for a {type(request).__name__}.")
