"""One MAVLink command, repeated until it is answered, with a limit of attempts.

https://mavlink.io/en/services/command.html: COMMAND_LONG is repeated with a rising
`confirmation` until a COMMAND_ACK comes; IN_PROGRESS means that another will follow. An ACK
carries nothing but the command's number, so:

- Acknowledgements for another ground station (target fields that are set and not ours) are
  ignored.
- Doubled acknowledgements, which repeated commands bring, are ignored after the first.
- An acknowledgement of an earlier command with the same number looks like that of ours. So
  no more than one command of a number is under way at a time, and what matters is confirmed
  from the vehicle's state (see `operations`).
"""

from __future__ import annotations

import enum
from dataclasses import dataclass, field
from typing import ClassVar

from mavlink_vehicle.codec import Message, Targeted, make, mavlink
from mavlink_vehicle.protocols.machine import Machine, Table

_COMMAND_ACK = mavlink.MAVLink_command_ack_message
IN_PROGRESS = mavlink.MAV_RESULT_IN_PROGRESS
ACCEPTED = mavlink.MAV_RESULT_ACCEPTED


def result_name(result: int) -> str:
    """Return the name of a MAV_RESULT without its prefix, for example "DENIED"."""
    entry = mavlink.enums["MAV_RESULT"].get(result)
    return entry.name.removeprefix("MAV_RESULT_") if entry else f"MAV_RESULT {result}"


def command_name(command: int) -> str:
    """Return the name of a MAV_CMD without its prefix, for example "NAV_TAKEOFF"."""
    entry = mavlink.enums["MAV_CMD"].get(command)
    return entry.name.removeprefix("MAV_CMD_") if entry else f"MAV_CMD {command}"


@dataclass(frozen=True)
class Address:
    """The addresses of a conversation: our ids and the autopilot's."""

    source_system: int
    source_component: int
    target_system: int
    target_component: int

    def answers(self, message: Message) -> bool:
        """Return whether the sender of `message` is the autopilot."""
        header = message._header
        return bool(
            header.srcSystem == self.target_system and header.srcComponent == self.target_component
        )

    def is_for_us(self, message: Targeted) -> bool:
        """Return whether its target fields are ours, or not set as in older firmwares."""
        return message.target_system in (0, self.source_system) and message.target_component in (
            0,
            self.source_component,
        )


@dataclass(frozen=True)
class CommandTiming:
    """Timeouts and retries of a command.

    Attributes:
        timeout_s: time to the next repetition.
        retries: repetitions after the first sending.
        progress_timeout_s: how long the next sign of life may take after IN_PROGRESS.
        limit_s: time after which a command that is still IN_PROGRESS is given up.
    """

    timeout_s: float = 0.5
    retries: int = 4
    progress_timeout_s: float = 5.0
    limit_s: float = 60.0


@dataclass(frozen=True)
class CommandRequest:
    """A command as COMMAND_LONG, or as COMMAND_INT when `frame` is given."""

    command: int
    params: tuple[float, ...] = field(default=())
    frame: int | None = None

    def message(self, address: Address, confirmation: int) -> Message:
        """Build the message; `confirmation` counts the repetitions of a COMMAND_LONG."""
        values = (*self.params, *([0.0] * (7 - len(self.params))))
        named = {f"param{number}": value for number, value in enumerate(values[:4], start=1)}
        target = {
            "target_system": address.target_system,
            "target_component": address.target_component,
            "command": self.command,
        }
        if self.frame is None:
            last = {"param5": values[4], "param6": values[5], "param7": values[6]}
            return make(
                "COMMAND_LONG", **target, confirmation=min(confirmation, 255), **named, **last
            )
        place = {"x": int(values[4]), "y": int(values[5]), "z": values[6]}
        return make("COMMAND_INT", **target, frame=self.frame, **named, **place)


@dataclass(frozen=True)
class CommandFinished:
    """The one end of a command.

    Attributes:
        result: MAV_RESULT, or None when no answer came.
        attempts: how often it was sent.
    """

    result: int | None
    attempts: int


class CommandState(enum.Enum):
    """The state of a command."""

    IDLE = "not started"
    WAITING = "sent, no answer yet"
    IN_PROGRESS = "the autopilot is executing it"
    FINISHED = "answered or given up"


class CommandInput(enum.Enum):
    """An input of a command."""

    START = "start"
    PROGRESS = "COMMAND_ACK with IN_PROGRESS"
    ANSWER = "COMMAND_ACK with a final result"
    RETRY = "timeout; attempts remain"
    EXHAUSTED = "timeout; no attempts remain"
    CANCEL = "cancelled by us"


def ack_result(message: Message, command: int, address: Address) -> int | None:
    """Return the MAV_RESULT if the message acknowledges our `command`, else None."""
    if (
        message.__class__ is not _COMMAND_ACK
        or message.command != command
        or not address.answers(message)
        or not address.is_for_us(message)
    ):
        return None
    return message.result


class CommandExchange(Machine[CommandFinished]):
    """Sends one command until it is answered; ends in exactly one `CommandFinished`."""

    def __init__(
        self,
        request: CommandRequest,
        address: Address,
        timing: CommandTiming,
        sent_before: int = 0,
    ) -> None:
        """Prepare; `start` sends. `sent_before` is how often it has been sent already."""
        super().__init__(CommandState.IDLE)
        self.request = request
        self.attempts = sent_before
        self._last_attempt = sent_before + timing.retries + 1
        self._address = address
        self._timing = timing
        self._started_s = 0.0
        self._result: int | None = None

    def start(self, now: float) -> None:
        """Send the command for the first time."""
        self._started_s = now
        self._fire(CommandInput.START, now)

    def excuse(self, gap_s: float) -> None:
        """Do not count a time in which we did not run."""
        self._started_s += gap_s
        if self.deadline_s is not None:
            self.deadline_s += gap_s

    def cancel(self, now: float) -> None:
        """Stop sending; no event follows, and answers still on the way are ignored."""
        self._fire(CommandInput.CANCEL, now)

    def receive(self, message: Message, now: float) -> None:
        """Look for our COMMAND_ACK."""
        result = ack_result(message, self.request.command, self._address)
        if result is None or self.state is CommandState.IDLE:
            return
        if result == IN_PROGRESS:
            self._fire(CommandInput.PROGRESS, now)
        else:
            if self.state is not CommandState.FINISHED:
                self._result = result
            self._fire(CommandInput.ANSWER, now)

    def _on_deadline(self, now: float) -> None:
        """Repeat or give up when it is time."""
        over = now >= self._started_s + self._timing.limit_s
        exhausted = over or self.attempts >= self._last_attempt
        self._fire(CommandInput.EXHAUSTED if exhausted else CommandInput.RETRY, now)

    def _send(self, now: float) -> None:
        self.outbox.append(self.request.message(self._address, self.attempts))
        self.attempts += 1
        self.deadline_s = now + self._timing.timeout_s

    def _extend(self, now: float) -> None:
        limit = self._started_s + self._timing.limit_s
        self.deadline_s = max(now, min(now + self._timing.progress_timeout_s, limit))

    def _finish(self, now: float) -> None:
        self.deadline_s = None
        self.events.append(CommandFinished(self._result, self.attempts))

    table: ClassVar[Table] = {
        (CommandState.IDLE, CommandInput.START): (CommandState.WAITING, _send),
        (CommandState.IDLE, CommandInput.CANCEL): (CommandState.FINISHED, Machine._stop),
        (CommandState.WAITING, CommandInput.RETRY): (CommandState.WAITING, _send),
        (CommandState.WAITING, CommandInput.EXHAUSTED): (CommandState.FINISHED, _finish),
        (CommandState.WAITING, CommandInput.PROGRESS): (CommandState.IN_PROGRESS, _extend),
        (CommandState.WAITING, CommandInput.ANSWER): (CommandState.FINISHED, _finish),
        (CommandState.WAITING, CommandInput.CANCEL): (CommandState.FINISHED, Machine._stop),
        (CommandState.IN_PROGRESS, CommandInput.RETRY): (CommandState.WAITING, _send),
        (CommandState.IN_PROGRESS, CommandInput.EXHAUSTED): (CommandState.FINISHED, _finish),
        (CommandState.IN_PROGRESS, CommandInput.PROGRESS): (CommandState.IN_PROGRESS, _extend),
        (CommandState.IN_PROGRESS, CommandInput.ANSWER): (CommandState.FINISHED, _finish),
        (CommandState.IN_PROGRESS, CommandInput.CANCEL): (CommandState.FINISHED, Machine._stop),
        (CommandState.FINISHED, CommandInput.PROGRESS): (CommandState.FINISHED, None),
        (CommandState.FINISHED, CommandInput.ANSWER): (CommandState.FINISHED, None),
        (CommandState.FINISHED, CommandInput.CANCEL): (CommandState.FINISHED, None),
    }
