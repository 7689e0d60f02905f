"""PX4's OFFBOARD: what a stream of setpoints asks for, axis by axis."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

from mavlink_sitl.autopilot.guided import Frame, Setpoint, Vector
from mavlink_sitl.autopilot.px4.modes import ZERO, Px4Mode
from mavlink_sitl.exchange import Guidance, Motors, YawMode

if TYPE_CHECKING:
    from mavlink_sitl.autopilot.personality import ModeSpec
    from mavlink_sitl.autopilot.px4.copter import Px4Copter


class Offboard(Px4Mode):
    """Follows the stream of setpoints; NaN components (None here) are left to the loops."""

    def __init__(self, copter: Px4Copter, spec: ModeSpec) -> None:
        """See the class."""
        super().__init__(copter, spec)
        self.target = Setpoint(Frame.LOCAL, velocity_m_s=ZERO)
        self._fresh = True

    def enter(self) -> None:
        """Follow the latest setpoint; without one, stop."""
        self._fresh = True
        if self.px4.stream_alive():
            self._follow()
        else:
            self.guide(self.brake_guidance())

    def take(self, setpoint: Setpoint) -> None:
        """A new setpoint, in LOCAL or BODY (velocity only)."""
        velocity = setpoint.velocity_m_s
        if setpoint.frame is Frame.BODY:
            if velocity is not None:
                c, s = math.cos(self.px4.motion.yaw_rad), math.sin(self.px4.motion.yaw_rad)
                north = velocity[0] * c - velocity[1] * s
                east = velocity[0] * s + velocity[1] * c
                velocity = (north, east, velocity[2])
            setpoint = replace(setpoint, frame=Frame.LOCAL, position_m=None, velocity_m_s=velocity)
        same = setpoint == self.target and not self._fresh
        self.target = setpoint
        if self.px4.mode is self and not same:
            self._follow()

    def _follow(self) -> None:
        s = self.target
        yaw_mode = YawMode.HOLD
        if s.yaw_rad is not None:
            yaw_mode = YawMode.ANGLE
        elif s.yaw_rate_rad_s is not None:
            yaw_mode = YawMode.RATE
        position, velocity = _given(s.position_m), _given(s.velocity_m_s)
        acceleration = _given(s.acceleration_m_s2)
        place, speed, push = (
            _zeros(v) for v in (s.position_m, s.velocity_m_s, s.acceleration_m_s2)
        )
        fresh, self._fresh = self._fresh, False
        self.guide(
            Guidance(
                motors=Motors.FLY,
                track_position_xy=float(position[0]),
                track_position_z=float(position[1]),
                # Where nothing is asked for, it brakes.
                track_velocity_xy=float(position[0] or velocity[0] or not acceleration[0]),
                track_velocity_z=float(position[1] or velocity[1] or not acceleration[1]),
                north_m=place[0],
                east_m=place[1],
                down_m=place[2],
                velocity_north_m_s=speed[0],
                velocity_east_m_s=speed[1],
                velocity_down_m_s=speed[2],
                acceleration_north_m_s2=push[0],
                acceleration_east_m_s2=push[1],
                acceleration_down_m_s2=push[2],
                yaw_mode=yaw_mode,
                yaw_rad=s.yaw_rad or 0.0,
                yaw_rate_rad_s=s.yaw_rate_rad_s or 0.0,
                limits=self.px4.px4_navigator.direct_limits(),
                restart_xy=fresh,
                restart_z=fresh,
            )
        )

    def wants_to_lift(self) -> bool:
        """A place above, a climb or an upward push."""
        s = self.target
        if not self.px4.stream_alive():
            return False
        if s.position_m is not None:
            return s.position_m[2] < self.px4.motion.down_m - 0.2
        if s.velocity_m_s is not None:
            return s.velocity_m_s[2] < -0.3
        return s.acceleration_m_s2 is not None and s.acceleration_m_s2[2] < -0.3


def _given(vector: Vector | None) -> tuple[bool, bool]:
    """Whether North and East, and whether down, are asked for."""
    if vector is None:
        return False, False
    return not (math.isnan(vector[0]) or math.isnan(vector[1])), not math.isnan(vector[2])


def _zeros(vector: Vector | None) -> Vector:
    """The vector with zeros for what is not asked for."""
    level, upright = _given(vector)
    north, east, down = vector or ZERO
    return (north if level else 0.0, east if level else 0.0, down if upright else 0.0)
