"""Sensed obstacles on the map of a report. No ROS."""

from __future__ import annotations

import numpy as np

from flight_reports.analysis.sensed_obstacles import Sensed
from flight_reports.contents.log_reader import Floats
from flight_reports.page.figures import Trace
from navigation_core.mapping.obstacles import Obstacles

# A post that is smaller than this stands for a cell of the map, which is a square.
_CELL_RADIUS_M = 0.3
# Columns of `Obstacles` that are seen from above; the others are heights.
_POST_OUTLINE, _BOX_OUTLINE = 3, 5


def obstacle_traces(sensed: Sensed | None) -> list[Trace]:
    """Return the outlines: first of what was gone at the end, then of what was still held."""
    if sensed is None:
        return []
    gone = Obstacles(
        _without(sensed.ever.posts, sensed.at_end.posts, _POST_OUTLINE),
        _without(sensed.ever.boxes, sensed.at_end.boxes, _BOX_OUTLINE),
    )
    return [
        _outlines(obstacles, name, opacity)
        for obstacles, name, opacity in (
            (gone, "sensed earlier", 0.25),
            (sensed.at_end, "obstacles at the end", 0.7),
        )
        if len(obstacles)
    ]


def _without(ever: Floats, held: Floats, columns: int) -> Floats:
    """Return one row for each outline (the first columns) that no row held any more has."""
    known = {row.tobytes() for row in held[:, :columns].round(3)}
    rows = {row[:columns].tobytes(): row for row in ever.round(3)}
    left = [row for key, row in rows.items() if key not in known]
    return np.array(left).reshape(-1, ever.shape[1])


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
