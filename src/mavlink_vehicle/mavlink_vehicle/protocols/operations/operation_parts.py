"""Arguments, states and inputs of the operation state machine (see `operations`)."""

from __future__ import annotations

import enum
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from mavlink_vehicle.events import OperationKind
from mavlink_vehicle.protocols.operations.command import CommandRequest
from mavlink_vehicle.state.reducer import VehicleState

Gate = Callable[[float], float]
"""now -> when the command may be sent as things are; infinity: something is missing."""


class Goal(Protocol):
    """The goal of an operation, judged by the vehicle's state."""

    @property
    def needs_ack(self) -> bool:
        """Whether the state alone does not show it."""

    @property
    def kind(self) -> OperationKind:
        """The kind of operation."""

    @property
    def wish(self) -> str:
        """The goal as part of a sentence: "GUIDED", "a height of 2.0 m"."""

    @property
    def request(self) -> CommandRequest:
        """The command that asks for it."""

    def reached(self, state: VehicleState) -> bool:
        """Return whether the state shows it."""

    def under_way(self, state: VehicleState) -> bool:
        """Return whether the state shows that the vehicle is about it."""

    def failure(self, state: VehicleState) -> str | None:
        """Return why the vehicle itself has made it impossible, if so."""

    def hint(self, state: VehicleState) -> str | None:
        """Return what the state says about why it isn't reached."""

    def expects_mode(self, state: VehicleState) -> bool:
        """Return whether the mode is one that it brings with it."""

    def cut_short(self, state: VehicleState, requested: bool) -> bool:
        """Return whether the mode that was just changed to ends it; `requested` if by us."""

    def next_modes(self, state: VehicleState) -> tuple[int, ...]:
        """Return the modes that the vehicle goes to by itself when it is done."""


@dataclass(frozen=True)
class OperationTiming:
    """Timeouts of an operation.

    Attributes:
        timeout_s: time for the whole operation.
        texts_s: time for the STATUSTEXTs of a rejection to come.
        doubt_s: time for the state to contradict the rejection of a repeated command.
        pause_s: pause after all repetitions of a command that nobody answered; then it is sent
            again, in case the link was down.
        rejected_s: time in which a command that is TEMPORARILY_REJECTED is sent again.
    """

    timeout_s: float = 10.0
    texts_s: float = 0.5
    doubt_s: float = 3.0
    pause_s: float = 1.0
    rejected_s: float = 0.0


class OperationState(enum.Enum):
    """The state of an operation."""

    IDLE = "not started"
    PREPARING = "waiting for the gate"
    COMMANDING = "command sent, not answered"
    CONFIRMING = "accepted or unanswered; waiting for the state to show it"
    REFUSING = "rejected; waiting for reasons, or for the state to contradict"
    FINISHED = "ended"


class OperationInput(enum.Enum):
    """An input of an operation."""

    START = "start"
    PREPARE = "start, when the gate is open"
    READY = "the gate is open"
    REACHED = "the state shows it"
    UNDER_WAY = "the state shows the vehicle at it"
    CLOSED = "rejected, and the gate has closed again"
    ACCEPTED = "COMMAND_ACK: accepted"
    REFUSED = "COMMAND_ACK: anything else"
    UNANSWERED = "no COMMAND_ACK after all repetitions"
    AGAIN = "no COMMAND_ACK, or a temporary rejection; time remains"
    TIME_UP = "the operation timed out"
    WAITED = "the wait for reasons is over"
    STOP = "cancelled, the link is lost, or the state shows that it can't be reached"
