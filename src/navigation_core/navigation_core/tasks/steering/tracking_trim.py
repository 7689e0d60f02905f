"""Sends a setpoint somewhat beside a trajectory, so that the vehicle flies the trajectory itself.

A vehicle follows its setpoint late, and goes round outside of a turn: the integrator of its
autopilot turns with it and comes late. So what is sent is ahead of the trajectory, and moved by a
share of the error of position and velocity, and by the integral of the error along and across the
motion. The gains and times were found on the simulated ArduCopter and PX4.

This difference from the trajectory comes and goes gradually: a vehicle that is to stop does so on
the trajectory, and must not be led to it by a jump.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from navigation_core.geometry import (
    ZERO,
    KinematicState,
    Vector3,
    add,
    horizontal_norm,
    limit_norm,
    scale,
    subtract,
)
from navigation_core.limits import Limits
from navigation_core.tasks.intents import Setpoint
from navigation_core.tasks.leading.carrot import Carrot

__all__ = ["TrackingTrim"]

# By what a setpoint is sent ahead, and its acceleration, which an airframe has to lean for.
_AHEAD_S, _LEAN_S = 0.1, 0.3
# Age of a measurement when it comes: of ArduCopter 30 ms, of PX4 38 ms (by ground truth).
_MEASURED_S = 0.035
# Shares of the error of position and velocity, and gain of the integral.
_POSITION_SHARE, _VELOCITY_SHARE, _INTEGRAL_1_S = 1.0, 1.0, 0.3
# An error beyond is no matter of following well; and the integral is no longer than this.
_ERROR_MAX_M, _INTEGRAL_MAX_M = 1.0, 1.0
# Slower than this a motion has no axes.
_MOVES_M_S = 0.5
# How fast the position is moved; velocity and acceleration change by the vehicle's own limits.
_MOVED_M_S = 2.0


@dataclass(frozen=True)
class _Difference:
    """The difference between the setpoint that is sent and the trajectory."""

    position_enu_m: Vector3 = ZERO
    velocity_enu_m_s: Vector3 = ZERO
    acceleration_enu_m_s2: Vector3 = ZERO


class TrackingTrim:
    """Trims the setpoints of one flight."""

    def __init__(self, limits: Limits) -> None:
        """Begin without an error; ``limits`` are those of the flight."""
        self._limits = limits
        self._along_left_up: Vector3 = ZERO
        self._difference = _Difference()

    def restart(self) -> None:
        """Begin on the trajectory itself."""
        self._difference = _Difference()

    def trimmed(self, carrot: Carrot, here: KinematicState, dt_s: float, stops: bool) -> Setpoint:
        """Return the setpoint to send.

        Args:
            carrot: where the trajectory is now.
            here: the measured state.
            dt_s: time since the last setpoint.
            stops: whether the vehicle is to stop, on the trajectory itself.
        """
        state = carrot.state
        wanted = carrot.setpoint if stops else self._wanted(carrot, here, dt_s)
        before, limits = self._difference, self._limits
        moved = subtract(wanted.position_enu_m, state.position_enu_m)
        faster = subtract(wanted.velocity_enu_m_s, state.velocity_enu_m_s)
        harder = subtract(wanted.acceleration_enu_m_s2, state.acceleration_enu_m_s2)
        faster_m_s = limits.acceleration_horizontal_m_s2 * dt_s
        now = self._difference = _Difference(
            _towards(before.position_enu_m, moved, _MOVED_M_S * dt_s),
            _towards(before.velocity_enu_m_s, faster, faster_m_s),
            _towards(before.acceleration_enu_m_s2, harder, limits.jerk_m_s3 * dt_s),
        )
        return replace(
            wanted,
            position_enu_m=add(state.position_enu_m, now.position_enu_m),
            velocity_enu_m_s=add(state.velocity_enu_m_s, now.velocity_enu_m_s),
            acceleration_enu_m_s2=add(state.acceleration_enu_m_s2, now.acceleration_enu_m_s2),
        )

    def _wanted(self, carrot: Carrot, here: KinematicState, dt_s: float) -> Setpoint:
        """Return the setpoint that makes a vehicle that is here fly the trajectory."""
        state, velocity = carrot.state, carrot.state.velocity_enu_m_s
        measured_there = subtract(state.position_enu_m, scale(velocity, _MEASURED_S))
        error = subtract(measured_there, here.position_enu_m)
        lacking = subtract(velocity, here.velocity_enu_m_s)
        lacking = subtract(lacking, scale(state.acceleration_enu_m_s2, _MEASURED_S))
        moved = add(
            scale(limit_norm(error, _ERROR_MAX_M), _POSITION_SHARE),
            self._integral(error, velocity, dt_s),
        )
        ahead, leaning = carrot.ahead(_AHEAD_S)[1], carrot.ahead(_LEAN_S)[1]
        faster = scale(limit_norm(lacking, _ERROR_MAX_M), _VELOCITY_SHARE)
        return replace(
            carrot.setpoint,
            position_enu_m=add(ahead.position_enu_m, moved),
            velocity_enu_m_s=add(ahead.velocity_enu_m_s, faster),
            acceleration_enu_m_s2=leaning.acceleration_enu_m_s2,
        )

    def _integral(self, error: Vector3, velocity: Vector3, dt_s: float) -> Vector3:
        """Return the integral of the error, in the map frame; nothing while it hardly moves."""
        speed_m_s = horizontal_norm(velocity)
        if speed_m_s < _MOVES_M_S:
            return ZERO
        cosine, sine = velocity[0] / speed_m_s, velocity[1] / speed_m_s
        x, y, z = error
        gained = (x * cosine + y * sine, y * cosine - x * sine, z)
        along, left, up = self._along_left_up = limit_norm(
            add(self._along_left_up, scale(gained, _INTEGRAL_1_S * dt_s)), _INTEGRAL_MAX_M
        )
        return (along * cosine - left * sine, along * sine + left * cosine, up)


def _towards(a: Vector3, b: Vector3, step_max: float) -> Vector3:
    return add(a, limit_norm(subtract(b, a), step_max))
