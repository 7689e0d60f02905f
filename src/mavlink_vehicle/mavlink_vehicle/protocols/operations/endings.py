"""The endings of an operation: result and sentence of each way in which it ends."""

from __future__ import annotations

from dataclasses import dataclass

from mavlink_vehicle.events import OperationResult
from mavlink_vehicle.protocols.operations.command import ACCEPTED, command_name, result_name
from mavlink_vehicle.protocols.operations.evidence import Evidence
from mavlink_vehicle.protocols.operations.operation_parts import Goal


@dataclass(frozen=True)
class Ending:
    """The result, and the reason as part of a sentence."""

    result: OperationResult
    reason: str


def title(goal: Goal) -> str:
    """Return the beginning of a sentence about an operation: "Mode change to GUIDED"."""
    words = f"{goal.kind.value} {goal.wish}".strip()
    return words[0].upper() + words[1:]


def rejected(goal: Goal, answer: int | None, evidence: Evidence) -> Ending:
    """Return the ending after a COMMAND_ACK that rejects; `answer` is its MAV_RESULT."""
    name = command_name(goal.request.command)
    result = result_name(answer) if answer is not None else "nothing"
    what = f"{title(goal)} rejected: {name} was answered {result}"
    hint = goal.hint(evidence.state)
    return Ending(OperationResult.REFUSED, f"{what}; {hint}" if hint else what)


def timed_out(
    goal: Goal, answer: int | None, attempts: int, timeout_s: float, evidence: Evidence
) -> Ending:
    """Return the ending of an operation whose goal did not show in time.

    Args:
        goal: what was wanted.
        answer: the last MAV_RESULT; None without one.
        attempts: how often the command was sent.
        timeout_s: time for the whole operation.
        evidence: what the vehicle shows.
    """
    name = command_name(goal.request.command)
    if answer == ACCEPTED:
        hint = goal.hint(evidence.state) or "the vehicle's state does not show it"
        what = f"{name} was ACCEPTED, but {hint}"
    else:
        what = f"{name} was sent {attempts} times and not answered"
    what = f"{title(goal)} not confirmed within {timeout_s:.1f} s: {what}"
    if evidence.connected:
        return Ending(OperationResult.TIMED_OUT, what)
    return Ending(OperationResult.LINK_LOST, f"{what}, and no HEARTBEAT is received")
