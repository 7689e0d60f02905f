"""Holds the current operation and remembers the ones requested before it."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

from mavlink_vehicle.codec import Message
from mavlink_vehicle.events import OperationFinished, OperationKind, OperationResult
from mavlink_vehicle.protocols.mission.mission_operation import MissionOperation
from mavlink_vehicle.protocols.operations.command import Address, CommandTiming
from mavlink_vehicle.protocols.operations.operation_parts import Gate, Goal, OperationTiming
from mavlink_vehicle.protocols.operations.operations import Operation
from mavlink_vehicle.protocols.operations.requested_changes import RequestedChanges
from mavlink_vehicle.state.reducer import VehicleState

SETTLE_S = 1.5
"""How long a command that was sent and given up may still take effect."""

Begin = Callable[[int, float], object]
"""Begins an operation with an id, at a time."""


@dataclass(frozen=True)
class Wanted:
    """The change of HEARTBEAT by an operation: the mode, the armed flag, or neither."""

    mode: int | None = None
    armed: bool | None = None


class OperationSlot:
    """Holds one operation at a time: a new one cancels the pending one first."""

    def __init__(self, command_timing: CommandTiming, grace_s: float) -> None:
        """Begin empty; see `RequestedChanges` for the grace period."""
        self._command_timing = command_timing
        self._requested = RequestedChanges(grace_s)
        self._last_words: list[Message] = []
        self._operation: Operation | MissionOperation | None = None
        self._then: Begin | None = None
        self._next_id = 1
        self._events: deque[OperationFinished] = deque()

    @property
    def pending(self) -> Operation | MissionOperation | None:
        """The operation under way."""
        return self._operation

    def begin(
        self,
        goal: Goal,
        wanted: Wanted,
        timing: OperationTiming,
        address: Address,
        state: VehicleState,
        now: float,
        *,
        connected: bool,
        first_ack_counts: bool,
        gate: Gate | None = None,
        then: Begin | None = None,
        operation_id: int | None = None,
    ) -> int:
        """Start an operation and return its id; the parameters are those of `Operation`.

        `then` begins what follows when it is achieved, with the same `operation_id`: only the
        end of that is told.
        """
        self.cancel(f"{goal.kind.value} was requested instead", now)
        operation = Operation(
            self._take_id() if operation_id is None else operation_id,
            goal,
            address,
            self._command_timing,
            timing,
            first_ack_counts=first_ack_counts,
            gate=gate,
        )
        self._operation, self._then = operation, then
        doubt = self._requested.contradicted(now, mode=wanted.mode, armed=wanted.armed)
        operation.begin(state, connected, now, SETTLE_S if doubt else 0.0)
        if not operation.finished and wanted != Wanted():
            self._requested.add(mode=wanted.mode, armed=wanted.armed)
        self._collect(now)
        return operation.operation_id

    def begin_mission(
        self,
        make: Callable[[int], MissionOperation],
        state: VehicleState,
        now: float,
        *,
        connected: bool,
    ) -> int:
        """Start an operation on the stored mission, made with the id that is returned."""
        operation = make(self._take_id())
        self.cancel(f"{operation.goal.kind.value} was requested instead", now)
        self._operation = operation
        operation.begin(state, connected, now)
        return operation.operation_id

    def end_at_once(
        self, kind: OperationKind, result: OperationResult, reason: str, now: float
    ) -> int:
        """Report the end of an operation that can't even begin; returns its id."""
        self.cancel(f"{kind.value} was requested instead", now)
        operation_id = self._take_id()
        self._events.append(OperationFinished(operation_id, kind, result, reason))
        return operation_id

    def cancel(self, reason: str, now: float) -> None:
        """End the pending operation, if any, as CANCELLED."""
        if self._operation is not None:
            self._operation.cancel(reason, now)
            self._collect(now)

    def lose(self, reason: str, now: float) -> None:
        """End the pending operation, if any, as LINK_LOST."""
        if self._operation is not None:
            self._operation.lose(reason, now)
            self._collect(now)

    def mode_changed(self, state: VehicleState, name: str, now: float) -> bool:
        """Record another mode; returns whether it was asked for.

        Ends what the change cuts short. A command is never repeated against a pilot's choice.
        """
        requested = self._requested.take_mode(state.custom_mode, now)
        operation = self._operation
        if operation is not None:
            if requested:
                operation.settle()
            if operation.goal.cut_short(state, requested):
                self.cancel(f"the vehicle was switched to {name} meanwhile", now)
            elif operation.goal.kind is OperationKind.TAKE_OFF:
                return True  # it goes through modes of its own
        return requested

    def armed_changed(self, armed: bool, now: float) -> bool:
        """Record arming or disarming; returns whether it was asked for."""
        requested = self._requested.take_armed(armed, now)
        if requested and self._operation is not None:
            self._operation.settle()
        return requested

    def observe(self, state: VehicleState, connected: bool, now: float) -> None:
        """Process the vehicle's new state."""
        if self._operation is not None:
            self._operation.observe(state, connected, now)
            self._collect(now)

    # The six methods

    def start(self, now: float) -> None:
        """Nothing to do before `begin`."""

    def receive(self, message: Message, now: float) -> None:
        """Process a COMMAND_ACK or a message of the mission service."""
        if self._operation is not None:
            self._operation.receive(message, now)
            self._collect(now)

    def next_deadline(self) -> float | None:
        """Return when `handle_timer` wants to be called."""
        return None if self._operation is None else self._operation.next_deadline()

    def handle_timer(self, now: float) -> None:
        """Repeat the command, or end."""
        if self._operation is not None:
            self._operation.handle_timer(now)
            self._collect(now)

    def messages_to_send(self) -> list[Message]:
        """Return and clear what is to be sent."""
        messages, self._last_words = self._last_words, []
        if self._operation is not None:
            messages += self._operation.messages_to_send()
        return messages

    def next_event(self) -> OperationFinished | None:
        """Return and remove the next end."""
        return self._events.popleft() if self._events else None

    def _collect(self, now: float) -> None:
        event = None if self._operation is None else self._operation.next_event()
        if event is not None and self._operation is not None:
            if event.result is OperationResult.ACHIEVED:
                for mode in self._operation.next_modes():
                    self._requested.add(mode=mode)
            # A transfer's end is acknowledged to the vehicle, which waits for it.
            self._last_words += self._operation.messages_to_send()
            then, self._operation, self._then = self._then, None, None
            self._requested.end(now)
            if then is not None and event.result is OperationResult.ACHIEVED:
                then(event.operation_id, now)
            else:
                self._events.append(event)

    def _take_id(self) -> int:
        operation_id = self._next_id
        self._next_id += 1
        return operation_id
