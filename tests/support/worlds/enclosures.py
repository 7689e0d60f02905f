"""Obstacles of the simulator's world that enclose a vehicle."""

from __future__ import annotations

import math

from mavlink_sitl import Obstacle

PEN = tuple(
    Obstacle(
        f"stake {k}",
        (5.0 * math.cos(math.tau * k / 12), 5.0 * math.sin(math.tau * k / 12)),
        radius_m=0.4,
        top_m=50.0,
    )
    for k in range(12)
)
"""Gaps of 1.8 m, where 3 m are needed"""
