"""A rover or boat with PX4 as its modes see it."""

from __future__ import annotations

from typing import Protocol

from mavlink_sitl.autopilot.px4.px4_view import Px4View
from mavlink_sitl.guidance import DriveGuidance

Point = tuple[float, float]


class Px4RoverView(Px4View, Protocol):
    """The members are those of `rover.Px4Rover`."""

    def cruise_m_s(self) -> float:
        """The cruise speed."""

    def accept_m(self) -> float:
        """The acceptance radius."""

    def is_still(self) -> bool:
        """Whether it stands."""

    def yaw_rate_limit_rad_s(self) -> float:
        """The fastest turn."""

    def turning_radius_m(self) -> float:
        """The tightest curve."""

    def reduced_m_s(self, share: float) -> float:
        """The speed limit in a turn, by its share of half a turn, 0..1."""

    def drive_guidance(
        self, speed_m_s: float, yaw_rad: float | None, place: Point | None = None
    ) -> DriveGuidance:
        """Drive at a speed, with the nose somewhere or straight on."""
