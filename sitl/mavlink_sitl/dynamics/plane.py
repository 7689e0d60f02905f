"""A fixed-wing aeroplane as a point mass that turns by banking.

Thrust and drag were fitted to the recording `plane_guided`: half throttle keeps 23 m/s, full
throttle climbs at 10 m/s with 27 m/s, the ground run to 20 m/s takes three seconds. Lift grows
with the square of the airspeed: too slow for the bank it flies, the nose drops until it is
fast enough again. It cannot hover.
"""

from __future__ import annotations

from typing import NamedTuple

from mavlink_sitl.array_ops import Lane, Ops
from mavlink_sitl.exchange import GRAVITY_M_S2


class PlaneModel(NamedTuple):
    """The parameters of the aircraft model; the same for all lanes. Speeds are true airspeeds."""

    max_thrust_m_s2: float = 17.8
    drag_1_m: float = 0.0175
    """Drag deceleration per airspeed squared, in level flight."""
    induced: float = 0.04
    """Growth of the drag with the square of the load."""
    turning: float = 0.95
    slip: float = 0.2
    """The recorded aircraft slips: it turns a little slower than a coordinated turn would, the
    more the steeper it banks."""
    stall_m_s: float = 13.0
    """In level flight; faster by the root of the load in a turn."""
    rotate_m_s: float = 19.5
    """It leaves the ground at this speed."""
    ground_drag_1_s: float = 0.5
    ground_drag_limit_m_s2: float = 7.0
    throttle_time_constant_s: float = 0.25
    bank_time_constant_s: float = 0.25
    roll_rate_rad_s: float = 1.5
    climb_time_constant_s: float = 0.4
    max_climb_angle_rad: float = 0.5
    slowest_m_s: float = 5.0
    """For divisions only."""


class PlaneState(NamedTuple):
    """The truth about the aircraft. Every field is a lane, NED, SI, radians."""

    north_m: Lane
    east_m: Lane
    down_m: Lane
    velocity_north_m_s: Lane
    velocity_east_m_s: Lane
    velocity_down_m_s: Lane
    yaw_rad: Lane
    yaw_rate_rad_s: Lane
    airspeed_m_s: Lane
    climb_rad: Lane
    """Angle of the path through the air, up."""
    bank_rad: Lane
    roll_rate_rad_s: Lane
    throttle: Lane
    thrust_m_s2: Lane
    on_ground: Lane
    impact_m_s: Lane


class PlaneCommand(NamedTuple):
    """The autopilot's commands to the aircraft; lanes."""

    bank_rad: Lane
    climb_m_s: Lane
    throttle: Lane


def step(
    state: PlaneState,
    command: PlaneCommand,
    wind: tuple[Lane, Lane, Lane],
    ground_down_m: Lane,
    dt: float,
    m: PlaneModel,
    o: Ops,
) -> PlaneState:
    """One fixed step."""
    s, rolling = state, state.on_ground * 1.0
    flying = 1.0 - rolling
    throttle = s.throttle + (o.clip(command.throttle, 0.0, 1.0) - s.throttle) * (
        dt / m.throttle_time_constant_s
    )
    thrust = m.max_thrust_m_s2 * throttle
    fast = o.maximum(s.airspeed_m_s, m.slowest_m_s)
    rate = o.clip(
        (command.bank_rad - s.bank_rad) / m.bank_time_constant_s,
        -m.roll_rate_rad_s,
        m.roll_rate_rad_s,
    )
    bank = (s.bank_rad + rate * dt) * flying
    # The largest load factor of the wings at this speed, and the one that this path needs.
    most = (s.airspeed_m_s / m.stall_m_s) * (s.airspeed_m_s / m.stall_m_s)
    upright, path = o.cos(bank), o.cos(s.climb_rad)
    load = o.minimum(path / o.maximum(upright, 0.2), most)
    sine = o.clip(command.climb_m_s / fast, -0.48, 0.48)
    wanted = o.atan2(sine, o.sqrt(1.0 - sine * sine))
    pull = (wanted - s.climb_rad) / m.climb_time_constant_s
    can = GRAVITY_M_S2 / fast * (most * upright - path)
    climb = s.climb_rad + o.minimum(pull, can) * dt
    climb = o.clip(climb, -1.2, m.max_climb_angle_rad) * flying
    lean = o.sin(bank)
    turning = m.turning - m.slip * lean * lean * lean * lean
    yaw_rate = turning * GRAVITY_M_S2 * load * lean / (fast * o.maximum(path, 0.2)) * flying
    drag = m.drag_1_m * s.airspeed_m_s * s.airspeed_m_s * (1.0 + m.induced * load * load)
    c, n = o.cos(s.yaw_rad), o.sin(s.yaw_rad)
    tail_wind = wind[0] * c + wind[1] * n
    friction = rolling * o.minimum(
        m.ground_drag_1_s * o.maximum(s.airspeed_m_s + tail_wind, 0.0), m.ground_drag_limit_m_s2
    )
    airspeed = s.airspeed_m_s + (thrust - drag - friction - GRAVITY_M_S2 * o.sin(climb)) * dt
    # On its wheels it does not roll backwards, whatever the wind.
    airspeed = o.maximum(airspeed, rolling * -tail_wind)
    lifts = (airspeed >= m.rotate_m_s) * (command.climb_m_s > 0.0)
    level = airspeed * o.cos(climb)
    along = level + rolling * tail_wind
    v_n = o.where(rolling > 0.5, along * c, level * c + wind[0])
    v_e = o.where(rolling > 0.5, along * n, level * n + wind[1])
    v_d = (wind[2] - airspeed * o.sin(climb)) * flying
    down = s.down_m + v_d * dt
    touching = o.where(rolling > 0.5, 1.0 - lifts, (down >= ground_down_m) * (v_d >= 0.0)) > 0.5
    first = touching * (1.0 - rolling)
    return PlaneState(
        north_m=s.north_m + v_n * dt,
        east_m=s.east_m + v_e * dt,
        down_m=o.minimum(down, ground_down_m),
        velocity_north_m_s=v_n,
        velocity_east_m_s=v_e,
        velocity_down_m_s=o.where(touching, 0.0, v_d),
        yaw_rad=o.wrap_pi(s.yaw_rad + yaw_rate * dt),
        yaw_rate_rad_s=yaw_rate,
        airspeed_m_s=o.maximum(airspeed, o.where(touching, -abs(tail_wind), 0.0)),
        climb_rad=o.where(touching, 0.0, climb),
        bank_rad=o.where(touching, 0.0, bank),
        roll_rate_rad_s=rate * flying,
        throttle=throttle,
        thrust_m_s2=thrust,
        on_ground=touching,
        impact_m_s=o.where(first > 0.5, v_d, s.impact_m_s),
    )
