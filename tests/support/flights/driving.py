"""A rover or boat that drives to the end of its goal."""

from __future__ import annotations

import math

from navigation_core.tasks.progress import Status
from tests.support.flights.simulated_flight import SimulatedFlight

__all__ = ["drive_to_end"]


def drive_to_end(drive: SimulatedFlight, goal_id: str) -> tuple[float, list[float]]:
    """Drive to the end; returns by how much it turned, in turns, and its speeds under way (m/s)."""
    turned_rad, yaw_rad = 0.0, float(drive.simulation.truth.yaw_rad[0])
    speeds = []
    while not drive.ends(goal_id):
        drive.run_for(0.1)
        now_rad = float(drive.simulation.truth.yaw_rad[0])
        turned_rad += abs(math.remainder(now_rad - yaw_rad, math.tau))
        yaw_rad = now_rad
        if drive.status(goal_id) == Status.NAVIGATING.value:
            speeds.append(drive.truth()[1])
    return turned_rad / math.tau, speeds
