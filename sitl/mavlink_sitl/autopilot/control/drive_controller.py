"""Speed and steering of rovers and boats over lanes, with ArduRover's laws and parameters.

Speed (AR_AttitudeControl, `get_throttle_out_speed`): the speed setpoint, changed no faster than
ATC_ACCEL_MAX, is followed by PI with CRUISE_THROTTLE over CRUISE_SPEED as feed-forward. The
simulated car needs less throttle than that, so it overshoots a step: 1.29 m/s for 1 m/s in
the recording `rover_guided`.

Steering of a car (`get_steering_out_rate`, AP_MotorsUGV `output_regular`): a rate of turn that
changes no faster than ATC_STR_ACC_MAX is followed by PI with ATC_STR_RAT_FF as feed-forward.
Above MOT_SPD_SCA_BASE the output is divided by the speed, below it the integrator does not grow.
A boat's rudder sets the rate of turn directly.
"""

from __future__ import annotations

import math
from operator import attrgetter
from typing import NamedTuple

from mavlink_sitl.array_ops import Lane, Ops
from mavlink_sitl.autopilot.control.control_state import packed
from mavlink_sitl.exchange import YawMode
from mavlink_sitl.guidance import DriveGuidance


class DriveGains(NamedTuple):
    """The same for all lanes."""

    feed_forward_s_m: float = 0.06
    """CRUISE_THROTTLE over CRUISE_SPEED, 30 % for 5 m/s; level ground takes 0.05."""
    speed: float = 0.1
    """ATC_SPEED_P"""
    speed_i: float = 0.2
    """ATC_SPEED_I"""
    integrator_limit: float = 0.5
    turn_rate_rad_s: float | None = None
    """Yaw rate of a boat at full rudder; None for a car, which uses the gains below."""
    steer_feed_forward_s: float = 0.75
    """ATC_STR_RAT_FF"""
    steer: float = 0.2
    """ATC_STR_RAT_P"""
    steer_i: float = 0.2
    """ATC_STR_RAT_I"""
    steer_limit_rad_s2: float = math.radians(120.0)
    """ATC_STR_ACC_MAX"""
    scale_base_m_s: float = 1.0
    """MOT_SPD_SCA_BASE"""


class DriveTargets(NamedTuple):
    """`DriveGuidance` as lanes."""

    drive: Lane
    manual: Lane
    throttle: Lane
    steering: Lane
    speed_m_s: Lane
    acceleration_m_s2: Lane
    yaw_mode: Lane
    yaw_rad: Lane
    yaw_rate_rad_s: Lane
    turn_gain_1_s: Lane
    turn_rate_limit_rad_s: Lane


class DriveBody(NamedTuple):
    """The estimated motion of the vehicles; lanes."""

    forward_m_s: Lane
    yaw_rad: Lane
    yaw_rate_rad_s: Lane


class DriveState(NamedTuple):
    """The state of the controllers; lanes."""

    speed_m_s: Lane
    """The wanted speed on its way to the target."""
    integrator: Lane
    turn_rate_rad_s: Lane
    """The wanted rate of turn on its way to the target."""
    steer_integrator: Lane


_STEADY = attrgetter(
    "throttle", "steering", "speed_m_s", "limits.acceleration_xy_m_s2", *DriveTargets._fields[6:]
)


def initial(o: Ops) -> DriveState:
    """Controllers at rest."""
    zero = o.full(0.0)
    return DriveState(zero, zero, zero, zero)


def targets_of(guidance: list[DriveGuidance], o: Ops) -> DriveTargets:
    """The targets of each vehicle, one lane per field."""
    return packed(DriveTargets, _STEADY, guidance, o)


def step(
    state: DriveState,
    t: DriveTargets,
    body: DriveBody,
    dt: float,
    k: DriveGains,
    o: Ops,
) -> tuple[DriveState, Lane, Lane]:
    """One fixed step.

    Returns:
        The new state of the controllers; throttle and steering, both -1..1.
    """
    forward_m_s = body.forward_m_s
    change = t.acceleration_m_s2 * dt
    wanted = state.speed_m_s + o.clip(t.speed_m_s - state.speed_m_s, -change, change)
    wanted = o.where(t.drive, wanted, forward_m_s)
    error = wanted - forward_m_s
    limit = k.integrator_limit
    integrator = o.clip(state.integrator + k.speed_i * error * dt, -limit, limit) * t.drive
    throttle = k.feed_forward_s_m * wanted + k.speed * error + integrator
    # Told to stand, and nearly standing: let go instead of creeping to and fro.
    standing = (t.speed_m_s == 0.0) * (abs(forward_m_s) < 0.08) * (abs(wanted) < 0.08)
    throttle = o.where(standing, 0.0, throttle)
    integrator = o.where(standing, 0.0, integrator)
    rate = wanted_turn_rate(t, body.yaw_rad, k, o)
    if k.turn_rate_rad_s is not None:
        steering, turn_rate = o.clip(rate / k.turn_rate_rad_s, -1.0, 1.0), rate
        steer_integrator = state.steer_integrator
    else:
        steering, turn_rate, steer_integrator = _steer(state, rate, t, body, wanted, dt, k, o)
    throttle = t.drive * o.clip(throttle, -1.0, 1.0) + t.manual * t.throttle
    steering = t.drive * steering + t.manual * t.steering
    return DriveState(wanted, integrator, turn_rate, steer_integrator), throttle, steering


def wanted_turn_rate(t: DriveTargets, yaw_rad: Lane, k: DriveGains, o: Ops) -> Lane:
    """The rate of turn that leads to the wanted heading, or that is wanted itself.

    No faster than it could be taken away again within the error (`get_turn_rate_from_heading`).
    """
    limit = t.turn_rate_limit_rad_s
    error = o.wrap_pi(t.yaw_rad - yaw_rad)
    in_time = o.minimum(limit, o.sqrt(2.0 * k.steer_limit_rad_s2 * abs(error)))
    by_angle = o.clip(t.turn_gain_1_s * error, -in_time, in_time)
    rate = o.where(t.yaw_mode == YawMode.ANGLE, by_angle, 0.0)
    return o.where(t.yaw_mode == YawMode.RATE, t.yaw_rate_rad_s, rate)


def _steer(
    state: DriveState,
    rate: Lane,
    t: DriveTargets,
    body: DriveBody,
    wanted: Lane,
    dt: float,
    k: DriveGains,
    o: Ops,
) -> tuple[Lane, Lane, Lane]:
    """Steering, the limited rate of turn and the integrator of cars."""
    change = k.steer_limit_rad_s2 * dt
    was = o.where(t.drive, state.turn_rate_rad_s, body.yaw_rate_rad_s)
    rate = was + o.clip(rate - was, -change, change)
    limit = t.turn_rate_limit_rad_s
    rate = o.where(t.yaw_mode == YawMode.ANGLE, o.clip(rate, -limit, limit), rate)
    error = rate - body.yaw_rate_rad_s
    fast = abs(body.forward_m_s) > k.scale_base_m_s
    output = k.steer_feed_forward_s * rate + k.steer * error + state.steer_integrator
    may_grow = fast * (abs(output) < 1.0)
    shrinks = state.steer_integrator * error < 0.0
    grown = state.steer_integrator + k.steer_i * error * dt * o.where(shrinks, 1.0, may_grow)
    integrator = o.clip(grown, -1.0, 1.0) * t.drive
    scale = k.scale_base_m_s / o.maximum(abs(body.forward_m_s), k.scale_base_m_s)
    # Which way it is going to roll decides which way the wheels must point.
    backwards = o.where(abs(body.forward_m_s) > 0.1, body.forward_m_s, wanted) < 0.0
    return o.clip(output * scale, -1.0, 1.0) * (1.0 - 2.0 * backwards), rate, integrator
