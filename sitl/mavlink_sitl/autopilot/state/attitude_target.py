"""SET_ATTITUDE_TARGET in GUIDED: a lean, a turn and a climb rate, without any position.

The thrust field is a climb rate, as it is unless GUID_OPTIONS says otherwise: 0.5 holds the
height, 1 climbs with WPNAV_SPEED_UP, 0 sinks with WPNAV_SPEED_DN. Body rates turn the attitude
on. After GUID_TIMEOUT without a new one the vehicle is level, keeps its height and drifts.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from mavlink_sitl.exchange import Guidance, Limits, Motion, Motors, Vector, YawMode

Quaternion = tuple[float, float, float, float]
"""w, x, y, z; from forward-right-down to NED"""

HOLD_HEIGHT = 0.5
LEAST_UPRIGHT = 0.3
"""Cosine of the steepest lean that is flown: the thrust has to carry, too"""


@dataclass(frozen=True)
class AttitudeTarget:
    """The requested attitude.

    Attributes:
        quaternion: the attitude, of length 1; None to turn on from the present one.
        rates_rad_s: about the body's axes, forward-right-down.
        thrust: 0..1, where 0.5 holds the height; of a rover -1..1.
        turns: a rate about the yaw axis was given.
    """

    quaternion: Quaternion | None
    rates_rad_s: Vector
    thrust: float
    turns: bool = False

    @property
    def yaw_rad(self) -> float:
        """The heading of the attitude; North of none."""
        w, x, y, z = self.quaternion or (1.0, 0.0, 0.0, 0.0)
        return math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))

    def climb_rate_m_s(self, limits: Limits) -> float:
        """The climb rate that the thrust stands for; positive is up."""
        share = 2.0 * (min(max(self.thrust, 0.0), 1.0) - HOLD_HEIGHT)
        return share * (limits.speed_up_m_s if share > 0.0 else limits.speed_down_m_s)

    def turned_on(self, motion: Motion, dt: float) -> AttitudeTarget:
        """The same `dt` later: with the attitude that the rates have led to."""
        start = self.quaternion or from_angles(motion.roll_rad, motion.pitch_rad, motion.yaw_rad)
        p, q, r = (0.5 * dt * rate for rate in self.rates_rad_s)
        w, x, y, z = start
        turned = (
            w - x * p - y * q - z * r,
            x + w * p + y * r - z * q,
            y + w * q + z * p - x * r,
            z + w * r + x * q - y * p,
        )
        length = math.sqrt(math.fsum(value * value for value in turned))
        w, x, y, z = (value / length for value in turned)
        return replace(self, quaternion=(w, x, y, z))

    def levelled(self, motion: Motion) -> AttitudeTarget:
        """The target after a timeout: level, at the present heading and height."""
        return AttitudeTarget(from_angles(0.0, 0.0, motion.yaw_rad), (0.0, 0.0, 0.0), HOLD_HEIGHT)

    def guidance(self, limits: Limits, begins: bool) -> Guidance:
        """The guidance for the controllers; only with a quaternion."""
        w, x, y, z = self.quaternion or (1.0, 0.0, 0.0, 0.0)
        upright = max(1.0 - 2.0 * (x * x + y * y), LEAST_UPRIGHT)
        return Guidance(
            motors=Motors.FLY,
            direct_lean=1.0,
            lean_north=-2.0 * (x * z + w * y) / upright,
            lean_east=-2.0 * (y * z - w * x) / upright,
            velocity_down_m_s=-self.climb_rate_m_s(limits),
            yaw_mode=YawMode.ANGLE,
            yaw_rad=self.yaw_rad,
            limits=limits,
            restart_xy=begins,
            restart_z=begins,
        )


def from_angles(roll_rad: float, pitch_rad: float, yaw_rad: float) -> Quaternion:
    """An attitude from Euler angles: yaw, then pitch, then roll."""
    cr, sr = math.cos(roll_rad / 2), math.sin(roll_rad / 2)
    cp, sp = math.cos(pitch_rad / 2), math.sin(pitch_rad / 2)
    cy, sy = math.cos(yaw_rad / 2), math.sin(yaw_rad / 2)
    return (
        cr * cp * cy + sr * sp * sy,
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
    )
