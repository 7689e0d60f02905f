"""The speed and course of a rover or boat that drives by velocity commands.

It moves along its nose only. One with the trait ``drives_by_turn_rate`` is sent a speed, also
backwards, and a turn rate; another is sent a velocity, whose direction it steers to, so a turn rate
turns that direction, and it cannot be driven backwards.
"""

from __future__ import annotations

import math

from navigation_core.geometry import ZERO, KinematicState, dot, horizontal_norm, wrap_angle
from navigation_core.limits import Limits
from navigation_core.tasks.inputs.velocity_command import VelocityCommand, VelocityFrame
from navigation_core.tasks.intents import Fly, Setpoint
from navigation_core.tasks.leading.pursuit import without_turn
from navigation_core.tasks.observation import Observation
from navigation_core.tasks.traits import Traits

__all__ = ["DrivenReference"]

# The course leads the nose by no more than this: a vehicle that steers hardest at a right angle
# would otherwise continue to turn long after the command has ended.
_COURSE_LEAD_RAD = 0.8
# Excess speed over ground is taken off the commanded speed this many times, and ever more while it
# lasts, up to half of it: PX4's rovers drive 1.4 m/s when 1.0 is sent (observed on its simulated
# one).
_EXCESS_GAIN, _EXCESS_GAIN_1_S = 2.0, 0.5
_STANDS_M_S = 0.01
# The speed is raised towards the commanded one in proportion to the difference, and at least at
# this rate: ArduRover's speed controller overshoots a ramp that ends abruptly by a quarter (see
# Pursuit).
_EASE_1_S, _LEAST_M_S2 = 0.7, 0.1


class DrivenReference:
    """Speed and course that the vehicle is to have now."""

    def __init__(self, traits: Traits, limits: Limits) -> None:
        """Prepare.

        Args:
            traits: what the vehicle can do.
            limits: speed, acceleration and turn rate that are kept.
        """
        self._traits = traits
        self._limits = limits
        self.speed_m_s = 0.0
        """Negative backwards."""
        self.course_enu_rad = 0.0
        # By how much the speed sent is below the one to be driven.
        self._less_m_s = 0.0
        self._since_s = 0.0

    def begin(self, here: KinematicState, yaw_enu_rad: float) -> None:
        """Continue from the measured motion."""
        nose = (math.cos(yaw_enu_rad), math.sin(yaw_enu_rad), 0.0)
        forward_m_s = dot(here.velocity_enu_m_s, nose)
        least_m_s = -math.inf if self._traits.drives_by_turn_rate else 0.0
        self.speed_m_s = max(forward_m_s, least_m_s)
        self.course_enu_rad = yaw_enu_rad

    def wanted_m_s(self, command: VelocityCommand | None) -> float:
        """Return the speed along the nose, or in the map along the course, that is asked for."""
        if command is None:
            return 0.0
        if command.frame is VelocityFrame.MAP:
            speed_m_s = horizontal_norm(command.linear_m_s)
        else:
            speed_m_s = command.linear_m_s[0]
        most_m_s = self._limits.speed_horizontal_m_s
        return min(max(speed_m_s, -most_m_s), most_m_s)

    def advance(
        self,
        dt_s: float,
        speed_m_s: float,
        command: VelocityCommand | None,
        yaw_enu_rad: float,
        brake_factor: float = 1.0,
    ) -> None:
        """Continue towards a speed.

        Args:
            dt_s: time since the last call.
            speed_m_s: what of the speed that is asked for may be driven.
            command: the command, None to stop.
            yaw_enu_rad: the measured yaw.
            brake_factor: how many times harder than usual it may brake.
        """
        if speed_m_s < 0.0 and not self._traits.drives_by_turn_rate:
            speed_m_s = 0.0
        slower = abs(speed_m_s) < abs(self.speed_m_s) or speed_m_s * self.speed_m_s < 0.0
        rate = self._limits.acceleration_horizontal_m_s2
        if slower:
            rate *= brake_factor
        else:
            left_m_s = abs(speed_m_s) - abs(self.speed_m_s)
            rate = min(rate, max(_EASE_1_S * left_m_s, _LEAST_M_S2))
        # While it slows down it lags, and is not too fast.
        self._since_s = 0.0 if slower else dt_s
        step = rate * dt_s
        self.speed_m_s += min(max(speed_m_s - self.speed_m_s, -step), step)
        self._steer(command, yaw_enu_rad, dt_s)

    def _steer(self, command: VelocityCommand | None, yaw_enu_rad: float, dt_s: float) -> None:
        if command is not None and command.frame is VelocityFrame.MAP:
            east, north, _ = command.linear_m_s
            if horizontal_norm(command.linear_m_s) > _STANDS_M_S:
                self.course_enu_rad = math.atan2(north, east)
            return
        rate_rad_s = self.turn_rate_rad_s(command)
        if abs(self.speed_m_s) < _STANDS_M_S:
            self.course_enu_rad = yaw_enu_rad
        course = wrap_angle(self.course_enu_rad + rate_rad_s * dt_s)
        lead = wrap_angle(course - yaw_enu_rad)
        lead = min(max(lead, -_COURSE_LEAD_RAD), _COURSE_LEAD_RAD)
        self.course_enu_rad = wrap_angle(yaw_enu_rad + lead)

    def turn_rate_rad_s(self, command: VelocityCommand | None) -> float:
        """Return the turn rate that is asked for, within the limits."""
        if command is None:
            return 0.0
        most = min(self._limits.yaw_rate_rad_s, self._traits.turn_rate_rad_s)
        return min(max(command.yaw_rate_rad_s, -most), most)

    def answer(
        self,
        command: VelocityCommand | None,
        here: KinematicState,
        yaw: float,
        observation: Observation,
    ) -> Fly:
        """Return what to send now, for a measured state and yaw."""
        speed_m_s = self._commanded_m_s(here)
        in_map = command is not None and command.frame is VelocityFrame.MAP
        if self._traits.drives_by_turn_rate and not in_map:
            setpoint = Setpoint(here.position_enu_m, _along(yaw, speed_m_s), ZERO, yaw)
            return Fly(setpoint, True, self.turn_rate_rad_s(command))
        course = self.course_enu_rad
        velocity = _along(course, speed_m_s) if abs(speed_m_s) > _STANDS_M_S else ZERO
        setpoint = Setpoint(here.position_enu_m, velocity, ZERO, course)
        return Fly(without_turn(setpoint, observation), True)

    def _commanded_m_s(self, here: KinematicState) -> float:
        """Return the speed to send, less than the wanted one while the vehicle is too fast."""
        lagging = self._since_s == 0.0
        kept_m_s = self._limits.speed_horizontal_m_s if lagging else abs(self.speed_m_s)
        beyond_m_s = horizontal_norm(here.velocity_enu_m_s) - kept_m_s
        most_m_s = 0.5 * abs(self.speed_m_s)
        self._less_m_s += _EXCESS_GAIN_1_S * beyond_m_s * self._since_s
        self._less_m_s = min(max(self._less_m_s, 0.0), most_m_s)
        less_m_s = self._less_m_s + _EXCESS_GAIN * max(beyond_m_s, 0.0)
        return math.copysign(abs(self.speed_m_s) - min(less_m_s, most_m_s), self.speed_m_s)


def _along(yaw_rad: float, speed_m_s: float) -> tuple[float, float, float]:
    return (speed_m_s * math.cos(yaw_rad), speed_m_s * math.sin(yaw_rad), 0.0)
