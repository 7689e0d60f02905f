"""PX4's position control: OFFBOARD's loops and smoothed trajectories.

OFFBOARD has no trajectory in front of it: a proportional position loop gives a velocity, a
PID loop around that an acceleration, and that a lean and a thrust. The AUTO modes follow a smooth
trajectory, which is slowed down while the vehicle lags behind it. Read in the firmware
(PositionControl, PositionSmoothing); gains are its parameters' default values.
"""

from __future__ import annotations

from mavlink_sitl.array_ops import Lane, Ops
from mavlink_sitl.autopilot.control import controller
from mavlink_sitl.autopilot.control.control_state import (
    Belief,
    ControllerGains,
    HorizontalState,
    Targets,
    VerticalState,
)
from mavlink_sitl.exchange import GRAVITY_M_S2

UNSHAPED_M_S2 = 1e3
"""A limit of acceleration from here on means: no trajectory; see `CopterNavigator`"""
VELOCITY_D = 0.1
"""Effective MPC_XY_VEL_D_ACC: 0.2, less the loss in the filter of MPC_VELD_LP (5 Hz). With this
gain, legs of 5 m to 30 m end as those of the real one"""
LAG_M = 2.0
"""MPC_XY_ERR_MAX: at this lag of the vehicle its trajectory would stop; see MOST_WAITING"""
MOST_WAITING = 0.7
"""The largest share by which a trajectory is slowed down, as recorded (`offboard_loss_stop`)"""
ANTI_WINDUP = 2.0
"""Over the velocity gain: how a saturated lean empties the integrator"""

Leans = tuple[HorizontalState, Lane, Lane]


def horizontal(
    s: HorizontalState, t: Targets, b: Belief, free: Lane, dt: float, k: ControllerGains, o: Ops
) -> Leans:
    """See `controller.horizontal`."""
    direct = t.acceleration_xy_m_s2 >= UNSHAPED_M_S2
    if isinstance(direct, bool):
        law = _direct if direct else _smooth
        return law(s, t, b, free, dt, k, o)
    bare, smooth = _direct(s, t, b, free, dt, k, o), _smooth(s, t, b, free, dt, k, o)
    state = HorizontalState(
        *(o.where(direct, x, y) for x, y in zip(bare[0], smooth[0], strict=True))
    )
    return state, o.where(direct, bare[1], smooth[1]), o.where(direct, bare[2], smooth[2])


def _smooth(
    s: HorizontalState, t: Targets, b: Belief, free: Lane, dt: float, k: ControllerGains, o: Ops
) -> Leans:
    """Along a trajectory that waits for the vehicle."""
    behind_n, behind_e = s.north_m - b.north_m, s.east_m - b.east_m
    lags = behind_n * s.velocity_north_m_s + behind_e * s.velocity_east_m_s > 0.0
    time_scale = 1.0 - lags * t.track_position_xy * o.minimum(
        o.hypot(behind_n, behind_e) / LAG_M, MOST_WAITING
    )
    return controller.horizontal(
        s, t, b, free, dt * time_scale, k, o, _approach_speed, controller.shortened
    )


def _approach_speed(distance: Lane, t: Targets, o: Ops) -> Lane:
    """At which a deceleration that has to build up first can still stop."""
    build_up = 2.0 * t.acceleration_xy_m_s2 * t.acceleration_xy_m_s2 / t.jerk_xy_m_s3
    squared = build_up * build_up + 2.0 * t.acceleration_xy_m_s2 * distance
    return o.sqrt(squared) - build_up


def _direct(
    s: HorizontalState, t: Targets, b: Belief, free: Lane, dt: float, k: ControllerGains, o: Ops
) -> Leans:
    """P and PID; a trajectory that follows begins where the vehicle is, without acceleration."""
    gain = 0.5 * t.jerk_xy_m_s3 / t.acceleration_xy_m_s2
    # A setpoint stands still until the next one comes.
    target_v_n, target_v_e = s.target_velocity_north_m_s, s.target_velocity_east_m_s
    target_n, target_e = s.target_north_m, s.target_east_m
    v_n = target_v_n + t.track_position_xy * gain * (target_n - b.north_m)
    v_e = target_v_e + t.track_position_xy * gain * (target_e - b.east_m)
    scale = t.speed_xy_m_s / o.maximum(o.hypot(v_n, v_e), t.speed_xy_m_s)
    error_n = (v_n * scale - b.velocity_north_m_s) * t.track_velocity_xy
    error_e = (v_e * scale - b.velocity_east_m_s) * t.track_velocity_xy
    rate_n = (b.velocity_north_m_s - s.velocity_north_m_s) / dt
    rate_e = (b.velocity_east_m_s - s.velocity_east_m_s) / dt
    damping = VELOCITY_D * t.track_velocity_xy * free
    p_n = t.acceleration_north_m_s2 + k.velocity_xy * error_n + s.integrator_north_m_s2
    p_e = t.acceleration_east_m_s2 + k.velocity_xy * error_e + s.integrator_east_m_s2
    p_n, p_e = p_n - damping * rate_n, p_e - damping * rate_e
    most = k.max_lean * GRAVITY_M_S2
    scale = most / o.maximum(o.hypot(p_n, p_e), most)
    back = ANTI_WINDUP / k.velocity_xy * (1.0 - scale)
    grow = k.velocity_xy_i * dt
    state = HorizontalState(
        target_n, target_e, target_v_n, target_v_e,
        b.north_m, b.east_m, b.velocity_north_m_s, b.velocity_east_m_s,
        0.0 * free, 0.0 * free,
        (s.integrator_north_m_s2 + (error_n - back * p_n) * grow) * free,
        (s.integrator_east_m_s2 + (error_e - back * p_e) * grow) * free,
        0.0 * free, 0.0 * free, 0.0 * free, 0.0 * free,
    )  # fmt: skip
    return state, p_n * scale / GRAVITY_M_S2, p_e * scale / GRAVITY_M_S2


def vertical(
    s: VerticalState,
    t: Targets,
    b: Belief,
    free: Lane,
    dt: float,
    k: ControllerGains,
    o: Ops,
    most_m_s: Lane,
) -> tuple[VerticalState, Lane]:
    """See `controller.vertical`."""
    direct = t.acceleration_z_m_s2 >= UNSHAPED_M_S2
    if isinstance(direct, bool):
        law = _direct_vertical if direct else controller.vertical
        return law(s, t, b, free, dt, k, o, most_m_s)
    bare = _direct_vertical(s, t, b, free, dt, k, o, most_m_s)
    smooth = controller.vertical(s, t, b, free, dt, k, o, most_m_s)
    state = VerticalState(*(o.where(direct, x, y) for x, y in zip(bare[0], smooth[0], strict=True)))
    return state, o.where(direct, bare[1], smooth[1])


def _direct_vertical(
    s: VerticalState,
    t: Targets,
    b: Belief,
    free: Lane,
    dt: float,
    k: ControllerGains,
    o: Ops,
    _most_m_s: Lane,
) -> tuple[VerticalState, Lane]:
    """P and PI; a trajectory that follows begins where the vehicle is, without acceleration."""
    here, speed = b.down_m, b.velocity_down_m_s
    target, target_v = s.target_down_m, s.target_velocity_down_m_s
    gain = 0.5 * t.jerk_z_m_s3 / t.acceleration_z_m_s2
    wanted = target_v + t.track_position_z * gain * (target - here)
    wanted = o.clip(wanted, -t.speed_up_m_s, t.speed_down_m_s)
    error = (wanted - speed) * t.track_velocity_z
    asked = t.acceleration_down_m_s2 + k.velocity_z * error + s.integrator_down_m_s2
    most = k.max_thrust_m_s2 - GRAVITY_M_S2
    grow = k.velocity_z_i * dt * (abs(asked) < most)
    integrator = (s.integrator_down_m_s2 + error * grow) * free
    zero = 0.0 * free
    state = VerticalState(target, target_v, here, speed, zero, integrator, zero, zero, speed)
    return state, GRAVITY_M_S2 - asked
