"""How goals are treated: the settings of the bridge. No ROS."""

from __future__ import annotations

from dataclasses import dataclass

from navigation_core.safety import FlightVolume
from navigation_core.tasks.goto import GotoConfig


@dataclass(frozen=True)
class BridgeConfig:
    """How goals are treated.

    Attributes:
        goto: settings of the flight to a point.
        volume: where targets are accepted.
        replace_active_goal: a new goal replaces the active one; else it is refused.
        setpoint_period_s: time between two setpoints.
        feedback_period_s: least time between two feedbacks.
        link_lost_abort_s: silence after which an active goal ends.
        speed_max_m_s: highest ground speed ever flown.
    """

    goto: GotoConfig
    volume: FlightVolume
    replace_active_goal: bool
    setpoint_period_s: float
    feedback_period_s: float
    link_lost_abort_s: float
    speed_max_m_s: float
