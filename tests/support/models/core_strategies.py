"""Hypothesis strategies for the tests of the navigation core."""

from __future__ import annotations

from hypothesis import strategies as st

from navigation_core.geometry import KinematicState
from navigation_core.trajectories.trajectory import Limits


def _number(low: float, high: float) -> st.SearchStrategy[float]:
    return st.floats(low, high, allow_nan=False)


limits = st.builds(
    Limits,
    speed_horizontal_m_s=_number(0.5, 15.0),
    speed_up_m_s=_number(0.3, 5.0),
    speed_down_m_s=_number(0.3, 4.0),
    acceleration_horizontal_m_s2=_number(0.5, 6.0),
    acceleration_vertical_m_s2=_number(0.5, 5.0),
    jerk_m_s3=_number(1.0, 20.0),
)
points = st.tuples(_number(-200.0, 200.0), _number(-200.0, 200.0), _number(0.0, 100.0))
velocities = st.tuples(_number(-15.0, 15.0), _number(-15.0, 15.0), _number(-5.0, 5.0))
accelerations = st.tuples(_number(-4.0, 4.0), _number(-4.0, 4.0), _number(-3.0, 3.0))
states = st.builds(KinematicState, points, velocities, accelerations)
fractions = _number(0.0, 1.0)
