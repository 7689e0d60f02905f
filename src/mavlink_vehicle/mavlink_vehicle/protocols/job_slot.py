"""Holds one job at a time that runs beside the operations: a transfer of a list, or parameters."""

from __future__ import annotations

from collections import deque
from typing import Generic, Protocol, TypeVar

from mavlink_vehicle.codec import Message
from mavlink_vehicle.events import OperationResult

EventT = TypeVar("EventT")
EventT_co = TypeVar("EventT_co", covariant=True)


class Job(Protocol[EventT_co]):
    """A state machine that ends in exactly one event."""

    def start(self, now: float) -> None:
        """Begin."""

    def receive(self, message: Message, now: float) -> None:
        """Process one message of the autopilot."""

    def next_deadline(self) -> float | None:
        """Return when `handle_timer` wants to be called."""

    def handle_timer(self, now: float) -> None:
        """Do what is due."""

    def messages_to_send(self) -> list[Message]:
        """Return and clear what is to be sent."""

    def next_event(self) -> EventT_co | None:
        """Return and remove the end."""

    def stop(self, result: OperationResult, reason: str, now: float) -> None:
        """End it for this reason."""


class JobSlot(Generic[EventT]):
    """Runs one job; the next begins after its end."""

    def __init__(self) -> None:
        """Begin empty."""
        self._job: Job[EventT] | None = None
        self._last_words: list[Message] = []
        self._events: deque[EventT] = deque()

    @property
    def pending(self) -> Job[EventT] | None:
        """The job under way."""
        return self._job

    def begin(self, job: Job[EventT], now: float) -> None:
        """Start a job; there must be none."""
        assert self._job is None
        self._job = job
        job.start(now)
        self._collect()

    def stop(self, result: OperationResult, reason: str, now: float) -> None:
        """End the pending job, if any, for this reason."""
        if self._job is not None:
            self._job.stop(result, reason, now)
            self._collect()

    def start(self, now: float) -> None:
        """Nothing to do before `begin`."""

    def receive(self, message: Message, now: float) -> None:
        """Process one message of the autopilot."""
        if self._job is not None:
            self._job.receive(message, now)
            self._collect()

    def next_deadline(self) -> float | None:
        """Return when `handle_timer` wants to be called."""
        return None if self._job is None else self._job.next_deadline()

    def handle_timer(self, now: float) -> None:
        """Repeat, or end."""
        if self._job is not None:
            self._job.handle_timer(now)
            self._collect()

    def messages_to_send(self) -> list[Message]:
        """Return and clear what is to be sent."""
        messages, self._last_words = self._last_words, []
        if self._job is not None:
            messages += self._job.messages_to_send()
        return messages

    def next_event(self) -> EventT | None:
        """Return and remove the next end."""
        return self._events.popleft() if self._events else None

    def _collect(self) -> None:
        event = None if self._job is None else self._job.next_event()
        if event is not None and self._job is not None:
            # A transfer's end is acknowledged to the vehicle, which waits for it.
            self._last_words += self._job.messages_to_send()
            self._job = None
            self._events.append(event)
