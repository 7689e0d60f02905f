"""Guidance inputs of the controllers of ground vehicles and planes, beside those of copters."""

from __future__ import annotations

from dataclasses import dataclass

from mavlink_sitl.exchange import Guidance


@dataclass(frozen=True)
class DriveGuidance(Guidance):
    """The reference of a rover or a boat until the next one.

    `motors` FLY drives at `speed_m_s` and steers by `yaw_mode`; IDLE rolls; MANUAL passes
    `throttle` (-1..1) and `steering` on. `north_m` and `east_m` say where to, for telemetry.

    Attributes:
        speed_m_s: along the nose; negative is backwards.
        steering: -1 (left) .. 1, only for MANUAL.
        turn_gain_1_s: from an error of the heading to a rate.
        turn_rate_limit_rad_s: no faster.
    """

    speed_m_s: float = 0.0
    steering: float = 0.0
    turn_gain_1_s: float = 2.0
    turn_rate_limit_rad_s: float = 2.1


@dataclass(frozen=True)
class GlideGuidance(Guidance):
    """The reference of a plane until the next one.

    `motors` FLY controls bank, climb and airspeed; IDLE closes the throttle; MANUAL passes
    `throttle` on with the wings level. `north_m`, `east_m`, `down_m` say where to.

    Attributes:
        bank_rad: right wing down.
        climb_m_s: up.
        airspeed_m_s: true airspeed to keep.
        least_throttle: 0..1; the airspeed decides between it and the next.
        most_throttle: 0..1.
    """

    bank_rad: float = 0.0
    climb_m_s: float = 0.0
    airspeed_m_s: float = 0.0
    least_throttle: float = 0.0
    most_throttle: float = 1.0
