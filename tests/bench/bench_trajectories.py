"""Trajectories of other planners: how far a copter is from them, by the simulation's truth.

The greatest distance between the vehicle and the place of the trajectory at its time, starts and
stops included. The reference is the distance that is flown in a second. The angle between the nose
and the direction of travel. And how long the server takes to check a trajectory, beside the time
between two setpoints.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import Any

from navigation_bridge.goals.requests import TrajectoryRequest
from navigation_core.outcomes import OutcomeCode
from tests.bench.rows import row
from tests.support.flights.trajectory_flight import TrajectoryFlight, circle, lissajous

_CHECKS = 20


def measures(short: bool = False) -> Iterator[dict[str, Any]]:
    """Fly with both firmwares, slowly and fast."""
    curves = (
        ("a figure of eight", lissajous, 12.0, 3.0, 0.05),
        ("a circle of 8 m", circle, 8.0, 3.0, 0.05),
        ("a circle of 40 m", circle, 40.0, 8.0, 0.0625),
    )
    for autopilot in ("ardupilot",) if short else ("ardupilot", "px4"):
        for name, curve, size_m, speed_m_s, goal in curves[:1] if short else curves:
            flight = _flight(autopilot, speed_m_s)
            planned = curve(flight.here, size_m, speed_m_s)
            goal_id = flight.start(TrajectoryRequest("map", planned.points()))
            errors = flight.errors(goal_id)
            assert flight.ends(goal_id)[0].code is OutcomeCode.SUCCESS
            flown = f"{autopilot} copter: {name} at {speed_m_s:g} m/s, greatest error"
            yield row(flown, (errors.largest_m, "m"), ("flown in 1 s", speed_m_s), f"<= {goal:g} x")
            turned = f"{autopilot} copter: {name} at {speed_m_s:g} m/s, yaw error (RMS)"
            yield row(turned, (errors.yaw_deg, "deg"), ("allowed", 1.5), "<= 1 x")
    flight = _flight("ardupilot", 8.0)
    request = TrajectoryRequest("map", circle(flight.here, 40.0, 8.0).points())
    begun_s = time.perf_counter()
    for _ in range(1 if short else _CHECKS):
        assert flight.check(request) is None
    took_ms = 1e3 * (time.perf_counter() - begun_s) / (1 if short else _CHECKS)
    period_ms = 1e3 * flight.config.bridge.setpoint_period_s
    checked = f"a trajectory of {len(request.points)} points checked"
    yield row(checked, (took_ms, "ms"), ("between setpoints", period_ms), "< 0.8 x")


def _flight(autopilot: str, speed_m_s: float) -> TrajectoryFlight:
    return TrajectoryFlight(autopilot, volume_radius_m=300.0, speed_max_m_s=1.05 * speed_m_s)
