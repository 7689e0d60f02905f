"""Obstacles on the map of a report, as the sensors in the log told of them. No ROS."""

from __future__ import annotations

import numpy as np

from drone_navigation.flight_recording import RecordingError, read_recording
from drone_navigation.report_figures import Trace
from drone_navigation.report_log import Floats, LogContents
from drone_navigation.report_rates import Source
from navigation_core.obstacles import Obstacles

LARGEST_LOG_BYTES = 8 << 20
"""All of a log goes through the code that flies, which takes some three seconds for each MB."""
_SENSORS = frozenset({"OBSTACLE_DISTANCE", "DISTANCE_SENSOR"})
# A post that is smaller than this stands for a cell of the map, which is a square.
_CELL_RADIUS_M = 0.3


def obstacles_left_out(contents: LogContents) -> bool:
    """Tell whether the log has what obstacles are seen from, but too much of it."""
    return contents.counts.bytes > LARGEST_LOG_BYTES and bool(_SENSORS & contents.names)


def read_obstacles(contents: LogContents, vehicle: Source) -> tuple[Obstacles, Obstacles] | None:
    """Return all obstacles that ever were in the map, and those that were in it at the end.

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
    return Obstacles(posts, boxes), held[-1]


def obstacle_traces(seen: tuple[Obstacles, Obstacles] | None) -> list[Trace]:
    """Return the outlines: first of what was seen once, then of what was still held at the end."""
    if seen is None:
        return []
    ever, at_end = seen
    return [
        _outlines(obstacles, name, opacity)
        for obstacles, name, opacity in (
            (ever, "seen once", 0.25),
            (at_end, "obstacles at the end", 0.7),
        )
        if len(obstacles)
    ]


def _outlines(obstacles: Obstacles, name: str, opacity: float) -> Trace:
    x: list[float | None] = []
    y: list[float | None] = []
    for corners in [*map(_post, obstacles.posts), *map(_box, obstacles.boxes)]:
        x += [*corners[:, 0].round(2).tolist(), None]
        y += [*corners[:, 1].round(2).tolist(), None]
    return {
        "type": "scatter",
        "mode": "lines",
        "name": name,
        "x": x,
        "y": y,
        "fill": "toself",
        "fillcolor": "@faint",
        "line": {"width": 0},
        "opacity": opacity,
        "hoverinfo": "skip",
    }


def _post(post: Floats) -> Floats:
    east_m, north_m, radius_m = post[:3]
    corners = 4 if radius_m < _CELL_RADIUS_M else 20
    angle = np.arange(corners) * 2.0 * np.pi / corners + np.pi / 4.0
    return np.stack(
        [east_m + radius_m * np.cos(angle), north_m + radius_m * np.sin(angle)], axis=-1
    )


def _box(box: Floats) -> Floats:
    east_m, north_m, half_length_m, half_width_m, yaw_rad = box[:5]
    along = np.array([1.0, -1.0, -1.0, 1.0]) * half_length_m
    across = np.array([1.0, 1.0, -1.0, -1.0]) * half_width_m
    cosine, sine = np.cos(yaw_rad), np.sin(yaw_rad)
    return np.stack(
        [east_m + along * cosine - across * sine, north_m + along * sine + across * cosine], axis=-1
    )
