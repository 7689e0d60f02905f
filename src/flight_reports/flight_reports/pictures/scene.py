"""Common look of pictures and videos: colours, views, obstacle shapes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from numpy.typing import NDArray

from flight_reports.flight_recording import FlightRecording
from navigation_core.geometry import Vector3
from navigation_core.mapping.obstacles import Obstacles

Array = NDArray[np.float64]

PAPER = "#fbfaf7"
INK = "#2b2f36"
FAINT = "#8b9099"
TRACK = "#1f6fb2"
PLAN = "#e07b00"
OLD_PLAN = "#b9bcc2"
GOAL = "#c0392b"
OBSTACLE = "#56606e"
GONE = "#d3d6db"
NEW = "#e8452c"
GOOD = "#3a9a5b"
COLOURS = (INK, FAINT, TRACK, PLAN, GOAL, OBSTACLE, GONE, NEW, GOOD)
_CORNERS = 24
_COLUMN_MAX_M = 0.3
# Obstacles this close to the path are shown from the side, too; sampling distance of the path.
_BESIDE_M = 2.5
_SIDE_SHARE = 0.45
_PATH_POINTS = 200
_AXES = ("east", "north", "altitude")


@dataclass(frozen=True)
class Viewpoint:
    """Viewpoint of a flight.

    Attributes:
        name: for people.
        across: axis of the map frame drawn to the right: 0 east, 1 north.
        upward: axis drawn upwards: 1 north, 2 up.
    """

    name: str
    across: int
    upward: int

    def points(self, points_enu_m: Array | tuple[Vector3, ...]) -> tuple[Array, Array]:
        """Return the coordinates to the right and upwards of points of shape (N, 3)."""
        points = np.asarray(points_enu_m, dtype=np.float64).reshape(-1, 3)
        return points[:, self.across], points[:, self.upward]

    def shapes(self, obstacles: Obstacles, heights_m: tuple[float, float]) -> list[Array]:
        """Return the outlines of obstacles, each of shape (K, 2).

        Args:
            obstacles: in the map frame.
            heights_m: lowest and highest map z of the picture, for unbounded obstacles.
        """
        if self.upward == 1:
            return [*_round_ones(obstacles.posts), *_turned_boxes(obstacles.boxes)]
        posts, boxes = obstacles.posts, obstacles.boxes
        turn = np.abs(np.stack([np.cos(boxes[:, 4]), np.sin(boxes[:, 4])]))
        along, aside = turn if self.across == 0 else turn[::-1]
        reach = np.concatenate([posts[:, 2], along * boxes[:, 2] + aside * boxes[:, 3]])
        middle = np.concatenate([posts[:, self.across], boxes[:, self.across]])
        ends = np.clip(np.concatenate([posts[:, 3:], boxes[:, 5:]]), *heights_m)
        left, right, (bottom, top) = middle - reach, middle + reach, ends.T
        corners = [(left, bottom), (right, bottom), (right, top), (left, top)]
        return list(np.stack([np.stack(corner, axis=-1) for corner in corners], axis=1))

    def label(self, axes: Axes, **look: Any) -> None:
        """Label the axes, with matplotlib's text properties."""
        axes.set_xlabel(f"{_AXES[self.across]} (m)", **look)
        axes.set_ylabel(f"{_AXES[self.upward]} (m)", **look)


ABOVE = Viewpoint("Top view", 0, 1)


def side_view(path_enu_m: Array) -> Viewpoint:
    """Return the side view that shows the longer path, of shape (N, 3)."""
    extent = np.ptp(path_enu_m[:, :2], axis=0)
    return Viewpoint("Side view", int(extent[1] > extent[0]), 2)


def bounds_m(recording: FlightRecording, margin_m: float) -> tuple[Array, Array]:
    """Return the corners (shape (3,)) of the area to show."""
    points = [recording.positions_enu_m]
    points += [np.array(goal.targets_enu_m) for _, goal in recording.goals]
    points += [np.array(plan) for _, plan in recording.plans]
    everything = np.concatenate([part.reshape(-1, 3) for part in points])
    return everything.min(axis=0) - margin_m, everything.max(axis=0) + margin_m


def ground_m(recording: FlightRecording) -> float:
    """Return the map z below which nothing is drawn: the ground, or the path's lowest point."""
    return min(float(recording.positions_enu_m[:, 2].min()), 0.0)


def fitted(
    low: Array, high: Array, view: Viewpoint, ratio: float
) -> tuple[float, float, float, float]:
    """Return left, right, bottom and top for a frame of a given width-to-height ratio."""
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    x, y = half[view.across], half[view.upward]
    x, y = max(x, y * ratio), max(y, x / ratio)
    across, upward = middle[view.across], middle[view.upward]
    # The ground stays at the lower edge.
    bottom = low[2] if view.upward == 2 else upward - y
    return across - x, across + x, bottom, bottom + 2.0 * y


def draw_obstacles(axes: Axes) -> PolyCollection:
    """Add empty shapes for obstacles to a picture; :func:`show_obstacles` fills them."""
    shapes = PolyCollection([], edgecolors="none")
    axes.add_collection(shapes, autolim=False)
    return shapes


def show_obstacles(
    shapes: PolyCollection,
    view: Viewpoint,
    obstacles: Obstacles,
    heights_m: tuple[float, float],
    colours: Array,
    path_enu_m: Array,
) -> None:
    """Show obstacles.

    Args:
        shapes: result of :func:`draw_obstacles`.
        view: the viewpoint.
        obstacles: in the map frame.
        heights_m: lowest and highest map z of the picture.
        colours: red, green and blue, shape (3,), or (N, 3) for each obstacle.
        path_enu_m: the path flown, shape (K, 3). A side view overlays everything, so obstacles far
            from the path are omitted.
    """
    rgb = np.broadcast_to(colours, (len(obstacles), 3))
    outlines = view.shapes(obstacles, heights_m)
    if view.upward != 1:
        beside = np.flatnonzero(_far_m(obstacles, path_enu_m) < _BESIDE_M)
        outlines = [outlines[index] for index in beside]
        rgb = _SIDE_SHARE * rgb[beside] + (1.0 - _SIDE_SHARE)
    # One array of outlines is drawn much faster than many.
    alike = len({len(outline) for outline in outlines}) == 1
    # matplotlib accepts arrays here and below; its stubs lack that.
    shapes.set_verts(np.stack(outlines) if alike else outlines)  # type: ignore[arg-type]
    shapes.set_facecolor(rgb)  # type: ignore[arg-type]


def _far_m(obstacles: Obstacles, path_enu_m: Array) -> Array:
    """Return the approximate distance of obstacles from a path."""
    path = path_enu_m[:: max(len(path_enu_m) // _PATH_POINTS, 1), :2]
    middles = np.concatenate([obstacles.posts[:, :2], obstacles.boxes[:, :2]])
    reach = np.concatenate([obstacles.posts[:, 2], np.hypot(*obstacles.boxes[:, 2:4].T)])
    offsets = middles[:, None] - path
    return np.asarray(np.hypot(offsets[..., 0], offsets[..., 1]).min(axis=1) - reach)


def replan_times_s(recording: FlightRecording) -> list[float]:
    """Return the times at which the count of replans rose; each goal counts from 0."""
    rises, last = [], 0
    for time_s, count in recording.replans:
        if count > last:
            rises.append(time_s)
        last = count
    return rises


def _round_ones(posts: Array) -> list[Array]:
    # The obstacle map gives columns as the posts around them; they are drawn as squares.
    small = posts[:, 2] < _COLUMN_MAX_M
    outlines: list[Array] = [np.empty(0)] * len(posts)
    for chosen, corners, start in ((small, 4, 0.25 * np.pi), (~small, _CORNERS, 0.0)):
        angle = start + np.linspace(0.0, 2.0 * np.pi, corners, endpoint=False)
        ring = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
        table = posts[chosen]
        shapes = table[:, None, :2] + table[:, 2, None, None] * ring
        for index, shape in zip(np.flatnonzero(chosen), shapes, strict=True):
            outlines[index] = shape
    return outlines


def _turned_boxes(boxes: Array) -> list[Array]:
    signs = np.array([(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)])
    own = signs * boxes[:, None, 2:4]
    cosine, sine = np.cos(boxes[:, 4, None]), np.sin(boxes[:, 4, None])
    x, y = own[..., 0], own[..., 1]
    turned = np.stack([x * cosine - y * sine, x * sine + y * cosine], axis=-1)
    return list(boxes[:, None, :2] + turned)
