"""Overlay of two recorded flights. No ROS."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from flight_reports.analysis.flight import Flight
from flight_reports.contents.log_reader import Floats
from flight_reports.contents.track import Track, laid_into
from flight_reports.page.figures import Figure, Trace, flown, line, markers
from flight_reports.page.html import Markup, element, joined, number, table
from flight_reports.page.page import Plots, beside, page
from flight_reports.page.sections import not_in_the_log, replans
from flight_reports.page.series import Row, points, stacked

# Beyond this distance, two flights have no common origin.
_SAME_PLACE_M = 5000.0
_COLOURS = ("@track", "@other")
_LETTERS = ("A", "B")
_WS_PER_WH = 3600.0
_SERIES = ("altitude (m)", "speed (m/s)", "tracking error (m)", "battery (%)", "remaining (m)")


@dataclass(frozen=True)
class Alignment:
    """The event from which times of both flights are counted.

    Attributes:
        event: for people, "acceptance of the first goal".
        times_s: of it, in each flight's own time.
    """

    event: str
    times_s: tuple[float, float]


def align(first: Flight, second: Flight) -> Alignment:
    """Return the first event that both flights have: a goal, the take-off, a movement."""
    for event, attribute in (
        ("acceptance of the first goal", "goal_s"),
        ("take-off (1 m above the first position)", "takeoff_s"),
        ("first movement (faster than 0.5 m/s)", "moved_s"),
    ):
        a, b = getattr(first, attribute), getattr(second, attribute)
        if a is not None and b is not None:
            return Alignment(event, (a, b))
    return Alignment("the beginning of each log", (0.0, 0.0))


def comparison_page(first: Flight, second: Flight) -> str:
    """Return the page that overlays two flights."""
    plots = Plots()
    flights = (first, second)
    alignment = align(first, second)
    tracks, placed = in_one_frame(first, second)
    parts: list[object] = [
        element("h2", "Flights"),
        _who(flights),
        element("p", _about(alignment, placed), class_="note"),
    ]
    for letter, flight in zip(_LETTERS, flights, strict=True):
        if missing := not_in_the_log(flight):
            parts += [element("p", f"{letter}: {flight.path.name}", class_="note"), missing]
    shown = None
    if any(len(track.time_s) for track in tracks):
        shown = plots.place_map("ab", _map(flights, tracks), "Both flights")
        together = zip(flights, tracks, _COLOURS, alignment.times_s, strict=True)
        for flight, track, colour, begin_s in together:
            if len(track.time_s):
                plots.follow("ab", flight, track, colour.removeprefix("@"), begin_s)
    parts += [
        element("h3", "Differences"),
        _differences(flights, alignment),
        element("h3", "Over time"),
        beside(
            shown, plots.place("ab-time", _series(flights, alignment), "Both flights over time")
        ),
    ]
    title = f"{first.path.name} and {second.path.name}"
    return page(f"Two flights: {title}", element("section", *parts, id="ab"), plots)


def in_one_frame(first: Flight, second: Flight) -> tuple[tuple[Track, Track], str]:
    """Return both tracks in the map frame of the first, and a sentence about the frames."""
    a, b = first.track, second.track
    if a.frame is not None and b.frame is not None:
        north_m, east_m, _ = a.frame.ned_m(b.frame.origin)
        if math.hypot(north_m, east_m) <= _SAME_PLACE_M:
            tracks = a, laid_into(b, a.frame)
            return tracks, "Both tracks are shown in the map frame of A."
    tracks = (_from_begin(a), _from_begin(b))
    return tracks, "The flights have no common origin: each track begins at its own."


def _from_begin(track: Track) -> Track:
    if not len(track.time_s):
        return track
    place = track.position_enu_m - track.position_enu_m[0]
    return replace(track, position_enu_m=place, frame=None)


def _who(flights: tuple[Flight, Flight]) -> Markup:
    rows = [
        [
            joined((element("span", class_=f"swatch {letter.lower()}"), letter)),
            flight.path.name,
            flight.name,
            flight.retold.state.firmware_version or "–",
        ]
        for letter, flight in zip(_LETTERS, flights, strict=True)
    ]
    return table(("flight", "log", "vehicle", "firmware"), rows)


def _about(alignment: Alignment, placed: str) -> str:
    a, b = alignment.times_s
    return f"Time zero is {alignment.event}: {a:.1f} s into A, {b:.1f} s into B. {placed}"


def _map(flights: tuple[Flight, Flight], tracks: tuple[Track, Track]) -> Figure:
    traces: list[Trace] = []
    shown = list(zip(_LETTERS, tracks, _COLOURS, flights, strict=True))
    for letter, track, colour, _ in shown:
        if len(track.time_s):
            traces.append(flown(track, letter, colour))
            begin = [track.position_enu_m[0].tolist()]
            traces.append(markers(begin, [f"{letter} begins"], f"{letter} begins", color=colour))
    for letter, track, colour, flight in shown:
        # The targets of goals are in each flight's own map frame.
        same = track.frame is not None and track.frame == flight.track.frame
        targets = [t for goal in flight.retold.noted.goals for t in goal.targets_enu_m]
        if same and targets:
            texts = [f"goal of {letter}"] * len(targets)
            traces.append(markers(targets, texts, f"goals of {letter}", symbol="x", color=colour))
    return {"data": traces, "layout": {}}


def _series(flights: tuple[Flight, Flight], alignment: Alignment) -> Figure:
    """Return the series of both, in one time."""
    rows = {title: Row(title, []) for title in _SERIES}
    begin_s, end_s = 0.0, 1.0
    together = zip(flights, alignment.times_s, _LETTERS, _COLOURS, strict=True)
    for flight, zero_s, letter, colour in together:
        begin_s = min(begin_s, -zero_s)
        end_s = max(end_s, flight.contents.duration_s - zero_s)
        for title, (time_s, values) in _of(flight).items():
            if len(time_s):
                rows[title].traces.append(
                    line(time_s - zero_s, values, f"{letter} {title}", colour)
                )
    shown = [row for row in rows.values() if row.traces]
    return stacked(shown or [Row("", [])], end_s, begin_s, f"time since {alignment.event} (s)")


def _of(flight: Flight) -> dict[str, tuple[Floats, Floats]]:
    track, noted, tracking = flight.track, flight.retold.noted, flight.position_tracking
    up_m = track.position_enu_m[:, 2]
    series = {
        "altitude (m)": (track.time_s, up_m - up_m[0] if len(up_m) else up_m),
        "speed (m/s)": (track.time_s, track.ground_speed_m_s) if track.has_velocity else points([]),
        "battery (%)": points(flight.retold.battery),
        "remaining (m)": points(noted.distance_m),
    }
    if tracking is not None:
        series["tracking error (m)"] = (tracking.time_s, tracking.horizontal)
    return series


def _differences(flights: tuple[Flight, Flight], alignment: Alignment) -> Markup:
    a, b = (_figures(f, zero_s) for f, zero_s in zip(flights, alignment.times_s, strict=True))
    rows = []
    for (name, unit, digits), before, after in zip(_FIGURES, a, b, strict=True):
        change = None if before is None or after is None else after - before
        rows.append(
            [
                name if name != _HEIGHT else name + _above(flights),
                number(before, unit, digits),
                number(after, unit, digits),
                _signed(change, unit, digits),
            ]
        )
    return table(("figure", "A", "B", "B − A"), rows, "figures")


def _above(flights: tuple[Flight, Flight]) -> str:
    """Return the common reference of the heights of two flights, such as " above home"."""
    references = [f.figures.height_reference for f in flights if f.figures is not None]
    return f" above {' and '.join(dict.fromkeys(references))}" if references else ""


def _signed(change: float | None, unit: str, digits: int) -> str:
    if change is None or not round(change, digits):
        return number(change if change is None else 0.0, unit, digits)
    return f"{change:+.{digits}f} {unit}".rstrip().replace("-", "−")


_HEIGHT = "maximum height"
_FIGURES = (
    ("duration from time zero", "s", 1),
    ("distance flown", "m", 1),
    (_HEIGHT, "m", 1),
    ("maximum ground speed", "m/s", 1),
    ("battery used", "%", 0),
    ("energy used", "Wh", 2),
    ("horizontal tracking error, RMS", "m", 2),
    ("horizontal tracking error, maximum", "m", 2),
    ("tracking delay", "s", 2),
    ("goals", "", 0),
    ("goals reached", "", 0),
    ("duration of the first goal", "s", 1),
    ("replans", "", 0),
    ("packets lost", "%", 1),
)


def _figures(flight: Flight, zero_s: float) -> list[float | None]:
    """Return the figures in the order of `_FIGURES`, None for what isn't known."""
    figures, tracking, goals = flight.figures, flight.position_tracking, flight.retold.noted.goals
    battery = flight.retold.battery
    ended = [goal.ended_s - goal.accepted_s for goal in goals[:1] if goal.ended_s is not None]
    return [
        flight.contents.duration_s - zero_s,
        None if figures is None else figures.distance_m,
        None if figures is None else figures.highest_m,
        None if figures is None else figures.fastest_m_s,
        battery[0][1] - battery[-1][1] if battery else None,
        energy_wh(flight),
        None if tracking is None else tracking.horizontal_rms,
        None if tracking is None else tracking.horizontal_max,
        None if tracking is None else tracking.delay_s,
        float(len(goals)) if goals else None,
        float(sum(goal.code == "SUCCESS" for goal in goals)) if goals else None,
        ended[0] if ended else None,
        float(replans(flight)) if goals else None,
        100.0 * flight.link.loss_share if flight.link.numbers_follow else None,
    ]


def energy_wh(flight: Flight) -> float | None:
    """Return the energy from SYS_STATUS: voltage times current; None without both."""
    status = flight.contents.of("SYS_STATUS", flight.source)
    if status is None:
        return None
    known = status[(status["current_battery"] >= 0) & (status["voltage_battery"] != 0xFFFF)]
    if len(known) < 2 or not known["current_battery"].any():
        return None
    power_w = known["voltage_battery"] * 1e-3 * known["current_battery"] * 1e-2
    between_s = np.diff(known["time_s"])
    return float((0.5 * (power_w[1:] + power_w[:-1]) * between_s).sum()) / _WS_PER_WH
