"""A quadrotor with its attitude loop closed.

The state holds where the thrust axis points instead of roll and pitch: the lean towards
North and East, as tangents. The inner loop (motors, rate and attitude control) is a second
order response of that axis to its command; yaw is a first order one. That leaves out motor
mixing and keeps what a navigation program can notice: lag, tilt and thrust limits, drag,
wind, weight, ground.

Drag was fitted to the recording `copter_guided`: steady lean at 2 m/s is 3.8 degrees, and
the lean while braking gives 1.6 m/s2 of drag at 4.4 m/s.
"""

from __future__ import annotations

from typing import NamedTuple

from mavlink_sitl.array_ops import Lane, Ops
from mavlink_sitl.exchange import GRAVITY_M_S2


class QuadrotorModel(NamedTuple):
    """The parameters of the vehicle model; the same for all lanes."""

    drag_linear_1_s: float = 0.29
    """Drag deceleration per speed through the air."""
    drag_quadratic_1_m: float = 0.018
    """Drag deceleration per speed squared."""
    attitude_rate_rad_s: float = 8.0
    """Natural frequency of the closed attitude loop."""
    attitude_damping: float = 0.8
    """Damping ratio of the closed attitude loop."""
    yaw_time_constant_s: float = 0.2
    yaw_share: float = 0.75
    """Of a yaw rate asked for, what the rate loop reaches against drag: its integrator is weak."""
    thrust_time_constant_s: float = 0.05
    max_thrust_m_s2: float = GRAVITY_M_S2 / 0.39
    """Full throttle; hover is 39 % of it, as MOT_THST_HOVER was recorded."""
    max_lean: float = 0.7
    """Tangent of the largest lean the airframe can hold (35 degrees)."""


class QuadrotorState(NamedTuple):
    """The truth about the vehicles. Every field is a lane.

    Positions are NED metres from the world's origin, velocities NED m/s. `lean_*` is the
    tangent of the angle by which the thrust axis leans to North and East.
    """

    north_m: Lane
    east_m: Lane
    down_m: Lane
    velocity_north_m_s: Lane
    velocity_east_m_s: Lane
    velocity_down_m_s: Lane
    lean_north: Lane
    lean_east: Lane
    lean_rate_north_1_s: Lane
    lean_rate_east_1_s: Lane
    thrust_m_s2: Lane
    yaw_rad: Lane
    yaw_rate_rad_s: Lane
    on_ground: Lane
    """Whether the legs touch the ground."""
    impact_m_s: Lane
    """Sink speed at the latest touch; 0 while in the air and before the first."""


class QuadrotorCommand(NamedTuple):
    """The autopilot's commands to the vehicle. Every field is a lane."""

    lean_north: Lane
    lean_east: Lane
    thrust_m_s2: Lane
    yaw_rate_rad_s: Lane


def step(
    state: QuadrotorState,
    command: QuadrotorCommand,
    wind: tuple[Lane, Lane, Lane],
    ground_down_m: Lane,
    dt: float,
    model: QuadrotorModel,
    o: Ops,
) -> QuadrotorState:
    """One fixed step, semi-implicit Euler (stable for dt well below 1/attitude_rate)."""
    # Names in place of fields: a third of the time of one vehicle.
    (
        north, east, down, v_n, v_e, v_d, lean_n, lean_e, rate_n, rate_e, thrust,
        yaw, yaw_rate, stood, impact,
    ) = state  # fmt: skip
    lean_n_cmd, lean_e_cmd, thrust_cmd, yaw_rate_cmd = command
    w = model.attitude_rate_rad_s
    damping = 2.0 * model.attitude_damping * w
    scale = model.max_lean / o.maximum(o.hypot(lean_n_cmd, lean_e_cmd), model.max_lean)
    rate_n = rate_n + (w * w * (lean_n_cmd * scale - lean_n) - damping * rate_n) * dt
    rate_e = rate_e + (w * w * (lean_e_cmd * scale - lean_e) - damping * rate_e) * dt
    lean_n = lean_n + rate_n * dt
    lean_e = lean_e + rate_e * dt
    thrust_cmd = o.clip(thrust_cmd, 0.0, model.max_thrust_m_s2)
    follow = dt / (model.thrust_time_constant_s + dt)
    thrust = thrust + (thrust_cmd - thrust) * follow
    follow = dt / (model.yaw_time_constant_s + dt)
    yaw_rate = yaw_rate + (yaw_rate_cmd * model.yaw_share - yaw_rate) * follow

    air_n, air_e, air_d = v_n - wind[0], v_e - wind[1], v_d - wind[2]
    airspeed = o.sqrt(air_n * air_n + air_e * air_e + air_d * air_d)
    drag = model.drag_linear_1_s + model.drag_quadratic_1_m * airspeed
    up = thrust / o.sqrt(1.0 + lean_n * lean_n + lean_e * lean_e)
    v_n = v_n + (up * lean_n - drag * air_n) * dt
    v_e = v_e + (up * lean_e - drag * air_e) * dt
    v_d = v_d + (GRAVITY_M_S2 - up - drag * air_d) * dt
    down = down + v_d * dt

    touching = down >= ground_down_m
    flying = 1.0 - touching  # legs neither slide nor turn, and the vehicle stands level
    return QuadrotorState(
        o.where(touching, north, north + v_n * dt),
        o.where(touching, east, east + v_e * dt),
        o.minimum(down, ground_down_m),
        v_n * flying,
        v_e * flying,
        v_d * flying,
        lean_n * flying,
        lean_e * flying,
        rate_n * flying,
        rate_e * flying,
        thrust,
        o.wrap_pi(yaw + yaw_rate * dt * flying),
        yaw_rate * flying,
        touching,
        o.where(touching, o.where(stood, impact, v_d), 0.0),
    )
