"""Goals of clients: checked, begun, cancelled, ended with the server. No ROS."""

from __future__ import annotations

from navigation_bridge.clients.client_services import ClientServices
from navigation_bridge.clients.service_requests import ServiceRequests
from navigation_bridge.engine import Engine
from navigation_bridge.goals.active_goal import ActiveGoal
from navigation_bridge.goals.goal import LogLevel
from navigation_bridge.goals.requests import Request
from navigation_bridge.reporting import Reporter
from navigation_bridge.requests.feature import Feature
from navigation_bridge.tasks.admission import Admission
from navigation_core.outcomes import OutcomeCode
from navigation_core.safety.target_checks import Rejection
from navigation_core.tasks.intents import Outcome

__all__ = ["STOPPED", "ClientGoals"]

STOPPED = Rejection(OutcomeCode.SHUTTING_DOWN, "The navigation server was stopped.")


class ClientGoals:
    """Begins, replaces and cancels the goals of one vehicle.

    Attributes:
        recorded_id: in a replay, the goal of the server that was recorded, or None.
    """

    def __init__(
        self,
        engine: Engine,
        admission: Admission,
        report: Reporter,
        features: Feature,
        services: ClientServices,
        service_requests: ServiceRequests,
    ) -> None:
        """Begin without a goal."""
        self._engine = engine
        self._admission = admission
        self._report = report
        self._features = features
        self._services = services
        self._service_requests = service_requests
        self.recorded_id: str | None = None

    @property
    def active(self) -> ActiveGoal | None:
        """The active goal, also one that commands have started; read only."""
        return self._engine.goal

    @property
    def active_id(self) -> str | None:
        """UUID of the active goal, live or in the recording, as hexadecimal digits."""
        goal = self._engine.goal
        return self.recorded_id if goal is None else goal.goal_id

    def check(self, request: Request, now: float, goal_id: str = "") -> Rejection | None:
        """Return whether a goal would be accepted now; a rejection is also reported.

        Args:
            request: what is asked for.
            now: time, s.
            goal_id: as hexadecimal digits, so that its client knows the reason for its own.
        """
        refusal = self._services.refusal
        admitted = refusal or self._admission.admit(request, self.active_id, now)
        if not isinstance(admitted, Rejection):
            return None
        self._report.rejected(admitted, goal_id)
        return admitted

    def reject(self, rejection: Rejection, goal_id: str = "") -> None:
        """Report a goal that was rejected before it reached the bridge."""
        self._report.rejected(rejection, goal_id)

    def start(self, goal_id: str, request: Request, now: float) -> None:
        """Begin an accepted goal; it replaces the active one.

        A condition that has failed since :meth:`check` ends the goal at once, with the same code.
        """
        refusal = self._services.refusal
        admitted = refusal or self._admission.redeem(request, self.active_id, now)
        if isinstance(admitted, Rejection):
            action = self._admission.action_of(request)
            self._report.rejected_at_start(goal_id, action, admitted)
            return
        self._features.give_way("A goal was started.")
        previous, goal = self._engine.begin(goal_id, admitted, now)
        self._service_requests.give_up("A new goal was started.", now)
        if previous is not None:
            replaced = Outcome(OutcomeCode.PREEMPTED, "Replaced by another goal.", None)
            self._report.ended(previous, replaced, now)
        self._engine.start_task(goal, now)

    def cancel(self, goal_id: str, now: float, action: str = "") -> bool:
        """Cancel a goal; True if it is active and will end.

        Args:
            goal_id: UUID of the goal as hexadecimal digits.
            now: time in seconds.
            action: name of its action, within which the id is unique; empty for any.
        """
        goal = self._engine.goal
        if goal is None or goal.goal_id != goal_id or action not in ("", goal.kind):
            return False
        if goal.cancel_requested_s is None:
            goal.begin_cancel(now)
            self._report.log(LogLevel.INFO, f"Goal {goal.short_id}: cancel requested")
        return True

    def shut_down(self, now: float, why: Rejection = STOPPED) -> None:
        """Stop the vehicle where it is and end the active goal, by default with SHUTTING_DOWN.

        Args:
            now: time in seconds.
            why: code and sentence of the end.
        """
        self._features.shut_down()
        goal = self._engine.goal
        if goal is None or goal.closing is not None:
            return
        goal.stop(Outcome(why.code, why.message, None), now)

    def release(self, now: float, why: Rejection = STOPPED) -> None:
        """End the active goal and command a hold, although the vehicle may still move."""
        goal = self._engine.goal
        if goal is None:
            return
        text = f"{why.message} Whether the vehicle has stopped is unknown."
        if goal.takeover is not None:
            self._engine.abandon(why.code, text, now)
        else:
            self._engine.end(goal, Outcome(why.code, text, None), now)
