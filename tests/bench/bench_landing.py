"""Landings on a target in wind: how far from it a copter stands, by the simulation's truth.

The target is seen by the camera of a simulated world, with noise, loss, a field of view and a delay
of 0.1 s, but without an error of its mount; the reference is the radius of the vehicle. And how far
off a target is that is seen late while the vehicle moves: the reference is what it flies meanwhile.
"""

from __future__ import annotations

import statistics
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from navigation_bridge.goals.requests import LandRequest
from tests.bench.rows import row
from tests.support.flights.landing_flight import CAMERA, LandingFlight

SEEDS, WIND_M_S, MEDIAN_M, HIGH_M = 25, 5.0, 0.15, 0.3
LATE_M = 0.15
_RADIUS_M = 0.5
_SPEED_M_S = 3.0


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
        off_m = statistics.median(_passing(autopilot))
        what = (
            f"{autopilot} copter at {_SPEED_M_S:g} m/s: error of a target seen 0.1 s late, median"
        )
        yield row(what, (off_m, "m"), ("flown meanwhile", 0.1 * _SPEED_M_S), f"<= {LATE_M:g} m")


def _passing(autopilot: str) -> list[float]:
    camera = replace(CAMERA, noise=0.0, loss=0.0)
    return LandingFlight(autopilot, (12.0, 0.0, 0.0), camera=camera).passed_errors_m(24.0)


def _land(autopilot: str, seed: int) -> float:
    flight = LandingFlight(autopilot, wind_m_s=WIND_M_S, seed=seed + 1)
    goal_id = flight.land(LandRequest("/target", target_required=True, retries=1))
    (end,) = flight.ends(goal_id)
    assert end.code.value == "SUCCESS", end.message
    return flight.off_m
