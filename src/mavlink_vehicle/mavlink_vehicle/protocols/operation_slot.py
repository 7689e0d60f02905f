"""Holds the current operation and remembers the ones requested before it."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass

from mavlink_vehicle.codec import Message, mavlink
from mavlink_vehicle.events import OperationFinished, OperationKind, OperationResult
from mavlink_vehicle.protocols.known_vehicle import KnownVehicle
from mavlink_vehicle.protocols.mission.mission_operation import (
    MissionJob,
    MissionOperation,
    MissionTiming,
)
from mavlink_vehicle.protocols.mission.transfer import MISSION_ANSWERS
from mavlink_vehicle.protocols.monitoring.heartbeat import HeartbeatWatch
from mavlink_vehicle.protocols.operations.command import CommandTiming
from mavlink_vehicle.protocols.operations.crossings import SETTLE_S, Crossings
from mavlink_vehicle.protocols.operations.operation_parts import Gate, Goal, OperationTiming
from mavlink_vehicle.protocols.operations.operations import Operation
from mavlink_vehicle.protocols.operations.requested_changes import RequestedChanges
from mavlink_vehicle.protocols.service import SendingRank
from mavlink_vehicle.protocols.slot import Slot
from mavlink_vehicle.state.reducer import VehicleState

Begin = Callable[[int, float], object]
"""Begins an operation with an id, at a time."""


@dataclass(frozen=True)
class Wanted:
    """The change of HEARTBEAT by an operation: the mode, the armed flag, or neither."""

    mode: int | None = None
    armed: bool | None = None


class OperationSlot(Slot[Operation | MissionOperation]):
    """Holds one operation at a time: a new one cancels the pending one first.

    Attributes:
        last_mission: the last operation on the mission; None before.
    """

    rank = SendingRank.OPERATIONS
    handles = (mavlink.MAVLink_command_ack_message, *MISSION_ANSWERS)
    commands = True

    def __init__(
        self,
        vehicle: KnownVehicle,
        heartbeats: HeartbeatWatch,
        command_timing: CommandTiming,
        *,
        requested: Callable[[float], None],
        done: Callable[[float], None],
    ) -> None:
        """Begin empty.

        Args:
            vehicle: the vehicle to operate.
            heartbeats: whether it is heard.
            command_timing: of each command.
            requested: called with the time in seconds before a request is processed.
            done: called after it, for the events.
        """
        super().__init__()
        self._vehicle = vehicle
        self._heartbeats = heartbeats
        self._on_request, self._on_done = requested, done
        self.last_mission: MissionOperation | None = None
        self._command_timing = command_timing
        grace_s = vehicle.config.grace_s
        self._requested = RequestedChanges(grace_s)
        self._crossings = Crossings(grace_s)
        self._then: Begin | None = None
        self._ids = itertools.count(1)

    @property
    def choice_is_unclear(self) -> bool:
        """Whether a mode command on its way may still overtake the mode that somebody chose."""
        return self._crossings.is_open

    @property
    def _mode_ends_with_flight(self) -> bool:
        """Whether the vehicle is in an earlier mode again once it is disarmed."""
        profile = self._vehicle.profile
        return profile is not None and profile.earlier_mode_after_landing

    @property
    def operation_id(self) -> int | None:
        """Id of the operation in progress, None when there is none."""
        return None if self.pending is None else self.pending.operation_id

    def begin(
        self,
        goal: Goal,
        wanted: Wanted,
        timing: OperationTiming,
        now: float,
        gate: Gate | None = None,
        then: Begin | None = None,
        operation_id: int | None = None,
    ) -> int:
        """Start an operation and return its id; the parameters are those of `Operation`.

        `then` begins what follows when it is achieved, with the same `operation_id`: only the
        end of that is reported.
        """
        self._on_request(now)
        vehicle, address, profile = self._vehicle, self._vehicle.address, self._vehicle.profile
        first_ack_counts = (
            profile is None or goal.request.command not in profile.messages.later_ack_counts
        )
        self.cancel(f"{goal.kind.value} was requested instead", now)
        operation = Operation(
            next(self._ids) if operation_id is None else operation_id,
            goal,
            address,
            self._command_timing,
            timing,
            first_ack_counts=first_ack_counts,
            gate=gate,
        )
        self.pending, self._then = operation, then
        if wanted.mode is None:
            self._crossings.end()
        else:
            self._crossings.begin(
                goal.request.command,
                wanted.mode,
                1 if first_ack_counts else 2,
                address,
                restores=goal.kind is OperationKind.RESTORE_MODE,
            )
        doubt = self._requested.contradicted(now, mode=wanted.mode, armed=wanted.armed)
        silent_until_s = self._crossings.silent_until_s
        settle_s = SETTLE_S if doubt else 0.0
        operation.begin(vehicle.state, self._heartbeats.alive, now, settle_s, silent_until_s)
        if not operation.finished and wanted != Wanted():
            self._requested.add(mode=wanted.mode, armed=wanted.armed)
        self._collect(now)
        self._on_done(now)
        return operation.operation_id

    def begin_mission(self, job: MissionJob, timing: MissionTiming, now: float) -> int:
        """Start an operation on the stored mission, and return its id."""
        self._on_request(now)
        vehicle = self._vehicle
        operation = MissionOperation(next(self._ids), job, vehicle.address, timing)
        self.last_mission = operation
        self.cancel(f"{operation.goal.kind.value} was requested instead", now)
        self.pending = operation
        operation.begin(vehicle.state, self._heartbeats.alive, now)
        self._set_deadline()
        self._on_done(now)
        return operation.operation_id

    def refuse(self, kind: OperationKind, reason: str, now: float) -> int:
        """End an operation at once as `REFUSED`; returns its id."""
        return self._end_at_once(kind, OperationResult.REFUSED, reason, now)

    def nobody(self, kind: OperationKind, now: float) -> int:
        """End an operation at once, as there is no vehicle yet; returns its id."""
        reason = "No vehicle has been detected yet; check the link and the vehicle's power."
        return self._end_at_once(kind, OperationResult.LINK_LOST, reason, now)

    def abandon(self, now: float) -> None:
        """End the operation in progress, if any, as CANCELLED. Nothing is sent to the vehicle."""
        self.cancel("it was abandoned", now)
        self._on_done(now)

    def _end_at_once(
        self, kind: OperationKind, result: OperationResult, reason: str, now: float
    ) -> int:
        self.cancel(f"{kind.value} was requested instead", now)
        operation_id = next(self._ids)
        self.events.append(OperationFinished(operation_id, kind, result, reason))
        self._on_done(now)
        return operation_id

    def cancel(self, reason: str, now: float) -> None:
        """End the pending operation, if any, as CANCELLED."""
        self._stop(OperationResult.CANCELLED, reason, now)

    def _stop(self, result: OperationResult, reason: str, now: float) -> None:
        if self.pending is not None:
            self.pending.stop(result, reason, now)
            self._collect(now)

    def link_lost(self, state: VehicleState, now: float) -> None:
        """Let the pending operation see it."""
        self.observe(state, False, now)

    def vehicle_gone(self, reason: str, now: float) -> None:
        """End the pending operation, if any, as LINK_LOST."""
        self._crossings.forget()
        self._stop(OperationResult.LINK_LOST, reason, now)
        self._set_deadline()

    def excuse(self, gap_s: float) -> None:
        """Do not count a time in which we did not run."""
        if self.pending is not None:
            self.pending.excuse(gap_s)
            self._set_deadline()

    def mode_asked(self, mode: int, now: float) -> None:
        """Somebody else has asked the vehicle for a mode; it need not obey.

        Nothing that asks for another mode is sent until it has had time to show.
        """
        self._crossings.mode_asked(mode, now)
        operation = self.pending
        if isinstance(operation, Operation):
            operation.keep_silent(self._crossings.silent_until_s)
        self._set_deadline()

    def mode_changed(self, state: VehicleState, name: str, now: float) -> tuple[bool, int | None]:
        """Record another mode; returns whether it was asked for, and which mode it has overtaken.

        Ends what the change cuts short. A command is never repeated against a pilot's choice.
        """
        requested = self._requested.take_mode(state.custom_mode, now)
        overtaken = self._crossings.mode_changed(state.custom_mode, requested, now)
        self._set_deadline()
        if overtaken is not None:
            self.cancel(f"another mode than {name} was chosen meanwhile", now)
            return True, overtaken
        return self._mode_goes_on(state, name, requested, now), None

    def _mode_goes_on(self, state: VehicleState, name: str, requested: bool, now: float) -> bool:
        """Let the pending operation see the mode; returns whether the mode was asked for."""
        operation = self.pending
        if operation is not None:
            if requested:
                operation.evidence.settle()
            if operation.goal.cut_short(state, requested):
                self.cancel(f"the vehicle was switched to {name} meanwhile", now)
            elif operation.goal.kind is OperationKind.TAKE_OFF:
                return True  # it goes through modes of its own
            elif operation.goal.kind is OperationKind.DISARM and self._mode_ends_with_flight:
                return True
        return requested

    def armed_changed(self, armed: bool, now: float) -> bool:
        """Record arming or disarming; returns whether it was asked for."""
        requested = self._requested.take_armed(armed, now)
        if requested and self.pending is not None:
            self.pending.evidence.settle()
        return requested

    def observe(self, state: VehicleState, connected: bool, now: float) -> None:
        """Process the vehicle's new state."""
        if self.pending is not None:
            self.pending.observe(state, connected, now)
            self._collect(now)

    def receive(self, message: Message, now: float) -> None:
        """Process one message of the autopilot."""
        self._crossings.receive(message, now)
        super().receive(message, now)
        self._set_deadline()

    def handle_timer(self, now: float) -> None:
        """Do what is due."""
        self._crossings.handle_timer(now)
        super().handle_timer(now)
        if self._crossings.outbox:  # the mode is asked for after what the operation says
            self.outbox = [*self.messages_to_send(), *self._crossings.messages_to_send()]
        self._set_deadline()

    def _set_deadline(self) -> None:
        """Take the earlier one of the operation and of the crossings; called after each call."""
        super()._set_deadline()
        asks_s = self._crossings.deadline_s
        if asks_s is not None and (self.deadline_s is None or asks_s < self.deadline_s):
            self.deadline_s = asks_s

    def _take_done(self, now: float) -> None:
        if isinstance(self.pending, Operation):
            self._crossings.attempted(self.pending.attempts, now)
        event = None if self.pending is None else self.pending.next_event()
        if event is not None and self.pending is not None:
            if event.result is OperationResult.ACHIEVED:
                for mode in self.pending.goal.next_modes(self.pending.evidence.state):
                    self._requested.add(mode=mode)
            self._vacate()
            self._crossings.end()
            then, self._then = self._then, None
            self._requested.end(now)
            if then is not None and event.result is OperationResult.ACHIEVED:
                then(event.operation_id, now)
            else:
                self.events.append(event)
