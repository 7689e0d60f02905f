"""The firmware's navigation report, for NAV_CONTROLLER_OUTPUT."""

from __future__ import annotations

from typing import NamedTuple


class NavigationReport(NamedTuple):
    """Degrees clockwise from North, metres, m/s."""

    roll_deg: float = 0.0
    pitch_deg: float = 0.0
    bearing_deg: float = 0.0
    target_bearing_deg: float = 0.0
    distance_m: float = 0.0
    altitude_error_m: float = 0.0
    airspeed_error_m_s: float = 0.0
    cross_track_m: float = 0.0
