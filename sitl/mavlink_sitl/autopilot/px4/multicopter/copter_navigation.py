"""Limits of a copter by PX4's parameters."""

from __future__ import annotations

import math
from dataclasses import replace

from mavlink_sitl.autopilot.px4.multicopter.position_law import LAG_M, UNSHAPED_M_S2
from mavlink_sitl.autopilot.px4.navigation import Px4Navigator
from mavlink_sitl.autopilot.state.navigation import LEAST_LIMIT
from mavlink_sitl.exchange import Limits, Motion, Vector

FADING_1_S = 10.0
"""An acceleration of a trajectory ends as late as the jerk allows (VelocitySmoothing): with a large
gain from the last error of the desired velocity to the acceleration"""
LEAST_CLIMB_M_S = 0.5
CLIMB_REACHED = 0.84
"""Share of MPC_Z_V_AUTO_UP that RTL climbs with (`mission_clear`, `offboard_loss_stop`)"""


class CopterNavigator(Px4Navigator):
    """Two sets of limits for multicopters: OFFBOARD's and that of the AUTO modes.

    The controllers shape a motion by limits of speed, acceleration and jerk. Their gains
    follow from the ratio of the latter two, so PX4's cascade of a proportional position loop
    around a proportional velocity loop is had by jerk = 2 * MPC_XY_P * acceleration.
    """

    def direct_limits(self) -> Limits:
        """OFFBOARD: the loops without a trajectory in front of them."""
        p = self._parameters
        gain_xy, gain_z = max(p["MPC_XY_P"], 0.1), max(p["MPC_Z_P"], 0.1)
        return Limits(
            speed_xy_m_s=max(p["MPC_XY_VEL_MAX"], LEAST_LIMIT),
            speed_up_m_s=max(p["MPC_Z_VEL_MAX_UP"], LEAST_LIMIT),
            speed_down_m_s=max(p["MPC_Z_VEL_MAX_DN"], LEAST_LIMIT),
            acceleration_xy_m_s2=UNSHAPED_M_S2,
            acceleration_z_m_s2=UNSHAPED_M_S2,
            jerk_xy_m_s3=2.0 * gain_xy * UNSHAPED_M_S2,
            jerk_z_m_s3=2.0 * gain_z * UNSHAPED_M_S2,
        )

    def limits(self) -> Limits:
        """The AUTO modes: cruise speed and a smooth trajectory."""
        p = self._parameters
        cruise = p["MPC_XY_CRUISE"] if self._speed_xy_m_s is None else self._speed_xy_m_s
        return Limits(
            speed_xy_m_s=max(cruise, LEAST_LIMIT),
            speed_up_m_s=max(p["MPC_Z_V_AUTO_UP"], LEAST_LIMIT),
            speed_down_m_s=max(p["MPC_Z_V_AUTO_DN"], LEAST_LIMIT),
            acceleration_xy_m_s2=max(p["MPC_ACC_HOR"], LEAST_LIMIT),
            acceleration_z_m_s2=max(p["MPC_ACC_UP_MAX"], LEAST_LIMIT),
            jerk_xy_m_s3=max(p["MPC_JERK_AUTO"], LEAST_LIMIT),
            jerk_z_m_s3=max(p["MPC_JERK_AUTO"], LEAST_LIMIT),
            fading_1_s=FADING_1_S,
        )

    def takeoff_limits(self) -> Limits:
        """AUTO take-offs: MPC_TKO_SPEED, which grows over MPC_TKO_RAMP_T."""
        p = self._parameters
        speed = max(p["MPC_TKO_SPEED"], LEAST_LIMIT)
        grow_s = max(p["MPC_TKO_RAMP_T"], 0.1)
        limits = self.limits()
        acceleration = min(speed / grow_s, limits.acceleration_z_m_s2)
        return replace(limits, speed_up_m_s=speed, acceleration_z_m_s2=acceleration)

    def climb_limits(self, motion: Motion, down_m: float) -> Limits:
        """A climb to above where it is, along a line from where it stops.

        The horizontal part of that line uses up some of the speed, which the climb then lacks.
        And it takes as long to reach its speed as the vehicle to stop: the axes of a trajectory
        are synchronized (VelocitySmoothing::timeSynchronization).
        """
        limits = self.limits()
        speed = motion.speed_m_s
        acceleration, jerk = limits.acceleration_xy_m_s2, limits.jerk_xy_m_s3
        stop_s = speed / (2.0 * acceleration) + acceleration / (2.0 * jerk)
        away_m = speed * stop_s + min(speed, LAG_M)
        climb_m = abs(motion.down_m - down_m)
        length_m = max(math.hypot(away_m, climb_m), 0.1)
        climbing = CLIMB_REACHED * limits.speed_up_m_s
        stopping_s = max(speed / acceleration, climbing / limits.acceleration_z_m_s2)
        return replace(
            limits,
            acceleration_z_m_s2=climbing / stopping_s,
            speed_xy_m_s=max(climbing * away_m / length_m, LEAST_CLIMB_M_S),
            speed_up_m_s=max(climbing * climb_m / length_m, LEAST_CLIMB_M_S),
        )

    def line_limits(self, start: Vector, end: Vector) -> Limits:
        """The AUTO modes fly a straight line, so height changes no faster than the way goes."""
        limits = self.limits()
        length = math.dist(start[:2], end[:2])
        if length < 2.0:
            return limits
        slope = max(abs(end[2] - start[2]) / length * limits.speed_xy_m_s, 0.3)
        return replace(
            limits,
            speed_up_m_s=min(limits.speed_up_m_s, slope),
            speed_down_m_s=min(limits.speed_down_m_s, slope),
        )
