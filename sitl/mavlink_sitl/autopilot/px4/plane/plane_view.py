"""A plane with PX4 as its modes see it."""

from __future__ import annotations

from typing import Protocol

from mavlink_sitl.autopilot.common.auto import Auto
from mavlink_sitl.autopilot.px4.plane.path_guidance import Law, Point
from mavlink_sitl.autopilot.px4.px4_view import Px4View


class Px4PlaneView(Px4View, Protocol):
    """The members are those of `plane.Px4Plane`."""

    circling: tuple[Point, float] | None
    airspeed_m_s: float

    @property
    def auto(self) -> Auto | None:
        """The mode that flies missions."""

    def law(self) -> Law:
        """How it follows a path."""

    def cruise_m_s(self) -> float:
        """The indicated airspeed that it keeps."""

    def takeoff_m_s(self) -> float:
        """The indicated airspeed of a take-off."""

    def landing_m_s(self) -> float:
        """The indicated airspeed of a landing."""

    def loiter_radius_m(self) -> float:
        """The radius of its circles; negative is counter-clockwise."""

    def accept_m(self) -> float:
        """The acceptance radius of a waypoint."""

    def height_accept_m(self) -> float:
        """How near a height is near enough."""
