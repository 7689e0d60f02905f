"""The page of a report: one self-contained HTML file that works offline."""

from __future__ import annotations

import base64
import hashlib
import json
import re
from importlib.resources import files

import numpy as np

from flight_reports.analysis.flight import Flight
from flight_reports.analysis.sensed_obstacles import obstacles_left_out
from flight_reports.contents.log_reader import Floats
from flight_reports.contents.track import Track
from flight_reports.page import sections
from flight_reports.page.figures import Figure, map_figure, numbers
from flight_reports.page.html import Markup, element, joined, safe
from flight_reports.page.obstacle_traces import obstacle_traces
from flight_reports.page.series import series_figure

_TRACK_POINTS_MAX = 4000
# Lines, markers and bars only: a quarter of the whole library (npm: plotly.js-basic-dist-min).
_LIBRARIES = ("plotly-basic.min.js", "map/leaflet.js")
# Modules, each after those that it imports.
_MODULES = ("map/colours.js", "map/local_map.js", "flight_map.js", "player.js", "page.js")
_STYLES = ("map/leaflet.css", "page.css")
_IMPORT, _EXPORT = re.compile(r"^import .*\n", re.MULTILINE), re.compile(r"^export ", re.MULTILINE)
# Between positions farther apart nothing is known.
_GAP_S = 5.0
_HEADING_UNKNOWN = 65535
_TOO_LONG = "Obstacles are drawn only for logs of up to 8 MB."
_NO_SCRIPT = "The plots of this page need JavaScript."


class Plots:
    """The figures of a page, and where vehicles were, for pointing from one plot to another."""

    def __init__(self) -> None:
        """Begin without figures."""
        self.figures: dict[str, Figure] = {}
        self.tracks: dict[str, list[dict[str, object]]] = {}

    def place(self, name: str, figure: Figure, label: str) -> Markup:
        """Take a figure, and return where it is to be drawn."""
        self.figures[name] = figure
        height = figure["layout"]["height"]
        return element("div", id=name, class_="plot", style=f"min-height:{height}px",
                       role="group", aria_label=label)  # fmt: skip

    def place_map(self, section: str, figure: Figure, label: str) -> Markup:
        """Take the map of a section, and return where it and the bar that plays it are to be."""
        self.figures[f"{section}-map"] = figure
        return joined(
            (
                element("div", id=f"{section}-map", class_="map", role="region", aria_label=label),
                element("div", id=f"{section}-player", class_="player", role="group",
                        aria_label="Play the flight"),
            )
        )  # fmt: skip

    def follow(
        self, section: str, flight: Flight, track: Track, colour: str, begin_s: float = 0.0
    ) -> None:
        """Let the map of a section show where a vehicle was at a time.

        Args:
            section: of the page.
            flight: whose headings are shown.
            track: of the flight, in the frame of the map.
            colour: of the page, "track" or "other".
            begin_s: the zero of the plots' time.
        """
        step = max(len(track.time_s) // _TRACK_POINTS_MAX, 1)
        time_s = track.time_s[::step]
        self.tracks.setdefault(section, []).append(
            {
                "t": numbers(time_s - begin_s),
                "x": numbers(track.position_enu_m[::step, 0]),
                "y": numbers(track.position_enu_m[::step, 1]),
                "colour": colour,
                "heading": numbers(_headings(flight, time_s)),
                "gap": max(_GAP_S, 3.0 * float(np.median(np.diff(time_s, prepend=time_s[0])))),
            }
        )

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
        plots.follow(section, flight, flight.track, "track")
    parts += [
        sections.goals(flight, section),
        sections.worth_a_look(flight, section),
        element("h3", "Map and plots over time" if on_map is not None else "Over time"),
        beside(
            plots.place_map(section, on_map, "Map of the flight") if on_map is not None else None,
            plots.place(
                f"{section}-time", series_figure(flight), "Altitude, speed and more over time"
            ),
        ),
        sections.tracking(flight),
        sections.speakers(flight),
        sections.modes(flight, section),
        sections.messages(flight),
    ]
    return element("section", *parts, id=section)


def beside(shown: Markup | None, *parts: object) -> Markup:
    """Return parts with the map beside them, which stays in sight while they are scrolled."""
    if shown is None:
        return joined(parts)
    return element("div", element("div", shown, class_="stays"), element("div", *parts),
                   class_="beside")  # fmt: skip


def _headings(flight: Flight, time_s: Floats) -> Floats:
    """Return the headings at some times, degrees from north; NaN where they are not known."""
    sent = flight.contents.of("GLOBAL_POSITION_INT", flight.source)
    known = None if sent is None else sent[sent["hdg"] != _HEADING_UNKNOWN]
    if known is None or not len(known):
        return np.full(len(time_s), np.nan)
    latest = np.searchsorted(known["time_s"], time_s, side="right") - 1
    return np.where(latest < 0, np.nan, known["hdg"][np.maximum(latest, 0)] / 100.0)


def page(title: str, body: Markup, plots: Plots) -> str:
    """Return a whole page.

    Its policy allows the page's own scripts, by their digests, and no network at all: whatever
    a log holds could neither run nor fetch anything, even if it were not escaped.
    """
    scripts = [*map(_asset, _LIBRARIES), _own_script()]
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
            *(element("style", Markup(_asset(name))) for name in _STYLES),
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


def _own_script() -> str:
    """Return the page's own modules as one script: a page in a file can import nothing."""
    modules = (_EXPORT.sub("", _IMPORT.sub("", _asset(name))) for name in _MODULES)
    return '"use strict";\n(() => {\n' + "\n".join(modules) + "})();\n"


def _digest(script: str) -> str:
    digest = hashlib.sha256(script.encode("utf-8")).digest()
    return f"'sha256-{base64.b64encode(digest).decode('ascii')}'"
