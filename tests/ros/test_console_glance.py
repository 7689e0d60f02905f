"""The console in a browser is read at a glance, also on a phone, in the words of a pilot."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator

import pytest

from tests.ros.test_console import (
    ACTIVE,
    CONSOLE,
    IDLE,
    MINE,
    READY,
    address_of,
    ends,
    on_map,
    wait_for_end,
)
from tests.support.processes import Process
from tests.support.ros.browser import CHROMIUM, Browser, Tab
from tests.support.ros.ros_flight import READY_TIMEOUT_S, Flight, navigate_goal

pytestmark = [
    pytest.mark.wide,
    pytest.mark.xdist_group("console"),
    pytest.mark.skipif(
        CHROMIUM is None, reason="no Chromium here (apt install chromium), so no page can be opened"
    ),
]
_FLIGHT_S = 60.0
PHONE = (400, 800)
FINGER_PX = 44
# Words that no pilot uses: ids, codes, numbers of pages.
ODD = re.compile(
    r"[0-9a-f]{32}|[Pp]age \d|requests rejected|navigate_to|\b[A-Z]{2,}_[A-Z]{2,}\b"
    r"|\b(?:SUCCESS|PREEMPTED|CANCELED|NAVIGATING)\b|undefined|NaN|\bnull\b|-0\b"
)
SEEN = "document.body.innerText"
CONTROLS = (
    "JSON.stringify([...document.querySelectorAll('button, input, select, summary')]"
    ".filter((each) => each.getClientRects().length)"
    # A finger also hits the label of a check box.
    ".map((each) => [each, (each.type === 'checkbox' ? each.closest('label') : each)"
    ".getBoundingClientRect()])"
    ".map(([each, box]) => [each.id || each.textContent || each.ariaLabel, box.width, box.height]))"
)

_TOOLS = (
    "(({ x, y, width, height }) => [x, y, width, height])"
    "(document.querySelector('.tools').getBoundingClientRect())"
)


@pytest.fixture(scope="module")
def flight(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Flight]:
    made = Flight(tmp_path_factory.mktemp("console_glance"))
    yield made
    made.close()


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    made = Browser(tmp_path_factory.mktemp("browser"))
    yield made
    made.close()


@pytest.fixture(scope="module")
def console(flight: Flight) -> Iterator[str]:
    process = Process("navigation_console", CONSOLE, flight.environment)
    yield address_of(process)
    process.stop()


@pytest.fixture
def page(browser: Browser, console: str) -> Iterator[Tab]:
    """A page that has control of a vehicle without a goal."""
    tab = browser.open(console)
    try:
        tab.wait(READY, READY_TIMEOUT_S)
        tab.press("v", "KeyV")
        tab.wait(MINE)
        yield tab
    finally:
        tab.press("h", "KeyH")
        tab.wait(IDLE, _FLIGHT_S)
        tab.close()


def number(tab: Tab, readout: str) -> float:
    return float(tab.value(f"document.querySelector('#{readout} b').textContent"))


def is_on_screen(tab: Tab, element: str) -> bool:
    """Return whether the middle of an element is seen, and nothing covers it."""
    left, top, width, height = tab.box(element)
    width_px, height_px = tab.value("[innerWidth, innerHeight]")
    inside = left >= 0 and top >= 0 and left + width <= width_px and top + height <= height_px
    # The readouts let clicks through to the map.
    tab.value("document.getElementById('glance').style.pointerEvents = 'auto'")
    at = f"document.elementFromPoint({left + width / 2}, {top + height / 2})"
    seen = tab.value(f"document.getElementById('{element}').contains({at})")
    tab.value("document.getElementById('glance').style.pointerEvents = ''")
    return inside and bool(seen)


def test_how_the_goal_goes_is_read_over_the_map_also_on_a_phone(page: Tab) -> None:
    before = ends(page)
    page.value("document.getElementById('speed').value = '1'")
    page.drag(on_map(page, 0.0, 8.0))
    page.press("g", "KeyG")
    page.press(" ", "Space", 1.8)
    page.wait("document.getElementById('progress').dataset.status === 'NAVIGATING'", _FLIGHT_S)
    page.wait("Number(document.querySelector('#out-speed b').textContent) > 0.5", _FLIGHT_S)
    page.wait("Number(document.querySelector('#out-distance b').textContent) < 6", _FLIGHT_S)
    assert 2.0 < number(page, "out-height") < 6.0
    assert 50.0 < number(page, "out-battery") <= 100.0
    assert re.fullmatch(r"\d+ s|\d+:\d\d min", page.text("out-time").strip()), page.text("out-time")
    assert page.text("progress") == "Under way"
    assert re.fullmatch(r"35\.363\d{3}° S, 149\.165\d{3}° E", page.text("coordinates"))
    label = "document.getElementById('{}').getAttribute('aria-label')"
    # It flies north with its nose down.
    page.wait(f"/^Attitude: roll -?\\d+° (left|right), pitch \\d+° (up|down)$/.test("
              f"{label.format('horizon')})")  # fmt: skip
    page.wait(f"[0, 1, 2, 358, 359].includes(parseInt({label.format('compass')}.split(' ')[1]))")
    readouts = ("out-distance", "out-time", "out-speed", "out-height", "out-battery", "progress")
    for width, height in ((1400, 900), (1024, 768), PHONE):
        page.resize(width, height)
        page.wait(f"innerWidth === {width}")
        for each in (*readouts, "horizon", "compass", "coordinates"):
            assert is_on_screen(page, each), (width, each)
    # They stay where commands are given, further down.
    page.value("document.getElementById('land').scrollIntoView()")
    assert all(is_on_screen(page, each) for each in readouts)
    wait_for_end(page, before, "SUCCESS")
    page.wait("document.getElementById('answer').textContent.startsWith('Done: ')")
    assert page.value("document.getElementById('answer').getAttribute('role')") == "status"
    assert page.value("document.querySelector('#out-distance b').textContent") == "–"


def test_a_finger_hits_everything_on_a_phone_and_no_keyboard_is_asked_for(page: Tab) -> None:
    page.resize(*PHONE)
    page.wait(f"innerWidth === {PHONE[0]}")
    assert page.value("document.documentElement.scrollWidth") == PHONE[0]
    page.drag(on_map(page, 2.0, 3.0))
    page.click("fly")
    page.wait("!document.getElementById('confirm').hidden")
    small = [row for row in json.loads(page.value(CONTROLS)) if min(row[1:]) < FINGER_PX]
    assert small == []
    text = page.value(SEEN)
    assert "Slide" in text
    for word in ("space bar", "Keys", "Esc"):
        assert word not in text
    left, top, width, height = page.box("slide")
    middle = top + height / 2
    page.drag((left + 30, middle), (left + width / 2, middle), (left + width - 5, middle))
    page.wait(ACTIVE)


def test_every_sentence_is_one_that_a_pilot_would_say(flight: Flight, page: Tab) -> None:
    other = page.browser.open(page.value("location.href"))
    texts = []

    def look() -> None:
        texts.append(page.value(SEEN) + page.text("events") + page.text("rejected"))

    try:
        other.wait("document.getElementById('control').textContent === 'Another page has control'")
        texts.append(other.value(SEEN))
        other.press("v", "KeyV")
        texts.append(other.text("confirm-text"))
    finally:
        other.close()
    page.drag(on_map(page, 3.0, 3.0))
    page.wait("document.getElementById('rehearsal').dataset.code === 'SUCCESS'", _FLIGHT_S)
    look()
    page.value(
        "(() => { const up = document.querySelectorAll('#waypoints input')[2];"
        " up.value = 900; up.dispatchEvent(new Event('change')); })()"
    )
    page.wait("document.getElementById('rehearsal').textContent.includes('be rejected')", _FLIGHT_S)
    page.press("g", "KeyG")
    page.press(" ", "Space", 1.8)
    page.wait("!document.getElementById('fly-answer').hidden")
    look()
    page.click("clear")
    assert flight.send(navigate_goal(0.0, 40.0, 5.0, 2.0)).accepted
    page.wait("document.getElementById('progress').dataset.status === 'NAVIGATING'", _FLIGHT_S)
    look()
    first = page.value("document.body.dataset.goal")
    assert flight.send(navigate_goal(0.0, 50.0, 5.0, 2.0)).accepted
    page.wait(f"!['', '{first}'].includes(document.body.dataset.goal)")
    page.wait("document.getElementById('end').textContent.includes('another goal')")
    look()
    page.press("p", "KeyP")
    page.wait("document.getElementById('progress').dataset.status === 'PAUSED'", _FLIGHT_S)
    look()
    page.press("r", "KeyR")
    page.press(" ", "Space", 1.8)
    page.wait("document.getElementById('answer').textContent.includes('resumed')")
    look()
    page.press("c", "KeyC")
    page.wait(IDLE, _FLIGHT_S)
    look()
    page.press("b", "KeyB")
    page.press(" ", "Space", 1.8)
    page.wait("document.getElementById('answer').textContent.includes('return is accepted')")
    look()
    for text in texts:
        found = ODD.search(text)
        assert not found, text[max(0, found.start() - 80) : found.end() + 80]
    assert "from another program" in " ".join(texts)


def test_no_page_complained(browser: Browser) -> None:
    assert browser.errors() == []


@pytest.mark.parametrize("width", [1400, 1024, 400])
def test_fit_shows_a_route_clear_of_what_lies_over_the_map(page: Tab, width: int) -> None:
    places = ((-12.0, 12.0), (14.0, 12.0), (0.0, -12.0))
    for _ in range(3):
        page.click("zoom-out")
    for place in places:
        page.drag(on_map(page, *place))
    page.wait("document.querySelectorAll('#waypoints li:not(.head)').length === 3")
    page.resize(width, 900)
    page.click("fit")
    covers = [page.box("glance")]
    covers.append(tuple(page.value(_TOOLS)))
    left, top, across, down = page.box("map")
    for east_m, north_m in (*places, (0.0, 0.0)):
        x, y = on_map(page, east_m, north_m)
        assert left < x < left + across
        assert top < y < top + down
        for cover in covers:
            clear = not (
                cover[0] <= x <= cover[0] + cover[2] and cover[1] <= y <= cover[1] + cover[3]
            )
            assert clear, f"({east_m}, {north_m}) is below {cover}"
    page.click("clear")
    page.resize(1400, 900)
