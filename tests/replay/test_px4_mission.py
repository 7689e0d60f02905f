"""The recorded mission of the real PX4, cleared in flight, played into the simulated one."""

from __future__ import annotations

import functools
from pathlib import Path
from typing import Any

from mavlink_sitl.compare import (
    Conversation,
    acknowledgements,
    landed_states,
    load,
    mission_acknowledgements,
    modes,
    replay,
)

RECORDING = Path(__file__).parent / "data" / "px4_mission_clear.tlog"
FIELDS = ("seq", "total", "mission_state", "mission_mode")


@functools.cache
def flight() -> Conversation:
    return replay(load(RECORDING))


def test_every_command_and_mission_is_answered_as_the_real_one_answered() -> None:
    assert acknowledgements(flight().ours) == acknowledgements(flight().real)
    assert mission_acknowledgements(flight().ours) == mission_acknowledgements(flight().real)


def test_modes_and_landed_states_come_in_the_same_order() -> None:
    assert modes(flight().ours) == modes(flight().real)
    assert landed_states(flight().ours) == landed_states(flight().real)


def test_items_are_asked_for_given_back_and_reached_in_the_same_order() -> None:
    def of(messages: list[tuple[float, Any]]) -> list[object]:
        found: list[object] = []
        for _, m in messages:
            kind = m.get_type()
            if kind in ("MISSION_REQUEST_INT", "MISSION_ITEM_REACHED"):
                event = (kind, m.seq)
                if not found or found[-1] != event:
                    found.append(event)
        return found

    assert of(flight().ours) == of(flight().real)


def test_the_items_read_back_are_the_recorded_ones() -> None:
    def of(messages: list[tuple[float, Any]]) -> list[str]:
        return [str(m) for _, m in messages if m.get_type() == "MISSION_ITEM_INT"]

    assert of(flight().ours) == of(flight().real)


def test_mission_current_goes_through_the_same_states() -> None:
    def of(messages: list[tuple[float, Any]]) -> list[tuple[int, ...]]:
        found: list[tuple[int, ...]] = []
        for _, m in messages:
            if m.get_type() == "MISSION_CURRENT":
                values = tuple(int(getattr(m, field)) for field in FIELDS)
                if not found or found[-1] != values:
                    found.append(values)
        return found

    assert of(flight().ours) == of(flight().real)
