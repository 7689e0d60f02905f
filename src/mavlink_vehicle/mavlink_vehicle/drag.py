"""Estimates the drag of a multicopter, for firmware that needs it as feed-forward.

An acceleration beside a position and a velocity means two things. ArduPilot takes it for how the
target moves. PX4 takes it for a push of the motors, and leans for that much and no more
(PositionControl.cpp): at speed the drag is then left to the integral part of its velocity loop,
which takes four seconds to fill, while the vehicle falls behind, and as long to empty, while it
overshoots. So what the drag takes is added to the setpoint.

The drag of a multicopter grows with its speed, as its rotors cause most of it. Measured ones are
0.4 to 0.55 1/s (Faessler et al., "Differential Flatness of Quadrotor Dynamics Subject to Rotor
Drag", 2018), PX4 begins with 0.15 (EKF2_MCOEF), and its own simulated one has 1.0. It is
learned in flight from how far the vehicle has to lean: gravity gives the push for a lean, the
change of velocity what has come of it, and the drag is what lies between.
"""

from __future__ import annotations

import math
from dataclasses import replace

from mavlink_vehicle.protocols.streams.setpoint_stream import SetpointNed
from mavlink_vehicle.state.telemetry import Attitude, LocalPosition

__all__ = ["Drag"]

_GRAVITY_M_S2 = 9.80665
# The derivative part of PX4's velocity loop works against every acceleration, also the one that
# is asked for (MPC_XY_VEL_D_ACC, 0.2).
_AGAINST_DAMPING = 1.2
# The learned drag may be wrong: no push leans the vehicle farther than 36 degrees.
_PUSH_MAX_M_S2 = 7.0
_FIRST_PER_S = 0.3
_MOST_PER_S = 1.2
# At 10 attitudes a second, this time has enough of them for a mean, and the velocity changes by
# more than its noise.
_WINDOW_S = 0.4
_LEANS_MIN = 3
# A window with a gap longer than this gives no mean.
_GAP_S = 1.0
# Slower than this there is no drag to learn from but that of the wind, which the vehicle's
# integral part has dealt with before it sets off.
_SLOW_M_S = 0.5
# Shares of an error that one window corrects: half a flight's acceleration is enough.
_LEARN_SHARE = 0.5
_WIND_SHARE = 0.3

Vector2 = tuple[float, float]


class Drag:
    """Learns the drag of one vehicle and adds it to its setpoints; see the module."""

    def __init__(self) -> None:
        """Begin with that of a usual one."""
        self.per_s = _FIRST_PER_S
        self._wind_m_s2: Vector2 = (0.0, 0.0)
        self._begin: LocalPosition | None = None
        self._attitude_s = -math.inf
        self._pushes: list[Vector2] = []

    def added_to(self, setpoint: SetpointNed) -> SetpointNed:
        """Return a setpoint with the push that keeps its speed."""
        velocity, acceleration = setpoint.velocity_ned_m_s, setpoint.acceleration_ned_m_s2
        if velocity is None or acceleration is None:
            return setpoint
        north = acceleration[0] * _AGAINST_DAMPING + self.per_s * velocity[0]
        east = acceleration[1] * _AGAINST_DAMPING + self.per_s * velocity[1]
        limit = _PUSH_MAX_M_S2 / max(math.hypot(north, east), _PUSH_MAX_M_S2)
        push = (north * limit, east * limit, acceleration[2])
        return replace(setpoint, acceleration_ned_m_s2=push)

    def learn(self, attitude: Attitude | None, motion: LocalPosition | None) -> None:
        """Process the newest attitude and velocity of a flight."""
        if attitude is None or motion is None:
            self._begin = None
            return
        begin = self._begin
        if begin is None or not 0.0 <= motion.time_s - begin.time_s <= _GAP_S:
            self._restart(motion)
            return
        if attitude.time_s > self._attitude_s:
            self._attitude_s = attitude.time_s
            self._pushes.append(push_m_s2(attitude))
        if motion.time_s - begin.time_s >= _WINDOW_S and len(self._pushes) >= _LEANS_MIN:
            self._take_window(begin, motion)
            self._restart(motion)

    def _restart(self, motion: LocalPosition) -> None:
        self._begin = motion
        self._pushes = []

    def _take_window(self, begin: LocalPosition, end: LocalPosition) -> None:
        time_s, count = end.time_s - begin.time_s, len(self._pushes)
        velocity, taken = [0.0, 0.0], [0.0, 0.0]
        for axis in (0, 1):
            first, last = begin.velocity_ned_m_s[axis], end.velocity_ned_m_s[axis]
            velocity[axis] = 0.5 * (first + last)
            push = math.fsum(push[axis] for push in self._pushes) / count
            taken[axis] = push - (last - first) / time_s
        north, east = (
            taken[axis] - self._wind_m_s2[axis] - self.per_s * velocity[axis] for axis in (0, 1)
        )
        speed2 = velocity[0] * velocity[0] + velocity[1] * velocity[1]
        if speed2 < _SLOW_M_S * _SLOW_M_S:
            wind = self._wind_m_s2
            self._wind_m_s2 = (wind[0] + _WIND_SHARE * north, wind[1] + _WIND_SHARE * east)
            return
        error_per_s = (north * velocity[0] + east * velocity[1]) / (1.0 + speed2)
        self.per_s = min(max(self.per_s + _LEARN_SHARE * error_per_s, 0.0), _MOST_PER_S)


def push_m_s2(attitude: Attitude) -> Vector2:
    """Return the push, north and east, of a lean in level flight."""
    forward = -math.tan(attitude.pitch_rad)
    right = math.tan(attitude.roll_rad) / math.cos(attitude.pitch_rad)
    cosine, sine = math.cos(attitude.yaw_ned_rad), math.sin(attitude.yaw_ned_rad)
    return (
        _GRAVITY_M_S2 * (forward * cosine - right * sine),
        _GRAVITY_M_S2 * (forward * sine + right * cosine),
    )
