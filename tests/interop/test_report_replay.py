"""The map of a report in a browser: a flight is played, and plots, tables and map share a time."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import urlsplit

import numpy as np
import pytest

from flight_reports.analysis.flight import Flight, read_flights
from flight_reports.contents.log_reader import read_log
from flight_reports.navigation_report import main
from tests.support.ros.browser import CHROMIUM, Browser, Tab

pytestmark = [
    pytest.mark.wide_but_first,
    pytest.mark.xdist_group("report_replay"),
    pytest.mark.skipif(
        CHROMIUM is None, reason="no Chromium here (apt install chromium), so no page can be opened"
    ),
]
DATA = Path(__file__).resolve().parents[1] / "data"
COPTER, ROVER = DATA / "copter_lowbatt.tlog", DATA / "rover_guided.tlog"
TIME = "Number(document.querySelector('.player').dataset.time)"
SHOWN = "document.querySelector('.map').dataset.at"


@pytest.fixture(scope="module")
def flight() -> Flight:
    return read_flights(read_log(COPTER))[0]


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    browser = Browser(tmp_path_factory.mktemp("browser"))
    yield browser
    browser.close()


@pytest.fixture(scope="module")
def report(browser: Browser, tmp_path_factory: pytest.TempPathFactory) -> Tab:
    page = tmp_path_factory.mktemp("report") / "report.html"
    assert main([str(COPTER), "--out", str(page)]) == 0
    return opened(browser, page)


def opened(browser: Browser, page: Path) -> Tab:
    """Return a report whose plots and maps are drawn."""
    tab = browser.open(page.as_uri())
    tab.wait("document.documentElement.dataset.drawn > 0", 40.0)
    # A click must not come while the page still scrolls.
    tab.value("document.documentElement.style.scrollBehavior = 'auto'")
    return tab


def paused(tab: Tab, time_s: float) -> None:
    """Let time pass on the page."""
    expression = f"new Promise((done) => setTimeout(done, {1000.0 * time_s}))"
    tab.call("Runtime.evaluate", awaitPromise=True, expression=expression)


def click_in_plot(tab: Tab, section: str, share: float) -> None:
    """Click in a plot, at a share of the time that is shown, and wait for its effect."""
    plot = f"document.getElementById('{section}-time')"
    tab.value(f"{plot}.scrollIntoView()")
    left, top, width, _ = tab.box(f"{section}-time")
    margin, begin, end = tab.value(
        f"(({{ margin, xaxis }}) => [margin, ...xaxis.range])({plot}.layout)"
    )
    at = left + margin["l"] + share * (width - margin["l"] - margin["r"])
    # Plotly takes a click for where the mouse was seen last, which it looks at now and then only;
    # two clicks at once are its double click, which shows all.
    tab.point_at((at, top + 250.0))
    paused(tab, 0.6)
    tab.drag((at, top + 250.0))
    tab.wait(f"Math.abs({TIME} - {begin + share * (end - begin)}) < 0.5", 5.0)


def assert_vehicle_is_where_it_was(tab: Tab, flight: Flight) -> None:
    time_s = tab.value(TIME)
    east, north, heading_deg = map(float, tab.value(SHOWN).split())
    track = flight.track
    place = [np.interp(time_s, track.time_s, track.position_enu_m[:, axis]) for axis in (0, 1)]
    assert (east, north) == pytest.approx(place, abs=0.1), time_s
    sent = flight.contents.of("GLOBAL_POSITION_INT", flight.source)
    assert sent is not None
    before = np.searchsorted(sent["time_s"], time_s) - 1
    known_deg = sent["hdg"][max(before - 3, 0) : before + 4] / 100.0
    assert np.abs((known_deg - heading_deg + 180.0) % 360.0 - 180.0).min() < 2.0


@pytest.mark.parametrize("share", [0.5, 0.65, 0.8])
def test_a_click_in_a_plot_leads_the_map_there(report: Tab, flight: Flight, share: float) -> None:
    click_in_plot(report, "v1-1", share)
    assert_vehicle_is_where_it_was(report, flight)
    # The line in the plots is at that time, too.
    now = report.value(
        "(() => { const b = document.querySelector('.now').getBoundingClientRect();"
        " return b.left + b.width / 2; })()"
    )
    left, _, width, _ = report.box("v1-1-time")
    assert now == pytest.approx(left + 64.0 + share * (width - 64.0 - 72.0), abs=2.0)


def test_it_plays_at_a_speed_and_stops(report: Tab, flight: Flight) -> None:
    click_in_plot(report, "v1-1", 0.5)
    report.value(
        "(() => { const s = document.querySelector('.player select'); s.value = '10';"
        " s.dispatchEvent(new Event('change')); })()"
    )
    before_s = report.value(TIME)
    report.click_on(".player button")
    report.wait(f"{TIME} > {before_s} + 5.0")
    report.click_on(".player button")
    assert report.value("document.querySelector('.player button').textContent") == "Play"
    stopped_s = report.value(TIME)
    assert_vehicle_is_where_it_was(report, flight)
    paused(report, 0.2)
    assert report.value(TIME) == stopped_s


def test_slider_table_and_the_flown_line_set_the_time(report: Tab, flight: Flight) -> None:
    slider = "document.querySelector('.player input')"
    report.value(f"({slider}.value = 70, {slider}.dispatchEvent(new Event('input')))")
    assert report.value(TIME) == 70.0
    assert_vehicle_is_where_it_was(report, flight)
    link = "document.querySelector('a.at')"
    wanted = float(report.value(f"{link}.dataset.time"))
    report.click_on("a.at")
    report.wait(f"Math.abs({TIME} - {wanted}) < 0.01")
    # Halfway up the first leg: it was there at one time only.
    report.value("document.querySelector('.map').scrollIntoView()")
    x, y, scale = map(float, report.value("document.querySelector('.map').dataset.view").split())
    left, top, width, height = report.box("v1-1-map")
    place = (left + width / 2 + (0.0 - x) * scale, top + height / 2 - (12.0 - y) * scale)
    report.drag(place)
    report.wait(f"{TIME} > 41 && {TIME} < 62")
    east, north, _ = map(float, report.value(SHOWN).split())
    assert math.hypot(east, north - 12.0) < 1.5
    assert_vehicle_is_where_it_was(report, flight)


def test_both_vehicles_of_a_comparison_move(browser: Browser, tmp_path: Path) -> None:
    page = tmp_path / "both.html"
    assert main(["--compare", str(COPTER), str(ROVER), "--out", str(page)]) == 0
    tab = opened(browser, page)
    vehicles = (
        "[...document.querySelectorAll('.vehicle:not([hidden])')].map((v) => v.style.transform)"
    )
    click_in_plot(tab, "ab", 0.35)
    before = tab.value(vehicles)
    click_in_plot(tab, "ab", 0.45)
    after = tab.value(vehicles)
    assert len(before) == len(after) == 2
    assert before[0] != after[0]
    assert before[1] != after[1]
    tab.close()


def test_no_page_complained_or_asked_for_anything(browser: Browser, report: Tab) -> None:
    assert report.text("errors") == ""
    assert browser.errors() == []
    assert {urlsplit(a).scheme for a in browser.requests() - {"about:blank"}} == {"file"}
