"""How a flight looks in pictures and films: colours, views, and the shapes of obstacles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from numpy.typing import NDArray

from drone_navigation.flight_recording import Recording
from navigation_core.geometry import Vector3
from navigation_core.obstacles import Obstacles

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
_CORNERS = 12
_AXES = ("east", "north", "height")


@dataclass(frozen=True)
class View:
    """From where a flight is looked at.

    Attributes:
        name: for people.
        across: axis of the map frame that is drawn to the right: 0 east, 1 north.
        upward: axis that is drawn upwards: 1 north, 2 up.
    """

    name: str
    across: int
    upward: int

    def points(self, points_enu_m: Array | tuple[Vector3, ...]) -> tuple[Array, Array]:
        """Return what is drawn to the right and upwards, of points of shape (N, 3)."""
        points = np.asarray(points_enu_m, dtype=np.float64).reshape(-1, 3)
        return points[:, self.across], points[:, self.upward]

    def shapes(self, obstacles: Obstacles, heights_m: tuple[float, float]) -> list[Array]:
        """Return the outlines of obstacles, each of shape (K, 2).

        Args:
            obstacles: in the map frame.
            heights_m: lowest and highest map z of the picture, for what has no end there.
        """
        if self.upward == 1:
            return [*_circles(obstacles.posts), *_turned_boxes(obstacles.boxes)]
        posts, boxes = obstacles.posts, obstacles.boxes
        turn = np.abs(np.stack([np.cos(boxes[:, 4]), np.sin(boxes[:, 4])]))
        along, aside = turn if self.across == 0 else turn[::-1]
        reach = np.concatenate([posts[:, 2], along * boxes[:, 2] + aside * boxes[:, 3]])
        middle = np.concatenate([posts[:, self.across], boxes[:, self.across]])
        ends = np.clip(np.concatenate([posts[:, 3:], boxes[:, 5:]]), *heights_m)
        left, right, (bottom, top) = middle - reach, middle + reach, ends.T
        corners = [(left, bottom), (right, bottom), (right, top), (left, top)]
        return list(np.stack([np.stack(corner, axis=-1) for corner in corners], axis=1))

    def label(self, axes: Axes) -> None:
        """Write what the axes are."""
        axes.set_xlabel(f"{_AXES[self.across]} (m)")
        axes.set_ylabel(f"{_AXES[self.upward]} (m)")


ABOVE = View("Seen from above", 0, 1)


def side_view(recording: Recording) -> View:
    """Return the view from the side that shows the longer way."""
    extent = np.ptp(recording.positions_enu_m[:, :2], axis=0)
    return View("Seen from the side", int(extent[1] > extent[0]), 2)


def bounds_m(recording: Recording, margin_m: float) -> tuple[Array, Array]:
    """Return the corners (shape (3,)) of what a picture must show."""
    points = [recording.positions_enu_m]
    points += [np.array(goal.targets_enu_m) for _, goal in recording.goals]
    points += [np.array(plan) for _, plan in recording.plans]
    everything = np.concatenate([part.reshape(-1, 3) for part in points])
    return everything.min(axis=0) - margin_m, everything.max(axis=0) + margin_m


def fitted(low: Array, high: Array, view: View, ratio: float) -> tuple[float, float, float, float]:
    """Return left, right, bottom and top so that a frame of a width-to-height ratio fits."""
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    x, y = half[view.across], half[view.upward]
    x, y = max(x, y * ratio), max(y, x / ratio)
    across, upward = middle[view.across], middle[view.upward]
    # The ground stays at the lower edge: what is under it is of no interest.
    bottom = low[2] if view.upward == 2 else upward - y
    return across - x, across + x, bottom, bottom + 2.0 * y


def draw_obstacles(
    axes: Axes, view: View, obstacles: Obstacles, heights_m: tuple[float, float], colour: str
) -> PolyCollection:
    """Add obstacles to a picture, and return what may be changed later."""
    # From the side one stands before the other, so what lies behind must shine through.
    alpha = 1.0 if view.upward == 1 else 0.25
    shapes = PolyCollection(
        view.shapes(obstacles, heights_m), facecolors=colour, edgecolors="none", alpha=alpha
    )
    axes.add_collection(shapes, autolim=False)
    return shapes


def replan_times_s(recording: Recording) -> list[float]:
    """Return when the count of replans rose; each goal counts from 0."""
    rises, last = [], 0
    for time_s, count in recording.replans:
        if count > last:
            rises.append(time_s)
        last = count
    return rises


def _circles(posts: Array) -> list[Array]:
    angle = np.linspace(0.0, 2.0 * np.pi, _CORNERS, endpoint=False)
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    return list(posts[:, None, :2] + posts[:, 2, None, None] * ring)


def _turned_boxes(boxes: Array) -> list[Array]:
    signs = np.array([(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)])
    own = signs * boxes[:, None, 2:4]
    cosine, sine = np.cos(boxes[:, 4, None]), np.sin(boxes[:, 4, None])
    x, y = own[..., 0], own[..., 1]
    turned = np.stack([x * cosine - y * sine, x * sine + y * cosine], axis=-1)
    return list(boxes[:, None, :2] + turned)
