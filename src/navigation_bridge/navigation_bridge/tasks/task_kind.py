"""The registration of a task: its action, request and admission."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, TypeVar

from navigation_bridge.goals.admitted import Admitted
from navigation_bridge.snapshot import LocatedSnapshot, Snapshot
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
        admit_anywhere: the same for a goal that needs no recent position; None where one is
            rejected without it.
    """

    action: str
    request: type[RequestT]
    admit: Callable[[RequestT, LocatedSnapshot], Admitted | Rejection]
    admit_anywhere: Callable[[RequestT, Snapshot], Admitted | Rejection] | None = None
