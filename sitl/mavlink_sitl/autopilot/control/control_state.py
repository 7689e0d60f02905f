"""The controllers' inputs, state and outputs. Every field of a lane type is a lane."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import fields
from operator import attrgetter
from typing import NamedTuple, TypeVar

from mavlink_sitl.array_ops import Lane, Ops
from mavlink_sitl.exchange import GRAVITY_M_S2, Guidance, Limits, Motors, YawMode


class ControllerGains(NamedTuple):
    """Gains of the tracking half; the same for all lanes."""

    position_xy: float = 1.0
    """PSC_POSXY_P"""
    velocity_xy: float = 2.0
    """PSC_VELXY_P"""
    velocity_xy_i: float = 1.0
    """PSC_VELXY_I"""
    velocity_xy_d: float = 0.5
    """PSC_VELXY_D of 2025; PSC_NE_VEL_D is 0.25 in 2026"""
    filter_xy_hz: float = 5.0
    """PSC_VELXY_FLTE and PSC_VELXY_FLTD"""
    position_z: float = 1.0
    """PSC_POSZ_P"""
    velocity_z: float = 5.0
    """PSC_VELZ_P"""
    velocity_z_i: float = 0.0
    """PSC_VELZ_I"""
    filter_z_hz: float = 5.0
    """PSC_VELZ_FLTE"""
    push_z: float = 1.28
    """PSC_ACCZ_P: of an error of acceleration, as an acceleration. The firmware's number counts in
    throttle, of which 0.39 hovers: 0.05 * 9.81 / 0.39"""
    push_z_i: float = 2.5
    """PSC_ACCZ_I, likewise"""
    direct_push_z: bool = False
    """Whether there is no loop around the acceleration (PX4)"""
    restart_keeps_lean: bool = True
    """Whether a restart gives the present lean to the integrator (init_NE_controller)"""
    max_lean: float = 0.5774
    """Tangent of ANGLE_MAX, 30 degrees"""
    most_ahead_m: float = 5.0
    """How far the desired position may be from the vehicle, in any direction but down"""
    most_faster_m_s: float = 4.0
    """How far the desired velocity may be from the vehicle's, North and East"""
    most_below_m: float = 2.0
    """The same, down"""
    yaw: float = 4.5
    """ATC_ANG_YAW_P: from yaw error to rate"""
    yaw_slew_rad_s: float = 1.0472
    """ATC_SLEW_YAW, 60 degrees a second"""
    yaw_shaped_1_s: float = 6.667
    """1 / ATC_INPUT_TC: how fast the desired yaw closes on the one asked for"""
    yaw_acceleration_rad_s2: float = 4.712
    """ATC_ACCEL_Y_MAX, 270 degrees/s2: of the desired yaw"""
    shapes_yaw: bool = True
    """Whether the desired yaw has limits of rate and acceleration (not in PX4)"""
    spool_up_s: float = 1.0
    """From idle to the thrust that lifts"""
    spool_thrust: float = 1.12
    """Thrust over weight at the end of spooling up"""
    max_thrust_m_s2: float = GRAVITY_M_S2 / 0.39


class Targets(NamedTuple):
    """`Guidance` as lanes (see there), packed once per change."""

    fly: Lane
    manual: Lane
    yaw_mode: Lane
    throttle: Lane
    track_position_xy: Lane
    track_velocity_xy: Lane
    track_position_z: Lane
    track_velocity_z: Lane
    acceleration_north_m_s2: Lane
    acceleration_east_m_s2: Lane
    acceleration_down_m_s2: Lane
    direct_lean: Lane
    lean_north: Lane
    lean_east: Lane
    speed_xy_m_s: Lane
    speed_up_m_s: Lane
    speed_down_m_s: Lane
    acceleration_xy_m_s2: Lane
    acceleration_z_m_s2: Lane
    jerk_xy_m_s3: Lane
    jerk_z_m_s3: Lane
    fading_1_s: Lane
    yaw_rate_rad_s: Lane
    straight: Lane


class HorizontalState(NamedTuple):
    """The horizontal state of the controllers. Every field is a lane."""

    target_north_m: Lane
    target_east_m: Lane
    target_velocity_north_m_s: Lane
    target_velocity_east_m_s: Lane
    north_m: Lane
    east_m: Lane
    velocity_north_m_s: Lane
    velocity_east_m_s: Lane
    acceleration_north_m_s2: Lane
    acceleration_east_m_s2: Lane
    integrator_north_m_s2: Lane
    integrator_east_m_s2: Lane
    error_north_m_s: Lane
    error_east_m_s: Lane
    """Of the velocity, filtered"""
    error_rate_north_m_s2: Lane
    error_rate_east_m_s2: Lane


class VerticalState(NamedTuple):
    """The same about down."""

    target_down_m: Lane
    target_velocity_down_m_s: Lane
    down_m: Lane
    velocity_down_m_s: Lane
    acceleration_down_m_s2: Lane
    integrator_down_m_s2: Lane
    error_down_m_s: Lane
    """Of the velocity, filtered"""
    push_down_m_s2: Lane
    """Integrator of the acceleration loop"""
    was_velocity_down_m_s: Lane
    """The estimate one step before"""


class YawState(NamedTuple):
    """The state of the yaw controller. Every field is a lane."""

    asked_rad: Lane
    """Where the nose is to look"""
    yaw_rad: Lane
    """The desired yaw on its way there"""
    rate_rad_s: Lane
    """Of the desired yaw"""


class ControllerState(NamedTuple):
    """The state of the controllers. NED and SI units.

    Attributes:
        horizontal: targets, desired motion and integrators, North and East.
        vertical: the same, down.
        yaw: the yaw asked for and the desired one.
        spool: 0 at idle .. 1 when the motors may give the thrust that is asked for, a lane.
    """

    horizontal: HorizontalState
    vertical: VerticalState
    yaw: YawState
    spool: Lane


class Belief(NamedTuple):
    """The estimated states of the vehicles. Every field is a lane."""

    north_m: Lane
    east_m: Lane
    down_m: Lane
    velocity_north_m_s: Lane
    velocity_east_m_s: Lane
    velocity_down_m_s: Lane
    yaw_rad: Lane
    on_ground: Lane


class Output(NamedTuple):
    """The outputs of the controllers. Every field is a lane."""

    lean_north: Lane
    lean_east: Lane
    thrust_m_s2: Lane
    yaw_rate_rad_s: Lane


def initial(belief: Belief, o: Ops) -> ControllerState:
    """Controllers that want to be where the vehicle is."""
    zero = o.full(0.0)
    return ControllerState(
        HorizontalState(
            belief.north_m, belief.east_m, zero, zero,
            belief.north_m, belief.east_m, zero, zero,
            zero, zero, zero, zero, zero, zero, zero, zero,
        ),
        VerticalState(
            belief.down_m, zero, belief.down_m, zero, zero, zero, zero, zero,
            belief.velocity_down_m_s,
        ),
        YawState(belief.yaw_rad, belief.yaw_rad, zero),
        zero,
    )  # fmt: skip


_LIMITS = {item.name for item in fields(Limits)}
_STEADY = attrgetter(*(f"limits.{n}" if n in _LIMITS else n for n in Targets._fields[3:]))


def targets_of(g: Guidance) -> Targets:
    """The steady part of the guidance of one vehicle; every field a float."""
    fly, manual = float(g.motors is Motors.FLY), float(g.motors is Motors.MANUAL)
    return Targets(fly, manual, float(g.yaw_mode), *_STEADY(g))


T = TypeVar("T", bound=NamedTuple)


def packed(
    kind: type[T], steady: Callable[[Guidance], tuple[float, ...]], rows: Sequence[Guidance], o: Ops
) -> T:
    """Lanes of the vehicles' guidance: `fly`, `manual` and the values that `steady` reads."""
    commands = [(g.motors is Motors.FLY, g.motors is Motors.MANUAL, *steady(g)) for g in rows]
    return kind._make(o.pack([float(v) for v in column]) for column in zip(*commands, strict=True))


def retargeted(
    state: ControllerState,
    g: Guidance,
    belief: Belief,
    k: ControllerGains,
    get: Callable[[Lane], float],
    put: Callable[[Lane, float], Lane],
) -> ControllerState:
    """The state of the controllers after one vehicle has got new guidance.

    Args:
        state: their state before.
        g: the new guidance.
        belief: where the vehicle thinks it is, every field a float.
        k: their gains.
        get: reads the vehicle's number in a lane.
        put: writes the vehicle's number into a lane.
    """
    level, upright, yaw = state.horizontal, state.vertical, state.yaw
    level = level._replace(
        target_north_m=put(level.target_north_m, g.north_m),
        target_east_m=put(level.target_east_m, g.east_m),
        target_velocity_north_m_s=put(level.target_velocity_north_m_s, g.velocity_north_m_s),
        target_velocity_east_m_s=put(level.target_velocity_east_m_s, g.velocity_east_m_s),
    )
    upright = upright._replace(
        target_down_m=put(upright.target_down_m, g.down_m),
        target_velocity_down_m_s=put(upright.target_velocity_down_m_s, g.velocity_down_m_s),
    )
    if g.restart_xy:
        level = level._replace(
            north_m=put(level.north_m, belief.north_m),
            east_m=put(level.east_m, belief.east_m),
            velocity_north_m_s=put(level.velocity_north_m_s, belief.velocity_north_m_s),
            velocity_east_m_s=put(level.velocity_east_m_s, belief.velocity_east_m_s),
        )
        if k.restart_keeps_lean:
            level = _keeping_lean(level, k, get, put)
    if g.restart_z:
        upright = upright._replace(
            down_m=put(upright.down_m, belief.down_m),
            velocity_down_m_s=put(upright.velocity_down_m_s, belief.velocity_down_m_s),
        )
    if g.unshaped:
        level = level._replace(
            north_m=put(level.north_m, g.north_m),
            east_m=put(level.east_m, g.east_m),
            velocity_north_m_s=put(level.velocity_north_m_s, g.velocity_north_m_s),
            velocity_east_m_s=put(level.velocity_east_m_s, g.velocity_east_m_s),
            acceleration_north_m_s2=put(level.acceleration_north_m_s2, g.acceleration_north_m_s2),
            acceleration_east_m_s2=put(level.acceleration_east_m_s2, g.acceleration_east_m_s2),
        )
        upright = upright._replace(
            down_m=put(upright.down_m, g.down_m),
            velocity_down_m_s=put(upright.velocity_down_m_s, g.velocity_down_m_s),
            acceleration_down_m_s2=put(upright.acceleration_down_m_s2, g.acceleration_down_m_s2),
        )
    if g.yaw_mode is YawMode.ANGLE:
        yaw = yaw._replace(asked_rad=put(yaw.asked_rad, g.yaw_rad))
    return ControllerState(level, upright, yaw, state.spool)


def _keeping_lean(
    s: HorizontalState,
    k: ControllerGains,
    get: Callable[[Lane], float],
    put: Callable[[Lane, float], Lane],
) -> HorizontalState:
    """A new desired motion begins without acceleration, and the integrator has the lean.

    A vehicle that was accelerating therefore does so until the integrator has emptied.
    """
    axes = zip(
        (s.acceleration_north_m_s2, s.acceleration_east_m_s2),
        (s.error_north_m_s, s.error_east_m_s),
        (s.integrator_north_m_s2, s.integrator_east_m_s2),
        (s.error_rate_north_m_s2, s.error_rate_east_m_s2),
        strict=True,
    )
    north, east = (
        get(wanted) + k.velocity_xy * get(error) + get(gathered) + k.velocity_xy_d * get(rate)
        for wanted, error, gathered, rate in axes
    )
    most = k.max_lean * GRAVITY_M_S2
    scale = most / max(math.hypot(north, east), most)
    return s._replace(
        acceleration_north_m_s2=put(s.acceleration_north_m_s2, 0.0),
        acceleration_east_m_s2=put(s.acceleration_east_m_s2, 0.0),
        integrator_north_m_s2=put(s.integrator_north_m_s2, north * scale),
        integrator_east_m_s2=put(s.integrator_east_m_s2, east * scale),
        error_north_m_s=put(s.error_north_m_s, 0.0),
        error_east_m_s=put(s.error_east_m_s, 0.0),
        error_rate_north_m_s2=put(s.error_rate_north_m_s2, 0.0),
        error_rate_east_m_s2=put(s.error_rate_east_m_s2, 0.0),
    )
