"""Begins the operations of `vehicle.Vehicle`, or ends them at once."""

from __future__ import annotations

from mavlink_vehicle.events import OperationKind, OperationResult
from mavlink_vehicle.profiles import Profile
from mavlink_vehicle.protocols.operations.operation_parts import Gate, Goal, OperationTiming
from mavlink_vehicle.protocols.operations.operation_slot import Begin, Wanted
from mavlink_vehicle.vehicle_core import VehicleCore


class VehicleOperations(VehicleCore):
    """One autopilot with a place for operations; sans I/O."""

    def _begin(
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
        self._notice(now)
        operation_id = self._slot.begin(
            goal,
            wanted,
            timing,
            self.address,
            self.state,
            now,
            connected=self.connected,
            first_ack_counts=goal.request.command not in profile.later_ack_counts,
            gate=gate,
            then=then,
            operation_id=operation_id,
        )
        self._take_ends()
        return operation_id

    def _refuse(self, kind: OperationKind, reason: str, now: float) -> int:
        operation_id = self._slot.end_at_once(kind, OperationResult.REFUSED, reason, now)
        self._take_ends()
        return operation_id

    def _nobody(self, kind: OperationKind, now: float) -> int:
        reason = "No vehicle has been detected yet; check the link and the vehicle's power."
        operation_id = self._slot.end_at_once(kind, OperationResult.LINK_LOST, reason, now)
        self._take_ends()
        return operation_id
