"""Tiles below the map of the console: each where the vehicle's firmware puts its place."""

from __future__ import annotations

import http.client
import math
import os
import re
import threading
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import numpy as np
import pytest
import rclpy
from nav_msgs.msg import Odometry
from PIL import Image
from rclpy.context import Context

from custom_interfaces.msg import HomePosition, VehicleStatus
from drone_navigation.console import plans
from drone_navigation.console.page_types import HomeValue
from drone_navigation.processes import ros_environment
from drone_navigation.qos import LATCHED_QOS, STREAM_QOS
from navigation_bridge.names import SERVER_NODE_NAME
from tests.support.processes import Process
from tests.support.ros.browser import CHROMIUM, Browser, Tab
from tests.support.ros.ros_flight import READY_TIMEOUT_S, new_domain
from tests.support.tiles import TileKey, draw_tiles, write_archive, write_folder

pytestmark = [
    pytest.mark.wide,
    pytest.mark.xdist_group("console_tiles"),
    pytest.mark.skipif(
        CHROMIUM is None, reason="no Chromium here (apt install chromium), so no page can be opened"
    ),
]
# Latitude and longitude of home; the first map goes across the date line.
VEHICLES = {
    "equator": ("ArduCopter", 0.0, 179.9995),
    "berlin": ("PX4 multicopter", 52.0, 13.0),
    "bellingshausen": ("ArduCopter", -69.0, -75.0),
}
# East and north of home, metres: what is marked on the tiles.
PLACES = ((70.0, 40.0), (-90.0, -35.0))
# Far enough for a web map to have another scale there.
FAR = (5200.0, 3600.0)
# There is a coarse tile, but none of the finest.
GAP = (2500.0, -1500.0)
HOME_ENU_M = (3.0, -2.0, 0.0)
ZOOM = 18
_PERIOD_S = 0.3


class Vehicles:
    """The messages of three servers about their vehicles, over and over."""

    def __init__(self, domain: int) -> None:
        os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
        self._context = Context()
        rclpy.init(context=self._context, domain_id=domain)
        self._node = rclpy.create_node("vehicles", context=self._context)
        self._told = [self._messages(name, *where) for name, where in VEHICLES.items()]
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._tell)
        self._thread.start()

    def _messages(
        self, name: str, autopilot: str, latitude: float, longitude: float
    ) -> list[tuple[Any, object]]:
        root = f"/{name}/{SERVER_NODE_NAME}"
        status = VehicleStatus(
            connected=True, autopilot=autopilot, mode="GUIDED", position_valid=True, server_id="1"
        )
        home = HomePosition(latitude=latitude, longitude=longitude, altitude_amsl=50.0)
        home.position.x, home.position.y, home.position.z = HOME_ENU_M
        odometry = Odometry()
        odometry.pose.pose.orientation.w = 1.0
        kinds = ((status, "vehicle_status", LATCHED_QOS), (home, "home", LATCHED_QOS),
                 (odometry, "odometry", STREAM_QOS))  # fmt: skip
        return [
            (self._node.create_publisher(type(message), f"{root}/{topic}", qos), message)
            for message, topic, qos in kinds
        ]

    def _tell(self) -> None:
        while not self._stop.wait(_PERIOD_S):
            for told in self._told:
                for publisher, message in told:
                    publisher.publish(message)

    def close(self) -> None:
        self._stop.set()
        self._thread.join()
        self._node.destroy_node()
        rclpy.try_shutdown(context=self._context)


@dataclass
class Scene:
    """A browser, and a console for each kind of file."""

    browser: Browser
    addresses: dict[str, str]
    processes: list[Process]


def home_of(name: str) -> HomeValue:
    _, latitude, longitude = VEHICLES[name]
    return HomeValue(latitude=latitude, longitude=longitude, altitude=50.0, at=list(HOME_ENU_M))


def places_of(
    name: str, places: Sequence[tuple[float, float]] = (*PLACES, FAR)
) -> list[tuple[float, float]]:
    """Return latitude and longitude of the marks, by the projection that the bridge uses."""
    frame, _ = plans.vehicle_map(VEHICLES[name][0], home_of(name))
    found = [frame.geodetic((north_m, east_m, 0.0)) for east_m, north_m in places]
    return [(latitude, longitude) for latitude, longitude, _ in found]


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Scene]:
    folder = tmp_path_factory.mktemp("tiles")
    tiles: dict[TileKey, bytes] = {}
    for zoom in range(ZOOM - 3, ZOOM + 1):
        tiles |= draw_tiles([place for name in VEHICLES for place in places_of(name)], zoom)
    tiles |= draw_tiles(places_of("berlin", [GAP]), ZOOM - 3)
    files = {
        "folder": write_folder(tiles, folder / "tiles"),
        "archive": write_archive(tiles, folder / "tiles.pmtiles"),
    }
    domain = new_domain()
    vehicles = Vehicles(domain)
    scene = Scene(Browser(folder / "browser"), {}, [])
    try:
        for kind, path in files.items():
            command = ["python", "-m", "drone_navigation.navigation_console", "--no-browser"]
            console = Process(kind, [*command, "--tiles", str(path)], ros_environment(domain))
            scene.processes.append(console)
            line = console.wait_for("The console is at", READY_TIMEOUT_S)
            found = re.search(r"http://\S+", line)
            assert found is not None
            scene.addresses[kind] = found[0]
        yield scene
    finally:
        scene.browser.close()
        for console in scene.processes:
            console.stop()
        vehicles.close()


def loaded(tab: Tab) -> None:
    """Wait until tiles are drawn, and none is on its way."""
    tab.wait("/^[1-9][0-9]* 0$/.test(document.getElementById('map').dataset.tiles)", 30.0)
    drawn(tab)


def view_of(tab: Tab) -> tuple[float, float, float]:
    """Return the middle of the map, east and north in metres, and how many pixels a metre has."""
    drawn(tab)
    x, y, scale = tab.value("document.getElementById('map').dataset.view").split()
    return float(x), float(y), float(scale)


def scale_of(tab: Tab) -> float:
    """Return how many pixels a metre has."""
    return view_of(tab)[2]


def drawn(tab: Tab) -> None:
    """Wait until what was asked for has been drawn."""
    frames = "new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))"
    tab.call("Runtime.evaluate", expression=frames, awaitPromise=True)


def marks(
    tab: Tab, file: Path, places: Sequence[tuple[float, float]] = PLACES
) -> list[tuple[float, float]]:
    """Return where marks are seen near places, east and north in metres from the map's zero."""
    tab.picture(file)
    with Image.open(file) as image:
        seen = np.asarray(image.convert("RGB"), dtype=float)
    left, top, width, height = tab.box("map")
    seen = seen[int(top) : int(top + height), int(left) : int(left + width)]
    # More red than anything else that is drawn there, however the theme dims it.
    red = seen[..., 0] - np.maximum(seen[..., 1], seen[..., 2])
    rows, columns = np.nonzero(red > 0.5 * red.max())
    x, y, scale = map(float, tab.value("document.getElementById('map').dataset.view").split())
    # The map begins within a pixel of the picture.
    east = x + (int(left) - left + columns + 0.5 - width / 2) / scale
    north = y - (int(top) - top + rows + 0.5 - height / 2) / scale
    found = []
    for place in places:
        near = np.hypot(east - place[0], north - place[1]) < 20.0
        found.append((float(east[near].mean()), float(north[near].mean())))
    return found


def opened(scene: Scene, kind: str, name: str) -> Tab:
    """Return a page that shows a vehicle."""
    tab = scene.browser.open(scene.addresses[kind])
    card = f"#fleet button[data-vehicle='/{name}']"
    tab.wait(f'!!document.querySelector("{card}")', READY_TIMEOUT_S)
    tab.click_on(card)
    tab.wait("document.body.dataset.ready === 'true'", READY_TIMEOUT_S)
    tab.wait("document.getElementById('facts').textContent.includes('east 0.0')")
    # The readouts lie over the map.
    tab.value("document.getElementById('glance').style.display = 'none'")
    return tab


@pytest.mark.parametrize("kind", ["folder", "archive"])
@pytest.mark.parametrize("name", VEHICLES)
def test_tiles_lie_where_the_firmware_puts_their_places(
    scene: Scene, name: str, kind: str, tmp_path: Path
) -> None:
    tab = opened(scene, kind, name)
    try:
        for theme in ("day", "night"):
            tab.value(f"document.documentElement.dataset.theme = '{theme}'")
            while scale_of(tab) > (4.5 if theme == "day" else 1.7):
                tab.click("zoom-out")
            loaded(tab)
            scale = scale_of(tab)
            for found, place in zip(marks(tab, tmp_path / "seen.png"), PLACES, strict=True):
                # Drawn to a pixel each: a mark in its tile, the tiles on their level, the level on
                # the map, and the grid that may hide a part of the mark.
                assert found == pytest.approx(place, abs=2.5 / scale + 0.15), (theme, scale)
    finally:
        tab.close()


def go(tab: Tab, place: tuple[float, float]) -> float:
    """Drag and zoom the map to a place; return how many pixels a metre has there."""
    while (before := scale_of(tab)) > 0.05:
        tab.click("zoom-out")
        if scale_of(tab) == before:
            break
    while (scale := scale_of(tab)) < 1.7:
        left, top, width, height = tab.box("map")
        x, y, _ = view_of(tab)
        over = ((place[0] - x) * scale, (y - place[1]) * scale)
        middle = (left + width / 2, top + height / 2)
        share = min(1.0, 0.4 * height / max(math.hypot(*over), 1.0))
        to = (middle[0] - share * over[0], middle[1] - share * over[1])
        if math.dist(middle, to) > 10.0:  # less is a click
            tab.drag(middle, ((middle[0] + to[0]) / 2, (middle[1] + to[1]) / 2), to)
        drawn(tab)
        if share == 1.0:
            tab.click("zoom-in")
    loaded(tab)
    return scale


@pytest.mark.parametrize("name", VEHICLES)
def test_tiles_lie_right_far_from_home_too(scene: Scene, name: str, tmp_path: Path) -> None:
    tab = opened(scene, "folder", name)
    try:
        scale = go(tab, FAR)
        (found,) = marks(tab, tmp_path / "seen.png", [FAR])
        assert found == pytest.approx(FAR, abs=2.5 / scale + 0.5)
    finally:
        tab.close()


@pytest.mark.night
def test_where_the_finest_tiles_have_a_gap_a_coarser_one_is_shown(
    scene: Scene, tmp_path: Path
) -> None:
    tab = opened(scene, "archive", "berlin")
    try:
        go(tab, GAP)
        (found,) = marks(tab, tmp_path / "seen.png", [GAP])
        # Half of a pixel of the coarse tile is 1.5 m.
        assert found == pytest.approx(GAP, abs=2.5)
    finally:
        tab.close()


def fingers(tab: Tab, kind: str, *places: tuple[float, float]) -> None:
    points = [{"x": x, "y": y, "id": i} for i, (x, y) in enumerate(places)]
    tab.call("Input.dispatchTouchEvent", type=f"touch{kind}", touchPoints=points)


def test_fingers_move_and_pinch_the_map_and_a_tap_is_a_waypoint(scene: Scene) -> None:
    tab = opened(scene, "folder", "berlin")
    try:
        tab.call("Emulation.setTouchEmulationEnabled", enabled=True, maxTouchPoints=2)
        left, top, width, height = tab.box("map")
        x, y = left + width / 2, top + height / 2
        east, north, scale = view_of(tab)
        fingers(tab, "Start", (x, y))
        for step in range(1, 6):
            fingers(tab, "Move", (x + 20 * step, y - 10 * step))
        fingers(tab, "Move", (x + 100, y - 50))
        drawn(tab)
        # It does not roll on once it is held still.
        tab.value("new Promise((done) => setTimeout(done, 300))")
        fingers(tab, "End")
        tab.wait("!document.body.classList.contains('leaflet-dragging')")
        moved = view_of(tab)
        assert moved[0] == pytest.approx(east - 100 / scale, abs=12 / scale)
        assert moved[1] == pytest.approx(north - 50 / scale, abs=12 / scale)
        assert moved[2] == pytest.approx(scale)
        fingers(tab, "Start", (x - 40, y), (x + 40, y))
        for step in range(1, 5):
            fingers(tab, "Move", (x - 40 - 10 * step, y), (x + 40 + 10 * step, y))
            drawn(tab)
        fingers(tab, "End")
        drawn(tab)
        pinched = view_of(tab)
        assert pinched[2] == pytest.approx(2 * scale, rel=0.05)
        assert pinched[:2] == pytest.approx(moved[:2], abs=3 / scale)
        assert tab.value("document.querySelectorAll('#waypoints li').length") == 0
        fingers(tab, "Start", (x + 30, y - 60))
        fingers(tab, "End")
        tab.wait("document.querySelectorAll('#waypoints li').length === 2")
        inputs = "[...document.querySelectorAll('#waypoints input')]"
        tapped = tab.value(f"{inputs}.slice(0, 2).map((input) => input.valueAsNumber)")
        place = (pinched[0] + 30 / pinched[2], pinched[1] + 60 / pinched[2])
        assert tapped == pytest.approx(place, abs=0.15)
    finally:
        tab.close()


def answer(address: str, path: str, host: str = "", token: bool = True) -> tuple[int, str]:
    """Return the status and the type that an address gets."""
    parts = urlsplit(address)
    link = http.client.HTTPConnection(str(parts.hostname), int(parts.port or 0), timeout=10.0)
    try:
        query = f"?{parts.query}" if token else ""
        link.request("GET", path + query, headers={"Host": host or parts.netloc})
        response = link.getresponse()
        response.read()
        return response.status, response.headers.get("Content-Type", "")
    finally:
        link.close()


@pytest.mark.parametrize("kind", ["folder", "archive"])
def test_only_tiles_are_served_and_only_with_the_token(scene: Scene, kind: str) -> None:
    address = scene.addresses[kind]
    latitude, longitude = places_of("berlin")[0]
    ((_, x, y), *_) = draw_tiles([(latitude, longitude)], ZOOM)
    tile = f"/tile/{ZOOM}/{x}/{y}"
    assert answer(address, tile) == (200, "image/png")
    assert answer(address, tile, token=False)[0] == 403
    assert answer(address, tile, host="evil.example")[0] == 421
    assert answer(address, "/tile/3/0/0")[0] == 204
    for path in (
        "/tile/../../../etc/passwd", f"/tile/{ZOOM}/{x}/../{x}/{y}.png", f"/tile/{ZOOM}/{x}/%2e%2e",
        f"/tile//{x}/{y}", f"/tile/{ZOOM}/{x}/{y}.png", "/tile/99/0/0", f"/tile/{ZOOM}",
    ):  # fmt: skip
        assert answer(address, path)[0] == 404, path


def test_without_tiles_none_are_served_and_a_wrong_file_is_said(tmp_path: Path) -> None:
    (tmp_path / "a.mbtiles").write_bytes(b"SQLite format 3\0")
    command = ["python", "-m", "drone_navigation.navigation_console", "--no-browser"]
    console = Process(
        "console", [*command, "--tiles", str(tmp_path / "a.mbtiles")], ros_environment(new_domain())
    )
    try:
        console.wait_for("neither a folder of tiles nor a PMTiles archive", READY_TIMEOUT_S)
        assert console.wait(10.0) == 2
        assert "Traceback" not in console.text
    finally:
        console.stop()


def test_no_page_complained_or_asked_for_anything_elsewhere(scene: Scene) -> None:
    tab = scene.browser.open(scene.addresses["folder"])
    tab.wait("document.body.dataset.ready === 'true'", READY_TIMEOUT_S)
    loaded(tab)
    tab.close()
    assert scene.browser.errors() == []
    requests = scene.browser.requests() - {"about:blank"}
    assert len([address for address in requests if "/tile/" in address]) > 5
    assert {urlsplit(address).hostname for address in requests} == {"127.0.0.1"}
