"""What a demo must have shown, told from its recording."""

from __future__ import annotations

import math

import numpy as np

from drone_navigation.flight_recording import Recording
from drone_navigation.flight_scene import replan_times_s

_WAYPOINTS, _GOALS, _REPLANS = 3, 2, 2


class DemoError(RuntimeError):
    """The demo did not show what it must; the sentence says what."""


def report(recording: Recording) -> str:
    """Return what was flown, in one sentence.

    Raises:
        DemoError: three waypoints, a goal sent in flight, two replans or success are missing.
    """
    goals = recording.goals.values
    replans = len(replan_times_s(recording))
    ends = [text for text in recording.status.values if text.startswith("ended")]
    if ends[-1:] != ["ended SUCCESS"]:
        raise DemoError(f"The last goal did not end with SUCCESS; the ends are {ends}.")
    if len(goals) < _GOALS or len(goals[0].targets_enu_m) < _WAYPOINTS:
        raise DemoError("The route and a goal that replaces it are not in the recording.")
    if replans < _REPLANS:
        raise DemoError(f"The way was planned anew {replans} times instead of {_REPLANS} or more.")
    flown_m = np.sqrt((np.diff(recording.positions_enu_m, axis=0) ** 2).sum(axis=1)).sum()
    took_s = recording.status.times_s[-1] - recording.goals.times_s[0]
    seen = [obstacles for _, obstacles in recording.obstacles]
    parts = [
        f"{_WAYPOINTS} waypoints and {len(goals) - 1} goal sent in flight",
        f"{flown_m:.0f} m in {took_s:.0f} s",
        f"planned anew {replans} times",
        f"{max((len(obstacles) for obstacles in seen), default=0)} places seen to be occupied",
    ]
    nearest_m = seen_clearance_m(recording)
    if math.isfinite(nearest_m):
        parts.append(f"{nearest_m:.1f} m to the nearest of them")
    return "Flown: " + ", ".join(parts) + "."


def seen_clearance_m(recording: Recording) -> float:
    """Return how near the vehicle's centre came to what its sensors saw; infinite for nothing."""
    nearest_m = math.inf
    for time_s, place in zip(recording.times_s, recording.positions_enu_m, strict=True):
        obstacles = recording.obstacles.at(float(time_s))
        if obstacles is not None and len(obstacles):
            nearest_m = min(nearest_m, float(obstacles.clearance_m(place[None])[0]))
    return nearest_m
