"""A plane as its modes, missions and failsafes see it."""

from __future__ import annotations

from typing import Protocol

from mavlink_sitl.autopilot.state.vehicle_view import ModeView, VehicleView
from mavlink_sitl.exchange import Vector


class PlaneView(VehicleView, Protocol):
    """The members are those of `plane.Plane`."""

    landed_at_s: float
    airspeed_m_s: float
    true_over_indicated: float
    step_s: float

    @property
    def auto(self) -> ModeView | None:
        """The mode that flies missions."""

    def sticks(self) -> Vector:
        """Roll and pitch, -1..1; throttle, 0..1."""

    def cruise_m_s(self) -> float:
        """The indicated airspeed that it keeps."""

    def set_speed(self, kind: int, speed_m_s: float) -> bool:
        """Another speed, if it makes sense."""

    def return_point_ned_m(self) -> Vector:
        """The point that RTL circles."""

    def return_to_launch(self) -> None:
        """NAV_RETURN_TO_LAUNCH in a mission."""

    def return_after_mission(self) -> None:
        """The mission is over."""

    def start_landing(self) -> bool:
        """DO_LAND_START: continue with the mission's landing, if it has one."""

    def reposition(self, place: Vector, radius_m: float = 0.0) -> None:
        """DO_REPOSITION, once in GUIDED."""
