"""A car with front-wheel steering and no sideways motion.

Fitted to the recording `rover_guided`: rolling with the throttle closed loses half of the
speed in 1.4 s (HOLD at 4.3 m/s); 5 % of throttle keep 1 m/s; steering to the stop the radius
is 0.9 m (64 degrees a second at 1 m/s), and 16 % of the stop give 0.29 rad/s at 1.5 m/s.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from mavlink_sitl.array_ops import Lane, Ops


class RoverModel(NamedTuple):
    """The parameters of the vehicle model; the same for all lanes."""

    max_thrust_m_s2: float = 10.0
    """Acceleration at full throttle; brakes are the motor run backwards."""
    rolling_1_s: float = 0.5
    """Rolling resistance per speed."""
    turn_radius_m: float = 0.9
    max_steer_rad: float = math.radians(35.0)
    servo_time_constant_s: float = 0.05
    grip_m_s2: float = 7.8
    """Largest sideways acceleration of the tyres; beyond it the curve widens."""
    still_m_s: float = 0.02


class GroundState(NamedTuple):
    """The truth about vehicles on the ground or on water. Every field is a lane, NED, SI."""

    north_m: Lane
    east_m: Lane
    down_m: Lane
    velocity_north_m_s: Lane
    velocity_east_m_s: Lane
    velocity_down_m_s: Lane
    yaw_rad: Lane
    yaw_rate_rad_s: Lane
    forward_m_s: Lane
    """Along the nose, negative backwards."""
    right_m_s: Lane
    """Sideways; a rover's is always 0."""
    throttle: Lane
    """-1..1, as the motor has it."""
    steering: Lane
    """-1 (left) .. 1, as the wheels or the rudder have it."""
    thrust_m_s2: Lane
    on_ground: Lane
    impact_m_s: Lane


class GroundCommand(NamedTuple):
    """The autopilot's commands to the vehicle; lanes in -1..1."""

    throttle: Lane
    steering: Lane


def moved(
    state: GroundState,
    forward: Lane,
    right: Lane,
    yaw_rate: Lane,
    command: GroundCommand,
    thrust: Lane,
    ground_down_m: Lane,
    dt: float,
    o: Ops,
) -> GroundState:
    """The state dt later, given its speeds in the body's frame then."""
    yaw = o.wrap_pi(state.yaw_rad + yaw_rate * dt)
    middle = state.yaw_rad + 0.5 * yaw_rate * dt
    c, s = o.cos(middle), o.sin(middle)
    v_n, v_e = forward * c - right * s, forward * s + right * c
    return state._replace(
        north_m=state.north_m + v_n * dt,
        east_m=state.east_m + v_e * dt,
        down_m=ground_down_m,
        velocity_north_m_s=v_n,
        velocity_east_m_s=v_e,
        yaw_rad=yaw,
        yaw_rate_rad_s=yaw_rate,
        forward_m_s=forward,
        right_m_s=right,
        throttle=command.throttle,
        steering=command.steering,
        thrust_m_s2=abs(thrust),
    )


def step(
    state: GroundState,
    command: GroundCommand,
    ground_down_m: Lane,
    dt: float,
    model: RoverModel,
    o: Ops,
) -> GroundState:
    """One fixed step."""
    throttle = o.clip(command.throttle, -1.0, 1.0)
    share = dt / (model.servo_time_constant_s + dt)
    steering = state.steering + share * (o.clip(command.steering, -1.0, 1.0) - state.steering)
    thrust = model.max_thrust_m_s2 * throttle
    forward = state.forward_m_s + (thrust - model.rolling_1_s * state.forward_m_s) * dt
    stuck = (abs(forward) < model.still_m_s) * (throttle == 0.0)
    forward = forward * (1.0 - stuck)
    # The radius is that of the steered axle's path.
    curvature = o.sin(steering * model.max_steer_rad) / (
        model.turn_radius_m * math.sin(model.max_steer_rad)
    )
    most = model.grip_m_s2 / o.maximum(forward * forward, 1e-6)
    yaw_rate = forward * o.clip(curvature, -most, most)
    command = GroundCommand(throttle, steering)
    zero = 0.0 * forward
    return moved(state, forward, zero, yaw_rate, command, thrust, ground_down_m, dt, o)
