"""The console in a browser shows a fleet, plans its routes together, and holds all of it."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from tests.ros.test_console import CONSOLE, MINE, READY, address_of, on_map, waypoints
from tests.support.processes import Process
from tests.support.ros.browser import CHROMIUM, Browser, Tab
from tests.support.ros.ros_fleet import FleetFlight, FleetVehicle, two_ports
from tests.support.ros.ros_flight import READY_TIMEOUT_S

pytestmark = [
    pytest.mark.wide,
    pytest.mark.xdist_group("console"),
    pytest.mark.skipif(
        CHROMIUM is None, reason="no Chromium here (apt install chromium), so no page can be opened"
    ),
]
_REHEARSED_S = 90.0
_FLIGHT_S = 60.0
VEHICLES = ("/copter", "/px4", "/rover")
EAST_M = 18.15
"""Each stands so far east of the one before"""
ASKS_ABOUT_DANGER = "document.getElementById('confirm').classList.contains('danger')"
ASKS = f"!document.getElementById('confirm').hidden && !{ASKS_ABOUT_DANGER}"
SEPARATION = "document.getElementById('separation').dataset.state"


@pytest.fixture(scope="module")
def fleet(tmp_path_factory: pytest.TempPathFactory) -> Iterator[FleetFlight]:
    shared, other = two_ports()
    flight = FleetFlight(
        tmp_path_factory.mktemp("fleet"),
        (
            FleetVehicle("copter", 1, (), shared),
            FleetVehicle("px4", 2, ("--autopilot", "px4"), shared),
            FleetVehicle("rover", 3, ("--vehicle", "rover"), other),
        ),
    )
    yield flight
    flight.close()


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    made = Browser(tmp_path_factory.mktemp("browser"))
    yield made
    made.close()


@pytest.fixture(scope="module")
def console(fleet: FleetFlight) -> Iterator[str]:
    process = Process("navigation_console", CONSOLE, fleet.environment)
    yield address_of(process)
    process.stop()


@pytest.fixture
def page(browser: Browser, console: str) -> Iterator[Tab]:
    """A page that has control of three vehicles, all of which it shows."""
    tab = browser.open(console)
    try:
        tab.wait(READY, READY_TIMEOUT_S)
        tab.wait("document.querySelectorAll('#fleet button').length === 3", READY_TIMEOUT_S)
        push(tab, "take-all")
        tab.wait("[...document.querySelectorAll('#fleet .control')].every((each) =>"
                 " each.textContent === 'yours')")  # fmt: skip
        tab.wait(f"document.getElementById('map').dataset.view && {MINE}")
        yield tab
    finally:
        tab.press("Escape", "Escape")
        tab.click("hold-all")
        tab.wait(" && ".join(idle(name) for name in VEHICLES), _FLIGHT_S)
        tab.close()


def card(name: str) -> str:
    return f"document.querySelector('#fleet button[data-vehicle=\"{name}\"]')"


def idle(name: str) -> str:
    return f"{card(name)}.dataset.goal === ''"


def is_chosen(name: str) -> str:
    return f"{card(name)}.getAttribute('aria-pressed') === 'true'"


def push(tab: Tab, element: str) -> None:
    """Push a button among texts that come and go."""
    tab.wait(f"!document.getElementById('{element}').disabled")
    tab.value(f"document.getElementById('{element}').click()")


def choose(tab: Tab, name: str) -> None:
    tab.click_on(f'#fleet button[data-vehicle="{name}"]')
    tab.wait(is_chosen(name))
    tab.click("fit")


def test_the_strip_shows_all_and_a_click_on_it_or_on_the_map_selects(page: Tab) -> None:
    page.wait("document.getElementById('fleet-list').textContent.includes('100 %')")
    for name in VEHICLES:
        page.wait(f"{card(name)}.textContent.includes('%')")
        text = page.value(f"{card(name)}.textContent")
        assert name.removeprefix("/") in text
        assert "No goal" in text
    choose(page, "/copter")
    assert page.text("vehicle") == "copter"
    assert "ArduCopter" in page.text("facts")
    page.drag(on_map(page, 4.0, 6.0))
    assert len(waypoints(page)) == 1
    assert "Route drawn" in page.value(f"{card('/copter')}.textContent")
    # Fit has shown all of them: the others stand east of it.
    left, top, width, height = page.box("map")
    for number in range(3):
        x, y = on_map(page, number * EAST_M, 0.0)
        assert left < x < left + width
        assert top < y < top + height
    page.drag(on_map(page, EAST_M, 0.0))
    page.wait(is_chosen("/px4"))
    page.wait("document.getElementById('facts').textContent.includes('PX4')")
    # The other's route is kept, and not this one's.
    assert waypoints(page) == []
    choose(page, "/copter")
    assert waypoints(page)[0][:2] == pytest.approx([4.0, 6.0], abs=0.3)
    page.click("clear")


def test_hold_all_is_the_largest_button_at_every_width(page: Tab) -> None:
    sizes = (
        "JSON.stringify([...document.querySelectorAll('button')].map((each) =>"
        " each.getBoundingClientRect()).map((box) => box.width * box.height)"
        ".sort((a, b) => b - a).slice(0, 2))"
    )
    for width in (1400, 1024, 400):
        page.resize(width, 800)
        page.wait(f"innerWidth === {width}")
        left, top, wide, high = page.box("hold-all")
        assert f"[{wide * high:.0f}" == page.value(sizes).split(".")[0].split(",")[0]
        assert left >= 0
        assert left + wide <= width
        assert top + high <= 800
        assert page.value("document.documentElement.scrollWidth") == width
    page.resize(1400, 900)
    page.wait("innerWidth === 1400")


def draw_routes(tab: Tab, up_m: float) -> None:
    """Draw a route for the copter, and one for the other one that leads back along it."""
    choose(tab, "/copter")
    for east_m in (6.0, 14.0):
        tab.drag(on_map(tab, east_m, 6.0))
    tab.value(
        "(() => { for (const up of document.querySelectorAll('[aria-label^=\"Up of\"]'))"
        f" {{ up.value = {up_m}; up.dispatchEvent(new Event('change')); }} }})()"
    )
    choose(tab, "/px4")
    for east_m in (14.0 - EAST_M, 6.0 - EAST_M):
        tab.drag(on_map(tab, east_m, 6.0))
    assert len(waypoints(tab)) == 2


def clear_routes(tab: Tab) -> None:
    for name in ("/copter", "/px4"):
        choose(tab, name)
        tab.click("clear")


def test_routes_that_meet_are_red_before_they_are_flown_and_asked_about_twice(page: Tab) -> None:
    draw_routes(page, 5.0)
    page.wait(f"{SEPARATION} === 'near'", _REHEARSED_S)
    text = page.text("separation")
    assert text.startswith("TOO NEAR: copter and px4 come to ")
    assert "5 m or 3 m are to be kept. The server has one of them wait." in text
    assert page.value("document.getElementById('separation').classList.contains('bad')")
    assert "copter: 2 waypoints. Rehearsed: " in page.text("together-routes")
    assert "px4: 2 waypoints. Rehearsed: " in page.text("together-routes")
    push(page, "fly-all")
    page.wait(ASKS_ABOUT_DANGER)
    assert "TOO NEAR: copter and px4" in page.text("confirm-text")
    page.press(" ", "Space", 1.8)
    page.wait(ASKS)
    assert "Fly all 2 together: copter the route of 2 waypoints and px4" in page.text(
        "confirm-text"
    )
    assert all(page.value(idle(name)) for name in VEHICLES)
    page.press("Escape", "Escape")
    clear_routes(page)


def test_routes_that_keep_apart_are_flown_together_and_all_are_held(page: Tab) -> None:
    draw_routes(page, 12.0)
    page.wait(f"{SEPARATION} === 'apart'", _REHEARSED_S)
    assert "copter and px4 come nearest" in page.text("separation")
    push(page, "fly-all")
    page.wait(ASKS)
    page.press(" ", "Space", 1.8)
    page.wait(f"!({idle('/copter')}) && !({idle('/px4')})", _FLIGHT_S)
    page.wait("/copter: .*accepted.*px4: .*accepted|px4: .*accepted.*copter: .*accepted/.test("
              "document.getElementById('answer').textContent)")  # fmt: skip
    # A route that is flown is no longer a draft.
    assert waypoints(page) == []
    page.wait("document.querySelector('#fleet').textContent.includes('In the air')", _FLIGHT_S)
    page.click("hold-all")
    page.wait(" && ".join(idle(name) for name in VEHICLES), _FLIGHT_S)
    page.wait("[...document.querySelectorAll('#fleet .goal')].every((each) =>"
              " each.textContent === 'No goal')")  # fmt: skip


def test_no_page_complained(browser: Browser) -> None:
    assert browser.errors() == []
