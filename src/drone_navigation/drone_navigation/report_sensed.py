"""What the sensors in a log told of obstacles, and how near the vehicle came to them. No ROS."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drone_navigation.flight_recording import Recording, RecordingError, read_recording
from drone_navigation.report_log import Floats, LogContents
from drone_navigation.report_rates import Source
from navigation_core.obstacles import Obstacles

LARGEST_LOG_BYTES = 8 << 20
"""All of a log goes through the code that flies, which takes some three seconds for each MB."""
_SENSORS = frozenset({"OBSTACLE_DISTANCE", "DISTANCE_SENSOR"})


@dataclass(frozen=True)
class Sensed:
    """Obstacles of the map that the sensors in a log make, and the clearance to them.

    Attributes:
        ever: all that were ever in the map.
        at_end: those that were in it at the end.
        time_s: shape (n,), since the log's first packet.
        clearance_m: shape (n,), from the vehicle's centre to the nearest obstacle that was in the
            map then; infinite without any.
    """

    ever: Obstacles
    at_end: Obstacles
    time_s: Floats
    clearance_m: Floats


def obstacles_left_out(contents: LogContents) -> bool:
    """Tell whether the log has what obstacles are seen from, but too much of it."""
    return contents.counts.bytes > LARGEST_LOG_BYTES and bool(_SENSORS & contents.names)


def read_sensed(contents: LogContents, vehicle: Source) -> Sensed | None:
    """Return what the sensors of a vehicle saw.

    Returns:
        None if nothing was seen, the log is too long, or another vehicle was the one to see.
    """
    if obstacles_left_out(contents) or not _SENSORS & contents.names:
        return None
    try:
        recording = read_recording(contents.path)
    except RecordingError:
        return None
    if not recording.vehicle.endswith(f", system {vehicle[0]}") or not len(recording.obstacles):
        return None
    held = recording.obstacles.values
    posts = np.unique(np.concatenate([one.posts for one in held]).round(3), axis=0)
    boxes = np.unique(np.concatenate([one.boxes for one in held]).round(3), axis=0)
    return Sensed(
        ever=Obstacles(posts, boxes),
        at_end=held[-1],
        time_s=recording.times_s + (recording.begun_unix_s - contents.begun_unix_s),
        clearance_m=clearances_m(recording),
    )


def clearances_m(recording: Recording) -> Floats:
    """Return for each position how far the nearest obstacle of the map was then, shape (N,)."""
    nearest = np.full(len(recording.times_s), np.inf)
    begins = np.searchsorted(recording.times_s, recording.obstacles.times_s).tolist()
    ends = [*begins[1:], len(nearest)]
    for obstacles, begin, end in zip(recording.obstacles.values, begins, ends, strict=True):
        nearest[begin:end] = obstacles.clearance_m(recording.positions_enu_m[begin:end])
    return nearest
