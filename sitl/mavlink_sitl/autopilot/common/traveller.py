"""The common base of rovers, boats and planes, as opposed to copters."""

from __future__ import annotations

from abc import abstractmethod

from mavlink_sitl.autopilot.common.commander import Commander
from mavlink_sitl.autopilot.common.navigation_report import NavigationReport
from mavlink_sitl.exchange import ModeChanged, Observation, SystemStatus, Vector


class Traveller(Commander):
    """A vehicle that cannot hover. Arguments and attributes as of `Commander`."""

    def update(self, observation: Observation) -> None:
        """See `Commander`; the end of starting is told at once."""
        was = self.started
        super().update(observation)
        if self.started and not was:
            self.events.append(ModeChanged(self.mode.spec.name, False))

    @property
    def system_status(self) -> SystemStatus:
        """For HEARTBEAT."""
        if not self.started:
            return SystemStatus.CALIBRATING
        if self.failsafe.active:
            return SystemStatus.CRITICAL
        return SystemStatus.ACTIVE if self.is_active() else SystemStatus.STANDBY

    @abstractmethod
    def is_active(self) -> bool:
        """Whether it does something."""

    def sticks_us(self) -> list[int]:
        """The pilot's channels, microseconds."""
        return self.pilot.channels(self.now_s, self.parameters["RC_OVERRIDE_TIME"])

    @abstractmethod
    def navigation_report(self) -> NavigationReport | None:
        """For NAV_CONTROLLER_OUTPUT; None in modes that say nothing."""

    @abstractmethod
    def destination_ned_m(self) -> Vector | None:
        """The destination, for POSITION_TARGET_GLOBAL_INT."""
