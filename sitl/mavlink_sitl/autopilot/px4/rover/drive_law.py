"""Speed and steering of PX4's cars over lanes, after `rover_ackermann` of v1.17.

The speed setpoint, slewed by RO_ACCEL_LIM and RO_DECEL_LIM, becomes a throttle by RO_MAX_THR_SPEED;
with the airframe's gains next to nothing is added for the measured speed. The heading is slewed
as fast as the car could turn at the speed that the throttle stands for, RO_YAW_P makes a rate of
turn of what is left, and that the angle of the wheels.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from mavlink_sitl.array_ops import Lane, Ops
from mavlink_sitl.autopilot.control.drive_controller import DriveBody, DriveTargets
from mavlink_sitl.exchange import YawMode


class DriveLaw(NamedTuple):
    """Parameters of the airframe 10045, the same for all lanes."""

    max_throttle_m_s: float = 3.2
    """RO_MAX_THR_SPEED"""
    deceleration_m_s2: float = 3.0
    """RO_DECEL_LIM"""
    still_m_s: float = 0.1
    """RO_SPEED_TH"""
    wheel_base_m: float = 0.321
    """RA_WHEEL_BASE"""
    max_steer_rad: float = 0.5236
    """RA_MAX_STR_ANG"""
    steer_rate_rad_s: float = math.radians(360.0)
    """RA_STR_RATE_LIM"""
    turn: float = 0.25
    """RO_YAW_RATE_P"""


class LawState(NamedTuple):
    """The state of the controllers; lanes."""

    speed_m_s: Lane
    """The wanted speed on its way to the target."""
    throttle: Lane
    yaw_rad: Lane
    """The wanted heading on its way to the target."""
    steering: Lane


def initial(o: Ops) -> LawState:
    """Controllers at rest."""
    zero = o.full(0.0)
    return LawState(zero, zero, zero, zero)


def step(
    state: LawState, t: DriveTargets, body: DriveBody, dt: float, k: DriveLaw, o: Ops
) -> tuple[LawState, Lane, Lane]:
    """One fixed step; arguments as of `drive_controller.step`."""
    slower = abs(t.speed_m_s) < abs(body.forward_m_s)
    limit = o.where(slower, k.deceleration_m_s2, t.acceleration_m_s2)
    speed = state.speed_m_s + o.clip(t.speed_m_s - state.speed_m_s, -limit * dt, limit * dt)
    # A slew that is further off than its target is no help.
    lost = abs(speed - body.forward_m_s) > abs(t.speed_m_s - body.forward_m_s)
    speed = o.where(lost, t.speed_m_s, speed) * t.drive
    throttle = o.clip(speed / k.max_throttle_m_s, -1.0, 1.0)
    change = limit / k.max_throttle_m_s * dt
    throttle = state.throttle + o.clip(throttle - state.throttle, -change, change)
    throttle = throttle * t.drive
    estimated = throttle * k.max_throttle_m_s
    fastest = abs(estimated) * math.tan(k.max_steer_rad) / k.wheel_base_m
    fastest = o.minimum(fastest, t.turn_rate_limit_rad_s)
    yaw, rate = _turn(state.yaw_rad, fastest, t, body, dt, o)
    rate = o.clip(rate, -fastest, fastest)
    rolling = abs(estimated) > k.still_m_s
    safe = o.where(rolling, estimated, 1.0)
    slope = rate * k.wheel_base_m / safe
    angle = o.atan2(slope, 1.0) + k.turn * (rate - body.yaw_rate_rad_s) * (estimated > 0.0)
    steering = o.where(rolling, o.clip(angle / k.max_steer_rad, -1.0, 1.0), 0.0)
    most = k.steer_rate_rad_s / k.max_steer_rad * dt
    steering = state.steering + o.clip(steering - state.steering, -most, most)
    steering = steering * t.drive
    return (
        LawState(speed, throttle, yaw, steering),
        throttle + t.manual * t.throttle,
        steering + t.manual * t.steering,
    )


def _turn(
    yaw_rad: Lane, fastest: Lane, t: DriveTargets, body: DriveBody, dt: float, o: Ops
) -> tuple[Lane, Lane]:
    """Return the slewed heading, and the rate of turn that it asks for."""
    angle = t.yaw_mode == YawMode.ANGLE
    turned = o.clip(o.wrap_pi(t.yaw_rad - yaw_rad), -fastest * dt, fastest * dt)
    slewed = o.wrap_pi(yaw_rad + turned)
    left = abs(o.wrap_pi(t.yaw_rad - body.yaw_rad))
    slewed = o.where(abs(o.wrap_pi(slewed - body.yaw_rad)) > left, t.yaw_rad, slewed)
    slewed = o.where(angle * t.drive, slewed, body.yaw_rad)
    by_angle = t.turn_gain_1_s * o.wrap_pi(slewed - body.yaw_rad)
    rate = o.where(angle, by_angle, 0.0)
    return slewed, o.where(t.yaw_mode == YawMode.RATE, t.yaw_rate_rad_s, rate)
