"""Checks of a demo flight from its recording."""

from __future__ import annotations

from dataclasses import dataclass

from flight_reports.flight_recording import FlightRecording
from flight_reports.pictures.scene import replan_times_s
from navigation_core.outcomes import OutcomeCode

# The path is straight until the scanner sees what is across it: once at least.
_WAYPOINTS, _GOALS, _REPLANS = 3, 2, 1
RADIUS_M = 0.5
"""vehicle_radius_m of the set-ups that the demos use"""


class DemoError(RuntimeError):
    """A check of the demo failed; the text says which."""


@dataclass(frozen=True)
class Nearest:
    """Least clearance to an obstacle, by the simulator's ground truth.

    Attributes:
        clearance_m: from the vehicle's middle to the obstacle's surface.
        obstacle: its name.
        collided: whether the vehicle has flown into something.
    """

    clearance_m: float
    obstacle: str
    collided: bool


def report(recording: FlightRecording, nearest: Nearest) -> str:
    """Check the flight and summarise it in one sentence.

    Args:
        recording: of the flight.
        nearest: what truly happened.

    Raises:
        DemoError: three waypoints, a goal sent in flight, a replan or success are missing, or the
            vehicle came nearer to an obstacle than its radius.
    """
    if nearest.collided:
        raise DemoError(f"The vehicle flew into the obstacle '{nearest.obstacle}'.")
    if nearest.clearance_m < RADIUS_M:
        raise DemoError(
            f"The clearance was only {nearest.clearance_m:.2f} m to the obstacle "
            f"'{nearest.obstacle}'; its radius is {RADIUS_M:g} m."
        )
    goals = recording.goals.values
    replans = len(replan_times_s(recording))
    ends = [goal.code for goal in recording.all_goals if goal.ended_s is not None]
    if ends[-1:] != [OutcomeCode.SUCCESS.value]:
        raise DemoError(f"The last goal did not end with SUCCESS; the outcomes are {ends}.")
    if len(goals) < _GOALS or len(goals[0].targets_enu_m) < _WAYPOINTS:
        raise DemoError("The recording lacks the route or the goal that replaces it.")
    if replans < _REPLANS:
        raise DemoError(f"The path was replanned {replans} times; at least {_REPLANS} expected.")
    took_s = recording.status.times_s[-1] - recording.goals.times_s[0]
    seen = [obstacles for _, obstacles in recording.obstacles]
    parts = [
        f"{_WAYPOINTS} waypoints and {len(goals) - 1} goal sent in flight",
        f"{recording.figures.distance_m:.0f} m in {took_s:.0f} s",
        f"replanned {replans} times",
        f"{max((len(obstacles) for obstacles in seen), default=0)} cells sensed as occupied",
        f"{nearest.clearance_m:.2f} m least clearance, to '{nearest.obstacle}'",
    ]
    return "Flown: " + ", ".join(parts) + "."
