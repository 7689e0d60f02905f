"""Landings on a target in wind: how far from it a copter stands, by the simulation's truth.

The target is seen by a seeded camera with noise, loss and a field of view, but without delay or an
error of its mount; the reference is the radius of the vehicle.
"""

from __future__ import annotations

import statistics
from collections.abc import Iterator
from typing import Any

import numpy as np

from navigation_bridge.goals.requests import LandRequest
from tests.bench.rows import row
from tests.support.flights.landing_flight import LandingFlight

SEEDS, WIND_M_S, MEDIAN_M, HIGH_M = 25, 5.0, 0.15, 0.3
_RADIUS_M = 0.5


def measures(short: bool = False) -> Iterator[dict[str, Any]]:
    """Land with both firmwares."""
    for autopilot in ("ardupilot",) if short else ("ardupilot", "px4"):
        errors_m = [_land(autopilot, seed) for seed in range(1 if short else SEEDS)]
        landed = f"{autopilot} copter: distance from the target in {WIND_M_S:g} m/s of wind"
        radius = ("radius of the vehicle", _RADIUS_M)
        median_m = statistics.median(errors_m)
        yield row(f"{landed}, median", (median_m, "m"), radius, f"<= {MEDIAN_M:g} m")
        high_m = float(np.percentile(errors_m, 95))
        yield row(f"{landed}, 95 %", (high_m, "m"), radius, f"<= {HIGH_M:g} m")


def _land(autopilot: str, seed: int) -> float:
    flight = LandingFlight(autopilot, wind_m_s=WIND_M_S, seed=seed + 1)
    goal_id = flight.land(LandRequest("/target", target_required=True, retries=1))
    (end,) = flight.ends(goal_id)
    assert end.code.value == "SUCCESS", end.message
    return flight.off_m
