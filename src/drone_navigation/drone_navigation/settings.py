"""How goals are treated: the settings of the bridge. No ROS."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from navigation_core.safety import FlightVolume
from navigation_core.tasks.goto import GotoConfig


class BatteryPolicy(Enum):
    """What is done about a battery that will not do for the goal and the way back."""

    REJECT = "reject"
    """The goal is refused, or ends with the vehicle holding."""
    WARN = "warn"
    IGNORE = "ignore"


@dataclass(frozen=True)
class SafetyConfig:
    """What is watched beside the flight itself.

    Attributes:
        fence_margin_m: how far targets must be inside of the vehicle's own fence.
        battery_policy: what is done when the battery will not do.
        battery_reserve: fraction that must be left after the way back.
        battery_endurance_s: how long a full battery lasts, until it was measured.
    """

    fence_margin_m: float = 1.0
    battery_policy: BatteryPolicy = BatteryPolicy.REJECT
    battery_reserve: float = 0.2
    battery_endurance_s: float = 900.0


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
        safety: what is watched beside the flight itself.
    """

    goto: GotoConfig
    volume: FlightVolume
    replace_active_goal: bool
    setpoint_period_s: float
    feedback_period_s: float
    link_lost_abort_s: float
    speed_max_m_s: float
    safety: SafetyConfig = SafetyConfig()
