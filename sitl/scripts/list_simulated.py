"""Writes the pages that list what the simulated firmwares know: `make pages`.

All comes from the tables that the simulator answers by, so a page is never older than the code;
tests/unit/test_command_pages.py holds them equal.
"""

from __future__ import annotations

import inspect
import math
import re
import sys
import textwrap
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

from mavlink_sitl import Simulation, VehicleConfig
from mavlink_sitl.autopilot.personality import Personality
from mavlink_sitl.autopilot.personality.parameters import whole_list
from mavlink_sitl.autopilot.plans.plan_commands import NAMES
from mavlink_sitl.autopilot.plans.plan_rules import PX4_DEVICES
from mavlink_sitl.autopilot.plans.plans import Cmd, PlanType
from mavlink_sitl.config import PERSONALITIES
from mavlink_sitl.exchange import Result
from mavlink_sitl.mavlink import commands, kind_commands
from mavlink_sitl.mavlink.codec import dialect
from mavlink_sitl.mavlink.messages import known_messages
from mavlink_sitl.mavlink.px4 import commands as px4_commands
from mavlink_sitl.mavlink.px4 import rates as px4_messages

ROOT = Path(__file__).resolve().parents[1]
PARAMETERS = ROOT / "docs/parameters.md"
VEHICLES = ("copter", "rover", "boat", "plane")
FIRMWARES = {"ardupilot": "ArduPilot", "px4": "PX4"}
ACTS, ACCEPTED, REFUSED, SILENT, ABSENT = "acts", "accepted", "rejected", "silent", "-"
NAMELESS = ("", "(Mode not available)")
Answers = Mapping[int, tuple[Callable[..., Any], int]]

_HEAD = """\
# Commands, modes, messages and mission items of the simulated {title}

Written by `make pages` from the simulator's own tables. [sitl]({about}) explains the lists;
[missions](missions.md) says how items are flown.

## Commands

As COMMAND_LONG or COMMAND_INT. **acts**: it has an effect; what it needs may be missing, then it is
rejected. **accepted**: acknowledged by its parameters, and nothing happens, as for a camera that is
not there. **rejected**: known, and always rejected. **silent**: no answer. **-** and all others:
UNSUPPORTED.

"""
_MODES = """
## Modes

By their `custom_mode`. **flown**; **listed**: in AVAILABLE_MODES, but not flown here.

"""
_SENT = """
## Messages sent

**sent**: comes unrequested, at its SET_MESSAGE_INTERVAL or after REQUEST_MESSAGE, where there is
something to report. **known**: an interval is accepted, and nothing comes. **-** and all others are
rejected.

"""
_HEARD = """
## Messages understood

"""
_ITEMS = """
## Mission items

**taken** in an upload, or **-**: rejected, as are all others.

"""


def acting(personality: Personality) -> list[str]:
    """The names of the parameters that have an effect."""
    return list(personality.parameter_table.acting)


def other_defaults(personality: Personality) -> list[tuple[str, float, float]]:
    """Parameters whose default is not the real simulator's: name, ours, theirs."""
    ours = personality.parameter_table.specs
    return [
        (spec.name, ours[spec.name].default, spec.default)
        for spec in whole_list(personality.whole)
        if not math.isclose(ours[spec.name].default, spec.default, rel_tol=1e-6)
    ]


def parameter_tables(personalities: Iterable[Personality]) -> str:
    """One section for each personality."""
    return "\n".join(line for each in personalities for line in _section(each))


def _section(personality: Personality) -> list[str]:
    names, table = acting(personality), personality.parameter_table
    others = other_defaults(personality)
    lines = [f"## {personality.name}", ""]
    lines += textwrap.wrap(f"Of {len(table.listed)} act {len(names)}: {', '.join(names)}.", 100)
    rows = [f"| {name} | {ours:g} | {theirs:g} |" for name, ours, theirs in others]
    return [*lines, "", "| Other default | Here | Real |", "|---|---|---|", *rows, ""]


def table(head: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    """A table of Markdown."""
    titles = list(head)
    lines = [titles, ["---"] * len(titles), *map(list, rows)]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def name_of(enum: str, number: int) -> str:
    """The name of an entry without the enum's own."""
    entry = dialect.enums[enum].get(number)
    return f"{number}" if entry is None else str(entry.name).removeprefix(f"{enum}_")


def answers(autopilot: str, personality: Personality) -> Answers:
    """The commands that a vehicle answers, by number."""
    if autopilot == "px4":
        return px4_commands.BY_KIND[personality.kind]
    return {**commands._HANDLERS, **kind_commands.BY_KIND[personality.kind]}


def answer(entry: tuple[Callable[..., Any], int] | None) -> str:
    """Return how a command is answered, by the function that carries it out.

    A function that does not use the server, which has the vehicle, changes nothing: unused
    arguments begin with an underscore here, or are `*_`.
    """
    if entry is None:
        return ABSENT
    handler = entry[0]
    server = next(iter(inspect.signature(handler).parameters.values()))
    if server.annotation is not inspect.Parameter.empty and _returns_none(handler):
        return SILENT
    if not server.name.startswith("_"):
        return ACTS
    try:
        result = handler(None, None)
    except AttributeError:  # it looks at the parameters
        return ACCEPTED
    return ACCEPTED if result is Result.ACCEPTED else REFUSED


def _returns_none(handler: Callable[..., Any]) -> bool:
    return inspect.signature(handler).return_annotation in (None, "None")


def commands_table(autopilot: str, kinds: Mapping[str, Personality]) -> str:
    """All commands that one of the vehicles answers."""
    known = {vehicle: answers(autopilot, kind) for vehicle, kind in kinds.items()}
    numbers = sorted({number for entries in known.values() for number in entries})
    rows = (
        [f"{number} {name_of('MAV_CMD', number)}", *(answer(e.get(number)) for e in known.values())]
        for number in numbers
    )
    return table(("Command", *kinds), (row for row in rows if set(row[1:]) != {ABSENT}))


def modes_table(kinds: Mapping[str, Personality]) -> str:
    """The modes of each vehicle."""
    listed = {
        vehicle: {
            **{m[0]: m[3] for m in kind.available_modes if m[3] not in NAMELESS},
            **_names(kind),
        }
        for vehicle, kind in kinds.items()
    }
    numbers = sorted({(n, name) for modes in listed.values() for n, name in modes.items()})
    rows = [
        [
            f"{number:#010x}" if number > 255 else f"{number}",
            name,
            *(
                "flown" if name == _names(kind).get(number)
                else "listed" if listed[vehicle].get(number) == name else ABSENT
                for vehicle, kind in kinds.items()
            ),
        ]
        for number, name in numbers
    ]  # fmt: skip
    return table(("Number", "Mode", *kinds), rows)


def _names(kind: Personality) -> dict[int, str]:
    return {mode.number: mode.name for mode in kind.modes.values()}


def server_of(autopilot: str, vehicle: str) -> Any:
    """Return the server that answers for a vehicle that has just started, a PX4 with a gimbal."""
    own = {"MNT_MODE_IN": 4.0} if autopilot == "px4" else {}
    config = VehicleConfig(vehicle=vehicle, autopilot=autopilot, parameters=own)
    simulation = Simulation([config])
    simulation.run_for(3.0)
    return simulation.vehicles[0]._servers[0]


def messages_table(autopilot: str, kinds: Mapping[str, Personality]) -> str:
    """The messages that each vehicle makes or accepts an interval for."""
    makes, knows = {}, {}
    for vehicle, kind in kinds.items():
        builders = server_of(autopilot, vehicle).builders
        makes[vehicle] = {number for number, build in builders.items() if not _never(build, kind)}
        px4 = autopilot == "px4"
        knows[vehicle] = px4_messages.STREAMS if px4 else known_messages.BY_KIND[kind.kind]
    numbers = sorted(set().union(*makes.values(), *knows.values()))
    rows = (
        [
            dialect.mavlink_map[number].msgname if number in dialect.mavlink_map else f"{number}",
            *(
                "sent" if number in makes[v] else "known" if number in knows[v] else ABSENT
                for v in kinds
            ),
        ]
        for number in numbers
    )
    return table(("Message", *kinds), sorted(rows))


def _never(build: Callable[..., Any], kind: Personality) -> bool:
    """Whether a builder is the one of a kind that never makes anything."""
    others = inspect.getclosurevars(build).nonlocals.get("others", {})
    return bool(others.get(kind.kind, build).__name__ == "never")


def heard(autopilot: str, kinds: Mapping[str, Personality]) -> str:
    """The messages that are understood, in lines."""
    found = set().union(*(server_of(autopilot, vehicle)._handlers for vehicle in kinds))
    text = f"{', '.join(sorted(found))}."
    return f"{textwrap.fill(text, 98, break_long_words=False)}\n"


def items_table(kinds: Mapping[str, Personality]) -> str:
    """The items that the lists of a firmware take; the same for all its vehicles."""
    (rules,) = {id(kind.plan_rules): kind.plan_rules for kind in kinds.values()}.values()

    def taken(item: int, plan: PlanType) -> bool:
        if rules.by_frame is not None:
            return any(item in items for items in rules.by_frame.values())
        return item in rules.commands[plan]

    rows = [
        [f"{int(item)} {name_of('MAV_CMD', item)}", "taken" if any(
            taken(item, plan) for plan in PlanType) else ABSENT]
        for item in sorted({*Cmd, *NAMES, *PX4_DEVICES})
    ]  # fmt: skip
    return table(("Item", "mission, fence or rally points"), rows)


def page(autopilot: str) -> str:
    """One firmware's page."""
    kinds = {vehicle: PERSONALITIES[vehicle, autopilot] for vehicle in VEHICLES}
    about = "px4.md" if autopilot == "px4" else "sitl.md"
    return "".join(
        (
            _HEAD.format(title=FIRMWARES[autopilot], about=about),
            commands_table(autopilot, kinds),
            _MODES,
            modes_table(kinds),
            _SENT,
            messages_table(autopilot, kinds),
            _HEARD,
            heard(autopilot, kinds),
            _ITEMS,
            items_table(kinds),
        )
    )


def path_of(autopilot: str) -> Path:
    """Where a firmware's page is."""
    return ROOT / f"docs/{autopilot}_lists.md"


def main() -> int:
    """Write the pages."""
    for autopilot in FIRMWARES:
        text = page(autopilot)
        assert not re.search(r" $", text, re.MULTILINE)
        path_of(autopilot).write_text(text, "utf-8")
    head = PARAMETERS.read_text("utf-8").partition("\n## ")[0]
    text = f"{head}\n{parameter_tables(PERSONALITIES.values()).rstrip()}\n"
    PARAMETERS.write_text(text, "utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
