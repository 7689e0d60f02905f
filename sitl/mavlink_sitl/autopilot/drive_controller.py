"""Speed and steering of rovers and boats over lanes, shaped like ArduRover's.

A wanted speed that changes no faster than allowed, followed by a PI controller with the
throttle that would keep it as feed-forward; a wanted heading or rate of turn, which gives a
steering angle at this speed. The gains produce the motion of the recording `rover_guided`.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from mavlink_sitl.exchange import Motors, YawMode
from mavlink_sitl.guidance import DriveGuidance
from mavlink_sitl.ops import Lane, Ops


class DriveGains(NamedTuple):
    """The same for all lanes."""

    feed_forward_s_m: float = 0.05
    """Throttle per speed: what keeps it on level ground."""
    speed: float = 0.1
    """ATC_SPEED_P"""
    speed_i: float = 0.2
    """ATC_SPEED_I"""
    integrator_limit: float = 0.5
    turn_radius_m: float = 0.9
    """What a full lock gives; 0 for a vehicle whose rudder sets the rate of turn."""
    max_steer_rad: float = math.radians(35.0)
    turn_rate_rad_s: float = 1.0
    """What full rudder gives; only without a turning radius."""
    slowest_m_s: float = 1.0
    """Below this speed steering is computed for this one."""


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


class DriveState(NamedTuple):
    """What the controllers remember; lanes."""

    speed_m_s: Lane
    """The wanted speed on its way to the target."""
    integrator: Lane


def initial(o: Ops) -> DriveState:
    """Controllers at rest."""
    zero = o.full(0.0)
    return DriveState(zero, zero)


def targets_of(guidance: list[DriveGuidance], o: Ops) -> DriveTargets:
    """What each vehicle is told, one lane per field."""

    def lane(name: str) -> Lane:
        return o.pack([float(getattr(g, name)) for g in guidance])

    return DriveTargets(
        o.pack([float(g.motors is Motors.FLY) for g in guidance]),
        o.pack([float(g.motors is Motors.MANUAL) for g in guidance]),
        lane("throttle"),
        lane("steering"),
        lane("speed_m_s"),
        o.pack([g.limits.acceleration_xy_m_s2 for g in guidance]),
        *(lane(name) for name in DriveTargets._fields[6:]),
    )


def step(
    state: DriveState,
    t: DriveTargets,
    forward_m_s: Lane,
    yaw_rad: Lane,
    dt: float,
    k: DriveGains,
    o: Ops,
) -> tuple[DriveState, Lane, Lane]:
    """One fixed step.

    Args:
        state: what the controllers remember.
        t: what the autopilots want.
        forward_m_s: speed along the nose.
        yaw_rad: heading.
        dt: seconds.
        k: gains.
        o: float or array arithmetic.

    Returns:
        What the controllers remember now, throttle and steering, both -1..1.
    """
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
    limit = t.turn_rate_limit_rad_s
    by_angle = o.clip(t.turn_gain_1_s * o.wrap_pi(t.yaw_rad - yaw_rad), -limit, limit)
    rate = o.where(t.yaw_mode == YawMode.ANGLE, by_angle, 0.0)
    rate = o.where(t.yaw_mode == YawMode.RATE, t.yaw_rate_rad_s, rate)
    steering = _steering(rate, forward_m_s, wanted, k, o)
    throttle = t.drive * o.clip(throttle, -1.0, 1.0) + t.manual * t.throttle
    steering = t.drive * steering + t.manual * t.steering
    return DriveState(wanted, integrator), throttle, steering


def _steering(rate: Lane, forward: Lane, wanted: Lane, k: DriveGains, o: Ops) -> Lane:
    if k.turn_radius_m <= 0.0:
        return o.clip(rate / k.turn_rate_rad_s, -1.0, 1.0)
    # Which way it is going to roll decides which way the wheels must point.
    backwards = o.where(abs(forward) > 0.1, forward, wanted) < 0.0
    speed = o.maximum(abs(forward), k.slowest_m_s) * (1.0 - 2.0 * backwards)
    sine = rate / speed * k.turn_radius_m * math.sin(k.max_steer_rad)
    most = math.sin(k.max_steer_rad)
    sine = o.clip(sine, -most, most)
    return o.atan2(sine, o.sqrt(1.0 - sine * sine)) / k.max_steer_rad
