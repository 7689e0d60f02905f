"""The distance in which a vehicle comes to rest, and the speed that a distance allows."""

from __future__ import annotations

import math

__all__ = ["stopping_distance_m", "stopping_speed_m_s"]


def stopping_distance_m(speed_m_s: float, delay_s: float, braking_m_s2: float) -> float:
    """Return how far it is to a standstill.

    Args:
        speed_m_s: of the vehicle.
        delay_s: time until the brake begins.
        braking_m_s2: deceleration of the brake.
    """
    return speed_m_s * delay_s + speed_m_s * speed_m_s / (2.0 * braking_m_s2)


def stopping_speed_m_s(room_m: float, delay_s: float, braking_m_s2: float) -> float:
    """Return the speed from which a vehicle comes to rest within a distance; 0 without any.

    Args:
        room_m: the distance; infinite for any speed.
        delay_s: time until the brake begins.
        braking_m_s2: deceleration of the brake.
    """
    if room_m <= 0.0:
        return 0.0
    lag_m_s = braking_m_s2 * delay_s
    return math.sqrt(lag_m_s * lag_m_s + 2.0 * braking_m_s2 * room_m) - lag_m_s
