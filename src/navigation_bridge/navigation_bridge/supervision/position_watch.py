"""Observation of whether a vehicle's reported position is in doubt. No ROS.

:mod:`mavlink_vehicle.state.position_trust` defines the signs, and
:mod:`navigation_bridge.rules.position` the effect on a goal.
"""

from __future__ import annotations

from mavlink_vehicle.state.position_trust import JUMP_MAX_M, PositionTrust
from mavlink_vehicle.state.telemetry import GlobalPosition
from mavlink_vehicle.state.vehicle_state import VehicleState
from navigation_bridge.snapshot import PositionFault
from navigation_core.outcomes import OutcomeCode, Rejection

# A client that repeats a goal at once after a jump has not checked the position.
_JUMP_RECENT_S = 60.0


class PositionWatch:
    """Monitors one vehicle's position."""

    def __init__(self) -> None:
        """Start without observations."""
        self._trust = PositionTrust()

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

    @property
    def jumps_ned_m(self) -> tuple[float, float]:
        """Sum of the position's jumps so far, north and east."""
        return self._trust.jump_ned_m

    def fault(self, jumps_ned_m: tuple[float, float]) -> PositionFault | None:
        """Return why the position is in doubt for a goal that began after some jumps, or None."""
        jump_m = self._trust.jump_m(jumps_ned_m)
        if jump_m > JUMP_MAX_M:
            reason = f"the position has jumped by {jump_m:.1f} m"
            return PositionFault(GlobalPosition, reason)
        found = self._trust.fault
        return None if found is None else PositionFault(*found)
