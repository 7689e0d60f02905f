"""The tables of the tasks' phases."""

from __future__ import annotations

import pytest

from navigation_core.tasks.flying.flight import SetpointFlight
from navigation_core.tasks.phased_task import PhasedTask
from navigation_core.tasks.phases import (
    FLIGHT,
    LED,
    MISSION,
    PLANE,
    STATUS,
    STOPPING,
    VELOCITY,
    Phase,
    PhaseError,
    Table,
    check_change,
)
from navigation_core.tasks.steering.steered_task import SteeredTask
from navigation_core.tasks.watching.mission import FlyMission
from navigation_core.tasks.watching.sent_plane import SentPlane
from navigation_core.tasks.watching.vehicle_led import VehicleLed

TASKS: dict[type[PhasedTask], Table] = {
    SetpointFlight: FLIGHT,
    FlyMission: MISSION,
    SentPlane: PLANE,
    VehicleLed: LED,
    SteeredTask: VELOCITY,
}


def reachable(table: Table, start: Phase) -> set[Phase]:
    """Return the phases that a task comes to from one of them."""
    reached: set[Phase] = set()
    new = {start}
    while new:
        reached |= new
        new = {after for phase in new for after in table.get(phase, ())} - reached
    return reached


def test_every_kind_of_task_has_its_own_table() -> None:
    assert {kind: kind.table for kind in PhasedTask.__subclasses__()} == TASKS
    assert set(STATUS) == set(Phase)


@pytest.mark.parametrize("table", TASKS.values(), ids=[kind.__name__ for kind in TASKS])
def test_every_phase_is_reached_and_leads_to_the_end_and_nothing_follows_that(table: Table) -> None:
    first = next(iter(table))
    assert reachable(table, first) == {*table, Phase.ENDED}
    for phase in table:
        assert Phase.ENDED in reachable(table, phase)
        if phase in STOPPING:
            assert reachable(table, phase) <= STOPPING, "a stop leads nowhere else"
        for after in set(Phase) - table[phase]:
            with pytest.raises(PhaseError, match=f"{after.name} cannot follow {phase.name}"):
                check_change(table, phase, after)
    for after in Phase:
        with pytest.raises(PhaseError):
            check_change(table, Phase.ENDED, after)
