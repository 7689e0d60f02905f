"""Trouble at each transition of each task ends as docs/transitions.md says, without a violation."""

from __future__ import annotations

import pytest

from navigation_core.outcomes import OutcomeCode
from tests.explore.transitions import FIRMWARES, TASKS, Cell, cells, fly_cell, on_page, troubles

pytestmark = pytest.mark.wide

# Each of these is flown by day, from a place in the order of the page that differs by task.
_EVERY = 41
_TASKS = [pytest.param(f, t, id=f"{f} {t}") for f in FIRMWARES for t in TASKS]


def _is_as_on_the_page(cell: Cell) -> None:
    seen = fly_cell(cell)
    assert not seen.violations
    assert seen.code == on_page()[cell.firmware, cell.task, cell.status.value, cell.trouble]


@pytest.mark.parametrize(("firmware", "task"), _TASKS)
def test_some_cells_of_each_task(firmware: str, task: str) -> None:
    first = list(TASKS).index(task) * 7
    for cell in cells(firmware, task)[first % _EVERY :: _EVERY]:
        _is_as_on_the_page(cell)


@pytest.mark.night
@pytest.mark.parametrize(("firmware", "task"), _TASKS)
def test_all_cells_of_each_task(firmware: str, task: str) -> None:
    for cell in cells(firmware, task):
        _is_as_on_the_page(cell)


def test_the_page_has_all_tasks_and_troubles_and_codes_that_exist() -> None:
    page = on_page()
    assert {task for _, task, _, _ in page} == set(TASKS)
    for firmware in FIRMWARES:
        assert {t for f, _, _, t in page if f == firmware} == set(troubles(firmware))
    codes = {code.value for code in OutcomeCode}
    assert set(page.values()) <= codes | {"no end", "-"}
    assert "INTERNAL_ERROR" not in page.values()
