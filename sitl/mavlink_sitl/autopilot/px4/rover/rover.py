"""PX4 for a car with steered front wheels or a boat: no altitude, never landed while driving.

Rules read in the source of v1.17 (rover_ackermann, RoverLandDetector, Commander, Navigator), and
seen once of its simulated rover.
"""

from __future__ import annotations

import math

from mavlink_sitl.autopilot.common.firmware import Inputs, Landing
from mavlink_sitl.autopilot.px4.navigation import Px4Navigator, within
from mavlink_sitl.autopilot.px4.rover import rover_modes
from mavlink_sitl.autopilot.px4.rover.pursuit import Point
from mavlink_sitl.autopilot.px4.rover.rover_mission import RoverMission
from mavlink_sitl.autopilot.px4.vehicle import Px4Vehicle, px4_table
from mavlink_sitl.autopilot.state.navigation import LEAST_LIMIT
from mavlink_sitl.exchange import Limits, Motors, YawMode
from mavlink_sitl.guidance import DriveGuidance

DRIVING_AFTER_S = 0.5
"""From arming until the land detector no longer says landed"""
_FASTEST_M_S = 50.0


class RoverNavigator(Px4Navigator):
    """Origin, home and limits of a rover."""

    def cruise_m_s(self) -> float:
        """The cruise speed, never above RO_SPEED_LIM."""
        limit = within(self._parameters["RO_SPEED_LIM"], 0.0, _FASTEST_M_S)
        return limit if self._speed_xy_m_s is None else min(self._speed_xy_m_s, limit)

    def limits(self) -> Limits:
        """Speed and acceleration; without a limit the body's."""
        acceleration = self._parameters["RO_ACCEL_LIM"]
        if acceleration <= 0.0:
            acceleration = _FASTEST_M_S
        return Limits(
            speed_xy_m_s=max(self.cruise_m_s(), LEAST_LIMIT),
            acceleration_xy_m_s2=within(acceleration, LEAST_LIMIT, _FASTEST_M_S),
        )


def _landed_at_rest(landing: Landing, inputs: Inputs) -> Landing:
    """Disarmed, in AUTO.LAND, or at the end of AUTO.RTL."""
    return landing._replace(landed=not inputs.armed or inputs.at_rest)


class Px4Rover(Px4Vehicle):
    """A car or a boat with PX4."""

    navigator: RoverNavigator
    table = px4_table(
        modes={
            "px4_hold": rover_modes.Hold,
            "px4_manual": rover_modes.Manual,
            "px4_altitude": rover_modes.Manual,
            "px4_position": rover_modes.Position,
            "px4_mission": RoverMission,
            "px4_return": rover_modes.Return,
            "px4_offboard": rover_modes.Offboard,
            "px4_takeoff": rover_modes.Takeoff,
            "px4_land": rover_modes.Land,
        },
        navigator=RoverNavigator,
        landing=_landed_at_rest,
    )

    # State.

    def takes_off(self) -> bool:
        """A moment after arming."""
        return not self.landed and self.now_s - self.arming.armed_at_s >= DRIVING_AFTER_S

    def may_disarm(self) -> bool:
        """Always, also while it rolls."""
        return True

    def can_run(self, number: int) -> bool:
        """Whether a mode has what it needs; a height to hold there is none."""
        impossible = self.personality.modes[number].behaviour == "px4_altitude"
        return not impossible and super().can_run(number)

    def accept_m(self) -> float:
        """The acceptance radius (NAV_ACC_RAD)."""
        return within(self.parameters["NAV_ACC_RAD"], 0.05, 200.0)

    def is_still(self) -> bool:
        """Whether it stands, by RO_SPEED_TH."""
        motion = self.motion
        speed = motion.speed_m_s
        return speed <= max(self.parameters["RO_SPEED_TH"], 0.01)

    def yaw_rate_limit_rad_s(self) -> float:
        """RO_YAW_RATE_LIM."""
        return math.radians(within(self.parameters["RO_YAW_RATE_LIM"], 0.0, 720.0))

    def turning_radius_m(self) -> float:
        """The tightest curve, of the steered axle."""
        return self._wheel_base_m() / math.sin(self._max_steer_rad())

    def _wheel_base_m(self) -> float:
        return within(self.parameters["RA_WHEEL_BASE"], 0.01, 20.0)

    def _max_steer_rad(self) -> float:
        return within(self.parameters["RA_MAX_STR_ANG"], 0.05, 1.5)

    def reduced_m_s(self, share: float) -> float:
        """The speed limit in a turn, by its share of half a turn, 0..1 (RO_SPEED_RED).

        Never slower than what turns it at RO_YAW_RATE_LIM with the wheels at their stop.
        """
        p = self.parameters
        slowest = self._wheel_base_m() * self.yaw_rate_limit_rad_s()
        slowest /= math.tan(self._max_steer_rad())
        most = within(p["RO_MAX_THR_SPEED"], 0.0, _FASTEST_M_S)
        reduction = min(within(p["RO_SPEED_RED"], 0.0, 1e3) * share, 1.0)
        return max(most * (1.0 - reduction), min(slowest, most))

    def drive_guidance(
        self, speed_m_s: float, yaw_rad: float | None, place: Point | None = None
    ) -> DriveGuidance:
        """Drive at a speed, with the nose somewhere or straight on.

        Args:
            speed_m_s: along the nose.
            yaw_rad: where the nose is to point; None to keep the wheels straight.
            place: where that leads, for telemetry; here when None.
        """
        north, east = self.motion[:2] if place is None else place
        return DriveGuidance(
            motors=Motors.FLY,
            north_m=north,
            east_m=east,
            down_m=self.motion.down_m,
            speed_m_s=speed_m_s,
            yaw_mode=YawMode.HOLD if yaw_rad is None else YawMode.ANGLE,
            yaw_rad=yaw_rad or 0.0,
            turn_gain_1_s=within(self.parameters["RO_YAW_P"], 0.0, 50.0),
            turn_rate_limit_rad_s=self.yaw_rate_limit_rad_s(),
            limits=self.navigator.limits(),
        )
