"""Lateness of the server's setpoints, and of the data that they are made from. No ROS."""

from __future__ import annotations

import math
from dataclasses import replace

from mavlink_vehicle.vehicle import Vehicle
from navigation_bridge.goals.goal import LogLevel
from navigation_bridge.reporting import Reporter
from navigation_core.outcomes import OutcomeCode
from navigation_core.safety.lateness import TOO_LATE_S, Lateness
from navigation_core.tasks.intents import Outcome

__all__ = ["LatenessWatch", "own_share"]

# The ends that a vehicle that was slowed down or not listened to may come to.
_BY_LATENESS = frozenset({OutcomeCode.NO_POSITION, OutcomeCode.TIMEOUT})
# Minimum interval of warnings about a late loop.
_WARNING_INTERVAL_S = 2.0


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
