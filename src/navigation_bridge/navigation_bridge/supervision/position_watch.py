"""Handling of goals while the reported position is in doubt. No ROS.

An active goal is held by velocity. It is resumed when the doubt is over, or ends with NO_POSITION
after a timeout. Its result reports duration and reason of the doubt.
:mod:`mavlink_vehicle.state.position_trust` defines the signs.
"""

from __future__ import annotations

from mavlink_vehicle.state.position_trust import JUMP_MAX_M, PositionTrust
from mavlink_vehicle.state.telemetry import GlobalPosition
from mavlink_vehicle.state.vehicle_state import VehicleState
from navigation_bridge.goals.goal import ActiveGoal, LogLevel
from navigation_bridge.reporting import Reporter
from navigation_bridge.snapshot import PositionFault, Snapshot
from navigation_core.outcomes import OutcomeCode, Rejection
from navigation_core.tasks.intents import Outcome

# A client that repeats a goal at once after a jump has not checked the position.
_JUMP_RECENT_S = 60.0


class PositionWatch:
    """Monitors one vehicle's position and handles doubts for the active goal."""

    def __init__(self, report: Reporter, timeout_s: float) -> None:
        """Start without observations.

        Args:
            report: receives doubts.
            timeout_s: time for which a goal is held.
        """
        self._report = report
        self._timeout_s = timeout_s
        self._trust = PositionTrust()

    def configure(self, timeout_s: float) -> None:
        """Apply another timeout."""
        self._timeout_s = timeout_s

    def observe(self, before: VehicleState, state: VehicleState, now: float) -> None:
        """Process a change of state."""
        self._trust.observe(before, state, now)

    def follow(
        self,
        last: GlobalPosition | None,
        state: VehicleState,
        here: GlobalPosition | None,
        now: float,
    ) -> None:
        """Process a position of which nothing else of the state has changed.

        Args:
            last: the position before.
            state: the state, whose own position is of no account.
            here: the position.
            now: time in seconds.
        """
        self._trust.follow(last, state, here, now)

    def check(self, now: float) -> tuple[Rejection | None, str]:
        """Return a rejection of a goal before it starts, or a warning."""
        trust = self._trust
        if trust.complaint:
            text = f"The position is in doubt: {trust.complaint}."
            return Rejection(OutcomeCode.NO_POSITION, text), ""
        jumped_s, jump_m = trust.jumped_s, trust.jump_m()
        if jumped_s is None or jump_m <= JUMP_MAX_M:
            return None, ""
        text = (
            f"The position jumped by {jump_m:.1f} m, {now - jumped_s:.0f} s ago, and has not "
            "jumped back; positions may be off by that much."
        )
        if now - jumped_s > _JUMP_RECENT_S:
            return None, text
        wait_s = _JUMP_RECENT_S - (now - jumped_s)
        hint = f"Check where the vehicle is; goals are accepted again in {wait_s:.0f} s."
        return Rejection(OutcomeCode.NO_POSITION, f"{text} {hint}"), ""

    def begin(self, goal: ActiveGoal) -> None:
        """Accept the jumps so far as part of the goal's frame."""
        goal.doubt.jumps_ned_m = self._trust.jump_ned_m

    def fault(self, goal: ActiveGoal) -> PositionFault | None:
        """Return why the position is in doubt for a goal, or None."""
        jump_m = self._trust.jump_m(goal.doubt.jumps_ned_m)
        if jump_m > JUMP_MAX_M:
            reason = f"the position has jumped by {jump_m:.1f} m"
            return PositionFault(GlobalPosition, reason)
        found = self._trust.fault
        return None if found is None else PositionFault(*found)

    def watch(self, goal: ActiveGoal, snapshot: Snapshot) -> Outcome | None:
        """Monitor the doubt about the active goal's position; return the outcome at the timeout."""
        doubt, fault, now = goal.doubt, snapshot.fault, snapshot.time_s
        if fault is None:
            if doubt.since_s is not None:
                self.conclude(goal, now)
                self._tell(goal, "The position is reliable again.")
            return None
        source, reason = fault.source, fault.reason
        if doubt.since_s is None:
            doubt.since_s = now
            self._tell(goal, f"The position is in doubt: {reason}.")
        elif source not in doubt.reasons:
            self._tell(goal, f"The position is still in doubt: {reason}.")
        # A position that is stuck jumps at each step, by more each time: that is reported once.
        doubt.reasons[source] = reason
        if goal.plan is None or goal.ending or now - doubt.since_s <= self._timeout_s:
            return None  # a landing and a return continue under the vehicle's own control
        text = f"The position is still in doubt after {self._timeout_s:g} s: {reason}."
        return Outcome(OutcomeCode.NO_POSITION, text, None)

    def conclude(self, goal: ActiveGoal, now: float) -> None:
        """Add past doubts to the notes of the goal."""
        doubt = goal.doubt
        if doubt.since_s is None:
            return
        goal.notes.append(
            f"The position was in doubt for {now - doubt.since_s:.1f} s, starting at "
            f"{doubt.since_s - goal.accepted_s:.0f} s ({'; '.join(doubt.reasons.values())})."
        )
        doubt.since_s, doubt.reasons = None, {}

    def _tell(self, goal: ActiveGoal, text: str) -> None:
        self._report.log(LogLevel.WARN, f"Goal {goal.short_id}: {text}")
        self._report.remark(goal, text)
