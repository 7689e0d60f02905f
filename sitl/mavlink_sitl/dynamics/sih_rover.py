"""The car of PX4's own simulator (SIH, airframe 10045): it slides and starts abruptly.

After `Sih::generate_rover_ackermann_dynamics` of v1.17 and the mass, inertia and drag of the
airframe. A motor force against friction and a drag that grows with the square of the speed, and
a bicycle whose tyres give way sideways. On the real one, speed setpoints from rest had no effect
up to 0.7 m/s; 1.0 m/s gave 1.2 m/s, 1.5 gave 1.8, 2.0 gave 2.35 and 3.0 gave 3.1: PX4's throttle
is mostly its feed-forward (RO_MAX_THR_SPEED), which includes neither friction nor drag.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from mavlink_sitl.array_ops import Lane, Ops
from mavlink_sitl.dynamics.rover import GroundCommand, GroundState, moved

_GRAVITY_M_S2 = 9.81


class SihRoverModel(NamedTuple):
    """The parameters of the vehicle model; the same for all lanes."""

    mass_kg: float = 20.0
    """SIH_MASS"""
    inertia_kg_m2: float = 2.083
    """SIH_IZZ"""
    max_thrust_m_s2: float = 20.0
    """400 N"""
    max_steer_rad: float = math.radians(30.0)
    wheel_base_m: float = 0.321
    cornering_n_rad: float = 500.0
    static_friction: float = 0.5
    kinetic_friction: float = 0.4
    rolling_friction: float = 0.3
    static_m_s: float = 0.01
    """Slower than this it sticks."""
    rolling_m_s: float = 0.05
    """Faster than this it rolls, and its wheels steer."""
    drag_n_s2_m2: float = 36.0
    """SIH_KDV is 50, but counts for each axis of the Earth's frame by itself."""
    turn_damping_n_m_s: float = 10.0
    """SIH_KDW"""


def step(
    state: GroundState,
    command: GroundCommand,
    ground_down_m: Lane,
    dt: float,
    model: SihRoverModel,
    o: Ops,
) -> GroundState:
    """One fixed step."""
    throttle = o.clip(command.throttle, -1.0, 1.0)
    steering = o.clip(command.steering, -1.0, 1.0)
    u, r = state.forward_m_s, state.yaw_rate_rad_s
    force = model.mass_kg * model.max_thrust_m_s2 * throttle
    weight = model.mass_kg * _GRAVITY_M_S2
    sticks = abs(u) < model.static_m_s
    static = o.clip(force, -model.static_friction * weight, model.static_friction * weight)
    kinetic = o.where(abs(u) < model.rolling_m_s, model.kinetic_friction, model.rolling_friction)
    towards = o.where(u < 0.0, -1.0, 1.0)
    friction = o.where(sticks, static, towards * kinetic * weight)
    drag = model.drag_n_s2_m2 * u * abs(u)
    forward = u + ((force - friction - drag) / model.mass_kg + r * state.right_m_s) * dt
    # Friction brings it to rest, and does not drive it the other way.
    stops = (1.0 - sticks) * (u * forward <= 0.0) * (abs(force) <= kinetic * weight)
    forward = o.where(stops, 0.0, forward)
    # The tyres' springs are stiff at low speed, so both are led to where they would settle.
    speed = o.maximum(abs(forward), model.rolling_m_s)
    rolls = abs(forward) > model.rolling_m_s
    stiffness = model.cornering_n_rad * model.wheel_base_m**2 / speed + model.turn_damping_n_m_s
    delta = model.max_steer_rad * steering * towards
    wanted = rolls * model.wheel_base_m * model.cornering_n_rad * delta / stiffness
    settling_s = model.inertia_kg_m2 / stiffness
    yaw_rate = r + (wanted - r) * dt / (settling_s + dt)
    aside = speed * (0.5 * delta - model.mass_kg * speed * yaw_rate / model.cornering_n_rad)
    sliding_s = 0.5 * model.mass_kg * speed / model.cornering_n_rad
    right = state.right_m_s + (rolls * aside - state.right_m_s) * dt / (sliding_s + dt)
    command = GroundCommand(throttle, steering)
    thrust = force / model.mass_kg
    return moved(state, forward, right, yaw_rate, command, thrust, ground_down_m, dt, o)
