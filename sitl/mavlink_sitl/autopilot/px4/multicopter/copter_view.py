"""A copter with PX4 as its modes see it."""

from __future__ import annotations

from typing import Protocol

from mavlink_sitl.autopilot.px4.multicopter.copter_navigation import CopterNavigator
from mavlink_sitl.autopilot.px4.px4_view import Px4View


class Px4CopterView(Px4View, Protocol):
    """The members are those of `copter.Px4Copter`."""

    @property
    def navigator(self) -> CopterNavigator:
        """Origin, home and limits."""
