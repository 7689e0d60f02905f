"""Detects whether the vehicle is on the ground, as far as the firmware can tell."""

from __future__ import annotations

from mavlink_sitl.exchange import Observation

LANDED_AFTER_S = 1.5
"""From touching down to 'landed': 1.5 to 1.7 s in the recordings"""
LOW_THRUST = 0.75
STILL_M_S = 0.3


class LandDetector:
    """Landed while motors push little and nothing moves, for a while."""

    def __init__(self) -> None:
        """On the ground."""
        self.landed = True
        self.landed_since_s = 0.0
        self._quiet_since_s: float | None = None

    def update(self, observation: Observation, armed: bool) -> None:
        """Look at one observation."""
        now_s = observation.time_s
        if not armed:
            self._set(True, now_s)
            return
        if self.landed:
            if not observation.touching_ground:
                self._set(False, now_s)
            return
        quiet = (
            observation.thrust_over_hover < LOW_THRUST
            and abs(observation.motion.velocity_down_m_s) < STILL_M_S
        )
        if not quiet:
            self._quiet_since_s = None
        elif self._quiet_since_s is None:
            self._quiet_since_s = now_s
        elif now_s - self._quiet_since_s >= LANDED_AFTER_S:
            self._set(True, now_s)

    def leave(self) -> None:
        """Be in the air, without a take-off."""
        self.landed = False
        self._quiet_since_s = None

    def _set(self, landed: bool, now_s: float) -> None:
        if landed and not self.landed:
            self.landed_since_s = now_s
        self.landed = landed
        self._quiet_since_s = None
