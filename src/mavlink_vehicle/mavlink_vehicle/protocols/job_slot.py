"""Holds one job at a time that runs beside the operations: a transfer of a list, or parameters."""

from __future__ import annotations

from typing import Protocol, TypeVar

from mavlink_vehicle.codec import mavlink
from mavlink_vehicle.events import (
    OperationResult,
    ParametersFinished,
    StoredListFinished,
    VehicleEvent,
)
from mavlink_vehicle.protocols.mission.transfer import MISSION_ANSWERS
from mavlink_vehicle.protocols.service import SendingRank
from mavlink_vehicle.protocols.slot import Part, Slot
from mavlink_vehicle.state.vehicle_state import VehicleState

EventT = TypeVar("EventT", bound=VehicleEvent)
EventT_co = TypeVar("EventT_co", bound=VehicleEvent, covariant=True)


class Job(Part, Protocol[EventT_co]):
    """A state machine that ends in exactly one event."""

    def start(self, now: float) -> None:
        """Begin."""

    def next_event(self) -> EventT_co | None:
        """Return and remove the end."""

    def stop(self, result: OperationResult, reason: str, now: float) -> None:
        """End it for this reason."""


class JobSlot(Slot[Job[EventT]]):
    """Runs one job; the next begins after its end."""

    def begin(self, job: Job[EventT], now: float) -> None:
        """Start a job; there must be none."""
        assert self.pending is None
        self.pending = job
        job.start(now)
        self._collect(now)

    def stop(self, result: OperationResult, reason: str, now: float) -> None:
        """End the pending job, if any, for this reason."""
        if self.pending is not None:
            self.pending.stop(result, reason, now)
            self._collect(now)

    def vehicle_gone(self, reason: str, now: float) -> None:
        """End the pending job, if any."""
        self.stop(OperationResult.LINK_LOST, reason, now)

    def _take_done(self, now: float) -> None:
        event = None if self.pending is None else self.pending.next_event()
        if event is not None:
            self._vacate()
            self.events.append(event)


class ListJobs(JobSlot[StoredListFinished]):
    """Reads or writes a fence or the rally points."""

    rank = SendingRank.LISTS
    handles = MISSION_ANSWERS


class ParameterJobs(JobSlot[ParametersFinished]):
    """Lists or changes parameters."""

    handles = (mavlink.MAVLink_param_value_message, mavlink.MAVLink_param_error_message)

    def link_lost(self, state: VehicleState, now: float) -> None:
        """End the pending job, if any."""
        self.stop(OperationResult.LINK_LOST, "the autopilot has fallen silent", now)
