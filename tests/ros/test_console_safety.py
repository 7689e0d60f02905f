"""The console in a browser warns of dangers before, during and at the end of a flight."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

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
from tests.support.ros.ros_flight import READY_TIMEOUT_S, Flight

pytestmark = [
    pytest.mark.wide,
    pytest.mark.xdist_group("console"),
    pytest.mark.skipif(
        CHROMIUM is None, reason="no Chromium here (apt install chromium), so no page can be opened"
    ),
]
ROOT = Path(__file__).resolve().parents[2]
CONFIG = ROOT / "bridge_config/simulated/ardupilot_copter.yaml"
WORLD = ROOT / "bridge_config/worlds/demo.yaml"
DANGER = "document.getElementById('rehearsal').dataset.danger"
ASKS_ABOUT_DANGER = "document.getElementById('confirm').classList.contains('danger')"
ASKS = f"!document.getElementById('confirm').hidden && !{ASKS_ABOUT_DANGER}"
_REHEARSED_S = 30.0
_FLIGHT_S = 60.0


@pytest.fixture(scope="module")
def flight(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Flight]:
    """A copter before a hoarding, which its scanner sees from the ground."""
    folder = tmp_path_factory.mktemp("console_safety")
    # Its battery is below the reserve soon after the take-off.
    simulator = ("--world", str(WORLD), "--battery", "remaining=0.22,capacity=2000")
    server = ("--config", str(CONFIG), "--ros-args", "-p", "battery_policy:=ignore", "--")
    made = Flight(folder, *server, simulator=simulator)
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
    """A page that has control of a vehicle without a goal, and knows its obstacles."""
    tab = browser.open(console)
    try:
        tab.wait(READY, READY_TIMEOUT_S)
        tab.press("v", "KeyV")
        tab.wait(MINE)
        tab.wait("document.getElementById('avoid').checked")
        yield tab
    finally:
        tab.press("h", "KeyH")
        tab.wait(IDLE, _FLIGHT_S)
        tab.close()


def visible(tab: Tab, element: str) -> bool:
    return not tab.value(f"document.getElementById('{element}').hidden")


def test_what_is_sensed_is_avoided_by_default_and_no_danger(page: Tab) -> None:
    page.drag(on_map(page, -2.0, 12.0))
    page.wait("document.getElementById('rehearsal').dataset.code === 'SUCCESS'", _REHEARSED_S)
    assert page.value(DANGER) == ""
    assert "Not considered: the wind" in page.text("rehearsal")
    page.press("g", "KeyG")
    page.wait(ASKS)


def test_commands_that_make_no_sense_are_disabled_and_say_why(page: Tab) -> None:
    disabled = "document.getElementById('{}').disabled"
    assert [page.value(disabled.format(each)) for each in ("takeoff", "land", "pause", "resume")] \
        == [False, True, True, True]  # fmt: skip
    page.press("r", "KeyR")
    assert page.text("command-answer") == "There is no paused goal."
    assert not visible(page, "confirm")


def test_the_reason_of_a_rejection_stands_beside_the_button(page: Tab) -> None:
    page.drag(on_map(page, 0.0, 4.0))
    page.value(
        "(() => { const up = document.querySelectorAll('#waypoints input')[2];"
        " up.value = 900; up.dispatchEvent(new Event('change')); })()"
    )
    page.press("g", "KeyG")
    page.press(" ", "Space", 1.8)
    page.wait("!document.getElementById('fly-answer').hidden")
    assert page.text("fly-answer").startswith("Rejected: The target ")
    _, top, _, _ = page.box("fly-answer")
    _, button, _, _ = page.box("fly")
    assert 0.0 < button - top < 120.0


def test_a_danger_that_the_rehearsal_finds_late_is_asked_about_before_the_flight(
    page: Tab,
) -> None:
    page.click("avoid")
    page.drag(on_map(page, -2.0, 12.0))
    page.press("g", "KeyG")
    page.wait(ASKS)
    assert "It is not rehearsed yet." in page.text("confirm-text")
    page.wait(ASKS_ABOUT_DANGER, _REHEARSED_S)
    page.press("Escape", "Escape")
    assert page.value(IDLE)


def test_a_flight_into_a_wall_is_red_asked_about_twice_and_its_end_is_told(page: Tab) -> None:
    before = ends(page)
    page.click("avoid")
    page.drag(on_map(page, -2.0, 12.0))
    page.wait(f"{DANGER} !== ''", _REHEARSED_S)
    assert page.value("document.getElementById('rehearsal').classList.contains('bad')")
    # The hoarding reaches from 9 m west to 1 m east, 9 m north.
    assert "it would hit a sensed obstacle after 13 m, at east -1, north 8" in page.value(DANGER)
    page.press("g", "KeyG")
    page.wait(ASKS_ABOUT_DANGER)
    assert page.value(DANGER) in page.text("confirm-text")
    page.press(" ", "Space", 1.8)
    page.wait(ASKS)
    assert page.value(IDLE)
    page.press(" ", "Space", 1.8)
    page.wait(ACTIVE)
    page.wait("document.getElementById('remarks').textContent.includes('straight legs hit')")
    # The warning comes by a topic of its own, perhaps after the remark.
    page.wait("document.getElementById('events').textContent.includes('straight legs hit')")
    page.wait("document.getElementById('alert-text').textContent.includes('below the reserve')",
              _FLIGHT_S)  # fmt: skip
    page.press("a", "KeyA")
    assert not visible(page, "alerts")
    wait_for_end(page, before, "DISARMED")
    assert "Crash: hit hoarding" in page.text("end")
    page.wait("document.getElementById('answer').textContent.includes('Crash: hit hoarding')")
    page.wait("document.getElementById('alert-text').textContent.includes('Crash: hit hoarding')")
    assert visible(page, "alerts")
    width = page.value("document.getElementById('alerts').getBoundingClientRect().width")
    assert width == page.value("innerWidth")
    page.click("acknowledge")
    assert not visible(page, "alerts")


def test_what_a_silent_server_reported_is_old_and_hold_says_that_it_reaches_nothing(
    flight: Flight, page: Tab
) -> None:
    assert not visible(page, "age")
    assert flight.server is not None
    flight.server.stop(0.0)
    page.wait("!document.getElementById('age').hidden")
    page.wait(r"/^\d+ s old$/.test(document.getElementById('age').textContent)")
    assert page.value("document.querySelector('aside').classList.contains('old')")
    assert page.value("getComputedStyle(document.querySelector('#facts dd')).fontStyle") == "italic"
    assert page.text("hold-note") == "cannot reach the vehicle"
    page.press("h", "KeyH")
    page.wait("document.getElementById('answer').textContent.startsWith("
              "'HOLD cannot reach the vehicle: the navigation server is silent')")  # fmt: skip
    flight.server = flight.start_server()
    page.wait("document.getElementById('age').hidden", READY_TIMEOUT_S)
    assert not visible(page, "hold-note")


def test_no_page_complained(browser: Browser) -> None:
    assert browser.errors() == []
