"""The console in a browser: a simulated vehicle is flown by clicks and keys, and by nobody else."""

from __future__ import annotations

import json
import re
import signal
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from socket import create_connection
from urllib.parse import urlsplit

import pytest
from websockets.exceptions import InvalidStatus
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Origin

from drone_navigation.processes import free_udp_port, ros_environment
from mavlink_vehicle.codec import make
from tests.support.messages.random_console_messages import FLY, MOVING, broken
from tests.support.processes import Process, patient_s
from tests.support.ros.browser import CHROMIUM, Browser, Tab, in_box
from tests.support.ros.ros_flight import READY_TIMEOUT_S, Flight, navigate_goal, new_domain
from tests.support.ros.target_publisher import TargetPublisher
from tests.support.stations import missions
from tests.support.stations.pymavlink_station import PymavlinkStation

pytestmark = [
    pytest.mark.wide,
    pytest.mark.xdist_group("console"),
    pytest.mark.skipif(
        CHROMIUM is None, reason="no Chromium here (apt install chromium), so no page can be opened"
    ),
]
COPTER = Path(__file__).resolve().parents[1] / "data/copter_lowbatt.tlog"
CONSOLE = ["python", "-m", "drone_navigation.navigation_console", "--no-browser"]
_FLIGHT_S = 60.0
_REHEARSED_S = 30.0
READY = "document.body.dataset.ready === 'true'"
MINE = "document.body.dataset.control === 'mine'"
IDLE = "document.body.dataset.goal === ''"
ACTIVE = "document.body.dataset.goal !== ''"


@dataclass
class Scene:
    """A flight, a console and a ground station beside it, and a browser."""

    flight: Flight
    station: PymavlinkStation
    console: Process
    address: str
    browser: Browser

    @property
    def origin(self) -> str:
        """Scheme, name and port of the console."""
        return self.address.partition("/?")[0]

    @property
    def socket(self) -> str:
        """Address of its WebSocket."""
        return self.address.replace("http", "ws", 1).replace("/?", "/socket?")

    def connected(self) -> ClientConnection:
        """Return a page that is no browser's."""
        # Reads all the time, also what a test does not ask for.
        return connect(self.socket, origin=Origin(self.origin), max_queue=None)


def address_of(console: Process) -> str:
    """Return where a console that starts can be opened."""
    found = re.search(r"http://\S+", console.wait_for("The console is at", READY_TIMEOUT_S))
    assert found is not None
    return found[0]


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Scene]:
    folder = tmp_path_factory.mktemp("console")
    port = free_udp_port()
    links = f"gcs_links:=['udpin://127.0.0.1:{port}']"
    has = ("PLND_ENABLED=1", "PLND_TYPE=1", "CAM1_TYPE=1", "MNT1_TYPE=1")
    equipment = tuple(word for each in has for word in ("--param", each))
    flight = Flight(folder, "--ros-args", "-p", links, "--", simulator=equipment)
    station = PymavlinkStation(port)
    console = Process("navigation_console", CONSOLE, flight.environment)
    browser = None
    try:
        browser = Browser(folder / "browser")
        yield Scene(flight, station, console, address_of(console), browser)
    finally:
        if browser is not None:
            browser.close()
        console.stop()
        station.close()
        flight.close()


@pytest.fixture
def on_the_ground(scene: Scene) -> None:
    """Before a page is opened: waypoints of one that is opened in the air are as high as it."""
    scene.flight.ground()


@pytest.fixture
def page(scene: Scene) -> Iterator[Tab]:
    """A page that has control of a vehicle without a goal."""
    tab = scene.browser.open(scene.address)
    try:
        tab.wait(READY, READY_TIMEOUT_S)
        tab.press("v", "KeyV")
        tab.wait(MINE)
        yield tab
    finally:
        tab.press("h", "KeyH")
        tab.wait(IDLE, _FLIGHT_S)
        tab.close()


def on_map(tab: Tab, east_m: float, north_m: float) -> tuple[float, float]:
    """Return where a place is on the page, in pixels, once the map stands still.

    It moves while texts above it come and go, and when vehicles appear on it.
    """

    def shown() -> tuple[str, tuple[float, float, float, float]]:
        left, top, width, height = tab.box("map")
        view = tab.value("document.getElementById('map').dataset.view")
        return view, (left, top, width, height)

    before, now = None, shown()
    deadline_s = time.monotonic() + 10.0
    while now != before and time.monotonic() < deadline_s:
        time.sleep(0.3)
        before, now = now, shown()
    return in_box(now[1], now[0], east_m, north_m)


def waypoints(tab: Tab) -> list[list[float]]:
    """Return the numbers in the list of waypoints."""
    values: list[list[float]] = tab.value(
        "[...document.querySelectorAll('#waypoints li:not(.head)')].map((row) =>"
        " [...row.querySelectorAll('input')].map((input) => input.valueAsNumber))"
    )
    return values


PAUSED = "document.body.dataset.replay === 'paused'"
TRAIL = "document.getElementById('map').dataset.trail"
AT = "document.getElementById('replay-seek').valueAsNumber"


def ends(tab: Tab) -> int:
    return int(tab.value("document.getElementById('end').dataset.number"))


def wait_for_end(tab: Tab, before: int, code: str) -> None:
    tab.wait(f"document.getElementById('end').dataset.number > {before}", _FLIGHT_S)
    assert tab.value("document.getElementById('end').dataset.code") == code, tab.text("end")


@pytest.mark.usefixtures("on_the_ground")
def test_a_target_is_named_followed_lost_and_landed_on(scene: Scene, page: Tab) -> None:
    flight = scene.flight
    state = "document.getElementById('progress').dataset.target"
    before = ends(page)
    page.press("t", "KeyT")
    page.press(" ", "Space", 1.8)
    wait_for_end(page, before, "SUCCESS")
    assert page.value("document.getElementById('track').disabled")

    def follow(topic: str) -> None:
        page.value(
            "(() => { document.getElementById('target-ahead').value = '-5';"
            " const name = document.getElementById('target-name');"
            f" name.value = '{topic}'; name.dispatchEvent(new Event('input')); }})()"
        )
        page.click("track")
        page.wait("!document.getElementById('confirm').hidden")
        assert f"follow the topic {topic}, 5 m behind, 5 m above?" in page.text("confirm-text")
        page.press(" ", "Space", 1.8)

    follow("a//b")
    page.wait("!document.getElementById('track-answer').hidden")
    assert page.text("track-answer").startswith("Rejected: ")
    target = TargetPublisher(flight, (6.0, 3.0))
    before = ends(page)
    follow("/target")
    flight.wait(lambda: page.value(f"{state} === 'FOLLOWING'"), _FLIGHT_S, "the target")
    assert page.value("document.getElementById('track-answer').hidden")
    assert re.search(r"target \d+\.\d m away", page.text("progress"))
    east_m, north_m, _ = map(
        float, page.value("document.getElementById('map').dataset.target").split()
    )
    assert (east_m, north_m) == pytest.approx((8.0, 3.0), abs=0.3)
    target.is_silent = True
    flight.wait(lambda: page.value(f"{state} === 'LOST'"), _FLIGHT_S, "the loss")
    page.press("c", "KeyC")
    wait_for_end(page, before, "CANCELED")

    target.is_silent = False
    before = ends(page)
    page.value(
        "(() => { document.getElementById('land-target').value = '/target';"
        " document.getElementById('land-required').checked = true;"
        " document.getElementById('land-retries').value = '1'; })()"
    )
    page.click("land")
    page.wait("!document.getElementById('confirm').hidden")
    assert page.text("confirm-text") == (
        "Land on the target of /target, searching again 1 time, and hold without it, with vehicle?"
    )
    page.press(" ", "Space", 1.8)
    end = f"document.getElementById('end').dataset.number > {before}"
    flight.wait(lambda: page.value(end), _FLIGHT_S, "the landing")
    target.is_silent = True
    assert "from the target" in page.text("end")
    assert page.value("document.getElementById('end').dataset.code") == "SUCCESS"


@pytest.mark.usefixtures("on_the_ground")
def test_a_goal_is_clicked_confirmed_by_keyboard_and_flown(page: Tab) -> None:
    before = ends(page)
    page.wait("/% lost, [0-9.]+ ms/.test(document.getElementById('facts').textContent)")
    page.drag(on_map(page, 4.0, 3.0))
    ((east_m, north_m, up_m, hold_s),) = waypoints(page)
    assert (east_m, north_m) == pytest.approx((4.0, 3.0), abs=0.3)
    assert (up_m, hold_s) == (5.0, 0.0)
    page.click("fly")
    page.wait("!document.getElementById('confirm').hidden")
    # Too short, and then a click on the slide: neither is a confirmation.
    page.press(" ", "Space", 0.4)
    page.click("slide")
    assert not page.value("document.getElementById('confirm').hidden")
    assert page.value(IDLE)
    page.press(" ", "Space", 1.8)
    page.wait(ACTIVE)
    assert page.value("document.getElementById('confirm').hidden")
    wait_for_end(page, before, "SUCCESS")
    assert "Accepted from this page: " in page.text("events")


def test_a_goal_is_rehearsed_before_it_is_confirmed(page: Tab) -> None:
    code = "document.getElementById('rehearsal').dataset.code"
    page.drag(on_map(page, 12.0, 8.0))
    page.wait(f"{code} === 'SUCCESS'", _REHEARSED_S)
    # Unknown until a flight has measured the consumption.
    assert re.search(r"battery (unknown|\d+ %) at the end", page.text("rehearsal"))
    page.wait("document.getElementById('rehearsal').dataset.lost !== ''")
    assert "Link lost half way" in page.text("rehearsal")
    page.value(
        "(() => { const up = document.querySelectorAll('#waypoints input')[2];"
        " up.value = 900; up.dispatchEvent(new Event('change')); })()"
    )
    page.wait(f"{code} !== '' && {code} !== 'SUCCESS'", _REHEARSED_S)
    assert "It would be rejected" in page.text("rehearsal")
    assert page.value(IDLE)
    page.value("document.getElementById('clear').click()")
    page.wait("document.getElementById('rehearsal').hidden")


def test_a_circle_is_drawn_rehearsed_and_flown(page: Tab) -> None:
    before = ends(page)
    page.drag(on_map(page, 6.0, 2.0))
    page.value(
        "(() => { const radius = document.getElementById('radius');"
        " radius.value = '-4'; radius.dispatchEvent(new Event('change')); })()"
    )
    page.wait("document.getElementById('rehearsal').dataset.code === 'SUCCESS'", _REHEARSED_S)
    page.press("g", "KeyG")
    page.wait("!document.getElementById('confirm').hidden")
    assert "clockwise on a circle of 4 m around east 6" in page.text("confirm-text")
    page.press(" ", "Space", 1.8)
    page.wait(ACTIVE)
    # The next waypoint is a goal again.
    assert page.value("document.getElementById('radius').value") == "0"
    wait_for_end(page, before, "SUCCESS")
    assert "Went round 1 times" in page.text("end")


@pytest.mark.usefixtures("on_the_ground")
def test_a_survey_is_drawn_computed_rehearsed_and_flown(page: Tab) -> None:
    before = ends(page)
    corners = ((4.0, 0.0), (16.0, 0.0), (16.0, 9.0), (4.0, 9.0))
    for corner in corners[:2]:
        page.drag(on_map(page, *corner))
    assert page.value("document.getElementById('survey').disabled")
    for corner in (corners[3], corners[2]):
        page.drag(on_map(page, *corner))
    page.value("document.getElementById('spacing').value = '3'")
    page.click("survey")
    page.wait("!document.getElementById('survey-answer').hidden")
    assert page.text("survey-answer").startswith("INVALID_WAYPOINTS: ")
    for _ in range(2):
        page.press("u", "KeyU")
    for corner in corners[2:]:
        page.drag(on_map(page, *corner))
    page.press("y", "KeyY")
    page.wait(
        "document.getElementById('answer').textContent.startsWith('The survey is on the map')"
    )
    assert re.search(r"map: 1[01]\d m². \d+ waypoints, \d+ m, \d+ s\.", page.text("answer"))
    assert page.value("document.getElementById('survey-answer').hidden")
    lines = waypoints(page)
    assert len(lines) >= 6
    assert {up_m for _, _, up_m, _ in lines} == {5.0}
    # Other lines over the same area, and back.
    page.value("document.getElementById('spacing').value = '4.5'")
    page.click("survey")
    page.wait(f"document.querySelectorAll('#waypoints li:not(.head)').length < {len(lines)}")
    page.press("u", "KeyU")
    assert waypoints(page) == lines
    page.wait("document.getElementById('rehearsal').dataset.code === 'SUCCESS'", _REHEARSED_S)
    page.press("g", "KeyG")
    page.wait("!document.getElementById('confirm').hidden")
    assert f"the survey by {len(lines)} waypoints" in page.text("confirm-text")
    page.press(" ", "Space", 1.8)
    page.wait(ACTIVE)
    # Interrupted after two waypoints, and continued from the leg that was left.
    page.wait("/waypoint [3-9]/.test(document.getElementById('progress').textContent)", _FLIGHT_S)
    assert page.value("document.getElementById('continue').disabled")
    page.press("c", "KeyC")
    wait_for_end(page, before, "CANCELED")
    page.wait("!document.getElementById('continue').disabled")
    page.press("k", "KeyK")
    page.wait("!document.getElementById('confirm').hidden")
    found = re.search(r"route at waypoint (\d+) of (\d+)", page.text("confirm-text"))
    assert found is not None, page.text("confirm-text")
    assert 2 <= int(found[1]) < int(found[2]) == len(lines)
    before = ends(page)
    page.press(" ", "Space", 1.8)
    page.wait(ACTIVE)
    wait_for_end(page, before, "SUCCESS")
    assert page.value("document.getElementById('continue').disabled")


def test_a_route_is_slid_dragged_in_flight_and_cancelled(page: Tab) -> None:
    before = ends(page)
    page.value("document.getElementById('speed').value = '0.5'")  # it flies while it is dragged
    for place in ((10.0, 0.0), (10.0, 8.0), (-6.0, 8.0)):
        page.drag(on_map(page, *place))
    assert len(waypoints(page)) == 3
    page.press("g", "KeyG")
    page.wait("!document.getElementById('confirm').hidden")
    left, top, width, height = page.box("slide")
    middle = top + height / 2
    page.drag((left + 30, middle), (left + width / 2, middle), (left + width - 5, middle))
    page.wait(ACTIVE)
    page.wait("document.getElementById('progress').dataset.status === 'NAVIGATING'", _FLIGHT_S)
    first = page.value("document.body.dataset.goal")
    page.drag(on_map(page, -6.0, 8.0), on_map(page, -5.0, 9.0), on_map(page, -3.0, 10.0))
    moved = waypoints(page)
    assert moved[-1][:2] == pytest.approx([-3.0, 10.0], abs=0.3)
    # Nothing is sent before it is confirmed.
    assert page.value("document.body.dataset.goal") == first
    page.press("g", "KeyG")
    page.press(" ", "Space", 1.8)
    page.wait(f"document.body.dataset.goal !== '{first}' && {ACTIVE}")
    before = ends(page)
    page.press("c", "KeyC")
    wait_for_end(page, before, "CANCELED")


def test_waypoints_are_inserted_raised_deleted_and_undone_by_keyboard(page: Tab) -> None:
    page.value("document.getElementById('map').focus()")
    page.press("ArrowRight", "ArrowRight")
    page.press("Enter", "Enter")
    page.press("ArrowUp", "ArrowUp")
    page.press("Enter", "Enter")
    page.press("i", "KeyI")
    page.press("PageUp", "PageUp")
    assert len(waypoints(page)) == 3
    high = waypoints(page)[2][2]
    page.press("Delete", "Delete")
    assert len(waypoints(page)) == 2
    page.press("u", "KeyU")
    assert waypoints(page)[2][2] == high
    while page.value("!document.getElementById('undo').disabled"):
        page.press("u", "KeyU")
    assert waypoints(page) == []


def on_side(tab: Tab, number: int) -> tuple[float, float]:
    """Return where a waypoint, counted from 0, is in the side view, in pixels of the page."""
    tab.wait(f"JSON.parse(document.getElementById('side').dataset.marks).length > {number}")
    x, y = json.loads(tab.value("document.getElementById('side').dataset.marks"))[number]
    left, top, _, _ = tab.box("side")
    return left + x, top + y


def clear(tab: Tab) -> None:
    tab.click("clear")
    assert waypoints(tab) == []


def test_waypoints_are_inserted_selected_deleted_and_undone_by_mouse(page: Tab) -> None:
    for place in ((-12.0, 0.0), (12.0, 0.0)):
        page.drag(on_map(page, *place))
    page.drag(on_map(page, 0.0, 0.0))  # on the line between the two
    assert [point[:2] for point in waypoints(page)][1] == pytest.approx([0.0, 0.0], abs=0.3)
    page.drag(on_map(page, 6.0, 0.0), on_map(page, 6.0, 4.0), on_map(page, 6.0, 8.0))
    assert len(waypoints(page)) == 4
    assert waypoints(page)[2][:2] == pytest.approx([6.0, 8.0], abs=0.3)
    page.drag(on_map(page, -12.0, 0.0))
    selected = "[...document.querySelectorAll('#waypoints li')].findIndex((row) =>"
    assert page.value(f"{selected} row.classList.contains('selected'))") == 1
    page.click_on("#waypoints li:nth-child(3) button:last-child")
    assert len(waypoints(page)) == 3
    page.click("undo")
    assert len(waypoints(page)) == 4
    page.click_on("#waypoints li:nth-child(2) button:nth-last-child(2)")
    assert len(waypoints(page)) == 5
    page.drag(on_map(page, 12.0, 0.0), on_map(page, 12.0, -3.0), on_map(page, 12.0, -5.0))
    assert waypoints(page)[-1][:2] == pytest.approx([12.0, -5.0], abs=0.3)
    # A drag is one step back.
    page.click("undo")
    assert waypoints(page)[-1][:2] == pytest.approx([12.0, 0.0], abs=0.3)
    clear(page)


def test_heights_are_dragged_in_the_side_view_and_undone(page: Tab) -> None:
    for place in ((8.0, 0.0), (8.0, 8.0)):
        page.drag(on_map(page, *place))
    x, y = on_side(page, 1)
    page.drag((x, y), (x, y - 8), (x, y - 20), (x, y - 30))
    low, high = (point[2] for point in waypoints(page))
    assert low == 5.0
    assert high > 6.0
    # It stays under the mouse when the scale follows.
    raised = on_side(page, 1)
    page.drag(raised, (raised[0], raised[1] + 10), (raised[0], raised[1] + 500))
    assert 0.0 <= waypoints(page)[1][2] < 1.0  # not below home
    page.press("u", "KeyU")
    assert waypoints(page)[1][2] == high
    page.press("u", "KeyU")
    assert [point[2] for point in waypoints(page)] == [5.0, 5.0]
    page.press("PageDown", "PageDown")
    page.press("PageDown", "PageDown")
    assert sorted(point[2] for point in waypoints(page)) == [3.0, 5.0]
    clear(page)


def test_a_hold_time_is_typed_and_steps_by_mouse_and_keyboard(page: Tab) -> None:
    page.drag(on_map(page, 8.0, 0.0))
    page.value("document.querySelector('[aria-label=\"Hold s of waypoint 1\"]').focus()")
    page.value("document.activeElement.select()")
    page.type("12.5")
    page.press("Enter", "Enter")
    assert waypoints(page)[0][3] == 12.5
    page.press("ArrowUp", "ArrowUp")
    assert waypoints(page)[0][3] == 13.0
    page.value("document.getElementById('map').focus()")
    for wrong in ("-3", ""):
        page.value("document.querySelector('[aria-label=\"Hold s of waypoint 1\"]').focus()")
        page.value("document.activeElement.select()")
        page.type(wrong or "\b")
        page.value("document.getElementById('map').focus()")
        assert waypoints(page)[0][3] == 13.0
    # The browser may tell of both at once.
    while waypoints(page)[0][3]:
        page.press("u", "KeyU")
    assert waypoints(page)[0][:2] == pytest.approx([8.0, 0.0], abs=0.3)
    clear(page)


def test_a_survey_leaves_a_hole_out_and_has_photos(page: Tab) -> None:
    for place in ((8.0, 3.0), (12.0, 3.0), (10.0, 6.0)):
        page.drag(on_map(page, *place))
    page.click("hole")
    assert waypoints(page) == []
    for place in ((4.0, 0.0), (16.0, 0.0), (16.0, 9.0), (4.0, 9.0)):
        page.drag(on_map(page, *place))
    page.value(
        "(() => { document.getElementById('spacing').value = '0';"
        " document.getElementById('camera-focal').value = '8.8'; })()"
    )
    page.press("y", "KeyY")
    page.wait(
        "/map: 10\\d m\u00b2.* \\d+ photos/.test(document.getElementById('answer').textContent)"
    )
    page.press("n", "KeyN")
    assert "photos every " in page.text("act-list")
    page.value(
        "(() => { document.getElementById('spacing').value = '10';"
        " document.getElementById('camera-focal').value = '0'; })()"
    )
    page.click("clear")
    assert waypoints(page) == []


def test_a_photo_is_taken_the_camera_pointed_and_both_done_at_a_waypoint(page: Tab) -> None:
    before = ends(page)
    page.drag(on_map(page, 2.0, 2.0))
    page.drag(on_map(page, 5.0, 2.0))
    assert not page.value("document.getElementById('acts').hidden")
    assert page.text("acts-of") == "At waypoint 2"
    for kind in ("point", "photo"):
        page.value(
            "(() => { const kind = document.getElementById('act-kind');"
            f" kind.value = '{kind}'; kind.dispatchEvent(new Event('change')); }})()"
        )
        page.click("act-add")
    assert "camera 90° down" in page.text("act-list")
    page.value("document.getElementById('turn').value = '30'")
    page.press("g", "KeyG")
    page.wait("!document.getElementById('confirm').hidden")
    assert "of 2 waypoints, turning right with 30°/s" in page.text("confirm-text")
    page.press(" ", "Space", 1.8)
    page.wait(ACTIVE)
    wait_for_end(page, before, "SUCCESS")
    assert "Not done" not in page.text("end")
    photos = "Number(document.getElementById('map').dataset.photos)"
    page.wait(f"{photos} === 1")
    page.click("photo")
    page.wait(f"{photos} === 2")
    answer = "document.getElementById('answer').textContent"
    page.wait(f"{answer} === 'The camera was triggered.'")
    page.click("point")
    page.drag(on_map(page, 8.0, 6.0))
    assert waypoints(page) == []
    page.wait(f"{answer} === 'The gimbal points there.'")


def test_a_plan_is_saved_and_dropped_on_the_page(scene: Scene, page: Tab, tmp_path: Path) -> None:
    scene.browser.call("Browser.setDownloadBehavior", behavior="allow", downloadPath=str(tmp_path))
    page.drag(on_map(page, 3.0, 4.0))
    page.value("document.getElementById('map').focus()")
    page.press("n", "KeyN")
    page.press("PageUp", "PageUp")
    before = waypoints(page)
    page.press("s", "KeyS")
    file = tmp_path / "route.plan"
    for _ in range(200):
        if file.exists() and file.stat().st_size:
            break
        page.value("new Promise((done) => setTimeout(done, 50))")
        page.wait("true")
    text = file.read_text("utf-8")
    assert json.loads(text)["mission"]["items"][0]["params"][6] == pytest.approx(6.0, abs=0.1)
    page.press("Delete", "Delete")
    assert waypoints(page) == []
    page.value(
        "(() => { const data = new DataTransfer();"
        f" data.items.add(new File([{json.dumps(text)}], 'route.plan'));"
        " document.getElementById('map').dispatchEvent(new DragEvent('drop',"
        " { dataTransfer: data, bubbles: true, cancelable: true })); })()"
    )
    page.wait("document.querySelectorAll('#waypoints li').length === 2")
    assert waypoints(page)[0] == pytest.approx(before[0], abs=0.03)
    # By keyboard the browser's own dialog is opened.
    page.call("Page.setInterceptFileChooserDialog", enabled=True)
    page.press("o", "KeyO")
    page.wait("true")
    assert any(e.get("method") == "Page.fileChooserOpened" for e in scene.browser.events)
    clear(page)


def test_a_goal_of_another_client_is_seen_and_held(scene: Scene, page: Tab) -> None:
    before = ends(page)
    record = scene.flight.send(navigate_goal(0.0, -20.0, 5.0, 1.0))
    assert record.accepted
    page.wait(ACTIVE)
    assert "from another program" in page.text("progress")
    # Hold needs no control.
    page.press("v", "KeyV")
    page.wait("document.body.dataset.control === ''")
    page.click("hold")
    wait_for_end(page, before, "PREEMPTED")
    assert "hold service" in page.text("end")


def rejected_total(link: ClientConnection) -> int:
    """Return how many requests were rejected, as the next new page is told."""
    return sum(json.loads(link.recv(timeout=patient_s(10.0)))["rejected"].values())


def test_strangers_are_rejected_and_counted(scene: Scene) -> None:
    with scene.connected() as link:
        before = rejected_total(link)
    token = scene.address.partition("token=")[2]
    port = int(scene.origin.rpartition(":")[2])
    here = f"127.0.0.1:{port}"
    strangers = (
        (here, "http://evil.example", token),
        (here, None, token),
        (here, "null", token),
        (here, f"https://{here}", token),
        (here, "http://127.0.0.1", token),
        # A name that now leads to this machine: its pages send what their own site would get.
        ("evil.example", "http://evil.example", token),
        (f"evil.example:{port}", f"http://evil.example:{port}", token),
        (f"evil.example:{port}", f"http://{here}", token),
        (here, f"http://{here}", ""),
        (here, f"http://{here}", "x" * len(token)),
    )
    for host, origin, given in strangers:
        socket = create_connection(("127.0.0.1", port), 10.0)
        address = f"ws://{host}/socket?token={given}"
        with (
            pytest.raises(InvalidStatus) as rejection,
            connect(address, sock=socket, origin=None if origin is None else Origin(origin)),
        ):
            pass
        assert rejection.value.response.status_code in (403, 421), (host, origin, given)
    with scene.connected() as link:
        assert rejected_total(link) == before + len(strangers)


def test_a_page_without_control_and_ten_thousand_broken_messages_move_nothing(
    scene: Scene, page: Tab
) -> None:
    with scene.connected() as link:
        before = rejected_total(link)
        for message in MOVING:
            link.send(json.dumps(message))
        for number, data in enumerate(broken(18, 10_000)):
            link.send(data)
            if number % 500 == 0:  # lets the console tell this page
                link.ping().wait(20.0)
        link.ping().wait(30.0)
        with scene.connected() as other:
            assert rejected_total(other) == before + len(MOVING) + 10_000
    assert page.value(IDLE)
    assert page.value(MINE)
    # The page itself has control, and is obeyed.
    page.drag(on_map(page, 2.0, 2.0))
    page.press("g", "KeyG")
    page.press(" ", "Space", 1.8)
    page.wait(ACTIVE)


def test_control_is_taken_over_knowingly(scene: Scene, page: Tab) -> None:
    other = scene.browser.open(scene.address)
    try:
        other.wait(READY)
        other.wait("document.getElementById('control').textContent === 'Another page has control'")
        other.press("g", "KeyG")
        assert other.value("document.getElementById('confirm').hidden")
        other.press("v", "KeyV")
        other.wait("!document.getElementById('confirm').hidden")
        other.press(" ", "Space", 1.8)
        other.wait(MINE)
        page.wait("document.getElementById('control').textContent === 'Another page has control'")
    finally:
        other.close()
    page.wait("document.body.dataset.control === ''")


def test_a_plan_is_opened_and_what_is_wrong_with_it_is_said(
    scene: Scene, page: Tab, tmp_path: Path
) -> None:
    with scene.connected() as link:
        link.recv(timeout=patient_s(10.0))
        points = [{"x": 3.0, "y": 4.0, "z": 6.0, "hold": 2.0}]
        link.send(json.dumps({"type": "save_plan", "vehicle": "/", "waypoints": points}))
        while (answer := json.loads(link.recv(timeout=patient_s(10.0))))["type"] != "plan_file":
            pass
    good, bad = tmp_path / "good.plan", tmp_path / "bad.plan"
    good.write_text(answer["text"])
    bad.write_text("{}")
    root = page.call("DOM.getDocument")["root"]["nodeId"]
    file = page.call("DOM.querySelector", nodeId=root, selector="#file")["nodeId"]
    page.call("DOM.setFileInputFiles", nodeId=file, files=[str(bad)])
    page.wait("document.getElementById('answer').textContent.includes('not a QGroundControl')")
    page.call("DOM.setFileInputFiles", nodeId=file, files=[str(good)])
    page.wait("document.querySelectorAll('#waypoints li').length === 2")
    assert waypoints(page)[0] == pytest.approx([3.0, 4.0, 6.0, 2.0], abs=0.03)


def test_fence_rally_points_and_mission_in_the_vehicle_are_shown_and_taken(
    scene: Scene, page: Tab
) -> None:
    station, drawn = scene.station, "document.getElementById('map').dataset.scene"
    page.wait(f"{drawn} === 'fence 0 rally 0 mission 0'", _FLIGHT_S)
    station.upload(missions.fence_with_hole(), 1)
    station.upload([missions.rally_point()], 2)
    station.upload(
        [
            missions.home(),
            missions.take_off(10.0),
            missions.waypoint(30.0, 5.0, 12.0),
            missions.waypoint(-10.0, 20.0, 8.0, 2.0),
        ]
    )
    page.wait(f"{drawn} === 'fence 2 rally 1 mission 2'", _FLIGHT_S)
    assert "12 m above home" in page.text("mission-items")
    page.press("m", "KeyM")
    page.wait("document.querySelectorAll('#waypoints li').length >= 3")
    taken = waypoints(page)[-2:]
    assert taken[0] == pytest.approx([5.0, 30.0, 12.0, 0.0], abs=0.4)
    assert taken[1] == pytest.approx([20.0, -10.0, 8.0, 2.0], abs=0.4)
    with scene.connected() as link:
        link.send(json.dumps({"type": "mission", "vehicle": "/", "form": "file"}))
        while (answer := json.loads(link.recv(timeout=patient_s(10.0))))["type"] != "plan_file":
            pass
    plan = json.loads(answer["text"])
    assert [entry["command"] for entry in plan["mission"]["items"]] == [22, 16, 16]
    assert len(plan["geoFence"]["polygons"][0]["polygon"]) == 4
    assert len(plan["rallyPoints"]["points"]) == 1
    assert not page.value("document.getElementById('battery').hidden")
    assert "in reserve" in page.text("battery-text")
    page.press("u", "KeyU")
    for kind in range(3):
        station.send(
            make("MISSION_CLEAR_ALL", target_system=1, target_component=1, mission_type=kind)
        )
    page.wait(f"{drawn} === 'fence 0 rally 0 mission 0'", _FLIGHT_S)
    assert page.value("document.getElementById('mission-box').hidden")


@pytest.mark.parametrize("width", [1400, 400])
def test_nothing_is_cut_off_and_hold_is_on_the_screen(page: Tab, width: int) -> None:
    page.resize(width, 800)
    page.wait(f"innerWidth === {width}")
    assert page.value("document.documentElement.scrollWidth") == width
    page.drag(on_map(page, 4.0, 3.0))
    page.press("g", "KeyG")
    page.press("?", "Slash")
    page.wait("document.getElementById('keys').open")
    page.wait("!document.getElementById('confirm').hidden")
    for name in ("hold", "cancel"):
        left, top, wide, high = page.box(name)
        seen = (
            f"document.elementFromPoint({left + wide / 2}, {top + high / 2}).closest('button').id"
        )
        assert page.value(seen) == name
        assert left >= 0
        assert left + wide <= width
        assert top + high <= 800
        assert high >= 50
    assert page.value("document.getElementById('hold').textContent").startswith("HOLD")


def test_a_server_that_was_killed_is_missed_and_found_again(scene: Scene, page: Tab) -> None:
    flight = scene.flight
    assert flight.server is not None
    flight.server.stop(0.0)
    page.wait("document.getElementById('banner').textContent.includes('is silent')")
    assert not page.value("document.getElementById('banner').hidden")
    with scene.connected() as link:
        for message in ({"type": "take", "vehicle": "/", "over": True}, FLY):
            link.send(json.dumps(message))
        while (answer := json.loads(link.recv(timeout=patient_s(10.0))))["type"] != "answer":
            pass
        assert "server does not respond" in answer["text"]
    flight.server = flight.start_server()
    page.wait(f"document.getElementById('banner').hidden && {READY}", READY_TIMEOUT_S)
    page.wait("document.getElementById('events').textContent.includes('restarted')")


def test_a_recorded_flight_is_played_on_the_page(scene: Scene) -> None:
    environment = ros_environment(new_domain())
    link = f"tlog:{COPTER}"
    server = ["python", "-m", "drone_navigation.navigation_server", "--link", link]
    processes = []
    try:
        for name, command in (("navigation_server", server), ("navigation_console", CONSOLE)):
            processes.append(Process(name, command, environment))
        address = address_of(processes[1])
        tab = scene.browser.open(address)
        tab.wait("!document.getElementById('replay').hidden", READY_TIMEOUT_S)
        assert tab.text("banner") == "A recording: nothing is flown."
        tab.wait("!!document.getElementById('map').dataset.view", READY_TIMEOUT_S)
        tab.wait("document.getElementById('replay-seek').max > 100", READY_TIMEOUT_S)
        tab.click("replay-play")
        tab.wait(PAUSED)
        # The slider is dragged to three quarters.
        left, top, width, height = tab.box("replay-seek")
        middle = top + height / 2
        tab.drag(*((left + share * width, middle) for share in (0.1, 0.3, 0.5, 0.75)))
        tab.wait(f"{AT} > 80 && {AT} < 95 && {PAUSED}", _FLIGHT_S)
        assert re.match(r"1:2\d / 1:5\d", tab.text("replay-time")), tab.text("replay-time")
        tab.wait(f"{TRAIL} <= 1")
        assert "armed" in tab.text("facts")
        tab.press(",", "Comma")
        tab.press(",", "Comma")
        tab.wait(f"{AT} > 60 && {AT} < 75 && {PAUSED}", _FLIGHT_S)
        tab.press(".", "Period")
        tab.wait(f"{AT} > 70 && {AT} < 85 && {PAUSED}", _FLIGHT_S)
        tab.wait(f"{TRAIL} <= 1")
        tab.press("x", "KeyX")
        tab.wait("document.getElementById('replay-speed').value === '2'")
        tab.press(" ", "Space")
        tab.wait("document.body.dataset.replay === 'playing'")
        before = tab.value(AT)
        tab.wait(f"{AT} > {before} + 2")
        # The end of the slider is the end.
        tab.value("document.getElementById('replay-seek').focus()")
        tab.press("End", "End")
        tab.wait("document.body.dataset.replay === 'ended'", _FLIGHT_S)
        assert tab.text("replay-play") == "Play again"
        tab.value("document.getElementById('map').focus()")
        tab.press("Home", "Home")
        tab.wait(f"{AT} < 20 && document.body.dataset.replay === 'playing'", _FLIGHT_S)
        # A page that comes later sees the same.
        other = scene.browser.open(address)
        other.wait("!document.getElementById('replay').hidden", READY_TIMEOUT_S)
        other.close()
        with connect(
            address.replace("http", "ws", 1).replace("/?", "/socket?"),
            origin=Origin(address.partition("/?")[0]),
        ) as socket:
            first = json.loads(socket.recv(timeout=patient_s(10.0)))
            assert len(first["trails"].get("/", [])) < 40
        tab.close()
    finally:
        for process in reversed(processes):
            process.stop()


def test_no_page_complained_or_asked_for_anything_elsewhere(scene: Scene, page: Tab) -> None:
    page.wait("!!document.getElementById('map').dataset.view", READY_TIMEOUT_S)
    assert scene.browser.errors() == []
    requests = scene.browser.requests() - {"about:blank"}
    assert len(requests) > 10
    assert {urlsplit(address).hostname for address in requests} == {"127.0.0.1"}


def test_a_console_that_ends_is_missed_by_its_page(scene: Scene, tmp_path: Path) -> None:
    console = Process("navigation_console", CONSOLE, scene.flight.environment)
    browser = Browser(tmp_path)  # of its own: this page may complain
    try:
        tab = browser.open(address_of(console))
        tab.wait(READY)
        console.signal(signal.SIGTERM)
        assert console.wait(10.0) == 0
        assert "goals continue" in console.text
        tab.wait("document.getElementById('banner').textContent.includes('console has ended')")
    finally:
        browser.close()
        console.stop()
