"""A rover or boat as its modes, missions and failsafes see it."""

from __future__ import annotations

from typing import Protocol

from mavlink_sitl.autopilot.state.breadcrumbs import Breadcrumbs
from mavlink_sitl.autopilot.state.vehicle_view import VehicleView
from mavlink_sitl.exchange import Result

Point = tuple[float, float]


class RestingMode(Protocol):
    """A mode that has arrived."""

    def stop(self) -> None:
        """Brake."""

    def stay_at(self, point: Point) -> None:
        """Keep near a point."""


class RoverView(VehicleView, Protocol):
    """The members are those of `rover.Rover`."""

    backwards: bool
    trail: Breadcrumbs[Point] | None

    def cruise_m_s(self) -> float:
        """The cruise speed."""

    def turn_limit_rad_s(self, speed_m_s: float) -> float:
        """The largest turn rate at a speed."""

    def stopping_point(self) -> Point:
        """The point at which it would stop if it braked now."""

    def sticks(self) -> tuple[float, float]:
        """Steering and throttle, -1..1."""

    def arm(self, force: bool = False) -> Result:
        """Arm the motors."""

    def rest_at(self, mode: RestingMode, place: Point) -> None:
        """The guidance after arrival."""
