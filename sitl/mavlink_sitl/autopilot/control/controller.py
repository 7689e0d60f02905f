"""Position, velocity and yaw control over lanes, shaped like ArduCopter's.

Two halves. *Shaping* moves a desired position, velocity and acceleration towards the target
within limits of speed, acceleration and jerk, by a square-root controller (the fastest
approach that can still stop in time). *Tracking* makes the vehicle follow the desired motion:
a proportional position loop around a PI velocity loop, whose output is a lean and a thrust.
Gains and limits carry the names of the firmware's parameters; that they produce the recorded
motion is tested with recordings.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from mavlink_sitl.array_ops import Lane, Ops
from mavlink_sitl.autopilot.control.control_state import (
    Belief,
    ControllerGains,
    ControllerState,
    HorizontalState,
    Output,
    Targets,
    VerticalState,
    YawState,
)
from mavlink_sitl.exchange import GRAVITY_M_S2, YawMode

HorizontalLaw = Callable[
    [HorizontalState, Targets, Belief, Lane, float, ControllerGains, Ops],
    tuple[HorizontalState, Lane, Lane],
]
"""Like `horizontal`: from state, targets and estimate to the leans north and east"""
VerticalLaw = Callable[
    [VerticalState, Targets, Belief, Lane, float, ControllerGains, Ops, Lane],
    tuple[VerticalState, Lane],
]
"""Like `vertical`: from state, targets and estimate to the upward specific force"""
OVERSPEED_GAIN = 2.0
"""POSCONTROL_OVERSPEED_GAIN_Z of the firmware"""
CORNER_SHARE = math.sqrt(0.5)
"""CORNER_ACCELERATION_RATIO of the firmware"""
_ANGLE, _LOOK_AHEAD, _RATE = (
    float(mode) for mode in (YawMode.ANGLE, YawMode.LOOK_AHEAD, YawMode.RATE)
)  # as the lanes have them


def sqrt_approach(error: Lane, gain: Lane, limit: Lane, o: Ops) -> Lane:
    """Speed at which to close a distance and still stop in time.

    Proportional near the target, and from where that would need more than `limit` to stop,
    the square root of the distance.

    Args:
        error: distance, >= 0.
        gain: proportional gain near the target, 1/s.
        limit: largest deceleration.
        o: float or array arithmetic.

    Returns:
        Speed, >= 0.
    """
    linear = limit / (gain * gain)
    far = o.sqrt(o.maximum(2.0 * limit * (error - 0.5 * linear), 0.0))
    return o.where(error <= linear, gain * error, far)


def step(
    state: ControllerState,
    targets: Targets,
    belief: Belief,
    dt: float,
    gains: ControllerGains,
    o: Ops,
    over_ground: HorizontalLaw | None = None,
    up_and_down: VerticalLaw | None = None,
) -> tuple[ControllerState, Output]:
    """One fixed step of shaping and tracking."""
    spool = o.clip(state.spool + (2.0 * targets.fly - 1.0) * (dt / gains.spool_up_s), 0.0, 1.0)
    # Until the motors may lift, nothing winds up and nothing runs ahead of the vehicle.
    free = targets.fly * (1.0 - belief.on_ground * (spool < 1.0))
    # A lean that is set directly (stick, SET_ATTITUDE_TARGET) leaves no desired motion over ground.
    own = free * (1.0 - targets.direct_lean)
    law = over_ground or horizontal
    most_level, most_upright = _along_the_line(state, targets, o)
    along = targets
    if most_level is not targets.speed_xy_m_s:  # one vehicle nearly always saves the copy
        along = targets._replace(speed_xy_m_s=most_level)
    level, lean_n, lean_e = law(state.horizontal, along, belief, own, dt, gains, o)
    # Off the ground, a vehicle with the throttle of the pilot leans and turns, too.
    by_pilot = targets.manual * (1.0 - belief.on_ground)
    turns = free + by_pilot
    lean_n = lean_n * own + targets.lean_north * targets.direct_lean * turns
    lean_e = lean_e * own + targets.lean_east * targets.direct_lean * turns
    climb = up_and_down or vertical
    upright_state, lift = climb(state.vertical, targets, belief, free, dt, gains, o, most_upright)
    upright = o.sqrt(1.0 + lean_n * lean_n + lean_e * lean_e)
    thrust = lift * upright
    ramp = o.where(spool >= 1.0, gains.max_thrust_m_s2, spool * gains.spool_thrust * GRAVITY_M_S2)
    thrust = targets.fly * o.clip(thrust, 0.0, ramp)
    thrust = thrust + targets.manual * targets.throttle * gains.max_thrust_m_s2 * upright
    turned = _shaped_yaw if gains.shapes_yaw else _yaw
    yaw, yaw_rate = turned(state.yaw, level, targets, belief, turns, dt, gains, o)
    state = ControllerState(level, upright_state, yaw, spool)
    return state, Output(lean_n, lean_e, thrust, yaw_rate)


def low_pass(cutoff_hz: float, dt: Lane) -> Lane:
    """Share of a new value that a filter of the first order takes over in a step."""
    return dt / (dt + 1.0 / (2.0 * math.pi * cutoff_hz))


def _along_the_line(s: ControllerState, t: Targets, o: Ops) -> tuple[Lane, Lane]:
    """How fast over ground, and up or down, so that the way to the target is straight.

    Where that is asked for, the slowest direction limits the others, as the firmware's
    position controller does it (AC_PosControl, with a position alone).
    """
    free = t.straight < 0.5
    if free is True:  # one vehicle, as nearly always
        return t.speed_xy_m_s, math.inf
    away_n = s.horizontal.target_north_m - s.horizontal.north_m
    away_e = s.horizontal.target_east_m - s.horizontal.east_m
    away_d = s.vertical.target_down_m - s.vertical.down_m
    upright = o.where(away_d > 0.0, t.speed_down_m_s, t.speed_up_m_s)
    # At least a millimetre: the shares of nothing are those of a way over ground.
    over_ground, height = o.maximum(o.hypot(away_n, away_e), 1e-3), abs(away_d)
    steep = height * t.speed_xy_m_s > over_ground * upright
    level = o.where(steep, upright * over_ground / o.maximum(height, 1e-3), t.speed_xy_m_s)
    slow = o.where(steep, upright, t.speed_xy_m_s * height / over_ground)
    return o.where(free, t.speed_xy_m_s, level), o.where(free, math.inf, slow)


def approach_speed(distance: Lane, t: Targets, o: Ops) -> Lane:
    """Over ground towards a target at a distance, metres: as fast as it can still stop."""
    gain = 0.5 * t.jerk_xy_m_s3 / t.acceleration_xy_m_s2
    return sqrt_approach(distance, gain, 0.5 * t.acceleration_xy_m_s2, o)


def cornering(
    n: Lane, e: Lane, wanted_v_n: Lane, wanted_v_e: Lane, most: Lane, o: Ops
) -> tuple[Lane, Lane]:
    """A correcting acceleration, shortened to `most`, with a share for what is across.

    Where more of it is along the wanted velocity than across it, up to CORNER_SHARE of `most`
    is kept for what is across, so that the vehicle is on its new course early (shape_vel_accel_xy
    of the firmware).
    """
    length = o.hypot(n, e)
    short = length <= most
    if short is True:  # one vehicle, as nearly always
        return n, e
    scale = most / o.maximum(length, most)
    wanted_v = o.hypot(wanted_v_n, wanted_v_e)
    unit_n, unit_e = wanted_v_n / o.maximum(wanted_v, 1e-9), wanted_v_e / o.maximum(wanted_v, 1e-9)
    along = n * unit_n + e * unit_e
    across_n, across_e = n - unit_n * along, e - unit_e * along
    across = o.hypot(across_n, across_e)
    kept = o.minimum(across, CORNER_SHARE * most)
    share = kept / o.maximum(across, 1e-9)
    left = o.sqrt(most * most - kept * kept)
    along_kept = o.clip(along, -left, left)
    corner = (abs(along) > across) & (length > most) & (wanted_v > 0.0)
    return (
        o.where(corner, across_n * share + unit_n * along_kept, n * scale),
        o.where(corner, across_e * share + unit_e * along_kept, e * scale),
    )


def shortened(n: Lane, e: Lane, _v_n: Lane, _v_e: Lane, most: Lane, o: Ops) -> tuple[Lane, Lane]:
    """The same in its own direction, whatever velocity is wanted (PX4's trajectories)."""
    scale = most / o.maximum(o.hypot(n, e), most)
    return n * scale, e * scale


def horizontal(
    s: HorizontalState,
    t: Targets,
    b: Belief,
    free: Lane,
    dt: Lane,
    k: ControllerGains,
    o: Ops,
    approach: Callable[[Lane, Targets, Ops], Lane] = approach_speed,
    shorten: Callable[[Lane, Lane, Lane, Lane, Lane, Ops], tuple[Lane, Lane]] = cornering,
) -> tuple[HorizontalState, Lane, Lane]:
    """Shape and track North and East; returns the leans."""
    # Names in place of fields: a third of the time of one vehicle.
    (
        target_n, target_e, target_v_n, target_v_e, n, e, v_n, v_e, a_n, a_e,
        integrator_n, integrator_e, was_n, was_e, rate_n, rate_e,
    ) = s  # fmt: skip
    here_n, here_e, _, speed_n, speed_e, _, _, _ = b
    a_limit, j_limit, track_v = t.acceleration_xy_m_s2, t.jerk_xy_m_s3, t.track_velocity_xy
    target_a_n, target_a_e = t.acceleration_north_m_s2, t.acceleration_east_m_s2
    # The target itself moves.
    target_v_n = target_v_n + target_a_n * dt * track_v
    target_v_e = target_v_e + target_a_e * dt * track_v
    target_n = target_n + target_v_n * dt
    target_e = target_e + target_v_e * dt
    # From position error to velocity.
    e_n = target_n - n
    e_e = target_e - e
    distance = o.hypot(e_n, e_e)
    speed = o.minimum(approach(distance, t, o), t.speed_xy_m_s)
    scale = t.track_position_xy * speed / o.maximum(distance, 1e-6)
    # From velocity error to acceleration.
    wanted_v_n, wanted_v_e = e_n * scale + target_v_n, e_e * scale + target_v_e
    d_n, d_e = wanted_v_n - v_n, wanted_v_e - v_e
    difference = o.hypot(d_n, d_e)
    fading = o.maximum(t.fading_1_s, j_limit / a_limit)
    wanted = sqrt_approach(difference, fading, j_limit, o)
    scale = track_v * wanted / o.maximum(difference, 1e-6)
    c_n, c_e = shorten(d_n * scale, d_e * scale, wanted_v_n, wanted_v_e, a_limit, o)
    # From acceleration error to jerk.
    j_n = c_n + target_a_n - a_n
    j_e = c_e + target_a_e - a_e
    most = j_limit * dt
    scale = most / o.maximum(o.hypot(j_n, j_e), most)
    a_n = (a_n + j_n * scale) * free
    a_e = (a_e + j_e * scale) * free
    # The desired motion stays close to the vehicle: one that cannot follow would overshoot later.
    faster_n = v_n + a_n * dt - speed_n
    faster_e = v_e + a_e * dt - speed_e
    scale = k.most_faster_m_s / o.maximum(o.hypot(faster_n, faster_e), k.most_faster_m_s)
    v_n = (speed_n + faster_n * scale) * free
    v_e = (speed_e + faster_e * scale) * free
    ahead_n, ahead_e = n + v_n * dt - here_n, e + v_e * dt - here_e
    scale = free * k.most_ahead_m / o.maximum(o.hypot(ahead_n, ahead_e), k.most_ahead_m)
    n, e = here_n + ahead_n * scale, here_e + ahead_e * scale
    # Tracking.
    error_n = v_n + k.position_xy * (n - here_n) - speed_n
    error_e = v_e + k.position_xy * (e - here_e) - speed_e
    smooth = low_pass(k.filter_xy_hz, dt)
    error_n = was_n + (error_n - was_n) * smooth
    error_e = was_e + (error_e - was_e) * smooth
    rate_n = (rate_n + ((error_n - was_n) / dt - rate_n) * smooth) * free
    rate_e = (rate_e + ((error_e - was_e) / dt - rate_e) * smooth) * free
    p_n = a_n + k.velocity_xy * error_n + integrator_n + k.velocity_xy_d * rate_n
    p_e = a_e + k.velocity_xy * error_e + integrator_e + k.velocity_xy_d * rate_e
    most = k.max_lean * GRAVITY_M_S2
    asked = o.hypot(p_n, p_e)
    scale = most / o.maximum(asked, most)
    grow = k.velocity_xy_i * dt * (asked < most)
    integrator_n = (integrator_n + error_n * grow) * free
    integrator_e = (integrator_e + error_e * grow) * free
    state = HorizontalState(
        target_n, target_e, target_v_n, target_v_e, n, e, v_n, v_e, a_n, a_e,
        integrator_n, integrator_e, error_n * free, error_e * free, rate_n, rate_e,
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
    """Shape and track down, at most so fast; returns the upward specific force, m/s2."""
    target, target_v, d, v, a, integrator, was_slip, push, was_speed_d = s
    _, _, here_d, _, _, speed_d, _, _ = b
    a_limit, j_limit, up, down = (
        t.acceleration_z_m_s2,
        t.jerk_z_m_s3,
        t.speed_up_m_s,
        t.speed_down_m_s,
    )
    target_v = target_v + t.acceleration_down_m_s2 * dt * t.track_velocity_z
    target = target + target_v * dt
    error = target - d
    # Faster than allowed, as after a mode with other limits: brake harder in proportion.
    excess = abs(v) / o.where(v > 0.0, down, up)
    boost = o.where(excess > 1.0, OVERSPEED_GAIN * excess, 1.0)
    acceleration, max_jerk = a_limit * boost, j_limit * boost
    speed = sqrt_approach(abs(error), 0.5 * j_limit / a_limit, 0.5 * a_limit, o)
    speed = o.minimum(speed, most_m_s)
    speed = o.where(error > 0.0, o.minimum(speed, down), -o.minimum(speed, up))
    difference = t.track_position_z * speed + target_v - v
    fading = o.maximum(t.fading_1_s, max_jerk / acceleration)
    wanted = sqrt_approach(abs(difference), fading, max_jerk, o)
    wanted = o.minimum(wanted, acceleration)
    wanted = t.track_velocity_z * o.where(difference > 0.0, wanted, -wanted)
    most = max_jerk * dt
    jerk = o.clip(wanted + t.acceleration_down_m_s2 - a, -most, most)
    a = (a + jerk) * free
    v = (v + a * dt) * free
    # The same, and a target below ground must not run away from a vehicle that stands on it.
    ahead = o.clip(d + v * dt - here_d, -k.most_ahead_m, k.most_below_m)
    d = here_d + ahead * free
    slip = v + k.position_z * (d - here_d) - speed_d
    slip = was_slip + (slip - was_slip) * low_pass(k.filter_z_hz, dt)
    integrator = o.clip(integrator + slip * (k.velocity_z_i * dt), -5.0, 5.0) * free
    asked = a + k.velocity_z * slip + integrator
    if not k.direct_push_z:
        # The vehicle's own accelerometer closes a loop around what was asked for.
        lacking = asked - (speed_d - was_speed_d) / dt
        push = o.clip(push + lacking * (k.push_z_i * dt), -5.0, 5.0) * free
        asked = k.push_z * lacking + push
    state = VerticalState(target, target_v, d, v, a, integrator, slip * free, push, speed_d)
    return state, GRAVITY_M_S2 - asked


def _shaped_yaw(
    s: YawState,
    level: HorizontalState,
    t: Targets,
    b: Belief,
    free: Lane,
    dt: float,
    k: ControllerGains,
    o: Ops,
) -> tuple[YawState, Lane]:
    """Turn the desired yaw towards the one asked for, within limits; returns it and the rate.

    Looking ahead, it also turns as fast as the desired velocity does; below a twentieth of the
    speed, and where no yaw is asked for, it stops turning (calculate_yaw_and_rate_yaw and
    input_thrust_vector_heading of the firmware). A yaw with a rate turns on with it (AutoYaw's
    ANGLE_RATE), and the rate is added to that towards it (input_shaping_angle).
    """
    v_n, v_e = level.velocity_north_m_s, level.velocity_east_m_s
    a_n, a_e = level.acceleration_north_m_s2, level.acceleration_east_m_s2
    speed = o.hypot(v_n, v_e)
    ahead = (t.yaw_mode == _LOOK_AHEAD) & (speed > 0.05 * t.speed_xy_m_s)
    turning, at_angle = t.yaw_mode == _RATE, t.yaw_mode == _ANGLE
    asked = o.where(at_angle, s.asked_rad + t.yaw_rate_rad_s * dt, s.yaw_rad)
    asked = o.where(ahead, o.atan2(v_e, v_n), asked)
    error = o.wrap_pi(asked - s.yaw_rad)
    limit = k.yaw_acceleration_rad_s2
    closing = sqrt_approach(abs(error), k.yaw_shaped_1_s, limit, o)
    curve = (v_n * a_e - v_e * a_n) / o.maximum(speed * speed, 1e-6)
    wanted = o.where(error > 0.0, closing, -closing) + ahead * curve + at_angle * t.yaw_rate_rad_s
    wanted = o.clip(wanted, -k.yaw_slew_rad_s, k.yaw_slew_rad_s) + turning * t.yaw_rate_rad_s
    most = limit * dt
    rate = (s.rate_rad_s + o.clip(wanted - s.rate_rad_s, -most, most)) * free
    yaw = o.where(free, s.yaw_rad + rate * dt, b.yaw_rad)
    asked = o.where(free, asked, b.yaw_rad)
    return YawState(asked, yaw, rate), (rate + k.yaw * o.wrap_pi(yaw - b.yaw_rad)) * free


def _yaw(
    s: YawState,
    _level: HorizontalState,
    t: Targets,
    b: Belief,
    free: Lane,
    dt: float,
    k: ControllerGains,
    o: Ops,
) -> tuple[YawState, Lane]:
    """Turn towards the yaw asked for; returns that yaw, turned on in rate mode, and the rate.

    With a yaw, too, a rate is added (AttitudeControl of the firmware, with yaw_sp_move_rate).
    """
    turning, at_angle = t.yaw_mode == _RATE, t.yaw_mode == _ANGLE
    asked = o.where(turning, s.asked_rad + t.yaw_rate_rad_s * dt, s.asked_rad)
    asked = o.where(free, asked, b.yaw_rad)
    error = o.wrap_pi(asked - b.yaw_rad)
    rate = k.yaw * error + at_angle * t.yaw_rate_rad_s
    rate = o.clip(rate, -k.yaw_slew_rad_s, k.yaw_slew_rad_s)
    return YawState(asked, asked, 0.0 * rate), (rate + turning * t.yaw_rate_rad_s) * free
