"""Time series of a report, stacked on one time axis. Pure."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from flight_reports.analysis.flight import Flight
from flight_reports.analysis.warnings import warnings
from flight_reports.contents.log_reader import Floats
from flight_reports.page.figures import Figure, Layout, Trace, line, moment_colour, numbers, shown

_ROW_PX = 150
_STRIP_PX = 92
_SPACE_PX = 16
_BOTTOM_PX = 104
_LINES_MAX = 40
# Larger distances are not drawn.
_CLEARANCE_MAX_M = 10.0
_MODE_TINTS = ("@tint1", "@tint2", "@tint3")


@dataclass
class Row:
    """One of the plots.

    Attributes:
        title: of its axis.
        traces: on the left axis.
        right_title: of the axis on the right; empty without one.
        right: traces on it.
        height_px: of the plot.
        axis: more of Plotly's axis.
        right_axis: the same on the right.
    """

    title: str
    traces: list[Trace]
    right_title: str = ""
    right: list[Trace] = field(default_factory=list)
    height_px: int = _ROW_PX
    axis: Mapping[str, object] = field(default_factory=dict)
    right_axis: Mapping[str, object] = field(default_factory=dict)


def series_figure(flight: Flight) -> Figure:
    """Return everything over time: modes and events, altitude, speed, errors, battery, link."""
    rows = [_strip(flight), *_height_and_speed(flight), *_errors(flight), *_clearance(flight)]
    rows += _battery(flight)
    figure = stacked([*rows, _link(flight)], flight.contents.duration_s)
    figure["layout"]["shapes"] = _mode_bars(flight) + _event_lines(flight)
    return figure


def stacked(rows: list[Row], end_s: float, begin_s: float = 0.0, title: str = "") -> Figure:
    """Return plots one under the other, which are zoomed in time together."""
    total_px = sum(row.height_px + _SPACE_PX for row in rows)
    layout: Layout = {
        "height": total_px + _BOTTOM_PX,
        "hovermode": "x unified",
        "margin": {"l": 64, "r": 72, "t": 24, "b": _BOTTOM_PX - 6},
        "legend": {"orientation": "h", "y": -44 / total_px, "yanchor": "top", "x": 0},
        "hoverlabel": {"namelength": -1},
        "xaxis": {
            "title": {"text": title or "time since the start of the log (s)"},
            "range": [begin_s, max(end_s, begin_s + 1.0)],
            "anchor": f"y{2 * len(rows) - 1}",
            "showspikes": True, "spikemode": "across", "spikethickness": 1, "spikedash": "solid",
            "spikecolor": "@faint", "zeroline": False, "unifiedhovertitle": {"text": "%{x:.2f} s"},
        },
    }  # fmt: skip
    data: list[Trace] = []
    top = 1.0
    for number, row in enumerate(rows):
        bottom = top - row.height_px / total_px
        names = [f"y{2 * number + side}" for side in (1, 2)]
        left, right = ("yaxis" + ("" if name == "y1" else name[1:]) for name in names)
        layout[left] = {
            "domain": [max(bottom, 0.0), top], "title": {"text": row.title}, "zeroline": False,
            **row.axis,
        }  # fmt: skip
        refs = ["y" if name == "y1" else name for name in names]
        data += [{**trace, "yaxis": refs[0]} for trace in row.traces]
        if row.right:
            layout[right] = {
                "overlaying": refs[0], "side": "right", "title": {"text": row.right_title},
                "showgrid": False, "zeroline": False, "tickmode": "auto", "nticks": 4,
                **row.right_axis,
            }  # fmt: skip
            data += [{**trace, "yaxis": refs[1]} for trace in row.right]
        top = bottom - _SPACE_PX / total_px
    return {"data": data, "layout": layout}


def points(pairs: list[tuple[float, float]]) -> tuple[Floats, Floats]:
    """Return times and values of pairs."""
    both = np.array(pairs, dtype=np.float64).reshape(-1, 2)
    return both[:, 0], both[:, 1]


def _strip(flight: Flight) -> Row:
    """Return the strip of modes, with what happened above it."""
    marks: list[tuple[float, str, str, str]] = []
    for warned in warnings(flight):
        look = (warned.first.text, moment_colour(warned.first), "triangle-up")
        marks += [(time_s, *look) for time_s in warned.times_s]
    for goal in flight.retold.noted.goals:
        marks.append((goal.accepted_s, f"goal {goal.short_id} accepted", "@goal", "x"))
        marks += [
            (t_s, f"{goal.short_id} {what}", "@goal", "line-ns") for t_s, what, _ in goal.statuses
        ]
        if goal.ended_s is not None:
            marks.append(
                (goal.ended_s, f"goal {goal.short_id} ended {goal.code}", "@goal", "square")
            )
    marks += [
        (moment.time_s, moment.text, "@mode", "circle-open")
        for moment in flight.retold.moments
        if moment.kind in ("mode", "arming")
    ]
    marks.sort(key=lambda one: one[0])
    trace: Trace = {
        "type": "scatter",
        "mode": "markers",
        "name": "events",
        "showlegend": False,
        "x": [round(one[0], 2) for one in marks],
        "y": [1.55] * len(marks),
        "text": [shown(one[1]) for one in marks],
        "hovertemplate": "%{text}<extra></extra>",
        "marker": {
            "color": [one[2] for one in marks],
            "symbol": [one[3] for one in marks],
            "size": 9,
            "line": {"width": 1.5, "color": [one[2] for one in marks]},
        },
    }
    axis = {
        "range": [0.0, 2.0], "fixedrange": True, "showgrid": False,
        "tickvals": [0.5, 1.55], "ticktext": ["mode", "events"],
    }  # fmt: skip
    return Row("", [trace], height_px=_STRIP_PX, axis=axis)


def _mode_bars(flight: Flight) -> list[Layout]:
    modes = flight.retold.modes
    ends = [time_s for time_s, _ in modes[1:]] + [flight.contents.duration_s]
    tints: dict[str, str] = {}
    bars = []
    for (begin_s, name), end_s in zip(modes, ends, strict=False):
        tint = tints.setdefault(name, _MODE_TINTS[len(tints) % len(_MODE_TINTS)])
        label = {"text": shown(name), "font": {"size": 11, "color": "@ink"}}
        bars.append(
            {
                "type": "rect", "xref": "x", "yref": "y", "x0": begin_s, "x1": end_s, "y0": 0.08,
                "y1": 0.92, "fillcolor": tint, "line": {"width": 0}, "label": label,
                "layer": "below",
            }
        )  # fmt: skip
    return bars


def _event_lines(flight: Flight) -> list[Layout]:
    times: list[tuple[float, str]] = []
    for goal in flight.retold.noted.goals:
        times.append((goal.accepted_s, "@goal"))
        if goal.ended_s is not None:
            times.append((goal.ended_s, "@goal"))
    times += [
        (warned.first.time_s, moment_colour(warned.first))
        for warned in warnings(flight)
        if warned.first.time_s > 0.0
    ]
    return [
        {
            "type": "line", "xref": "x", "yref": "paper", "x0": time_s, "x1": time_s, "y0": 0,
            "y1": 1, "line": {"color": colour, "width": 1, "dash": "dot"}, "opacity": 0.55,
            "layer": "below",
        }
        for time_s, colour in times[:_LINES_MAX]
    ]  # fmt: skip


def _height_and_speed(flight: Flight) -> list[Row]:
    track = flight.track
    if not len(track.time_s):
        return []
    up = line(track.time_s, track.position_enu_m[:, 2], "altitude (m)", "@track")
    heights = [up]
    if len(flight.setpoints.time_s) > 1:
        wanted = -flight.setpoints.vectors_ned[:, 2]
        look = {"dash": "dot", "width": 1.5}
        heights.append(
            line(flight.setpoints.time_s, wanted, "altitude setpoint (m)", "@goal", look=look)
        )
    altitudes = Row("altitude (m)", heights)
    if not track.has_velocity:
        return [altitudes]
    climb = -track.velocity_ned_m_s[:, 2]
    speeds = [
        line(track.time_s, track.ground_speed_m_s, "ground speed (m/s)", "@track"),
        line(track.time_s, climb, "climb (m/s)", "@second", look={"width": 1.5}),
    ]
    return [altitudes, Row("speed (m/s)", speeds)]


def _errors(flight: Flight) -> list[Row]:
    events = flight.position_tracking
    if events is None:
        return []
    across = line(events.time_s, events.horizontal, "horizontal error (m)", "@track")
    above = line(
        events.time_s, events.vertical, "vertical error (m)", "@second", look={"width": 1.5}
    )
    return [Row("tracking error (m)", [across, above])]


def _clearance(flight: Flight) -> list[Row]:
    seen = flight.clearance
    if not len(seen.time_s):
        return []
    near = np.where(seen.distance_m <= _CLEARANCE_MAX_M, seen.distance_m, np.nan)
    trace = line(seen.time_s, near, "to the nearest obstacle (m)", "@track")
    return [Row("clearance (m)", [trace], axis={"rangemode": "tozero"})]


def _battery(flight: Flight) -> list[Row]:
    retold = flight.retold
    traces = []
    if retold.battery:
        traces.append(line(*points(retold.battery), "battery (%)", "@track"))
    volts = []
    if retold.voltage:
        look = {"width": 1.5, "dash": "dot"}
        volts.append(line(*points(retold.voltage), "voltage (V)", "@second", look=look))
    if not traces and not volts:
        return []
    low = min((percent for _, percent in retold.battery), default=0.0)
    axis = {"range": [min(max(low - 5.0, 0.0), 90.0), 101.0]}
    if not traces:
        return [Row("voltage (V)", volts)]
    return [Row("battery (%)", traces, "voltage (V)" if volts else "", volts, axis=axis)]


def _link(flight: Flight) -> Row:
    link = flight.link
    middle = 0.5 * (link.intervals_s[1:] + link.intervals_s[:-1])
    rate: Trace = {
        "type": "scatter", "mode": "lines", "name": "messages per second", "x": numbers(middle),
        "y": numbers(link.rate_hz), "line": {"color": "@track", "width": 2, "shape": "hvh"},
        "hovertemplate": "%{y:.0f}<extra>messages per second</extra>",
    }  # fmt: skip
    top = max(float(np.nan_to_num(link.loss).max(initial=0.0)) * 100.0, 5.0)
    loss: Trace = {
        "type": "bar", "name": "lost (%)", "x": numbers(middle),
        "y": numbers(100.0 * link.loss), "marker": {"color": "@bad"}, "opacity": 0.6,
        "width": float(link.intervals_s[1]), "hovertemplate": "%{y:.1f}<extra>lost (%)</extra>",
    }  # fmt: skip
    known = [loss] if link.numbers_follow else []
    return Row(
        "messages (1/s)", [rate], "lost (%)", known, axis={"rangemode": "tozero"},
        right_axis={"range": [0.0, top * 1.1]},
    )  # fmt: skip
