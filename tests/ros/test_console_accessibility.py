"""The console's page breaks no rule of axe-core, whatever it shows."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from drone_navigation.processes import ros_environment
from tests.ros.test_console import ACTIVE, CONSOLE, COPTER, MINE, READY, address_of, ends, on_map
from tests.support.processes import Process
from tests.support.ros.accessibility import violations_at_all_widths
from tests.support.ros.browser import CHROMIUM, Browser, Tab
from tests.support.ros.ros_fleet import FleetFlight, FleetVehicle, two_ports
from tests.support.ros.ros_flight import READY_TIMEOUT_S, navigate_goal, new_domain

pytestmark = [
    pytest.mark.wide,
    pytest.mark.xdist_group("console"),
    pytest.mark.skipif(
        CHROMIUM is None, reason="no Chromium here (apt install chromium), so no page can be opened"
    ),
]
_FLIGHT_S = 60.0
_REHEARSED_S = 30.0
CONFIRMS = "!document.getElementById('confirm').hidden"


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    made = Browser(tmp_path_factory.mktemp("browser"))
    yield made
    made.close()


@pytest.fixture(scope="module")
def fleet(tmp_path_factory: pytest.TempPathFactory) -> Iterator[FleetFlight]:
    """Two copters, of which one has an alert: its battery is below the reserve."""
    first, second = two_ports()
    low = ("--battery", "remaining=0.1,capacity=2000")
    made = FleetFlight(
        tmp_path_factory.mktemp("accessibility"),
        (FleetVehicle("copter", 1, (), first), FleetVehicle("low", 2, low, second)),
    )
    yield made
    made.close()


@pytest.fixture(scope="module")
def page(browser: Browser, fleet: FleetFlight) -> Iterator[Tab]:
    console = Process("navigation_console", CONSOLE, fleet.environment)
    try:
        tab = browser.open(address_of(console))
        tab.wait(READY, READY_TIMEOUT_S)
        yield tab
        tab.close()
    finally:
        console.stop()


def test_a_page_without_a_server(browser: Browser) -> None:
    console = Process("navigation_console", CONSOLE, ros_environment(new_domain()))
    try:
        tab = browser.open(address_of(console))
        tab.wait("document.getElementById('banner').textContent.includes('Waiting for')")
        assert violations_at_all_widths(tab) == []
        tab.close()
    finally:
        console.stop()


def test_a_fleet_with_an_alert_and_more_messages_than_fit(fleet: FleetFlight, page: Tab) -> None:
    page.wait("document.getElementById('alert-text').textContent.includes('below the reserve')")
    assert page.value("document.querySelectorAll('#fleet button').length") == 2
    page.value("document.getElementById('legend').open = true")
    events = "document.getElementById('events')"
    goal = navigate_goal(0.0, 0.0, 900.0)
    goal.target_pose.header.frame_id = "copter/map"
    for _ in range(12):
        assert not fleet.fly("copter", goal).accepted
    page.wait(f"{events}.scrollHeight > {events}.clientHeight")
    assert violations_at_all_widths(page) == []
    page.value("document.getElementById('legend').open = false")
    # It scrolls by keyboard: the map's cross does not take the arrows away.
    page.value(f"{events}.focus()")
    page.press("ArrowDown", "ArrowDown")
    page.wait(f"{events}.scrollTop > 0")


def test_a_route_its_confirmation_the_keys_and_a_rejection(page: Tab) -> None:
    page.press("v", "KeyV")
    page.wait(MINE)
    page.value("document.getElementById('map').focus()")
    for place in ((4.0, 3.0), (6.0, 3.0)):
        page.drag(on_map(page, *place))
    page.wait("document.getElementById('rehearsal').dataset.code === 'SUCCESS'", _REHEARSED_S)
    assert violations_at_all_widths(page) == []
    page.press("g", "KeyG")
    page.press("?", "Slash")
    page.wait(f"{CONFIRMS} && document.getElementById('keys').open")
    assert violations_at_all_widths(page) == []
    page.press("?", "Slash")
    page.press("Escape", "Escape")
    page.value(
        "(() => { const up = document.querySelectorAll('#waypoints input')[2];"
        " up.value = 900; up.dispatchEvent(new Event('change')); })()"
    )
    page.press("g", "KeyG")
    page.press(" ", "Space", 1.8)
    page.wait("!document.getElementById('fly-answer').hidden")
    assert violations_at_all_widths(page) == []
    page.click("clear")


def test_a_goal_in_flight_and_its_end_which_is_read_aloud_once(page: Tab) -> None:
    if not page.value(MINE):  # lost while axe-core kept the page busy for longer than its lease
        page.press("v", "KeyV")
        page.wait(MINE)
    before = ends(page)
    page.drag(on_map(page, 4.0, 8.0))
    page.press("g", "KeyG")
    page.wait(CONFIRMS)
    page.press(" ", "Space", 1.8)
    page.wait(ACTIVE)
    page.wait("document.getElementById('progress').dataset.status === 'NAVIGATING'", _FLIGHT_S)
    assert violations_at_all_widths(page) == []
    # It arrives by itself: on a busy machine the look at the page takes longer than the flight.
    page.wait(f"document.getElementById('end').dataset.number > {before}", _FLIGHT_S)
    assert violations_at_all_widths(page) == []
    assert page.text("end").partition(": ")[2] in page.text("answer")
    live = "document.getElementById('{}').{}"
    assert page.value(live.format("end", "role")) == "status"
    assert page.value(live.format("answer", "ariaLive")) == "off"


def test_a_server_that_is_dead(fleet: FleetFlight, page: Tab) -> None:
    fleet.server.stop(0.0)
    page.wait("document.getElementById('banner').textContent.includes('is silent')")
    assert page.value("document.querySelector('aside').classList.contains('old')")
    assert violations_at_all_widths(page) == []


def test_a_recorded_flight(browser: Browser) -> None:
    environment = ros_environment(new_domain())
    link = f"tlog:{COPTER}"
    server = ["python", "-m", "drone_navigation.navigation_server", "--link", link]
    processes = []
    try:
        for name, command in (("navigation_server", server), ("navigation_console", CONSOLE)):
            processes.append(Process(name, command, environment))
        tab = browser.open(address_of(processes[1]))
        tab.wait("!document.getElementById('replay').hidden", READY_TIMEOUT_S)
        assert violations_at_all_widths(tab) == []
        tab.close()
    finally:
        for process in reversed(processes):
            process.stop()
