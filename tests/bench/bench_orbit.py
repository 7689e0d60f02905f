"""Circles in wind: how far a copter is from its circle, by the simulation's truth at each tick.

The reference is the radius. A simulated PX4 cannot fly against this wind at this speed; what is
measured is that it does not leave the circle for it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from mavlink_sitl import VehicleConfig, Wind, World
from navigation_bridge.goals.requests import OrbitRequest
from tests.bench.rows import row
from tests.support.flights.simulated_flight import SimulatedFlight

RADIUS_M, SPEED_M_S, WIND_M_S, LAPS, GOAL = 30.0, 5.0, 8.0, 2.0, 0.03
_CENTRE = (20.0, 10.0, 0.0)


def measures(short: bool = False) -> Iterator[dict[str, Any]]:
    """Fly with both firmwares."""
    for autopilot in ("ardupilot",) if short else ("ardupilot", "px4"):
        for wind_m_s in (0.0,) if short else (0.0, WIND_M_S):
            flown = (
                f"{autopilot} copter: circle at {SPEED_M_S:g} m/s in {wind_m_s:g} m/s of wind, "
                "95 % of the distances from it"
            )
            error_m = _fly(autopilot, wind_m_s, 0.2 if short else LAPS)
            yield row(flown, (error_m, "m"), ("radius", RADIUS_M), f"<= {GOAL:g} x")


def _fly(autopilot: str, wind_m_s: float, laps: float) -> float:
    """Return the 95th percentile of the distances, m."""
    flight = SimulatedFlight(
        simulated=VehicleConfig(autopilot=autopilot, ready_after_s=1.0),
        world=World(wind=Wind((0.0, wind_m_s, 0.0))),
        battery_policy="ignore",
    ).ready()
    request = OrbitRequest("map", _CENTRE, RADIUS_M, 10.0, laps, SPEED_M_S)
    goal_id, errors_m = flight.start(request), []
    while not flight.ends(goal_id):
        flight.tick()
        feedback = flight.feedback(goal_id)
        orbit = feedback[-1].orbit if feedback else None
        if orbit is not None and not math.isnan(orbit.radius_error_m):
            (east, north, _), _ = flight.truth()
            away_m = math.hypot(east - _CENTRE[0], north - _CENTRE[1])
            errors_m.append(abs(away_m - RADIUS_M))
    (end,) = flight.ends(goal_id)
    assert end.code.value == "SUCCESS", end.message
    return float(np.percentile(errors_m, 95))
