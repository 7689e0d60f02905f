"""Capabilities and modes of a vehicle, by its profile and its parameters. No ROS."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import NamedTuple

from mavlink_vehicle.profiles import Profile, SetpointField, VehicleKind
from navigation_core.limits import Limits
from navigation_core.safety.late_setpoints import Following, Shaping
from navigation_core.tasks.observation import VehicleMode
from navigation_core.tasks.traits import Traits

_NONE: Mapping[str, float] = MappingProxyType({})
# Minimum safe height of a plane's circle, and default height of its take-off.
_PLANE_HEIGHT_MIN_M, _PLANE_TAKEOFF_M = 20.0, 40.0
# TURN_RADIUS of ArduRover defaults to 0.9 m; a boat needs more. The parameters count if they give
# more: tyres and hulls slide.
_ROVER_TURN_M, _BOAT_TURN_M = 0.9, 4.0
_ROVER_TURN_RAD_S, _BOAT_TURN_RAD_S = 1.0, 0.6
# A firmware keeps to its limits of turn rate and deceleration, but the vehicle lags; this share of
# them is used.
_TURN_SHARE, _BRAKING_SHARE = 0.8, 0.6
_BOAT_ARRIVAL_M = 2.0
# Default deceleration, and the maximum for a boat, which has no brakes but its drag.
_ROVER_BRAKING_M_S2, _BOAT_BRAKING_M_S2 = 0.6, 0.4
# Overshoot of ArduRover's PI controller on a ramp (recorded), and of a hull in addition
# (simulated).
_ROVER_LAG_S, _BOAT_LAG_S = 0.3, 1.0
# Of the acceleration by which a copter corrects its motion this share is flown with: without a rest
# for errors it lags behind, and overshoots its speed as it catches up.
_FOLLOWED_SHARE = 0.8
# A plane keeps a circle by this share of its greatest bank; the rest is for wind, and for errors.
# ArduPlane, sent to 40 m where this gives 52 m, circles with 50 to 60 m (observed).
_BANK_SHARE = 2.0 / 3.0
_GRAVITY_M_S2 = 9.80665


def drives(profile: Profile | None) -> bool:
    """Whether a vehicle is known to stay on the ground."""
    return profile is not None and profile.kind in (VehicleKind.ROVER, VehicleKind.BOAT)


def circle_radius_m(
    profile: Profile, parameters: Mapping[str, float], about_launch: bool = False
) -> float:
    """Return the radius of a plane's circles by its own parameters, as far as known.

    A fast plane circles wider than that (``circle_max_m`` of the core).
    """
    names = profile.return_circle_parameters if about_launch else profile.circle_parameters
    return abs(_signed_radius_m(profile, names, parameters))


def _signed_radius_m(
    profile: Profile, names: Sequence[str], parameters: Mapping[str, float]
) -> float:
    """Return the radius of circles; both firmwares circle to the left if it is negative."""
    return next(
        (parameters[name] for name in names if parameters.get(name)), profile.circle_radius_m
    )


def traits_of(profile: Profile, parameters: Mapping[str, float] = _NONE) -> Traits:
    """Return the traits of a kind of vehicle and of this one, for navigation.

    Args:
        profile: its kind and firmware.
        parameters: the known ones of the profile's `wanted_parameters`.
    """
    lands_itself = profile.land_mode is not None
    before = profile.takeoff.control_first
    if profile.kind is VehicleKind.PLANE:
        least_m_s, greatest_m_s = _airspeed_limits_m_s(profile, parameters)
        return Traits(
            name="plane",
            hovers=False,
            control_before_takeoff=before,
            lands_itself=lands_itself,
            circle_radius_m=circle_radius_m(profile, parameters),
            circles_left=_signed_radius_m(profile, profile.circle_parameters, parameters) < 0.0,
            airspeed_m_s=_airspeed_m_s(profile, parameters),
            airspeed_min_m_s=least_m_s,
            airspeed_max_m_s=greatest_m_s,
            circle_acceleration_m_s2=_circle_acceleration_m_s2(profile, parameters),
            reposition_keeps_mode=profile.reposition_keeps_mode,
            sinks_along_leg=profile.sinks_along_leg,
            height_min_m=_PLANE_HEIGHT_MIN_M,
            takeoff_height_m=_PLANE_TAKEOFF_M,
        )
    if drives(profile):
        boat = profile.kind is VehicleKind.BOAT
        driving = driving_of(parameters)
        braking_m_s2, turn_rad_s = _ROVER_BRAKING_M_S2, _ROVER_TURN_RAD_S
        if driving.braking_m_s2 is not None:
            braking_m_s2 = _BRAKING_SHARE * driving.braking_m_s2
        if driving.turn_rate_rad_s is not None:
            turn_rad_s = _TURN_SHARE * driving.turn_rate_rad_s
        turning_radius_m = max(
            _BOAT_TURN_M if boat else _ROVER_TURN_M, driving.turning_radius_m or 0.0
        )
        return Traits(
            name="boat" if boat else "rover",
            flies=False,
            control_before_takeoff=before,
            lands_itself=False,
            turning_radius_m=turning_radius_m,
            turn_rate_rad_s=min(turn_rad_s, _BOAT_TURN_RAD_S if boat else math.inf),
            arrival_radius_m=_BOAT_ARRIVAL_M if boat else 0.0,
            speed_max_m_s=driving.speed_m_s or math.inf,
            acceleration_m_s2=driving.acceleration_m_s2 or math.inf,
            brake_lag_s=_BOAT_LAG_S if boat else _ROVER_LAG_S,
            braking_m_s2=min(braking_m_s2, _BOAT_BRAKING_M_S2 if boat else math.inf),
            drives_by_turn_rate=profile.setpoints.drives_by_turn_rate,
            setpoint_timeout_s=_setpoint_timeout_s(profile, parameters),
            return_turn_m=turning_radius_m if _drives_back(profile, parameters) else 0.0,
        )
    following = profile.setpoints.following
    most_m_s2 = most_climb_m_s2 = math.inf
    if following is not None:
        most_m_s2 = _FOLLOWED_SHARE * _limit(following.acceleration, parameters, math.inf)
        most_climb_m_s2 = _FOLLOWED_SHARE * _limit(
            following.climb_acceleration, parameters, math.inf
        )
    return Traits(
        control_before_takeoff=before,
        lands_itself=lands_itself,
        acceleration_m_s2=most_m_s2,
        climb_acceleration_m_s2=most_climb_m_s2,
        setpoint_timeout_s=_setpoint_timeout_s(profile, parameters),
        following=_following(profile, parameters),
    )


def _airspeed_m_s(profile: Profile, parameters: Mapping[str, float]) -> float:
    """Return the airspeed that a plane keeps by its parameter, 0 while that is not known."""
    speeds_m_s = (scale * parameters.get(name, 0.0) for name, scale in profile.return_speeds)
    return next((speed_m_s for speed_m_s in speeds_m_s if speed_m_s > 0.0), 0.0)


def _airspeed_limits_m_s(profile: Profile, parameters: Mapping[str, float]) -> tuple[float, float]:
    """Return the least and the greatest airspeed by their parameters, 0 while one is not known."""
    limits = [parameters.get(name, 0.0) for name in profile.airspeed_limit_parameters]
    if len(limits) != 2 or not 0.0 < limits[0] <= limits[1] < math.inf:
        return 0.0, 0.0
    return limits[0], limits[1]


def _circle_acceleration_m_s2(profile: Profile, parameters: Mapping[str, float]) -> float:
    """Return what a plane turns with on a given circle, 0 while its greatest bank is not known."""
    limit_rad = math.radians(parameters.get(profile.roll_limit_parameter, 0.0))
    if not 0.0 < limit_rad < math.pi / 2:
        return 0.0
    return _GRAVITY_M_S2 * math.tan(_BANK_SHARE * limit_rad)


def _drives_back(profile: Profile, parameters: Mapping[str, float]) -> bool:
    """Return whether the vehicle drives back by itself when its setpoints end."""
    name = profile.setpoints.loss_parameter
    return bool(name) and parameters.get(name) not in profile.setpoints.loss_stops


def _limit(
    limit: tuple[str, float, float], parameters: Mapping[str, float], unknown: float
) -> float:
    """Return a limit of the autopilot by its parameter, or another number if that is unknown."""
    name, factor, _ = limit
    value = factor * parameters.get(name, 0.0)
    return value if math.isfinite(value) and value > 0.0 else unknown


def _following(profile: Profile, parameters: Mapping[str, float]) -> Following | None:
    """Return how the vehicle comes to a setpoint whose target it moves on."""
    following = profile.setpoints.following
    if following is None:
        return None
    limits = (
        following.acceleration,
        following.jerk,
        following.climb_acceleration,
        following.climb_jerk,
    )
    level, jerk, climb, climb_jerk = (_limit(one, parameters, one[2]) for one in limits)
    return Following(Shaping(level, jerk), Shaping(climb, climb_jerk))


def _setpoint_timeout_s(profile: Profile, parameters: Mapping[str, float]) -> float:
    """Return the time for which the vehicle follows its last setpoint."""
    timeout_s = parameters.get(profile.setpoints.timeout_parameter)
    return profile.setpoints.timeout_s if timeout_s is None else max(timeout_s, 0.0)


def limits_of(traits: Traits, limits: Limits) -> Limits:
    """Return the limits of the server, capped by those of the autopilot."""
    return replace(
        limits,
        speed_horizontal_m_s=min(limits.speed_horizontal_m_s, traits.speed_max_m_s),
        acceleration_horizontal_m_s2=min(
            limits.acceleration_horizontal_m_s2, traits.acceleration_m_s2
        ),
        acceleration_vertical_m_s2=min(
            limits.acceleration_vertical_m_s2, traits.climb_acceleration_m_s2
        ),
    )


def vehicle_mode(profile: Profile | None, name: str) -> VehicleMode:
    """Classify a mode by the autopilot's own name."""
    if profile is None or not name:
        return VehicleMode.OTHER
    on_target = profile.landing_target
    for mode, known in (
        (VehicleMode.CONTROL, profile.control_mode),
        (VehicleMode.HOLD, profile.hold_mode),
        (VehicleMode.LAND, profile.land_mode),
        (VehicleMode.LAND, None if on_target is None else on_target.mode),
        (VehicleMode.RETURN, profile.return_mode),
        (VehicleMode.MISSION, profile.mission_mode),
        (VehicleMode.TAKE_OFF, profile.takeoff.mode),
    ):
        if name == known:
            return mode
    return VehicleMode.OTHER


def velocity_only(profile: Profile | None) -> bool:
    """True if the vehicle receives velocities only and keeps moving with the last one."""
    return profile is not None and profile.setpoints.form is SetpointField.VELOCITY


class Driving(NamedTuple):
    """Driving characteristics from parameters; None where unknown.

    Attributes:
        turning_radius_m: radius of the tightest turn at low speed.
        turn_rate_rad_s: maximum turn rate.
        speed_m_s: maximum speed of setpoints.
        acceleration_m_s2: acceleration of the autopilot.
        braking_m_s2: its deceleration.
    """

    turning_radius_m: float | None = None
    turn_rate_rad_s: float | None = None
    speed_m_s: float | None = None
    acceleration_m_s2: float | None = None
    braking_m_s2: float | None = None


def driving_of(parameters: Mapping[str, float]) -> Driving:
    """Read the parameters of ArduRover or of PX4's rovers with steered wheels.

    ArduRover: TURN_RADIUS; ATC_STR_RAT_MAX, ATC_ACCEL_MAX and ATC_DECEL_MAX (0: the same), where 0
    means no limit; WP_SPEED, above which GUIDED accepts no velocity (GCS_MAVLink_Rover.cpp).
    PX4 (rover_ackermann): RA_WHEEL_BASE and RA_MAX_STR_ANG; RO_YAW_RATE_LIM, RO_SPEED_LIM,
    RO_ACCEL_LIM and RO_DECEL_LIM, where 0 means no limit.

    Args:
        parameters: parameters of either firmware.
    """

    def positive(name: str) -> float | None:
        value = parameters.get(name, 0.0)
        return value if math.isfinite(value) and value > 0.0 else None

    radius_m = positive("TURN_RADIUS")
    base_m, angle_rad = positive("RA_WHEEL_BASE"), positive("RA_MAX_STR_ANG")
    if base_m is not None and angle_rad is not None and angle_rad < 0.5 * math.pi:
        radius_m = base_m / math.tan(angle_rad)
    rate_deg_s = positive("ATC_STR_RAT_MAX") or positive("RO_YAW_RATE_LIM")
    acceleration = positive("ATC_ACCEL_MAX") or positive("RO_ACCEL_LIM")
    braking = positive("ATC_DECEL_MAX") or positive("ATC_ACCEL_MAX") or positive("RO_DECEL_LIM")
    return Driving(
        radius_m,
        None if rate_deg_s is None else math.radians(rate_deg_s),
        positive("WP_SPEED") or positive("RO_SPEED_LIM"),
        acceleration,
        braking,
    )
