"""Setpoints that come late, and a setpoint whose motion ends at a standstill if no other follows.

How late the control loop runs gives the speed that this allows.

An ArduCopter moves its target on by the velocity and the acceleration of the last setpoint until
its timeout (GUID_TIMEOUT; mode_guided.cpp, posvelaccel_control_run, velaccel_control_run and
accel_control_run). A brake of 2 m/s² at 3 m/s leads to 3 m/s backwards 3 s later. So an
acceleration is sent only up to the value that brings the velocity to zero within the timeout. The
rest of it becomes a shift of the position, by the gain of the firmware's own controller: it
follows the sum of both. A climb or descent goes into the position as a whole, so that it ends after
its braking distance, about a metre, and not on the ground.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

from navigation_core.geometry import KinematicState

__all__ = [
    "LATE_S",
    "TOO_LATE_S",
    "WINDOW_S",
    "Following",
    "Shaping",
    "held",
    "speed_share",
]

LATE_S = 0.25
"""Setpoints that are this much late, five periods at 20 Hz, are no longer the usual jitter."""
TOO_LATE_S = 1.0
"""Later than this nobody steers: PX4 gives OFFBOARD up after COM_OF_LOSS_T, by default 1 s."""
WINDOW_S = 3.0
"""A delay counts for this time: a server that was late a moment ago may be late again."""


def speed_share(late_s: float) -> float:
    """Return the share of its speed that a vehicle may have when setpoints are this late.

    All of it up to LATE_S, nothing from TOO_LATE_S on.
    """
    if not math.isfinite(late_s):
        return 0.0
    return min(max((TOO_LATE_S - late_s) / (TOO_LATE_S - LATE_S), 0.0), 1.0)


_STANDS_M_S = 1e-3
# A timeout shorter than the controller's own time constant leaves no room to share a brake.
_GAIN_MIN = 1.5


@dataclass(frozen=True)
class Shaping:
    """How an autopilot comes to a target, by AP_Math's control.cpp (shape_pos_vel_accel).

    Attributes:
        acceleration_m_s2: greatest acceleration by which it corrects its motion.
        jerk_m_s3: by which it changes that.
    """

    acceleration_m_s2: float
    jerk_m_s3: float

    @cached_property
    def velocity_gain_1_s(self) -> float:
        """Acceleration for each m/s by which its velocity differs from the wanted one."""
        return self.jerk_m_s3 / self.acceleration_m_s2

    def distance_m(self, speed_m_s: float) -> float:
        """Return how far off a position is towards which it moves at a speed."""
        gain_1_s, braking_m_s2 = 0.5 * self.velocity_gain_1_s, 0.5 * self.acceleration_m_s2
        linear_m_s = braking_m_s2 / gain_1_s
        if speed_m_s <= linear_m_s:
            return speed_m_s / gain_1_s
        return 0.5 * (speed_m_s * speed_m_s / braking_m_s2 + linear_m_s / gain_1_s)


@dataclass(frozen=True)
class Following:
    """How an autopilot comes to a setpoint whose target it moves on by itself.

    Attributes:
        horizontal: over ground.
        vertical: up and down.
    """

    horizontal: Shaping = Shaping(2.5, 5.0)
    vertical: Shaping = Shaping(1.0, 5.0)


def held(state: KinematicState, following: Following, timeout_s: float) -> KinematicState:
    """Return the setpoint of a motion, such that the vehicle stops if no other follows.

    The velocity that is sent is between the motion's and zero, and so is the velocity that its
    acceleration makes of it until the timeout.

    Args:
        state: the motion, map frame.
        following: how the autopilot comes to a target.
        timeout_s: for how long it moves the target on, > 0.
    """
    x, y, z = state.position_enu_m
    v_x, v_y, v_z = state.velocity_enu_m_s
    a_x, a_y, a_z = state.acceleration_enu_m_s2
    level, upright = following.horizontal, following.vertical
    sent_x, sent_y, sent_a_x, sent_a_y = v_x, v_y, 0.0, 0.0
    speed_m_s = math.sqrt(v_x * v_x + v_y * v_y)
    if speed_m_s > _STANDS_M_S:
        course_x, course_y = v_x / speed_m_s, v_y / speed_m_s
        braking_m_s2 = max(-(a_x * course_x + a_y * course_y), 0.0)
        if braking_m_s2 * timeout_s > speed_m_s:
            # A lower velocity brakes, too: it and its own brake make up the whole.
            share = 1.0 - 1.0 / max(level.velocity_gain_1_s * timeout_s, _GAIN_MIN)
            slower_m_s = (speed_m_s - braking_m_s2 / level.velocity_gain_1_s) / share
            slower_m_s = min(max(slower_m_s, 0.0), speed_m_s)
            sent_x, sent_y = slower_m_s * course_x, slower_m_s * course_y
            braking_m_s2 = slower_m_s / timeout_s
        sent_a_x, sent_a_y = -braking_m_s2 * course_x, -braking_m_s2 * course_y
    # By how much the position has to make it faster.
    lacking_x = v_x - sent_x + (a_x - sent_a_x) / level.velocity_gain_1_s
    lacking_y = v_y - sent_y + (a_y - sent_a_y) / level.velocity_gain_1_s
    lacking_m_s = math.sqrt(lacking_x * lacking_x + lacking_y * lacking_y)
    if lacking_m_s > 0.0:
        ahead_s = level.distance_m(lacking_m_s) / lacking_m_s
        x, y = x + ahead_s * lacking_x, y + ahead_s * lacking_y
    rising_m_s = v_z + a_z / upright.velocity_gain_1_s
    z += math.copysign(upright.distance_m(abs(rising_m_s)), rising_m_s)
    return KinematicState((x, y, z), (sent_x, sent_y, 0.0), (sent_a_x, sent_a_y, 0.0))
