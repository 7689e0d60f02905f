"""A motor boat: responds more slowly than a car, drifts outwards in turns and with the wind.

No recording exists of one; the numbers are those of a two-metre hull with an outboard motor:
5 m/s at full throttle, a turn of some 60 degrees a second at most, and a tenth of the wind's
speed when it only drifts.
"""

from __future__ import annotations

from typing import NamedTuple

from mavlink_sitl.array_ops import Lane, Ops
from mavlink_sitl.dynamics.rover import GroundCommand, GroundState, moved


class BoatModel(NamedTuple):
    """The parameters of the vehicle model; the same for all lanes."""

    max_thrust_m_s2: float = 2.0
    motor_time_constant_s: float = 0.4
    drag_linear_1_s: float = 0.15
    drag_quadratic_1_m: float = 0.05
    drift_linear_1_s: float = 0.6
    """Resistance of the hull against going sideways."""
    wind_1_s: float = 0.03
    """Acceleration by the air per speed of the air past the hull."""
    turn_rate_rad_s: float = 1.0
    """Largest, with enough water past the rudder."""
    full_rudder_m_s: float = 1.5
    """At this speed, or with the propeller pushing that much, the rudder has its full effect."""
    turn_time_constant_s: float = 0.7


def step(
    state: GroundState,
    command: GroundCommand,
    wind: tuple[Lane, Lane, Lane],
    ground_down_m: Lane,
    dt: float,
    model: BoatModel,
    o: Ops,
) -> GroundState:
    """One fixed step."""
    u, w, r = state.forward_m_s, state.right_m_s, state.yaw_rate_rad_s
    share = dt / model.motor_time_constant_s
    throttle = state.throttle + share * (o.clip(command.throttle, -1.0, 1.0) - state.throttle)
    rudder = o.clip(command.steering, -1.0, 1.0)
    c, s = o.cos(state.yaw_rad), o.sin(state.yaw_rad)
    air_u = wind[0] * c + wind[1] * s - u
    air_w = wind[1] * c - wind[0] * s - w
    thrust = model.max_thrust_m_s2 * throttle
    water = (model.drag_linear_1_s + model.drag_quadratic_1_m * abs(u)) * u
    # The hull keeps its way while the nose turns: the centrifugal terms.
    du = thrust - water + model.wind_1_s * air_u + r * w
    dw = -model.drift_linear_1_s * w + model.wind_1_s * air_w - r * u
    wash = u + 2.0 * throttle
    effect = o.clip(wash / model.full_rudder_m_s, -1.0, 1.0)
    wanted = model.turn_rate_rad_s * rudder * effect
    yaw_rate = r + (wanted - r) * (dt / model.turn_time_constant_s)
    command = GroundCommand(throttle, rudder)
    return moved(state, u + du * dt, w + dw * dt, yaw_rate, command, thrust, ground_down_m, dt, o)
