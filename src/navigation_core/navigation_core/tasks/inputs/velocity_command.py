"""A velocity command of a client."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum

from navigation_core.geometry import ZERO, Vector3


class VelocityFrame(Enum):
    """The axes of a velocity command."""

    BODY = "base_link"
    """Forward, left, up of the vehicle, level whatever its roll and pitch (REP 103)."""
    MAP = "map"
    """East, north, up."""


@dataclass(frozen=True)
class VelocityCommand:
    """A velocity that a client asks for. All numbers are finite.

    Attributes:
        time_s: when it was received.
        frame: the axes of the velocity.
        linear_m_s: the velocity in these axes.
        yaw_rate_rad_s: turn rate about the vertical, counter-clockwise seen from above.
    """

    time_s: float
    frame: VelocityFrame
    linear_m_s: Vector3
    yaw_rate_rad_s: float = 0.0

    @property
    def is_zero(self) -> bool:
        """Whether it asks the vehicle to stand still."""
        return self.linear_m_s == ZERO and self.yaw_rate_rad_s == 0.0

    def velocity_enu_m_s(self, yaw_enu_rad: float) -> Vector3:
        """Return the velocity in the map frame, for a vehicle with this yaw."""
        if self.frame is VelocityFrame.MAP:
            return self.linear_m_s
        forward, left, up = self.linear_m_s
        cosine, sine = math.cos(yaw_enu_rad), math.sin(yaw_enu_rad)
        return (forward * cosine - left * sine, forward * sine + left * cosine, up)
