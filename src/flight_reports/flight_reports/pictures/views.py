"""Parts of a picture of a flight from one side: path, targets, obstacles, frame."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb

from flight_reports.pictures import scene
from flight_reports.pictures.scene import ABOVE, Array, Viewpoint
from navigation_core.geometry import Vector3
from navigation_core.mapping.obstacles import Obstacles

__all__ = ["draw_obstacles", "draw_path", "draw_targets", "frame"]


def draw_obstacles(
    axes: Axes,
    view: Viewpoint,
    obstacles: Obstacles,
    heights_m: tuple[float, float],
    colour: str,
    path_enu_m: Array,
) -> None:
    """Draw obstacles in one colour; the other arguments are those of `scene.show_obstacles`."""
    shapes = scene.draw_obstacles(axes)
    scene.show_obstacles(shapes, view, obstacles, heights_m, np.array(to_rgb(colour)), path_enu_m)


def draw_path(axes: Axes, view: Viewpoint, path_enu_m: Array, name: str) -> None:
    """Draw a path, shape (N, 3), and where it begins."""
    places = view.points(path_enu_m)
    axes.plot(*places, color=scene.TRACK, linewidth=2.0, label=name)
    axes.plot(*(part[:1] for part in places), "o", color=scene.TRACK, label="start")


def draw_targets(axes: Axes, view: Viewpoint, targets_enu_m: Sequence[Vector3]) -> None:
    """Draw the targets of goals."""
    for number, target in enumerate(targets_enu_m):
        x, y = (float(part[0]) for part in view.points((target,)))
        axes.plot(x, y, "x", color=scene.GOAL, markersize=10, markeredgewidth=2.5,
                  label="goals" if number == 0 else None)  # fmt: skip


def frame(axes: Axes, view: Viewpoint, low_m: Array, high_m: Array) -> None:
    """Label the axes, show at least the cuboid between two corners, and name what is drawn."""
    view.label(axes)
    axes.set_title(view.name, color=scene.INK, fontsize=11, loc="left")
    axes.set_aspect("equal", adjustable="datalim")
    axes.update_datalim(np.stack(view.points(np.array([low_m, high_m])), axis=-1))
    axes.margins(0.0)
    axes.autoscale_view()
    axes.grid(alpha=0.3)
    if view is ABOVE:
        # Beside the title, as within the picture it would hide something.
        axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=3, fontsize=8,
                    frameon=False, borderaxespad=0.2)  # fmt: skip
