"""Draw docs/states.md: state diagrams, drawn from the transition tables of the code.

`python scripts/draw_states.py` writes the page; a test holds it equal to the tables.
"""

from __future__ import annotations

import argparse
from collections import defaultdict
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from mavlink_vehicle.protocols.machine import Machine
from mavlink_vehicle.protocols.message_rates import MessageRates
from mavlink_vehicle.protocols.mission.mission_clear import MissionClear
from mavlink_vehicle.protocols.mission.mission_download import MissionDownload
from mavlink_vehicle.protocols.mission.mission_operation import MissionOperation
from mavlink_vehicle.protocols.mission.mission_upload import MissionUpload
from mavlink_vehicle.protocols.monitoring.heartbeat import HeartbeatWatch
from mavlink_vehicle.protocols.operations.command import CommandExchange
from mavlink_vehicle.protocols.operations.operations import Operation
from mavlink_vehicle.protocols.streams.setpoint_stream import SetpointStream
from mavlink_vehicle.storage.list_operation import ListOperation
from navigation_bridge.goals import lifecycle
from navigation_core.planning import replanner
from navigation_core.tasks import phases

PAGE = Path(__file__).resolve().parents[1] / "docs/states.md"
_Arrows = dict[tuple[str, str], list[str]]
_INTRODUCTION = """\
# State diagrams

Drawn by `scripts/draw_states.py` from the transition tables of the code. An input that a table does
not list for a state is a program error, and raises.
"""
TASKS: dict[str, phases.Table] = {
    "Flight to a point or along a route": phases.FLIGHT,
    "Mission flown by the vehicle": phases.MISSION,
    "Flight of a plane to its targets": phases.PLANE,
    "Landing or return by the vehicle": phases.LED,
    "Velocity commands": phases.VELOCITY,
}
MACHINES: dict[str, type[Machine[Any]]] = {
    "Operation": Operation,
    "Command": CommandExchange,
    "Mission upload": MissionUpload,
    "Mission download": MissionDownload,
    "Mission clearing": MissionClear,
    "Stored mission": MissionOperation,
    "Stored list": ListOperation,
    "HEARTBEAT": HeartbeatWatch,
    "Message rates": MessageRates,
    "Setpoint stream": SetpointStream,
}


def diagrams() -> dict[str, tuple[str, _Arrows]]:
    """Return what is drawn: headings, the module of the table, and the events by both states."""
    tasks = {
        "Life cycle of a goal": (lifecycle.__name__, _of_events(lifecycle.TRANSITIONS)),
        **{task: (phases.__name__, _of_states(table)) for task, table in TASKS.items()},
        "Replanning": (replanner.__name__, _of_events(replanner.TRANSITIONS)),
    }
    machines = {
        heading: (machine.__module__, _of_events(machine.table))
        for heading, machine in MACHINES.items()
    }
    return tasks | machines


def page() -> str:
    """Return the text of the page."""
    parts = [_INTRODUCTION]
    for heading, (module, arrows) in diagrams().items():
        lines = [
            f"    {before} --> {after}" + (f": {', '.join(events)}" if events else "")
            for (before, after), events in arrows.items()
        ]
        drawn = "\n".join(["stateDiagram-v2", *lines])
        parts.append(f"## {heading}\n\n`{module}`\n\n```mermaid\n{drawn}\n```\n")
    return "\n".join(parts)


def _of_events(table: Mapping[Any, Any]) -> _Arrows:
    """Put the events together that lead from one state to the same other one."""
    arrows: _Arrows = defaultdict(list)
    for (state, event), target in table.items():
        after = target[0] if isinstance(target, tuple) else target
        arrows[state.name, after.name].append(event.name)
    return arrows


def _of_states(following: phases.Table) -> _Arrows:
    """Return arrows without events, in the order in which the states are declared."""
    return {
        (before.name, after.name): []
        for before, all_after in following.items()
        for after in sorted(all_after, key=lambda phase: int(phase.value))
    }


if __name__ == "__main__":
    argparse.ArgumentParser(description="Write docs/states.md from the tables.").parse_args()
    PAGE.write_text(page(), encoding="utf-8")
