"""Begins the operations of an autopilot, or ends them at once."""

from __future__ import annotations

from mavlink_vehicle.events import OperationKind, OperationResult
from mavlink_vehicle.profiles import Profile
from mavlink_vehicle.protocols.operation_slot import Begin, Wanted
from mavlink_vehicle.protocols.operations.operation_parts import Gate, Goal, OperationTiming
from mavlink_vehicle.vehicle_core import VehicleCore


class OperationRequests:
    """Begins operations in the one place that the autopilot has for them; sans I/O."""

    def __init__(self, core: VehicleCore) -> None:
        """Begin them on this autopilot."""
        self._core = core

    def begin(
        self,
        profile: Profile,
        goal: Goal,
        wanted: Wanted,
        timing: OperationTiming,
        now: float,
        gate: Gate | None = None,
        then: Begin | None = None,
        operation_id: int | None = None,
    ) -> int:
        """Begin an operation; returns its id. The arguments are those of the slot."""
        self._core.notice(now)
        operation_id = self._core.slot.begin(
            goal,
            wanted,
            timing,
            self._core.address,
            self._core.state,
            now,
            connected=self._core.connected,
            first_ack_counts=goal.request.command not in profile.messages.later_ack_counts,
            gate=gate,
            then=then,
            operation_id=operation_id,
        )
        self._core.collect(now)
        return operation_id

    def refuse(self, kind: OperationKind, reason: str, now: float) -> int:
        """End an operation at once as `REFUSED`; returns its id."""
        operation_id = self._core.slot.end_at_once(kind, OperationResult.REFUSED, reason, now)
        self._core.collect(now)
        return operation_id

    def nobody(self, kind: OperationKind, now: float) -> int:
        """End an operation at once, as there is no vehicle yet; returns its id."""
        reason = "No vehicle has been detected yet; check the link and the vehicle's power."
        operation_id = self._core.slot.end_at_once(kind, OperationResult.LINK_LOST, reason, now)
        self._core.collect(now)
        return operation_id
