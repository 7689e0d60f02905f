"""Draw a recorded flight: ``python -m drone_navigation.flight_plot LOG -o PICTURE``."""

from __future__ import annotations

import argparse
import sys
from dataclasses import dataclass, field
from pathlib import Path

import matplotlib as mpl

from drone_navigation import notes
from mavlink_vehicle import frames
from mavlink_vehicle.codec import Codec, Message
from mavlink_vehicle.errors import LinkError
from mavlink_vehicle.io.tlog import TlogReader

mpl.use("Agg")
from matplotlib import pyplot as plt
from matplotlib.axes import Axes

EXIT_OK = 0
EXIT_FAILED = 1
_TRACK_COLOUR = "#1f5fa8"
_GOAL_COLOUR = "#c0392b"
_EVENT_COLOUR = "#888888"


class PlotError(ValueError):
    """The recording cannot be drawn; the sentence says why."""


@dataclass
class Flight:
    """What is drawn: times in seconds since the first position."""

    time_s: list[float] = field(default_factory=list)
    position_enu_m: list[tuple[float, float, float]] = field(default_factory=list)
    battery: list[tuple[float, float]] = field(default_factory=list)
    distance_m: list[tuple[float, float]] = field(default_factory=list)
    goals: list[tuple[float, tuple[float, float, float]]] = field(default_factory=list)
    events: list[tuple[float, str]] = field(default_factory=list)


def read_flight(path: Path) -> Flight:
    """Read what is drawn from a tlog that the navigation server recorded.

    Raises:
        PlotError: there is no such file, or no position in it.
    """
    try:
        records = list(TlogReader(path))
    except LinkError as error:
        raise PlotError(str(error)) from error
    codec = Codec(source_system=255, source_component=190)
    flight = Flight()
    origin: tuple[float, float, float] | None = None
    start_s: float | None = None
    for time_s, data in records:
        for message in codec.decode(data):
            kind = message.get_type()
            if kind == "GPS_GLOBAL_ORIGIN":
                origin = (message.latitude * 1e-7, message.longitude * 1e-7,
                          message.altitude * 1e-3)  # fmt: skip
            if kind == "GLOBAL_POSITION_INT" and (message.lat or message.lon):
                here = (message.lat * 1e-7, message.lon * 1e-7, message.alt * 1e-3)
                origin = origin or here
                start_s = time_s if start_s is None else start_s
                north_m, east_m, _ = frames.geodetic_to_ned(*here, origin)
                flight.time_s.append(time_s - start_s)
                flight.position_enu_m.append((east_m, north_m, here[2] - origin[2]))
            elif start_s is not None:
                _read_other(flight, kind, message, time_s - start_s)
    if not flight.time_s:
        raise PlotError(f"{path} holds no GLOBAL_POSITION_INT with a position.")
    return flight


def _read_other(flight: Flight, kind: str, message: Message, time_s: float) -> None:
    if kind == "BATTERY_STATUS" and message.battery_remaining >= 0:
        flight.battery.append((time_s, float(message.battery_remaining)))
    elif kind == "NAMED_VALUE_FLOAT" and message.name == "dist_rem":
        flight.distance_m.append((time_s, message.value))
    elif kind == "STATUSTEXT" and message.get_srcComponent() == notes.COMPONENT_ID:
        goal = notes.parse_goal(message.text)
        if goal is not None:
            flight.goals.append((time_s, goal[1]))
            flight.events.append((time_s, "goal"))
        else:
            flight.events.append((time_s, _short(message.text)))


def _short(text: str) -> str:
    """Leave out the goal's id, which a picture has no use for."""
    words = text.split()
    return " ".join(words[2:]) if words[:1] == ["goal"] and len(words) > 2 else text


def plot_flight(path: Path, picture: Path) -> None:
    """Draw the recording at ``path`` into the PNG ``picture``.

    Raises:
        PlotError: the recording cannot be drawn.
    """
    flight = read_flight(path)
    figure = plt.figure(figsize=(13.0, 7.5), layout="constrained")
    grid = figure.add_gridspec(3, 2, width_ratios=(1.0, 1.15))
    _draw_track(figure.add_subplot(grid[:, 0]), flight)
    altitude = figure.add_subplot(grid[0, 1])
    distance = figure.add_subplot(grid[1, 1], sharex=altitude)
    battery = figure.add_subplot(grid[2, 1], sharex=altitude)
    _draw_line(altitude, flight, "altitude (m)", flight.time_s,
               [place[2] for place in flight.position_enu_m])  # fmt: skip
    _draw_line(distance, flight, "distance remaining (m)", *_columns(flight.distance_m))
    _draw_line(battery, flight, "battery (%)", *_columns(flight.battery))
    if flight.battery:
        low = min(value for _, value in flight.battery)
        battery.set_ylim(max(0.0, min(low - 2.0, 90.0)), 101.0)
    _name_events(altitude, flight)
    battery.set_xlabel("time since the first position (s)")
    figure.suptitle(f"Flight recorded in {path.name}")
    figure.savefig(picture, dpi=110)
    plt.close(figure)


def _columns(pairs: list[tuple[float, float]]) -> tuple[list[float], list[float]]:
    return [pair[0] for pair in pairs], [pair[1] for pair in pairs]


def _draw_track(axes: Axes, flight: Flight) -> None:
    axes.plot(
        [place[0] for place in flight.position_enu_m],
        [place[1] for place in flight.position_enu_m],
        color=_TRACK_COLOUR,
        label="track",
    )
    axes.plot(*flight.position_enu_m[0][:2], "o", color=_TRACK_COLOUR, label="start")
    for number, (_, target) in enumerate(flight.goals):
        axes.plot(*target[:2], "x", color=_GOAL_COLOUR, markersize=10, markeredgewidth=2.5,
                  label="goal" if number == 0 else None)  # fmt: skip
        axes.annotate(
            f"({target[0]:g}, {target[1]:g}, {target[2]:g})",
            target[:2],
            textcoords="offset points",
            xytext=(-8, 12),
            ha="right",
        )
    axes.set_aspect("equal", adjustable="datalim")
    axes.margins(0.12)
    axes.set_xlabel("east (m)")
    axes.set_ylabel("north (m)")
    axes.set_title("Seen from above")
    axes.grid(alpha=0.3)
    axes.legend(loc="upper left")


def _draw_line(
    axes: Axes, flight: Flight, label: str, times_s: list[float], values: list[float]
) -> None:
    axes.plot(times_s, values, color=_TRACK_COLOUR)
    for time_s, _ in flight.events:
        axes.axvline(time_s, color=_EVENT_COLOUR, linewidth=0.8, linestyle=":")
    axes.set_ylabel(label)
    axes.grid(alpha=0.3)
    if not values:
        axes.text(0.5, 0.5, "not in this recording", transform=axes.transAxes, ha="center")


def _name_events(axes: Axes, flight: Flight) -> None:
    last_s = -1e9
    for time_s, text in flight.events:
        # Events of one moment would be printed over each other; the first names them.
        if time_s - last_s < 0.02 * flight.time_s[-1]:
            continue
        last_s = time_s
        axes.annotate(
            text, (time_s, 1.0), xycoords=("data", "axes fraction"),
            xytext=(0, 4), textcoords="offset points", rotation=35, fontsize=8, ha="left",
        )  # fmt: skip


def make_parser() -> argparse.ArgumentParser:
    """Return the command line of the plot."""
    parser = argparse.ArgumentParser(
        prog="python -m drone_navigation.flight_plot",
        description="Draw a flight that the navigation server recorded.",
    )
    parser.add_argument("log", type=Path, help="tlog that navigation_server --tlog wrote")
    parser.add_argument("-o", "--output", type=Path, help="picture (default: beside the log)")
    return parser


def main(args: list[str] | None = None) -> int:
    """Draw a recording; 0 on success."""
    options = make_parser().parse_args(args)
    picture: Path = options.output or options.log.with_suffix(".png")
    try:
        plot_flight(options.log, picture)
    except PlotError as error:
        print(f"flight_plot: {error}", file=sys.stderr)
        return EXIT_FAILED
    print(f"Drawn in {picture}")
    return EXIT_OK


if __name__ == "__main__":
    sys.exit(main())
