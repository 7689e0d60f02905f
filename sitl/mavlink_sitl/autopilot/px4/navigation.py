"""Origin, home and limits by PX4's parameters."""

from __future__ import annotations

import math
from dataclasses import replace

from mavlink_sitl.autopilot.common.navigation import LEAST_LIMIT, Navigator
from mavlink_sitl.autopilot.common.parameters import Parameters
from mavlink_sitl.autopilot.px4.multicopter.position_law import LAG_M, UNSHAPED_M_S2
from mavlink_sitl.exchange import Limits, Motion, Vector
from mavlink_sitl.geodesy import GeoPoint, LocalFrame

ACCELERATION_Z_M_S2 = 5.0
LEAST_CLIMB_M_S = 0.5
CLIMB_REACHED = 0.84
"""Share of MPC_Z_V_AUTO_UP that RTL climbs with (`mission_clear`, `offboard_loss_stop`)"""


def within(value: float, least: float, most: float) -> float:
    """A number within limits, whatever a parameter says."""
    return min(max(value, least), most)


class Px4Navigator(Navigator):
    """A `Navigator` that tells home as it is from home as the firmware has it."""

    def __init__(self, frame: LocalFrame, parameters: Parameters) -> None:
        super().__init__(frame, parameters)
        self._true_home: GeoPoint | None = None

    def place_ned_m(self, point: GeoPoint) -> Vector:
        """A place on earth in the local frame."""
        return self.frame.to_local(point)

    def down_of_amsl(self, altitude_amsl_m: float) -> float:
        """An altitude in the local frame."""
        return self.origin.altitude_amsl_m - altitude_amsl_m

    def set_home(self) -> None:
        """Home is here."""
        super().set_home()
        self._true_home = self.home

    def true_home_ned_m(self) -> Vector:
        """Home in the local frame, before any drift."""
        return (0.0, 0.0, 0.0) if self._true_home is None else self.place_ned_m(self._true_home)

    def true_home_down_m(self) -> float:
        """Home's height in the local frame, before any drift."""
        if self._true_home is None:
            return 0.0
        return self.down_of_amsl(self._true_home.altitude_amsl_m)

    def set_home_at(self, point: GeoPoint) -> None:
        """Home is there."""
        self.home = self._true_home = point

    def drift_home(self, offset_m: float) -> None:
        """Home's altitude is off by this much for now; its place stays."""
        if self._true_home is not None:
            altitude = self._true_home.altitude_amsl_m + offset_m
            self.home = self._true_home._replace(altitude_amsl_m=altitude)


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
            acceleration_z_m_s2=ACCELERATION_Z_M_S2,
            jerk_xy_m_s3=2.0 * gain_xy * UNSHAPED_M_S2,
            jerk_z_m_s3=2.0 * gain_z * ACCELERATION_Z_M_S2,
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

        What the way over ground takes of the speed, the climb does not.
        """
        limits = self.limits()
        speed = motion.speed_m_s
        acceleration, jerk = limits.acceleration_xy_m_s2, limits.jerk_xy_m_s3
        stop_s = speed / (2.0 * acceleration) + acceleration / (2.0 * jerk)
        away_m = speed * stop_s + min(speed, LAG_M)
        climb_m = abs(motion.down_m - down_m)
        length_m = max(math.hypot(away_m, climb_m), 0.1)
        climbing = CLIMB_REACHED * limits.speed_up_m_s
        return replace(
            limits,
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
