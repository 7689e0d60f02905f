"""Picture of a flight that is planned: its path, obstacles, fence and flight volume."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon

from flight_logs.whole_file import whole_file
from flight_reports.pictures import scene, views
from flight_reports.pictures.scene import ABOVE, Viewpoint
from flight_reports.planned_flight import PlannedFlight

__all__ = ["plot_planned"]

_MARGIN_M = 4.0
_BELOW_GROUND_M = 1.0
_SIZE_IN, _DOTS_PER_IN = (9.0, 8.0), 100


def plot_planned(flight: PlannedFlight, picture: Path) -> None:
    """Draw a flight into a PNG file; any thread.

    Raises:
        OSError: it cannot be written.
    """
    # Not by pyplot, which is for one thread.
    figure = Figure(figsize=_SIZE_IN, layout="constrained", facecolor=scene.PAPER)
    FigureCanvasAgg(figure)
    above, side = figure.subplots(2, 1, height_ratios=(2.0, 1.0))
    path = np.array(flight.path_enu_m, dtype=np.float64).reshape(-1, 3)
    everything = np.concatenate([path, np.array(flight.targets_enu_m).reshape(-1, 3)])
    low, high = everything.min(axis=0) - _MARGIN_M, everything.max(axis=0) + _MARGIN_M
    low[2] = min(float(path[:, 2].min()), 0.0) - _BELOW_GROUND_M
    for axes, view in ((above, ABOVE), (side, scene.side_view(path))):
        heights_m = (float(low[2]), float(high[2]))
        if len(flight.obstacles):
            views.draw_obstacles(axes, view, flight.obstacles, heights_m, scene.OBSTACLE, path)
        _draw_bounds(axes, view, flight, heights_m)
        views.draw_path(axes, view, path, "rehearsed")
        views.draw_targets(axes, view, flight.targets_enu_m)
        views.frame(axes, view, low, high)
    figure.suptitle(flight.title, color=scene.INK, fontsize=10)
    with whole_file(picture) as draft:
        figure.savefig(draft, dpi=_DOTS_PER_IN, format="png")


def _draw_bounds(
    axes: Axes, view: Viewpoint, flight: PlannedFlight, heights_m: tuple[float, float]
) -> None:
    """Draw areas from above, heights from the side; what is off the picture stays off it."""
    if view is not ABOVE:
        for height_m in flight.heights_m:
            if heights_m[0] <= height_m <= heights_m[1]:
                axes.axhline(height_m, color=scene.GOAL, linewidth=2.0, linestyle="--")
        return
    for number, area in enumerate(flight.areas):
        style = "--" if area.inclusion else "-"
        outline = (
            Polygon(np.array(area.points_enu_m))
            if area.radius_m is None
            else Circle(area.points_enu_m[0], area.radius_m)
        )
        outline.set(
            fill=not area.inclusion, facecolor=(0.75, 0.22, 0.17, 0.15), edgecolor=scene.GOAL,
            linewidth=2.0, linestyle=style, label="fence and volume" if number == 0 else None,
        )  # fmt: skip
        axes.add_artist(outline)
