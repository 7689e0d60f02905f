"""The run-out of a vehicle that nobody leads any more, and the brake that is counted on."""

from __future__ import annotations

BRAKE_SHARE = 0.6
"""Share of the acceleration that a stop at the end of what is reserved counts on"""

REACTION_S = 0.3
"""Time until a brake begins"""


def run_out_m(speed_m_s: float, setpoint_timeout_s: float, braking_m_s2: float) -> float:
    """Return how far it is to a standstill if no further setpoint comes.

    Args:
        speed_m_s: of the last setpoint.
        setpoint_timeout_s: for how long the autopilot follows it.
        braking_m_s2: how hard the vehicle brakes then.
    """
    delay_s = setpoint_timeout_s + REACTION_S
    return speed_m_s * delay_s + speed_m_s * speed_m_s / (2.0 * braking_m_s2)
