"""Setpoints, as the modes of both firmwares take them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum
from typing import NamedTuple

from mavlink_sitl.exchange import Motion, Vector


class SetpointFrame(Enum):
    """The reference of a setpoint."""

    LOCAL = "local NED"
    OFFSET = "offset from the vehicle, NED"
    BODY = "offset from the vehicle, forward-right-down"


@dataclass(frozen=True)
class Setpoint:
    """A target for GUIDED or OFFBOARD; None where the sender ignores it.

    Attributes:
        frame: of all three vectors. Velocities and accelerations are only turned by BODY.
        position_m: metres.
        velocity_m_s: metres a second.
        acceleration_m_s2: metres a second squared.
        yaw_rad: from North, or from the nose in BODY.
        yaw_rate_rad_s: clockwise.
        is_global: it came as latitude and longitude.
    """

    frame: SetpointFrame
    position_m: Vector | None = None
    velocity_m_s: Vector | None = None
    acceleration_m_s2: Vector | None = None
    yaw_rad: float | None = None
    yaw_rate_rad_s: float | None = None
    is_global: bool = False

    def place_ned_m(self, motion: Motion) -> Vector | None:
        """Its position in the local frame, of a vehicle that moves so."""
        position = self.position_m
        if position is None or self.frame is SetpointFrame.LOCAL:
            return position
        if self.frame is SetpointFrame.BODY:
            position = turned(position, motion.yaw_rad)
        north, east, down = position
        return motion.north_m + north, motion.east_m + east, motion.down_m + down


class DriveTarget(NamedTuple):
    """SET_ATTITUDE_TARGET as a rover takes it.

    Attributes:
        thrust: share of the speed, -1..1.
        heading_rad: from North; None to turn at the rate.
        turn_rate_rad_s: clockwise.
    """

    thrust: float
    heading_rad: float | None
    turn_rate_rad_s: float


def turned(vector: Vector, yaw_rad: float) -> Vector:
    """From forward-right-down to NED."""
    c, s = math.cos(yaw_rad), math.sin(yaw_rad)
    return (vector[0] * c - vector[1] * s, vector[0] * s + vector[1] * c, vector[2])
