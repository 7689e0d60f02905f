"""Commands in a recording and their acknowledgements. Pure."""

from __future__ import annotations

from dataclasses import dataclass, replace

from flight_logs.vehicles import Source
from flight_reports.contents.log_reader import LogContents
from mavlink_vehicle.codec import mavlink

ANSWER_LIMIT_S = 5.0
"""A later COMMAND_ACK is not an answer."""
LATE_S = 1.0
"""A later answer is a warning: the server repeats after that time."""
_REPEATED_S = 4.0


@dataclass(frozen=True)
class SentCommand:
    """A COMMAND_LONG or COMMAND_INT to the vehicle.

    Attributes:
        time_s: when it was sent first.
        name: as in the dialect, without "MAV_CMD_".
        by: who sent it.
        sent: how often, as it was repeated before an answer came.
        result: MAV_RESULT without "MAV_RESULT_"; empty without an answer.
        answered_after_s: from the first sending to the first answer, None without one.
    """

    time_s: float
    name: str
    by: Source
    sent: int
    result: str
    answered_after_s: float | None


def commands(contents: LogContents, vehicle: Source) -> list[SentCommand]:
    """Return the commands to a vehicle with their answers, in sending order."""
    found: list[tuple[int, SentCommand]] = []
    latest: dict[tuple[int, Source], int] = {}
    for time_s, kind, number, by in _sent_and_answered(contents, vehicle):
        if kind == "answer":
            _answer(found, number, time_s, by)
            continue
        place = latest.get((number, by))
        if place is not None and _is_again(found[place][1], time_s):
            found[place] = (number, replace(found[place][1], sent=found[place][1].sent + 1))
            continue
        latest[(number, by)] = len(found)
        found.append((number, SentCommand(time_s, command_name(number), by, 1, "", None)))
    return [command for _, command in found]


def command_name(number: int) -> str:
    """Return a command's name without "MAV_CMD_", or its number."""
    entry = mavlink.enums["MAV_CMD"].get(number)
    return entry.name.removeprefix("MAV_CMD_") if entry is not None else f"command {number}"


def _sent_and_answered(
    contents: LogContents, vehicle: Source
) -> list[tuple[float, str, int, Source]]:
    """Return (time in s, "command" or "answer", number, who sent; for an answer, its result)."""
    lines: list[tuple[float, str, int, Source]] = []
    for name in ("COMMAND_LONG", "COMMAND_INT"):
        for record in contents.records.get(name, ()):
            by = (int(record["system"]), int(record["component"]))
            if record["target_system"] == vehicle[0] and by != vehicle:
                lines.append((float(record["time_s"]), "command", int(record["command"]), by))
    answers = contents.of("COMMAND_ACK", vehicle)
    for record in () if answers is None else answers:
        result = (int(record["result"]), 0)
        lines.append((float(record["time_s"]), "answer", int(record["command"]), result))
    # Of what has the same time, a command comes before its answer.
    return sorted(lines, key=lambda line: (line[0], line[1] == "answer"))


def _is_again(command: SentCommand, time_s: float) -> bool:
    return command.answered_after_s is None and time_s - command.time_s < _REPEATED_S * command.sent


def _answer(
    found: list[tuple[int, SentCommand]], number: int, time_s: float, result: tuple[int, int]
) -> None:
    """Assign an answer to the oldest command that waits for it."""
    for place, (its_number, command) in enumerate(found):
        waits = command.answered_after_s is None or command.result == "IN_PROGRESS"
        recent = time_s - command.time_s <= ANSWER_LIMIT_S * command.sent
        if its_number != number or not waits or not recent:
            continue
        entry = mavlink.enums["MAV_RESULT"].get(result[0])
        name = entry.name.removeprefix("MAV_RESULT_") if entry is not None else str(result[0])
        after_s = command.answered_after_s
        found[place] = (
            number,
            replace(
                command,
                result=name,
                answered_after_s=time_s - command.time_s if after_s is None else after_s,
            ),
        )
        return
