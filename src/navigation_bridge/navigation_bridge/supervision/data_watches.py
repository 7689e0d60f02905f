"""Watches of the vehicle's data: how late it is, and whether its position is in doubt. No ROS.

Lateness is that of the server's setpoints, too. :mod:`mavlink_vehicle.state.position_trust` defines
the signs of a position in doubt, :mod:`navigation_bridge.rules.goal_rules` the effect on a goal.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import replace

from mavlink_vehicle.state.position_trust import JUMP_MAX_M, PositionTrust
from mavlink_vehicle.state.telemetry import GlobalPosition
from mavlink_vehicle.vehicle import Vehicle
from navigation_bridge.goals.goal import LogLevel
from navigation_bridge.reporting import Reporter
from navigation_bridge.snapshot import PositionFault
from navigation_core.outcomes import OutcomeCode, Rejection
from navigation_core.safety.late_setpoints import LATE_S, TOO_LATE_S, WINDOW_S
from navigation_core.tasks.intents import Outcome

__all__ = ["LatenessWatch", "check_position", "own_share", "position_fault"]

# The ends that a vehicle that was slowed down or not listened to may come to.
_BY_LATENESS = frozenset({OutcomeCode.NO_POSITION, OutcomeCode.TIMEOUT})
# Minimum interval of warnings about a late loop.
_WARNING_INTERVAL_S = 2.0


class Lateness:
    """Remembers the worst delay of the last seconds.

    Attributes:
        count: how many delays of more than LATE_S there were.
        worst_s: the greatest delay ever.
    """

    def __init__(self) -> None:
        """Begin without a delay."""
        self.count = 0
        self.worst_s = 0.0
        # Falling delays with their times: the first is the worst of those that still count.
        self._delays: deque[tuple[float, float]] = deque()

    def note(self, late_s: float, now: float) -> bool:
        """Record how late something was that was due.

        Args:
            late_s: the delay.
            now: when it was done.

        Returns:
            Whether that was late.
        """
        while self._delays and self._delays[-1][1] <= late_s:
            self._delays.pop()
        self._delays.append((now, late_s))
        self.worst_s = max(self.worst_s, late_s)
        if late_s < LATE_S:
            return False
        self.count += 1
        return True

    def recent_s(self, now: float) -> float:
        """Return the worst delay of the last WINDOW_S seconds."""
        while self._delays and now - self._delays[0][0] > WINDOW_S:
            self._delays.popleft()
        return self._delays[0][1] if self._delays else 0.0


class LatenessWatch:
    """Notes how late each step of a goal is.

    Attributes:
        lateness: of the steps.
        data_age_s: age of the vehicle's data when it was last read in a goal; None while unknown.
    """

    def __init__(self, vehicle: Vehicle, report: Reporter) -> None:
        """Begin without a delay."""
        self._vehicle = vehicle
        self._report = report
        self.lateness = Lateness()
        self.data_age_s: float | None = None
        self._data_time_ms: int | None = None
        self._warned_s = -math.inf

    def note_step(self, late_s: float, now: float) -> None:
        """Note a step that was due some time ago, and the age of the data that it uses."""
        if self.lateness.note(late_s, now):
            self._warn(
                f"The control loop is {late_s:.2f} s late; the vehicle is slowed down, and stopped "
                f"from {TOO_LATE_S:g} s on. Reduce the load on this machine.",
                now,
            )
        self._note_data(now)

    def _note_data(self, now: float) -> None:
        """Count data that was old when it was read as lateness: the vehicle is elsewhere by now."""
        time_ms = self._vehicle.live.boot_time_ms
        if time_ms == self._data_time_ms:
            return  # nothing came: that is for the rules about the link
        self._data_time_ms = time_ms
        vehicle = self._vehicle
        self.data_age_s = vehicle.data_age.age_s(time_ms, vehicle.live.known.boot_count, now)
        age_s = self.data_age_s or 0.0
        if self.lateness.note(age_s, now):
            self._warn(
                f"The vehicle's data is {age_s:.2f} s old when it is read; the vehicle is slowed "
                f"down, and stopped from {TOO_LATE_S:g} s on. Reduce the load on this machine, or "
                "check the link.",
                now,
            )

    def _warn(self, text: str, now: float) -> None:
        if now - self._warned_s >= _WARNING_INTERVAL_S:
            self._warned_s = now
            self._report.log(LogLevel.WARN, text)


def own_share(outcome: Outcome, late_s: float) -> Outcome:
    """Return the outcome, with the server's own lateness as its reason if it is one."""
    if late_s < TOO_LATE_S or outcome.code not in _BY_LATENESS:
        return outcome
    text = f"{outcome.message} This server was {late_s:.1f} s late itself."
    return replace(outcome, code=OutcomeCode.SERVER_LATE, message=text)


# A client that repeats a goal at once after a jump has not checked the position.
_JUMP_RECENT_S = 60.0


def check_position(trust: PositionTrust, now: float) -> tuple[Rejection | None, str]:
    """Return a rejection of a goal before it starts, or a warning."""
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


def position_fault(trust: PositionTrust, jumps_ned_m: tuple[float, float]) -> PositionFault | None:
    """Return why the position is in doubt for a goal that began after some jumps, or None."""
    if trust.jump_ned_m != jumps_ned_m:
        jump_m = trust.jump_m(jumps_ned_m)
        if jump_m > JUMP_MAX_M:
            reason = f"the position has jumped by {jump_m:.1f} m"
            return PositionFault(GlobalPosition, reason)
    found = trust.fault
    return None if found is None else PositionFault(*found)
