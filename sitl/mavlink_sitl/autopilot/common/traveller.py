"""The common base of rovers, boats and planes, as opposed to copters."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Mapping
from typing import Any, ClassVar

from mavlink_sitl.autopilot.ardupilot.copter.copter import Copter
from mavlink_sitl.autopilot.ardupilot.copter.copter_modes import Mode
from mavlink_sitl.autopilot.common.navigation_report import NavigationReport
from mavlink_sitl.autopilot.personality import ModeSpec
from mavlink_sitl.exchange import ModeChanged, Observation, Result, SystemStatus, Vector


class Traveller(Copter):
    """A vehicle that cannot hover. Arguments and attributes as of `Copter`.

    Attributes:
        behaviours: the class of the mode by its behaviour.
    """

    behaviours: ClassVar[Mapping[str, Callable[[Any, ModeSpec], Mode]]] = {}

    def make_mode(self, spec: ModeSpec) -> Mode:
        """See `Copter`."""
        return self.behaviours[spec.behaviour](self, spec)

    def update(self, observation: Observation) -> None:
        """See `Copter`; the end of starting is told at once."""
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

    def pause_or_go_on(self, go_on: bool) -> Result:
        """DO_PAUSE_CONTINUE: the firmware has it for copters only."""
        return Result.UNSUPPORTED
