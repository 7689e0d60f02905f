"""Plots of a report as Plotly figures in plain data. Pure.

A colour that begins with "@" is one of the page's own (`report_page.css`), so that the plots
follow the reader's choice of light or dark.
"""

from __future__ import annotations

import html
import itertools
from collections.abc import Mapping, Sequence
from typing import TypeAlias, TypedDict

import numpy as np
from numpy.typing import NDArray

from flight_reports.analysis.flight import GAP_S, Flight
from flight_reports.analysis.warnings import warnings
from flight_reports.contents.log_reader import Floats
from flight_reports.contents.track import Track
from flight_reports.recorded_events import EventSeverity, Moment

Trace: TypeAlias = dict[str, object]
Layout: TypeAlias = dict[str, object]


class Figure(TypedDict):
    """A figure of Plotly."""

    data: list[Trace]
    layout: Layout


_POINTS_MAX = 4000
_PLANS_MAX = 60
_NAMED_MAX = 12
_SEVERITIES = {EventSeverity.BAD: "@bad", EventSeverity.WARNING: "@warn"}


def shown(text: str) -> str:
    """Return text of a log for a plot: Plotly takes some of HTML for more than text."""
    return html.escape("".join(c if c.isprintable() else " " for c in text))


def line(
    x: Floats, y: Floats, name: str, colour: str, look: Mapping[str, object] | None = None
) -> Trace:
    """Return a line that is broken where no value came, thinned to what can be seen.

    Args:
        x: times, shape (n,).
        y: shape (n,).
        name: for the legend.
        colour: of the page.
        look: of Plotly's line.
    """
    chosen = _visible(y, len(x))
    x, y = x[chosen], y[chosen]
    return {
        **_line_with_breaks(x, y, name, _breaks(x)),
        "line": {"color": colour, "width": 2, **(look or {})},
        "hovertemplate": f"%{{y:.2f}}<extra>{name}</extra>",
    }


def _line_with_breaks(x: Floats, y: Floats, name: str, breaks: NDArray[np.int64]) -> Trace:
    return {
        "type": "scatter",
        "mode": "lines",
        "name": name,
        "x": numbers(np.insert(x, breaks, np.nan)),
        "y": numbers(np.insert(y, breaks, np.nan)),
    }


def _breaks(time_s: Floats) -> NDArray[np.int64]:
    """Return the places after pauses; a slow but regular message has none."""
    apart_s = np.diff(time_s)
    pause_s = max(GAP_S, 5.0 * float(np.median(apart_s))) if len(apart_s) else GAP_S
    return np.flatnonzero(apart_s > pause_s) + 1


def numbers(values: Floats) -> list[float | None]:
    """Return numbers for JSON, rounded to 0.001; NaN becomes None."""
    return [None if value != value else value for value in np.round(values, 3).tolist()]


def _visible(values: Floats | None, count: int) -> NDArray[np.int64]:
    """Return the places of the points to draw: of each small part the least and the greatest."""
    if count <= _POINTS_MAX:
        return np.arange(count)
    parts = np.linspace(0, count, _POINTS_MAX // 2 + 1).astype(np.int64)
    if values is None:
        return np.unique(np.append(parts[:-1], count - 1))
    spans = zip(parts[:-1].tolist(), parts[1:].tolist(), strict=True)
    found = [
        begin + int(pick(values[begin:end]))
        for begin, end in spans
        for pick in (np.argmin, np.argmax)
    ]
    return np.unique(found)


def markers(
    places: Sequence[Sequence[float]], texts: Sequence[str], name: str, **look: object
) -> Trace:
    """Return marked places on the map.

    Args:
        places: of each (east, north) in m, more is ignored.
        texts: what is shown for each; safe already.
        name: for the legend.
        look: of Plotly's marker.
    """
    return {
        "type": "scatter",
        "mode": "markers",
        "name": name,
        "x": [round(place[0], 3) for place in places],
        "y": [round(place[1], 3) for place in places],
        "text": list(texts),
        "hovertemplate": "%{text}<extra></extra>",
        "marker": {"size": 11, "line": {"width": 1.5, "color": "@paper"}} | look,
    }


def map_figure(flight: Flight, below: Sequence[Trace] = ()) -> Figure | None:
    """Return the map: track, plans, goals and what happened where; None without a position.

    Args:
        flight: of one vehicle.
        below: what is drawn beneath all that.
    """
    track = flight.track
    if not len(track.time_s):
        return None
    traces = [*below, *_plans(flight), flown(track, "flown", "@track"), *_ends(track)]
    traces += [*_replans(flight), *_modes(flight), *_worth_a_look(flight), *_goals(flight)]
    return {"data": traces, "layout": {}}


def flown(track: Track, name: str, colour: str) -> Trace:
    """Return the line of a track, with time, height and speed where one points at it."""
    chosen = _visible(None, len(track.time_s))
    about = np.stack([track.time_s, track.position_enu_m[:, 2], track.ground_speed_m_s], axis=-1)[
        chosen
    ]
    east, north, _ = track.position_enu_m[chosen].T
    breaks = _breaks(track.time_s[chosen])
    return {
        **_line_with_breaks(east, north, name, breaks),
        "customdata": np.insert(about, breaks, 0.0, axis=0).round(2).tolist(),
        "line": {"color": colour, "width": 2.5},
        "hovertemplate": "%{customdata[0]:.1f} s<br>east %{x:.1f} m, north %{y:.1f} m, "
        f"up %{{customdata[1]:.1f}} m<br>%{{customdata[2]:.1f}} m/s<extra>{name}</extra>",
    }


def _plans(flight: Flight) -> list[Trace]:
    plans = [plan for _, plan in flight.retold.noted.plans][-_PLANS_MAX:]
    if not plans:
        return []
    x: list[float | None] = []
    y: list[float | None] = []
    for plan in plans:
        x += [*(round(place[0], 2) for place in plan), None]
        y += [*(round(place[1], 2) for place in plan), None]
    look = {"color": "@plan", "width": 1.5, "dash": "dash"}
    return [
        {
            "type": "scatter", "mode": "lines", "name": "plans", "x": x, "y": y, "line": look,
            "opacity": 0.7, "hoverinfo": "skip",
        }
    ]  # fmt: skip


def _ends(track: Track) -> list[Trace]:
    return [
        markers(
            [track.position_enu_m[place].tolist()],
            [f"{name} of the recording, {track.time_s[place]:.1f} s"],
            name,
            symbol=symbol,
            color="@track",
        )
        for place, name, symbol in ((0, "begin", "circle"), (-1, "end", "square"))
    ]


def _replans(flight: Flight) -> list[Trace]:
    counts = flight.retold.noted.replans
    times_s = [
        time_s for (_, before), (time_s, after) in itertools.pairwise(counts) if after > before
    ]
    return _at_times(flight, [(time_s, "replanned") for time_s in times_s], "replans",
                     symbol="diamond", color="@plan")  # fmt: skip


def _modes(flight: Flight) -> list[Trace]:
    events = [(time_s, f"mode {name}") for time_s, name in flight.retold.modes[1:]]
    return _at_times(flight, events, "mode changes", symbol="square-open", color="@mode",
                     line={"width": 2.5, "color": "@mode"})  # fmt: skip


def _worth_a_look(flight: Flight) -> list[Trace]:
    events = [(t_s, warned.first.text) for warned in warnings(flight) for t_s in warned.times_s]
    events = [(time_s, text) for time_s, text in events if time_s > 0.0]
    return _at_times(flight, events, "warnings", symbol="triangle-up", color="@bad")


def _at_times(
    flight: Flight, events: list[tuple[float, str]], name: str, **look: object
) -> list[Trace]:
    placed = [(flight.track.at(time_s), time_s, text) for time_s, text in events]
    known = [(place, time_s, text) for place, time_s, text in placed if place is not None]
    if not known:
        return []
    texts = [f"{time_s:.1f} s: {shown(text)}" for _, time_s, text in known]
    return [markers([place for place, _, _ in known], texts, name, **look)]


def _goals(flight: Flight) -> list[Trace]:
    places, texts, names = [], [], []
    for number, goal in enumerate(flight.retold.noted.goals, 1):
        for point, target in enumerate(goal.targets_enu_m, 1):
            route = f", waypoint {point}" if len(goal.targets_enu_m) > 1 else ""
            places.append(target)
            names.append(f"{number}" + (f".{point}" if route else ""))
            where = ", ".join(f"{part:.1f}" for part in target)
            texts.append(f"goal {number}{route}<br>({where}) m")
    if not places:
        return []
    trace = markers(places, texts, "goals", symbol="x", color="@goal", size=12)
    named = len(names) <= _NAMED_MAX
    mode = "markers+text" if named else "markers"
    trace |= {"mode": mode, "textposition": "top right", "textfont": {"color": "@goal", "size": 13}}
    return [
        trace | {"hovertext": texts, "text": names, "hovertemplate": "%{hovertext}<extra></extra>"}
    ]


def moment_colour(moment: Moment) -> str:
    """Return the page's colour for an event."""
    return _SEVERITIES.get(moment.severity, "@mode")
