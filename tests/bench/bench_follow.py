"""Targets at 5 m/s: how far a copter is from its place beside one, by the simulation's truth.

The target is measured ten times a second, with noise, and turns in a wide curve. The reference is
the length of the offset, in which the vehicle would be if it kept no place at all.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from navigation_bridge.goals.requests import FollowRequest, OffsetFrame, TargetSource
from navigation_core.geometry import Vector3
from tests.bench.rows import row
from tests.support.flights.follow_flight import FollowFlight

SPEED_M_S, RADIUS_M, OFFSET_M, NOISE_M, GOAL = 5.0, 60.0, (-8.0, 0.0, 6.0), 0.1, 0.08
_SETTLED_S = 15.0


def measures(short: bool = False) -> Iterator[dict[str, Any]]:
    """Follow with both firmwares, on a straight line and on a circle."""
    for autopilot in ("ardupilot",) if short else ("ardupilot", "px4"):
        for turns in (False,) if short else (False, True):
            course = f"on a circle of {RADIUS_M:g} m" if turns else "straight ahead"
            flown = (
                f"{autopilot} copter: a target at {SPEED_M_S:g} m/s {course}, 95 % of the "
                "distances from the place beside it"
            )
            error_m = _follow(autopilot, turns, 20.0 if short else 60.0)
            yield row(flown, (error_m, "m"), ("offset", math.hypot(*OFFSET_M)), f"<= {GOAL:g} x")


def _follow(autopilot: str, turns: bool, seconds: float) -> float:
    """Return the 95th percentile of the distances, m."""
    flight = FollowFlight(
        _circle if turns else _straight,
        autopilot=autopilot,
        noise_m=NOISE_M,
        speed_max_m_s=8.0,
        volume_radius_m=1000.0,
        battery_policy="ignore",
    )
    offset_frame = OffsetFrame.MAP
    flight.follow(FollowRequest(TargetSource("/target"), OFFSET_M, offset_frame, 4.0, 8.0))
    flight.chase(_SETTLED_S)
    flight.places.clear()
    flight.chase(seconds)
    errors_m = [
        math.dist(place, [a + b for a, b in zip(target, OFFSET_M, strict=True)])
        for place, target in flight.places
    ]
    assert errors_m, "the goal has ended"
    return float(np.percentile(errors_m, 95))


def _straight(passed_s: float) -> Vector3:
    return (10.0 + SPEED_M_S * passed_s, 0.0, 0.0)


def _circle(passed_s: float) -> Vector3:
    turned_rad = SPEED_M_S * passed_s / RADIUS_M
    return (10.0 + RADIUS_M * math.sin(turned_rad), RADIUS_M * (1.0 - math.cos(turned_rad)), 0.0)
