"""Traits of usual vehicles."""

from __future__ import annotations

from navigation_core.tasks.traits import Traits

PLANE = Traits(
    name="plane", hovers=False, control_before_takeoff=False, circle_radius_m=60.0,
    height_min_m=20.0,
)  # fmt: skip
