"""The observation of a vehicle that hovers under control, for tests to change."""

from __future__ import annotations

from navigation_core.geometry import ZERO
from navigation_core.tasks.observation import Observation

__all__ = ["HOVERING"]

HOVERING = Observation(
    time_s=0.0,
    position_enu_m=(0.0, 0.0, 5.0),
    velocity_enu_m_s=ZERO,
    yaw_enu_rad=0.0,
    armed=True,
    in_control=True,
    airborne=True,
    ground_enu_m=0.0,
    position_age_s=0.0,
    connected=True,
    operation=None,
)
