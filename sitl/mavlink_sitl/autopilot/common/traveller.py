"""The common base of rovers, boats and planes, as opposed to copters."""

from __future__ import annotations

from abc import abstractmethod
from typing import NamedTuple

from mavlink_sitl.autopilot.common.commander import Commander
from mavlink_sitl.exchange import ModeChanged, Observation, Vector


class NavigationReport(NamedTuple):
    """For NAV_CONTROLLER_OUTPUT; degrees clockwise from North, metres, m/s."""

    roll_deg: float = 0.0
    pitch_deg: float = 0.0
    bearing_deg: float = 0.0
    target_bearing_deg: float = 0.0
    distance_m: float = 0.0
    altitude_error_m: float = 0.0
    airspeed_error_m_s: float = 0.0
    cross_track_m: float = 0.0


class Traveller(Commander):
    """A vehicle that cannot hover. Arguments and attributes as of `Commander`."""

    def update(self, observation: Observation) -> None:
        """See `Commander`; the end of starting is reported at once."""
        was = self.started
        super().update(observation)
        if self.started and not was:
            self.events.append(ModeChanged(self.mode.spec.name, False))

    @abstractmethod
    def navigation_report(self) -> NavigationReport | None:
        """For NAV_CONTROLLER_OUTPUT; None in modes that say nothing."""

    @abstractmethod
    def destination_ned_m(self) -> Vector | None:
        """The destination, for POSITION_TARGET_GLOBAL_INT."""
