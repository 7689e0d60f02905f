"""PX4's OFFBOARD: interprets a stream of setpoints, axis by axis."""

from __future__ import annotations

from dataclasses import replace

from mavlink_sitl.autopilot.px4.mode import OffboardMode, given, zeros
from mavlink_sitl.autopilot.px4.multicopter.copter_modes import CopterMode
from mavlink_sitl.exchange import Guidance, Motors, YawMode


class Offboard(CopterMode, OffboardMode):
    """OFFBOARD of a multicopter."""

    def stop(self) -> None:
        """Brake as hard as the loops do."""
        limits = self.vehicle.navigator.direct_limits()
        self.guide(replace(self.hold_guidance(), limits=limits))

    def follow(self, fresh: bool) -> None:
        """See `OffboardMode`."""
        s = self.target
        yaw_mode = YawMode.HOLD
        if s.yaw_rad is not None:
            yaw_mode = YawMode.ANGLE
        elif s.yaw_rate_rad_s is not None:
            yaw_mode = YawMode.RATE
        position, velocity = given(s.position_m), given(s.velocity_m_s)
        acceleration = given(s.acceleration_m_s2)
        place, speed, push = (zeros(v) for v in (s.position_m, s.velocity_m_s, s.acceleration_m_s2))
        guidance = Guidance(
            motors=Motors.FLY,
            track_position_xy=float(position[0]),
            track_position_z=float(position[1]),
            # Where nothing is asked for, it brakes.
            track_velocity_xy=float(position[0] or velocity[0] or not acceleration[0]),
            track_velocity_z=float(position[1] or velocity[1] or not acceleration[1]),
            north_m=place[0],
            east_m=place[1],
            down_m=place[2],
            yaw_mode=yaw_mode,
            yaw_rad=s.yaw_rad or 0.0,
            yaw_rate_rad_s=s.yaw_rate_rad_s or 0.0,
            limits=self.vehicle.navigator.direct_limits(),
            restart_xy=fresh,
            restart_z=fresh,
        )
        self.guide(guidance.moving(speed, push))

    def wants_to_lift(self) -> bool:
        """A place above, a climb or an upward push."""
        s = self.target
        if not self.vehicle.stream_alive():
            return False
        if s.position_m is not None:
            return s.position_m[2] < self.vehicle.motion.down_m - 0.2
        if s.velocity_m_s is not None:
            return s.velocity_m_s[2] < -0.3
        return s.acceleration_m_s2 is not None and s.acceleration_m_s2[2] < -0.3
