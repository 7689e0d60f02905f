"""The page of a report: one self-contained HTML file that works offline."""

from __future__ import annotations

import base64
import hashlib
import json
from importlib.resources import files

from flight_reports.analysis.flight import Flight
from flight_reports.analysis.sensed_obstacles import obstacles_left_out
from flight_reports.contents.track import Track
from flight_reports.page import sections
from flight_reports.page.figures import Figure, map_figure, numbers
from flight_reports.page.html import Markup, element, joined, safe
from flight_reports.page.obstacle_traces import obstacle_traces
from flight_reports.page.series import series_figure

_TRACK_POINTS_MAX = 4000
# Lines, markers and bars only: a quarter of the whole library (npm: plotly.js-basic-dist-min).
_PLOTLY = "plotly-basic.min.js"
_TOO_LONG = "Obstacles are drawn only for logs of up to 8 MB."
_NO_SCRIPT = "The plots of this page need JavaScript."


class Plots:
    """The figures of a page, and where vehicles were, for pointing from one plot to another."""

    def __init__(self) -> None:
        """Begin without figures."""
        self.figures: dict[str, Figure] = {}
        self.tracks: dict[str, dict[str, list[float | None]]] = {}

    def place(self, name: str, figure: Figure, label: str) -> Markup:
        """Take a figure, and return where it is to be drawn."""
        self.figures[name] = figure
        height = figure["layout"]["height"]
        return element("div", id=name, class_="plot", style=f"min-height:{height}px",
                       role="group", aria_label=label)  # fmt: skip

    def follow(self, section: str, track: Track, begin_s: float = 0.0) -> None:
        """Let the map of a section show where the vehicle was at the time that is pointed at."""
        step = max(len(track.time_s) // _TRACK_POINTS_MAX, 1)
        self.tracks[section] = {
            "t": numbers(track.time_s[::step] - begin_s),
            "x": numbers(track.position_enu_m[::step, 0]),
            "y": numbers(track.position_enu_m[::step, 1]),
        }

    def as_json(self) -> str:
        """Return everything as JSON that is safe in a script element."""
        text = json.dumps({"figures": self.figures, "tracks": self.tracks}, allow_nan=False,
                          separators=(",", ":"))  # fmt: skip
        return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def report_page(flights: list[Flight]) -> str:
    """Return the report on the vehicles of a log."""
    plots = Plots()
    name = flights[0].path.name
    several = len(flights) > 1
    links = [
        element("a", flight.name, href=f"#v{flight.source[0]}-{flight.source[1]}")
        for flight in flights
    ]
    parts: list[object] = [element("nav", *links)] if several else []
    parts += [_flight(flight, plots) for flight in flights]
    return page(f"Flight in {name}", joined(parts), plots)


def _flight(flight: Flight, plots: Plots) -> Markup:
    section = f"v{flight.source[0]}-{flight.source[1]}"
    on_map = map_figure(flight, obstacle_traces(flight.sensed))
    parts: list[object] = [
        element("h2", flight.name),
        sections.summary(flight),
        sections.not_in_the_log(flight),
    ]
    if on_map is not None:
        if flight.sensed is None and obstacles_left_out(flight.contents):
            parts.append(element("p", _TOO_LONG, class_="note"))
        plots.follow(section, flight.track)
        parts += [element("h3", "Map"), plots.place(f"{section}-map", on_map, "Map of the flight")]
    parts += [
        sections.goals(flight, section),
        sections.worth_a_look(flight, section),
        element("h3", "Over time"),
        plots.place(f"{section}-time", series_figure(flight), "Altitude, speed and more over time"),
        sections.tracking(flight),
        sections.speakers(flight),
        sections.modes(flight, section),
        sections.messages(flight),
    ]
    return element("section", *parts, id=section)


def page(title: str, body: Markup, plots: Plots) -> str:
    """Return a whole page.

    Its policy allows the page's own scripts, by their digests, and no network at all: whatever
    a log holds could neither run nor fetch anything, even if it were not escaped.
    """
    scripts = [_asset(_PLOTLY), _asset("page.js")]
    policy = (
        f"default-src 'none'; script-src {' '.join(map(_digest, scripts))}; "
        "style-src 'unsafe-inline'; img-src data: blob:; font-src data:; base-uri 'none'; "
        "form-action 'none'"
    )
    data = Markup(plots.as_json())
    head = joined(
        (
            Markup('<meta charset="utf-8">'),
            Markup(f'<meta http-equiv="Content-Security-Policy" content="{safe(policy)}">'),
            Markup('<meta name="viewport" content="width=device-width, initial-scale=1">'),
            Markup('<meta name="color-scheme" content="light dark">'),
            element("title", title),
            element("style", Markup(_asset("page.css"))),
        )
    )
    main = element(
        "main",
        element("header", element("p", "navigation_report", class_="by"), element("h1", title)),
        element("noscript", element("p", _NO_SCRIPT)),
        element("p", id="errors", hidden="", role="alert"),
        body,
    )
    tail = joined(
        (
            element("script", data, type="application/json", id="plots"),
            *(element("script", Markup(script)) for script in scripts),
        )
    )
    return f'<!doctype html>\n<html lang="en"><head>{head}</head><body>{main}{tail}</body></html>\n'


def _asset(name: str) -> str:
    return files("flight_reports.page").joinpath(name).read_text("utf-8")


def _digest(script: str) -> str:
    digest = hashlib.sha256(script.encode("utf-8")).digest()
    return f"'sha256-{base64.b64encode(digest).decode('ascii')}'"
