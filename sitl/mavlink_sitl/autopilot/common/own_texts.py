"""Texts that a firmware sends by itself: lines of its start, GPS lost and back, hard landings."""

from __future__ import annotations

from typing import TYPE_CHECKING

from mavlink_sitl.exchange import Observation, Severity

if TYPE_CHECKING:
    from mavlink_sitl.autopilot.common.firmware import Firmware


class OwnTexts:
    """The texts of one firmware, from one power-up to the next."""

    def __init__(self, vehicle: Firmware, observation: Observation) -> None:
        self._vehicle = vehicle
        self._begun = 0
        self._aiding_lost = False
        self._impact_m_s = observation.impact_m_s

    def update(self, observation: Observation) -> None:
        """Say what is due."""
        self._say_start()
        self._say_aiding()
        impact_m_s = observation.impact_m_s
        if impact_m_s not in (0.0, self._impact_m_s) and self._vehicle.personality.says_impacts:
            self._vehicle.say(Severity.INFO, f"SIM Hit ground at {impact_m_s:.6f} m/s")
        self._impact_m_s = impact_m_s

    def passed(self, text: str) -> bool:
        """Whether a line of the start has its time behind it; one that never comes has, too."""
        steps = self._vehicle.personality.boot
        return self._is_due(next((step.at_s for step in steps if step.text == text), 0.0))

    def _is_due(self, at_s: float) -> bool:
        return self._vehicle.now_s >= self._vehicle.estimator.scaled(at_s)

    def _say_start(self) -> None:
        steps = self._vehicle.personality.boot
        while self._begun < len(steps) and self._is_due(steps[self._begun].at_s):
            elevation = self._vehicle.navigator.origin.altitude_amsl_m
            text = steps[self._begun].text.format(elevation=elevation)
            self._vehicle.say(Severity.INFO, text)
            self._begun += 1

    def _say_aiding(self) -> None:
        """Texts of the real copter, 15 s after its GPS went off and when it was back."""
        lost = self._vehicle.estimator.lost
        if lost is self._aiding_lost:
            return
        self._aiding_lost = lost
        for name in self._vehicle.personality.estimators:
            if lost:
                self._vehicle.say(Severity.WARNING, f"{name} stopped aiding")
            else:
                self._vehicle.say(Severity.INFO, f"{name} is using GPS")
