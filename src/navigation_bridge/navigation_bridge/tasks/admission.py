"""Admission of goals: checks a goal and makes its task. No ROS."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from mavlink_vehicle.state.position_trust import PositionTrust
from mavlink_vehicle.vehicle import Vehicle
from navigation_bridge.engine import Engine
from navigation_bridge.goals.admitted import Admitted
from navigation_bridge.goals.point_requests import check_request
from navigation_bridge.goals.requests import NavigateRequest, Request, VelocityRequest
from navigation_bridge.requests.feature import Feature, Redirection
from navigation_bridge.snapshot import LocatedSnapshot, Snapshot
from navigation_bridge.supervision.preflight import check_position, check_safety
from navigation_bridge.tasks.registry import task_of
from navigation_bridge.tasks.task_kind import TaskKind
from navigation_core.outcomes import OutcomeCode
from navigation_core.safety.target_checks import Rejection

__all__ = ["Admission", "admit"]

# Time within which a goal starts that was admitted.
_TICKET_S = 0.2


@dataclass(frozen=True)
class _Ticket:
    """An admitted request, as long as nothing that it was decided by has changed.

    Attributes:
        request: the request.
        active_goal_id: the goal that was active, or None.
        snapshot: what was known.
        admitted: the admitted goal.
    """

    request: Request
    active_goal_id: str | None
    snapshot: Snapshot
    admitted: Admitted


class Admission:
    """Decides about goals for one vehicle."""

    def __init__(
        self,
        tasks: Sequence[TaskKind[Any]],
        engine: Engine,
        vehicle: Vehicle,
        positions: PositionTrust,
        features: Feature,
    ) -> None:
        """Decide by these."""
        self._tasks = tasks
        self._engine = engine
        self._vehicle = vehicle
        self._positions = positions
        self._features = features
        self._ticket: _Ticket | None = None

    def action_of(self, request: Request) -> str:
        """Return the name of the action of a request."""
        return task_of(request, self._tasks).action

    def redeem(
        self, request: Request, active_goal_id: str | None, now: float
    ) -> Admitted | Rejection:
        """Return a goal that was admitted just before; decide again if anything has changed."""
        ticket, self._ticket = self._ticket, None
        if (
            ticket is None
            or ticket.request != request
            or ticket.active_goal_id != active_goal_id
            or ticket.snapshot.state is not self._vehicle.state
            or ticket.snapshot.config is not self._engine.config
            or now - ticket.snapshot.time_s > _TICKET_S
            or self._features.objection(now) is not None
        ):
            return self.admit(request, active_goal_id, now)
        return ticket.admitted

    def admit(
        self, request: Request, active_goal_id: str | None, now: float
    ) -> Admitted | Rejection:
        """Return the admitted goal, or the first reason for its rejection."""
        snapshot = self._engine.look(now)
        # The new limits of the flight count from now on, for the active goal as well.
        snapshot = self._engine.bound(snapshot)
        admitted = self._decide(request, active_goal_id, snapshot)
        if isinstance(admitted, Rejection):
            return admitted
        self._ticket = _Ticket(request, active_goal_id, snapshot, admitted)
        return admitted

    def _decide(
        self, request: Request, active_goal_id: str | None, snapshot: Snapshot
    ) -> Admitted | Rejection:
        admitted, now = admit(request, self._tasks, snapshot, active_goal_id), snapshot.time_s
        if isinstance(admitted, Rejection):
            return admitted
        admitted = replace(
            admitted,
            action=self.action_of(request),
            follows_commands=isinstance(request, VelocityRequest),
        )
        checked = check_safety(admitted, snapshot)
        if isinstance(checked, Rejection) or checked.plan is None:
            return checked
        objection = self._features.objection(now)
        if objection is not None:
            return objection
        checked = self._considered(checked, request, active_goal_id, snapshot)
        if isinstance(checked, Rejection):
            return checked
        doubt, note = check_position(self._positions, now)
        if doubt is not None:
            return doubt
        return replace(checked, warnings=(*checked.warnings, note)) if note else checked

    def _considered(
        self,
        admitted: Admitted,
        request: Request,
        active_goal_id: str | None,
        snapshot: Snapshot,
    ) -> Admitted | Rejection:
        """Let the features consider a goal; it may become another one."""
        considered = self._features.consider(admitted, request, snapshot)
        if not isinstance(considered, Redirection):
            return considered
        again = self.admit(considered.request, active_goal_id, snapshot.time_s)
        if isinstance(again, Rejection):
            return considered.otherwise
        return replace(again, warnings=(*again.warnings, considered.note))


def admit(
    request: Request,
    tasks: Sequence[TaskKind[Any]],
    snapshot: Snapshot,
    active_goal_id: str | None,
) -> Admitted | Rejection:
    """Return the admitted goal for this vehicle, or the first reason for rejection."""
    if isinstance(request, NavigateRequest):
        rejection = check_request(request)
        if rejection is not None:
            return rejection
    task = task_of(request, tasks)
    rejection = _check_vehicle(snapshot)
    if rejection is not None:
        return rejection
    busy: Rejection | None = None
    if active_goal_id is not None and not snapshot.config.replace_active_goal:
        text = "A goal is active and on_new_goal is 'reject'; cancel it first."
        busy = Rejection(OutcomeCode.BUSY, text)
    if task.admit_anywhere is not None:
        return busy or task.admit_anywhere(request, snapshot)
    if not isinstance(snapshot, LocatedSnapshot):
        return Rejection(
            OutcomeCode.NO_POSITION,
            "The autopilot has no valid position yet; wait for its GPS and estimator.",
        )
    age_s, stale_s = snapshot.arrival_age_s, snapshot.config.goto.position_stale_s
    if age_s > stale_s:
        return Rejection(
            OutcomeCode.NO_POSITION,
            f"The last GLOBAL_POSITION_INT is {age_s:.1f} s old, and this goal needs one of the "
            f"last {stale_s:g} s; send it again, or check the link and the message rates.",
        )
    return busy or task.admit(request, snapshot)


def _check_vehicle(snapshot: Snapshot) -> Rejection | None:
    """Return why goals are not accepted by this vehicle, or by none, or None."""
    profile = snapshot.profile
    if not snapshot.connected:
        return Rejection(
            OutcomeCode.NO_VEHICLE,
            "No autopilot is heard on the link; check link_url and the vehicle's power.",
        )
    if snapshot.one_way:
        return Rejection(
            OutcomeCode.NO_VEHICLE,
            "The link is one way: telemetry arrives, but nothing that is sent is answered; check "
            "the way from this computer to the autopilot.",
        )
    if profile.unsupported is not None:
        return Rejection(OutcomeCode.UNSUPPORTED_VEHICLE, profile.unsupported)
    if profile.control_mode is None:
        return Rejection(
            OutcomeCode.UNSUPPORTED_VEHICLE,
            f"Goals on this vehicle ({profile.name}) are not supported; docs/autopilots.md lists "
            "the supported ones.",
        )
    return None
