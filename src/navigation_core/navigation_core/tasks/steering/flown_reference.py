"""The moving reference of a vehicle that flies by velocity commands.

The autopilot gets position, velocity and acceleration, as on a trajectory: so the vehicle stands
firmly when the command is zero, where a velocity of zero alone would let it drift by the error of
its estimate (a PX4 by up to 0.7 m/s, observed).
"""

from __future__ import annotations

import math

from navigation_core.geometry import (
    ZERO,
    KinematicState,
    Vector3,
    add,
    limit_norm,
    scale,
    subtract,
    wrap_angle,
)
from navigation_core.limits import Limits
from navigation_core.tasks.goto_config import GotoConfig
from navigation_core.tasks.intents import Setpoint

__all__ = ["FlownReference"]

# Least time constant with which the velocity eases into the one that is commanded.
_EASE_S = 0.4
# While it moves, the reference leads only as far as velocity and position together ask for no more
# than the speed limit, times this.
_HURRY_SHARE = 1.03
_LEAD_MIN_M = 0.05
# Slower than this, the reference stands, and the vehicle is to come to it.
_STANDS_M_S = 0.05
# The yaw leads by what the vehicle turns in this time, and by this much.
_YAW_LEAD_S, _YAW_LEAD_RAD = 0.3, 0.1


class FlownReference:
    """Position, velocity, acceleration and yaw that the vehicle is to have now."""

    def __init__(self, config: GotoConfig, limits: Limits) -> None:
        """Prepare.

        Args:
            config: its ``following_gain_per_s`` and ``tracking_error_max_m``.
            limits: speeds, accelerations, jerk and yaw rate that are kept.
        """
        self._config = config
        self._limits = limits
        self.state: KinematicState | None = None
        """None before :meth:`begin`."""
        self.yaw_enu_rad = 0.0

    @property
    def ease_s(self) -> float:
        """Time by which the velocity lags the one that is commanded.

        The jerk of the limits must suffice to take the acceleration back within it.
        """
        limits = self._limits
        return max(_EASE_S, limits.acceleration_horizontal_m_s2 / limits.jerk_m_s3)

    def begin(self, state: KinematicState, yaw_enu_rad: float) -> None:
        """Continue from a state."""
        self.state = state
        self.yaw_enu_rad = wrap_angle(yaw_enu_rad)

    @property
    def setpoint(self) -> Setpoint:
        """The setpoint to send now.

        Raises:
            ValueError: it has not begun.
        """
        state = self.state
        if state is None:
            raise ValueError("The reference has not begun.")
        return Setpoint(
            state.position_enu_m,
            state.velocity_enu_m_s,
            state.acceleration_enu_m_s2,
            self.yaw_enu_rad,
        )

    def advance(
        self,
        dt_s: float,
        velocity_enu_m_s: Vector3,
        yaw_rate_rad_s: float,
        here: KinematicState,
        yaw_enu_rad: float,
        brake_factor: float = 1.0,
    ) -> None:
        """Continue towards a velocity.

        Args:
            dt_s: time since the last call.
            velocity_enu_m_s: the velocity to come to, within the limits.
            yaw_rate_rad_s: the turn rate, within the limits.
            here: the measured state.
            yaw_enu_rad: the measured yaw.
            brake_factor: how many times the acceleration of the limits may be used.
        """
        state = self.state
        if state is None or dt_s <= 0.0:
            return
        acceleration = self._acceleration(state, velocity_enu_m_s, dt_s, brake_factor)
        velocity = add(state.velocity_enu_m_s, scale(acceleration, dt_s))
        mean = scale(add(velocity, state.velocity_enu_m_s), 0.5)
        position = add(state.position_enu_m, scale(mean, dt_s))
        position = self._held(position, velocity, here.position_enu_m)
        self.state = KinematicState(position, velocity, acceleration)
        self.yaw_enu_rad = _turned(self.yaw_enu_rad, yaw_rate_rad_s, dt_s, yaw_enu_rad)

    def _acceleration(
        self, state: KinematicState, wanted_m_s: Vector3, dt_s: float, factor: float
    ) -> Vector3:
        """Return the acceleration: eased, within the limits and, unless it is urgent, the jerk."""
        limits = self._limits
        level_max, rise_max = (
            factor * limits.acceleration_horizontal_m_s2,
            factor * limits.acceleration_vertical_m_s2,
        )
        ease_s = self.ease_s if factor == 1.0 else _EASE_S
        wanted = scale(subtract(wanted_m_s, state.velocity_enu_m_s), 1.0 / max(ease_s, dt_s))
        level = limit_norm((wanted[0], wanted[1], 0.0), level_max)
        wanted = (level[0], level[1], min(max(wanted[2], -rise_max), rise_max))
        if factor > 1.0:
            return wanted
        before = state.acceleration_enu_m_s2
        return add(before, limit_norm(subtract(wanted, before), limits.jerk_m_s3 * dt_s))

    def _held(self, position: Vector3, velocity: Vector3, here: Vector3) -> Vector3:
        """Return the position, not farther from the vehicle than it can follow at the limit."""
        limits, gain = self._limits, max(self._config.following_gain_per_s, 1e-3)
        far_m = self._config.tracking_error_max_m
        lead = subtract(position, here)
        speed_m_s, climb_m_s = math.hypot(velocity[0], velocity[1]), velocity[2]
        level_m = rise_m = far_m
        if speed_m_s > _STANDS_M_S:
            spare_m_s = _HURRY_SHARE * limits.speed_horizontal_m_s - speed_m_s
            level_m = min(max(spare_m_s / gain, _LEAD_MIN_M), far_m)
        if abs(climb_m_s) > _STANDS_M_S:
            most_m_s = limits.speed_up_m_s if climb_m_s > 0.0 else limits.speed_down_m_s
            spare_m_s = _HURRY_SHARE * most_m_s - abs(climb_m_s)
            rise_m = min(max(spare_m_s / gain, _LEAD_MIN_M), far_m)
        level = limit_norm((lead[0], lead[1], 0.0), level_m)
        rise = min(max(lead[2], -rise_m), rise_m)
        return add(here, (level[0], level[1], rise))

    def stand(self, position_enu_m: Vector3) -> None:
        """Stand at a position."""
        self.state = KinematicState(position_enu_m, ZERO, ZERO)


def _turned(yaw_rad: float, rate_rad_s: float, dt_s: float, measured_rad: float) -> float:
    """Return the yaw a moment later, not farther ahead of the vehicle than it follows."""
    turned = wrap_angle(yaw_rad + rate_rad_s * dt_s)
    if rate_rad_s == 0.0:
        return turned
    most_rad = _YAW_LEAD_S * abs(rate_rad_s) + _YAW_LEAD_RAD
    lead = wrap_angle(turned - measured_rad)
    return wrap_angle(measured_rad + min(max(lead, -most_rad), most_rad))
