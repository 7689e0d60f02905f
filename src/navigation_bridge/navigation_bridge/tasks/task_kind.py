"""The registration of a task: its action, request and admission."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, TypeVar

from navigation_bridge.goals.admitted import Admitted, Situation
from navigation_core.safety.target_checks import Rejection

RequestT = TypeVar("RequestT")


@dataclass(frozen=True)
class TaskKind(Generic[RequestT]):
    """One served task.

    Attributes:
        action: name of its action.
        request: type of its requests, which no other task has. Its base among those of
            ``goals/requests.py`` decides the type of the action.
        admit: returns the admitted goal, or the first reason for rejection.
        needs_position: whether a goal is rejected while the vehicle has no position.
    """

    action: str
    request: type[RequestT]
    admit: Callable[[RequestT, Situation], Admitted | Rejection]
    needs_position: bool = True
