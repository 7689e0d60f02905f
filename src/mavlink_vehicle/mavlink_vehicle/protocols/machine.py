"""The base of the state machines: a transition table, an outbox and an event queue."""

from __future__ import annotations

import enum
from collections import deque
from collections.abc import Callable, Mapping
from typing import ClassVar, Generic, TypeVar

from mavlink_vehicle.errors import ProtocolError
from mavlink_vehicle.protocols.outbox import TimedOutbox

EventT = TypeVar("EventT")

Action = Callable[..., None]
"""A method of the machine, with the time in seconds."""
Table = Mapping[tuple[enum.Enum, enum.Enum], tuple[enum.Enum, "Action | None"]]
"""(state, input) -> (next state, what to do on the way). A missing key is an error."""


class Machine(TimedOutbox, Generic[EventT]):
    """A state, moved by a transition table only.

    The state is set before the action runs, so an action may fire the next input.
    """

    table: ClassVar[Table]

    def __init__(self, state: enum.Enum) -> None:
        """Begin in `state`."""
        super().__init__()
        self.state = state
        self.events: deque[EventT] = deque()

    def _fire(self, what: enum.Enum, now: float) -> None:
        try:
            self.state, action = self.table[(self.state, what)]
        except KeyError:
            raise ProtocolError(
                f"{type(self).__name__} has no transition for {what.name} in {self.state.name}."
            ) from None
        if action is not None:
            action(self, now)

    def _stop(self, now: float) -> None:
        """Want nothing more, and send nothing more."""
        self.deadline_s = None
        self.outbox.clear()

    def next_event(self) -> EventT | None:
        """Return and remove the next event."""
        return self.events.popleft() if self.events else None
