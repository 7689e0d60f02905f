"""The phases of the tasks that are flown: none may follow another beside its task's table."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from navigation_core.tasks.phased_task import PhasedTask
from navigation_core.tasks.phases import Phase

Changes = list[tuple[type[PhasedTask], Phase, Phase]]


@pytest.fixture(autouse=True)
def phases_flown(monkeypatch: pytest.MonkeyPatch) -> Iterator[Changes]:
    """Every change of a phase in a test, however it is written."""
    changes: Changes = []

    def write(task: PhasedTask, name: str, value: object) -> None:
        if isinstance(value, Phase) and name in vars(task):
            changes.append((type(task), task.phase, value))
        object.__setattr__(task, name, value)

    monkeypatch.setattr(PhasedTask, "__setattr__", write, raising=False)
    yield changes
    for kind, before, after in changes:
        assert after in kind.table[before], f"{kind.__name__}: {before.name} to {after.name}"
