"""Trouble at each transition of each task, flown one by one; and the page that shows it.

``python -m tests.explore.transitions`` flies every cell and writes the tables of
docs/transitions.md. A cell is a task of one firmware that enters a status, and trouble that begins
at that moment. Every policy of exploration is checked in each flight.
"""

from __future__ import annotations

import argparse
import itertools
import multiprocessing
import re
import sys
from collections.abc import Iterable, Iterator, Mapping
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from navigation_bridge.goals.goal import GoalFeedback, GoalFinished
from navigation_core.tasks.progress import Status
from tests.explore.check import Checker
from tests.explore.log import Asked, Entry
from tests.explore.run import fly
from tests.explore.scenario import Craft, Event, Scenario

PAGE = Path(__file__).parents[2] / "docs" / "transitions.md"
FIRMWARES = {"ardupilot": "ArduCopter", "px4": "PX4"}
_UP = Event(0.0, 0, "navigate", {"place": [6.0, 0.0, 6.0]})
# A vehicle that stands at the end of the flight up, whatever the firmware.
_LATER_S = 45.0
_ROUTE = {"places": [[8.0, 0.0, 4.0], [8.0, 8.0, 4.0]], "hold_s": 1.0}
_MARK = {"mark": [1.0, 1.0], "retries": 1}
_TARGET = {
    "start": [20.0, 0.0, 0.0], "velocity": [1.0, 0.0, 0.0], "offset": [-8.0, 0.0, 6.0],
    "duration": 12.0,
}  # fmt: skip
_ORBIT = {"centre": [10.0, 0.0], "radius": 5.0, "height": 5.0, "speed": 2.0}

# The copters land on targets, and a stick takes a PX4 from OFFBOARD, too.
_ONBOARD = {"ardupilot": {"PLND_ENABLED": 1.0, "PLND_TYPE": 1.0}, "px4": {"COM_RC_OVERRIDE": 3.0}}

TASKS: Mapping[str, tuple[Event, ...]] = {
    "Takeoff": (Event(0.0, 0, "takeoff", {"height": 4.0}),),
    "Navigate": (Event(0.0, 0, "navigate", {"place": [12.0, 0.0, 4.0]}),),
    "NavigateWaypoints by setpoints": (Event(0.0, 0, "route", _ROUTE),),
    "NavigateWaypoints by a mission": (Event(0.0, 0, "route", {**_ROUTE, "mission": True}),),
    "Orbit": (Event(0.0, 0, "orbit", _ORBIT),),
    "Follow": (_UP, Event(_LATER_S, 0, "follow", _TARGET)),
    "Land": (_UP, Event(_LATER_S, 0, "land")),
    "Land on a target": (_UP, Event(_LATER_S, 0, "land", _MARK)),
    "ReturnToLaunch": (_UP, Event(_LATER_S, 0, "go_home")),
}
"""The last event of each is the goal that is watched."""

_MODES = {"ardupilot": ("LOITER", "RTL"), "px4": ("POSCTL", "AUTO.RTL")}


def _for_a_while(what: str, begin: dict[str, object], end: dict[str, object], s: float) -> Steps:
    return ((0.0, what, begin), (s, what, end))


Steps = tuple[tuple[float, str, dict[str, object]], ...]
"""Seconds after the transition, an action of `happenings`, its arguments."""


def troubles(firmware: str) -> dict[str, Steps]:
    """Return what may happen at a transition, by name."""
    by_pilot, by_station = _MODES[firmware]
    return {
        "none": (),
        "cancel": ((0.0, "cancel", {}),),
        "another goal": ((0.0, "navigate", {"place": [0.0, 8.0, 5.0]}),),
        "pause for 10 s": ((0.0, "pause", {}), (10.0, "resume", {})),
        "the pilot takes over": ((0.0, "pilot_mode", {"mode": by_pilot}),),
        "the pilot moves a stick for 1 s": _for_a_while(
            "pilot_stick", {"forward": 0.6}, {"forward": 0.0}, 1.0
        ),
        "a station sends it home": ((0.0, "station_mode", {"mode": by_station}),),
        "a station disarms it": ((0.0, "station_arm", {"arm": False}),),
        "a station clears its mission": ((0.0, "station_clear", {}),),
        "a station sends another mission": ((0.0, "station_upload", {"count": 3}),),
        "a station moves it": ((0.0, "station_goto", {"north_m": 15.0, "height_m": 8.0}),),
        "no GPS for 20 s": _for_a_while("gps", {"lost": True}, {"lost": False}, 20.0),
        "GPS wrong by 15 m for 10 s": _for_a_while(
            "glitch", {"offset": [15.0, 0.0, 0.0]}, {"offset": [0.0, 0.0, 0.0]}, 10.0
        ),
        "the estimate stuck for 5 s": _for_a_while("stuck", {"on": True}, {"on": False}, 5.0),
        "no link for 2 s": _for_a_while("silence", {"on": True}, {"on": False}, 2.0),
        "no link for 20 s": _for_a_while("silence", {"on": True}, {"on": False}, 20.0),
        "nothing gets there for 20 s": _for_a_while("full", {"on": True}, {"on": False}, 20.0),
        "the radio lost for 20 s": _for_a_while("radio", {"lost": True}, {"lost": False}, 20.0),
        "battery at 5 %": ((0.0, "battery", {"share": 0.05}),),
        "a gust of 14 m/s for 5 s": _for_a_while(
            "wind", {"velocity": [0.0, 14.0, 0.0]}, {"velocity": [0.0, 0.0, 0.0]}, 5.0
        ),
        "the autopilot restarts": ((0.0, "reboot", {}),),
        "the server stands still for 3 s": ((0.0, "stall", {"seconds": 3.0}),),
        "the server is asked to end": ((0.0, "shut_down", {}),),
        "the server is killed for 10 s": ((0.0, "kill", {}), (10.0, "start", {})),
    }


@dataclass(frozen=True)
class Cell:
    """One flight.

    Attributes:
        firmware: "ardupilot" or "px4".
        task: name of a task.
        status: which it enters for the first time.
        after_s: how long after its acceptance.
        trouble: name of what happens then.
    """

    firmware: str
    task: str
    status: Status
    after_s: float
    trouble: str

    def scenario(self) -> Scenario:
        """Return what happens in it."""
        events = TASKS[self.task]
        begins_s = events[-1].time_s + self.after_s
        steps = troubles(self.firmware)[self.trouble]
        happening = [Event(begins_s + s, 0, what, dict(how)) for s, what, how in steps]
        # The flight goes on for longer than any trouble lasts, and than a failsafe takes.
        rest = Event(begins_s + 60.0, 0, "link")
        return _scenario(self.firmware, (*events, *happening, rest))


@dataclass(frozen=True)
class Seen:
    """The end of a flight: its code, "no end" without one, and the violated policies."""

    cell: Cell
    code: str
    violations: tuple[str, ...] = ()


def _scenario(firmware: str, events: tuple[Event, ...]) -> Scenario:
    craft = Craft("copter", firmware, onboard=_ONBOARD[firmware], sticks=firmware == "px4")
    return Scenario(1, (craft,), events)


def cells(firmware: str, task: str) -> list[Cell]:
    """Return all cells of a task: it is flown to see which statuses it enters, and when."""
    events = TASKS[task]
    entries = fly(_scenario(firmware, events)).entries
    goal_id, accepted_s = _watched(entries)
    entered: dict[Status, float] = {}
    for entry in entries:
        if isinstance(entry.value, GoalFeedback) and entry.value.goal_id == goal_id:
            entered.setdefault(entry.value.status, entry.time_s - accepted_s)
    return [
        Cell(firmware, task, status, round(after_s, 3), trouble)
        for status, after_s in entered.items()
        for trouble in troubles(firmware)
    ]


def fly_cell(cell: Cell) -> Seen:
    """Fly a cell."""
    scenario = cell.scenario()
    checker = Checker(scenario)
    entries = fly(scenario, checker.take).entries
    goal_id, _ = _watched(entries, len(TASKS[cell.task]))
    codes = [
        entry.value.code.value
        for entry in entries
        if isinstance(entry.value, GoalFinished) and entry.value.goal_id == goal_id
    ]
    code = ", ".join(codes) or "no end"
    return Seen(
        cell, code, tuple(f"{v.policy} at {v.time_s:.1f} s" for v in checker.found.values())
    )


def _watched(entries: Iterable[Entry], number: int | None = None) -> tuple[str, float]:
    """Return the id of the watched goal, and when it was accepted."""
    asked = [entry for entry in entries if isinstance(entry.value, Asked)]
    entry = asked[-1 if number is None else number - 1]
    return entry.value.goal_id, entry.time_s


def flown(workers: int, wanted: Iterable[str]) -> Iterator[Seen]:
    """Fly all cells with this trouble, in order."""
    pairs = list(itertools.product(FIRMWARES, TASKS))
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(workers, mp_context=context) as pool:
        for some in pool.map(cells, *zip(*pairs, strict=True)):
            yield from pool.map(fly_cell, [c for c in some if c.trouble in wanted], chunksize=4)


def main() -> int:
    """Fly all; write the page, or fail with what was violated."""
    parser = argparse.ArgumentParser(
        prog="python -m tests.explore.transitions", description=__doc__
    )
    parser.add_argument("--workers", type=int, default=2, help="processes (default: 2)")
    names = list(troubles("ardupilot"))
    parser.add_argument(
        "--trouble", action="append", choices=names, metavar="ROW",
        help="fly these rows only, and keep the others of the page; may be repeated",
    )  # fmt: skip
    options = parser.parse_args()
    seen: list[Seen] = []
    for one in flown(options.workers, options.trouble or names):
        seen.append(one)
        if one.violations:
            print(f"{_name(one.cell)}: {one.code}; {'; '.join(one.violations)}", flush=True)
        if sys.stderr.isatty() or len(seen) % 100 == 0:
            end = "\r" if sys.stderr.isatty() else "\n"
            print(f"{len(seen)} flights, {one.cell.task}   ", end=end, file=sys.stderr)
    codes = on_page() if options.trouble else {}
    for one in seen:
        cell = one.cell
        codes[cell.firmware, cell.task, cell.status.value, cell.trouble] = one.code
    head = PAGE.read_text("utf-8").split("\n## ")[0].rstrip()
    PAGE.write_text(f"{head}\n\n{tables(codes)}", "utf-8")
    return 1 if any(one.violations for one in seen) else 0


def _name(cell: Cell) -> str:
    return f"{FIRMWARES[cell.firmware]}, {cell.task}, {cell.status.value}, {cell.trouble}"


def tables(codes: Mapping[tuple[str, str, str, str], str]) -> str:
    """Return the tables of the page, one for each task: rows of trouble, columns of statuses.

    Args:
        codes: by firmware, task, status and trouble, as `on_page`.
    """
    tasks: dict[str, dict[str, dict[str, dict[str, str]]]] = {}
    for (firmware, task, status, trouble), code in codes.items():
        row = tasks.setdefault(task, {}).setdefault(trouble, {})
        row.setdefault(status, {})[firmware] = code
    parts = []
    for task, rows in tasks.items():
        statuses = list(dict.fromkeys(status for row in rows.values() for status in row))
        lines = [f"## {task}", "", "| | " + " | ".join(statuses) + " |",
                 "|---|" + "---|" * len(statuses)]  # fmt: skip
        for trouble, row in rows.items():
            lines.append(
                f"| {trouble} | " + " | ".join(_told(row.get(s, {})) for s in statuses) + " |"
            )
        parts.append("\n".join(lines) + "\n")
    return "\n".join(parts)


def _told(by_firmware: Mapping[str, str]) -> str:
    """Return the codes of both firmwares in one cell, or the one that they share."""
    both = [by_firmware.get(firmware, "-") for firmware in FIRMWARES]
    return both[0] if both[0] == both[1] else " / ".join(both)


def on_page() -> dict[tuple[str, str, str, str], str]:
    """Return the code of each cell of the page by firmware, task, status and trouble."""
    found = {}
    for part in PAGE.read_text().split("\n## ")[1:]:
        task, _, table = part.partition("\n")
        rows = [re.findall(r"(?<=\|)[^|]*(?=\|)", line) for line in table.strip().splitlines()]
        statuses = [word.strip() for word in rows[0][1:]]
        for row in rows[2:]:
            for status, words in zip(statuses, row[1:], strict=True):
                codes = words.strip().split(" / ")
                for firmware, code in zip(FIRMWARES, codes * (3 - len(codes)), strict=True):
                    found[firmware, task.strip(), status, row[0].strip()] = code
    return found


if __name__ == "__main__":
    raise SystemExit(main())
