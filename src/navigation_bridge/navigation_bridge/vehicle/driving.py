"""Driving characteristics of a rover or boat, from its parameters. No ROS."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple


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
