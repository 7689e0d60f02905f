"""Video frames of a recorded flight."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import matplotlib as mpl
import numpy as np
from numpy.typing import NDArray

from flight_reports.flight_recording import FlightRecording
from flight_reports.pictures import scene
from flight_reports.pictures.panel import Panel
from flight_reports.pictures.scene import ABOVE, Array, Viewpoint
from navigation_core.mapping.obstacles import NOTHING, Obstacles

mpl.use("Agg")
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.path import Path as Outline

Picture = NDArray[np.uint8]

SIZE_PX = (1280, 720)
_DPI = 160
_MARGIN_M = 4.0
_BELOW_GROUND_M = 1.0
# Left, bottom, width and height, as shares of the picture.
_ABOVE_FRAME = (0.052, 0.135, 0.514, 0.77)
_SIDE_FRAME = (0.627, 0.735, 0.358, 0.17)
# Fade time of an old path and glow time of a new obstacle (seconds of the video).
_FADE_S = 1.6
_GLOW_S = 0.5


@dataclass(frozen=True)
class Playback:
    """Time range and speed of a video.

    Attributes:
        begin_s: first moment.
        end_s: last moment.
        speedup: factor of real time.
        frames_hz: frames per second of the film.
    """

    begin_s: float
    end_s: float
    speedup: float
    frames_hz: float

    def times_s(self) -> Array:
        """Return the moments."""
        step_s = self.speedup / self.frames_hz
        return np.append(np.arange(self.begin_s, self.end_s, step_s), self.end_s)


def make_playback(recording: FlightRecording, film_s: float, frames_hz: float) -> Playback:
    """Return a pace that shows the flight in about ``film_s``, never slower than real time."""
    times_s = recording.goals.times_s or recording.status.times_s
    begin_s = max((times_s[0] if times_s else 0.0) - 0.5, 0.0)
    end_s = recording.duration_s
    if recording.goals and len(recording.status):
        end_s = min(end_s, recording.status.times_s[-1] + 1.0)
    speedup = max(np.ceil(2.0 * (end_s - begin_s) / film_s) / 2.0, 1.0)
    return Playback(begin_s, max(end_s, begin_s), float(speedup), frames_hz)


class Film:
    """Draws the moments of a recording.

    The static part is drawn once; for each moment only the rest is drawn over a copy.
    """

    def __init__(self, recording: FlightRecording, speedup: float) -> None:
        """Prepare the pictures of ``recording``."""
        self._recording = recording
        width, height = (pixels / _DPI for pixels in SIZE_PX)
        self._figure = Figure(figsize=(width, height), dpi=_DPI, facecolor=scene.PAPER)
        # Untyped in matplotlib.
        canvas: Any = FigureCanvasAgg(self._figure)
        self._canvas = canvas
        side = scene.side_view(recording.positions_enu_m)
        self._stages = [
            _Stage(self._figure.add_axes(_ABOVE_FRAME), ABOVE, recording, speedup),
            _Stage(self._figure.add_axes(_SIDE_FRAME), side, recording, speedup),
        ]
        self._panel = Panel(self._figure, recording, speedup)
        self._memory = _Memory()
        canvas.draw()
        self._background = canvas.copy_from_bbox(self._figure.bbox)

    def pictures(self, playback: Playback) -> Iterator[Picture]:
        """Yield a picture, shape (height, width, 3), for each moment."""
        for time_s in playback.times_s():
            self._canvas.restore_region(self._background)
            self._memory.update(self._recording.obstacles.at(time_s) or NOTHING, time_s)
            changing: list[Artist] = []
            for stage in self._stages:
                changing += stage.show(time_s, self._memory)
            changing += self._panel.show(time_s)
            for artist in changing:
                self._figure.draw_artist(artist)
            yield np.asarray(self._canvas.buffer_rgba())[..., :3].copy()


class _Memory:
    """Time since which each obstacle is known, and former obstacles."""

    def __init__(self) -> None:
        self.known = NOTHING
        self.gone = NOTHING
        self.since_s: Array = np.empty(0)
        self._first_s: dict[bytes, float] = {}
        self._rows: dict[bytes, Array] = {}

    def update(self, obstacles: Obstacles, time_s: float) -> None:
        """Update from the present map."""
        if obstacles is not self.known:
            self.known = obstacles
            rows = [*obstacles.posts, *obstacles.boxes]
            keys = [row.round(1).tobytes() for row in rows]
            for key, row in zip(keys, rows, strict=True):
                self._first_s.setdefault(key, time_s)
                self._rows.setdefault(key, row)
            held = set(keys)
            left = [row for key, row in self._rows.items() if key not in held and len(row) == 5]
            self.gone = Obstacles(np.array(left).reshape(-1, 5))
            self.since_s = np.array([self._first_s[key] for key in keys])


class _Stage:
    """The moving parts of one view of the flight."""

    def __init__(
        self, axes: Axes, view: Viewpoint, recording: FlightRecording, speedup: float
    ) -> None:
        self._axes, self._view, self._recording = axes, view, recording
        self._fade_s, self._glow_s = _FADE_S * speedup, _GLOW_S * speedup
        low, high = scene.bounds_m(recording, _MARGIN_M)
        ground_m = scene.ground_m(recording)
        low[2] = ground_m - _BELOW_GROUND_M
        frame = axes.get_position()
        ratio = frame.width * SIZE_PX[0] / (frame.height * SIZE_PX[1])
        left, right, bottom, top = scene.fitted(low, high, view, ratio)
        self._heights_m = (ground_m, top if view.upward == 2 else float(high[2]))
        if view.upward == 2:
            axes.axhline(ground_m, color=scene.FAINT, linewidth=0.8)
        axes.set(xlim=(left, right), ylim=(bottom, top), facecolor="white")
        _decorate(axes, view)
        self._places = np.stack(view.points(recording.positions_enu_m), axis=-1)
        self._gone, self._known = scene.draw_obstacles(axes), scene.draw_obstacles(axes)
        for shapes in (self._gone, self._known):
            shapes.set(animated=True)
        self._old = [self._line("-", scene.FAINT, 1.6) for _ in range(3)]
        (self._plan,) = axes.plot([], [], "-", color=scene.PLAN, linewidth=2.0, animated=True)
        (self._track,) = axes.plot([], [], "-", color=scene.TRACK, linewidth=2.2, animated=True)
        (self._anew,) = axes.plot([], [], "D", color=scene.PLAN, markersize=4.5, animated=True)
        self._goals = [self._cross(colour) for colour in (scene.OLD_PLAN, scene.GOAL)]
        (self._vehicle,) = axes.plot([], [], color=scene.INK, markersize=11, animated=True)

    def _line(self, style: str, colour: str, width: float) -> Line2D:
        (line,) = self._axes.plot([], [], style, color=colour, linewidth=width, animated=True)
        return line

    def _cross(self, colour: str) -> Line2D:
        (cross,) = self._axes.plot([], [], "x", color=colour, markersize=8,
                                   markeredgewidth=2.2, animated=True)  # fmt: skip
        return cross

    def show(self, time_s: float, memory: _Memory) -> list[Artist]:
        """Set the state of a time, and return the artists to draw."""
        recording = self._recording
        count = max(int(np.searchsorted(recording.times_s, time_s, "right")), 1)
        self._track.set_data(*self._places[:count].T)
        self._show_obstacles(time_s, memory)
        self._show_plans(time_s)
        goals = recording.goals.values[: recording.goals.count(time_s)]
        for cross, shown in zip(self._goals, (goals[:-1], goals[-1:]), strict=True):
            targets = [target for goal in shown for target in goal.targets_enu_m]
            cross.set_data(*self._view.points(tuple(targets)))
        anew = [at_s for at_s in scene.replan_times_s(recording) if at_s <= time_s]
        where = np.searchsorted(recording.times_s, anew).clip(0, len(self._places) - 1)
        self._anew.set_data(*self._places[where].T)
        self._vehicle.set_data(*self._places[count - 1 : count].T)
        if self._view is ABOVE:
            turn_deg = np.degrees(recording.yaws_enu_rad[count - 1]) - 90.0
            self._vehicle.set_marker(_arrow(turn_deg))
        else:
            self._vehicle.set(marker="o", markersize=6)
        return [self._gone, self._known, *self._old, self._plan, self._track, self._anew,
                *self._goals, self._vehicle]  # fmt: skip

    def _show_obstacles(self, time_s: float, memory: _Memory) -> None:
        share = np.clip((time_s - memory.since_s) / self._glow_s, 0.0, 1.0)[:, None]
        colours = (1.0 - share) * _rgb(scene.NEW) + share * _rgb(scene.OBSTACLE)
        for shapes, obstacles, rgb in (
            (self._gone, memory.gone, _rgb(scene.GONE)),
            (self._known, memory.known, colours),
        ):
            flown = self._recording.positions_enu_m
            scene.show_obstacles(shapes, self._view, obstacles, self._heights_m, rgb, flown)

    def _show_plans(self, time_s: float) -> None:
        plans = self._recording.plans
        count = plans.count(time_s)
        self._plan.set_data(*self._view.points(plans.values[count - 1] if count else ()))
        for back, line in enumerate(self._old, start=1):
            index = count - 1 - back
            if index < 0:
                line.set(visible=False)
                continue
            age_s = time_s - plans.times_s[index + 1]
            line.set_data(*self._view.points(plans.values[index]))
            line.set(visible=True, alpha=float(np.clip(1.0 - age_s / self._fade_s, 0.0, 1.0)))


def _rgb(colour: str) -> Array:
    return np.array(to_rgb(colour))


def _decorate(axes: Axes, view: Viewpoint) -> None:
    axes.tick_params(labelsize=6, length=2, colors=scene.FAINT, pad=2)
    for spine in axes.spines.values():
        spine.set_color(scene.GONE)
    axes.grid(color=scene.GONE, alpha=0.5, linewidth=0.5)
    axes.set_axisbelow(True)
    view.label(axes, fontsize=6, color=scene.FAINT, labelpad=1)
    axes.set_title(view.name, fontsize=7, color=scene.FAINT, loc="left", pad=3)


def _arrow(turn_deg: float) -> Outline:
    """Return the outline of a vehicle turned from north, counter-clockwise."""
    outline = np.array([(0.0, 1.0), (-0.7, -0.8), (0.0, -0.4), (0.7, -0.8), (0.0, 1.0)])
    turn = np.radians(turn_deg)
    cosine, sine = np.cos(turn), np.sin(turn)
    return Outline(outline @ np.array([(cosine, sine), (-sine, cosine)]))
