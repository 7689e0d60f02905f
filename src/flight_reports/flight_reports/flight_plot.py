"""Plot a recorded flight: ``python -m flight_reports.flight_plot LOG -o PICTURE``."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import matplotlib as mpl
import numpy as np

from flight_logs.command_version import add_version
from flight_logs.whole_file import whole_file
from flight_reports.flight_recording import FlightRecording, NoFlightError, read_recording
from flight_reports.pictures import labels, scene, views
from flight_reports.pictures.scene import ABOVE, Viewpoint
from flight_reports.timeline import Timeline
from navigation_core.mapping.obstacles import Obstacles

mpl.use("Agg")
from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg

EXIT_OK = 0
EXIT_FAILED = 1
_MARGIN_M = 4.0
_BELOW_GROUND_M = 1.0
# Events that are nearer than this to each other (share of the flight) share a name.
_APART = 0.05
_TARGETS_NAMED_MAX = 12
_PAUSE_S = 5.0


class PictureError(Exception):
    """Raised for a picture that no format is known for."""


def plot_flight(path: Path, picture: Path, system: int | None = None) -> FlightRecording:
    """Draw the recording at ``path`` into the file ``picture``, and return what was drawn.

    The picture's name says its format; its folder is made. Of several vehicles, ``system`` or the
    first is drawn.

    Raises:
        NoFlightError: the recording contains no flight.
        PictureError: there is no such format of pictures.
        OSError: the file can't be written.
    """
    formats = sorted(FigureCanvasAgg.get_supported_filetypes())
    if picture.suffix[1:].lower() not in formats:
        raise PictureError(
            f"{picture} does not end in a format of pictures: .{', .'.join(formats)}."
        )
    recording = read_recording(path, system)
    picture.parent.mkdir(parents=True, exist_ok=True)
    figure = plt.figure(figsize=(14.0, 8.0), layout="constrained", facecolor=scene.PAPER)
    grid = figure.add_gridspec(3, 2, width_ratios=(1.25, 1.0), height_ratios=(1.0, 1.0, 1.0))
    above = figure.add_subplot(grid[:2, 0])
    _draw_view(above, ABOVE, recording)
    _draw_view(
        figure.add_subplot(grid[2, 0]), scene.side_view(recording.positions_enu_m), recording
    )
    altitude = figure.add_subplot(grid[0, 1])
    distance = figure.add_subplot(grid[1, 1], sharex=altitude)
    battery = figure.add_subplot(grid[2, 1], sharex=altitude)
    heights = Timeline(tuple(recording.times_s), tuple(recording.positions_enu_m[:, 2]))
    _draw_line(altitude, recording, "altitude (m)", heights)
    _draw_line(distance, recording, "distance remaining (m)", recording.distance_m)
    _draw_line(battery, recording, "battery (%)", recording.battery_percent)
    middle = 0.5 * sum(altitude.get_ylim())
    # At least 1 m of altitude is shown: a rover's few centimetres need no magnifying glass.
    altitude.set_ylim(
        *(
            edge(middle + side, limit)
            for edge, side, limit in zip((min, max), (-0.5, 0.5), altitude.get_ylim(), strict=True)
        )
    )
    if len(recording.battery_percent):
        low = min(recording.battery_percent.values)
        battery.set_ylim(max(0.0, min(low - 2.0, 90.0)), 101.0)
    _name_events(altitude, recording)
    battery.set_xlabel("time since the first position (s)")
    figure.suptitle(f"Flight recorded in {path.name}: {_summary(recording)}", color=scene.INK)
    if recording.remarks:
        figure.supxlabel("\n".join(recording.remarks), fontsize=9, color=scene.GOAL)
    # Where labels are free is known once everything else has its place.
    figure.draw_without_rendering()
    _name_goals(above, recording)
    kind = picture.suffix.removeprefix(".") or None
    with whole_file(picture) as draft:
        figure.savefig(draft, dpi=110, format=kind)
    plt.close(figure)
    return recording


def _summary(recording: FlightRecording) -> str:
    figures = recording.figures
    parts = [
        recording.vehicle,
        f"{figures.duration_s:.0f} s",
        f"{figures.distance_m:.0f} m",
        f"highest {figures.highest_m:.1f} m above {figures.height_reference}",
    ]
    if figures.fastest_m_s is not None:
        parts.append(f"fastest {figures.fastest_m_s:.1f} m/s")
    replans = len(scene.replan_times_s(recording))
    if replans:
        parts.append(f"replanned {replans} times")
    return ", ".join(parts)


def _draw_view(axes: Axes, view: Viewpoint, recording: FlightRecording) -> None:
    low, high = scene.bounds_m(recording, _MARGIN_M)
    ground_m = scene.ground_m(recording)
    low[2] = ground_m - _BELOW_GROUND_M
    heights_m = (ground_m, float(high[2]))
    if view is not ABOVE:
        axes.axhline(ground_m, color=scene.FAINT, linewidth=1.0)
    if len(recording.obstacles):
        passed, now = _all_of(recording.obstacles), recording.obstacles.values[-1]
        for obstacles, colour in ((passed, scene.GONE), (now, scene.OBSTACLE)):
            path = recording.positions_enu_m
            views.draw_obstacles(axes, view, obstacles, heights_m, colour, path)
    _draw_plans(axes, view, recording)
    views.draw_path(axes, view, recording.positions_enu_m, "flown")
    targets = [target for _, goal in recording.goals for target in goal.targets_enu_m]
    views.draw_targets(axes, view, targets)
    views.frame(axes, view, low, high)


def _all_of(obstacles: Timeline[Obstacles]) -> Obstacles:
    """Return everything that was ever in the map, once each."""
    posts = np.concatenate([held.posts for held in obstacles.values])
    boxes = np.concatenate([held.boxes for held in obstacles.values])
    return Obstacles(np.unique(posts.round(2), axis=0), np.unique(boxes.round(2), axis=0))


def _draw_plans(axes: Axes, view: Viewpoint, recording: FlightRecording) -> None:
    plans = recording.plans.values
    for number, plan in enumerate(plans):
        newest = number == len(plans) - 1
        label = "last plan" if newest else "earlier plans" if number == 0 else None
        colour = scene.PLAN if newest else scene.OLD_PLAN
        axes.plot(*view.points(plan), "--", color=colour, linewidth=1.4, label=label)
    for number, time_s in enumerate(scene.replan_times_s(recording)):
        index = np.searchsorted(recording.times_s, time_s).clip(0, len(recording.times_s) - 1)
        place = view.points(recording.positions_enu_m[index])
        axes.plot(*place, "D", color=scene.PLAN, markersize=5,
                  label="replanned" if number == 0 else None)  # fmt: skip


def _name_goals(axes: Axes, recording: FlightRecording) -> None:
    """Write the goals' numbers and places beside them, where nothing is drawn."""
    targets = [target for _, goal in recording.goals for target in goal.targets_enu_m]
    named = labels.names_of(targets)
    if not named or len(named) > _TARGETS_NAMED_MAX:
        return
    seen = ABOVE.points
    paths = [recording.positions_enu_m, *map(np.array, recording.plans.values)]
    drawn = [np.stack(seen(labels.along(path)), axis=-1) for path in paths]
    if len(recording.obstacles):
        drawn += ABOVE.shapes(_all_of(recording.obstacles), (0.0, 0.0))
    to_px = axes.transData.transform
    texts = [axes.text(0.0, 0.0, name, fontsize=9, color=scene.GOAL) for _, name in named]
    extents = [text.get_window_extent() for text in texts]
    frame = axes.get_window_extent()
    corners = labels.free_places(
        to_px(np.stack(seen(tuple(place for place, _ in named)), axis=-1)),
        np.array([(extent.width, extent.height) for extent in extents]),
        to_px(np.concatenate(drawn)),
        (frame.x0, frame.y0, frame.x1, frame.y1),
    )
    for text, corner in zip(texts, corners, strict=True):
        text.set(position=axes.transData.inverted().transform(corner), va="bottom")


def _draw_line(axes: Axes, recording: FlightRecording, label: str, line: Timeline[float]) -> None:
    times_s, values = np.array(line.times_s), np.array(line.values, dtype=np.float64)
    # Between two goals nothing is reported.
    pauses = np.flatnonzero(np.diff(times_s) > _PAUSE_S) + 1
    axes.plot(np.insert(times_s, pauses, np.nan), np.insert(values, pauses, np.nan),
              color=scene.TRACK)  # fmt: skip
    for time_s, _ in recording.status:
        axes.axvline(time_s, color=scene.FAINT, linewidth=0.8, linestyle=":")
    for time_s in scene.replan_times_s(recording):
        axes.axvline(time_s, color=scene.PLAN, linewidth=1.0)
    axes.set_ylabel(label)
    axes.set_xlim(0.0, max(recording.duration_s, 1.0))
    axes.grid(alpha=0.3)
    if not len(line):
        axes.text(0.5, 0.5, "not in this recording", transform=axes.transAxes, ha="center")


def _name_events(axes: Axes, recording: FlightRecording) -> None:
    # Replans are the orange lines, as on the map.
    named = [*recording.status]
    named += [(time_s, "goal") for time_s, _ in recording.goals]
    last_s = -1e9
    for time_s, text in sorted(named):
        # Events of one moment would be printed over each other; the first names them. Those of a
        # clock that was set back are outside the picture.
        if time_s - last_s < _APART * recording.duration_s:
            continue
        last_s = time_s
        axes.annotate(
            text, (time_s, 1.0), xycoords=("data", "axes fraction"),
            xytext=(0, 4), textcoords="offset points", rotation=35, fontsize=8, ha="left",
            annotation_clip=True,
        )  # fmt: skip


def make_parser() -> argparse.ArgumentParser:
    """Return the command line of the plot."""
    parser = argparse.ArgumentParser(
        prog="python -m flight_reports.flight_plot",
        description="Plot the flight in a tlog of navigation_server --tlog, QGroundControl, "
        "MAVProxy or Mission Planner.",
    )
    add_version(parser, "flight_reports")
    parser.add_argument("log", type=Path, help="the tlog")
    parser.add_argument(
        "-o", "--out", "--output", type=Path, help="picture file (default: beside the log)"
    )
    parser.add_argument("--system", type=int, metavar="ID", help="system id (default: the first)")
    return parser


def main(args: list[str] | None = None) -> int:
    """Draw a recording; 0 on success."""
    options = make_parser().parse_args(args)
    picture: Path = options.out or options.log.with_suffix(".png")
    try:
        recording = plot_flight(options.log, picture, options.system)
    except (NoFlightError, PictureError) as error:
        print(f"flight_plot: {error}", file=sys.stderr)
        return EXIT_FAILED
    except OSError as error:
        print(f"flight_plot: cannot write {picture}: {error.strerror}.", file=sys.stderr)
        return EXIT_FAILED
    except KeyboardInterrupt:
        print(f"Interrupted; {picture} was not written.", file=sys.stderr)
        return EXIT_FAILED
    for remark in recording.remarks:
        print(remark)
    print(f"Wrote {picture}")
    return EXIT_OK


if __name__ == "__main__":
    sys.exit(main())
