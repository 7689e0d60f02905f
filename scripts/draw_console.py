"""Draw the pictures of docs/console.md and its film: ``python scripts/draw_console.py [FOLDER]``.

Pages in Chromium fly the simulated copter of ``make console`` through its obstacles, then three
vehicles, two of which would meet. Some minutes; the files go to docs, or to a folder.
"""

from __future__ import annotations

import re
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import imageio_ffmpeg
from PIL import Image

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from tests.support.processes import Process  # noqa: E402
from tests.support.ros.browser import Browser, Tab, in_box  # noqa: E402
from tests.support.ros.ros_fleet import FleetFlight, FleetVehicle, two_ports  # noqa: E402

_WIDE, _TABLET, _PHONE = (1400, 860), (1024, 768), (400, 800)
_GIF = (940, 578)
_COLOURS, _GIF_COLOURS = 128, 160
_FRAMES_HZ, _GIF_HZ, _FASTER, _LAST_S = 5.0, 1.5, 3.0, 2.0
_QUALITY = 30
_TIMEOUT_S = 60.0
_CONSOLE = ["python", "-m", "drone_navigation.navigation_console", "--no-browser"]
_SIMULATED = ["python", "-m", "drone_navigation.simulated_console", "--no-browser"]
_ROUTE_M = ((7.0, 5.5), (16.0, 1.0), (22.0, 7.0))
# East and north of each vehicle itself, which stands 18 m east of the one before. The paths of the
# first two cross; neither ends where the other one passes.
_FLEET_ROUTES_M = {
    "/copter": ((5.0, 7.0), (37.0, 7.0)),
    "/px4": ((6.0, 1.0), (-9.0, 11.0)),
    "/rover": ((0.0, -3.5), (-18.0, -3.5)),
}
# The camera may hold up the server on a small machine.
_PX4 = ("--autopilot", "px4", "--param", "COM_OF_LOSS_T=5")
_SECOND = "document.getElementById('progress').textContent.includes('waypoint 2')"
_DISTANCE_M = "parseFloat(document.querySelector('#out-distance b').textContent)"
_WAITS = "document.getElementById('fleet').textContent.includes('Waiting for other')"
_IDLE = "[...document.querySelectorAll('#fleet button')].every((each) => each.dataset.goal === '')"


def main() -> None:
    """Fly, and keep what the pages show."""
    docs = Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "docs"
    docs.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        browser = Browser(folder / "browser")
        try:
            _draw_one(browser, docs)
            _draw_fleet(browser, docs, folder)
        finally:
            browser.close()


def _draw_one(browser: Browser, docs: Path) -> None:
    """Fly one vehicle through obstacles: at night on a tablet, by day on a phone."""
    console = Process("console", _SIMULATED)
    try:
        tab = browser.open(_address(console), *_TABLET)
        _take(tab, "night")
        tab.wait("document.getElementById('avoid').checked", _TIMEOUT_S)
        for _ in range(2):
            tab.press("-", "Minus")
        for place in _ROUTE_M:
            tab.drag(_on_map(tab, *place))
        tab.wait("document.getElementById('rehearsal').dataset.code", _TIMEOUT_S)
        tab.press("g", "KeyG")
        tab.wait("!document.getElementById('confirm').hidden")
        tab.press(" ", "Space", 1.8)
        tab.wait("document.body.dataset.goal !== ''")
        tab.wait(_SECOND, _TIMEOUT_S)
        tab.wait(f"{_DISTANCE_M} < 17", _TIMEOUT_S)
        tab.click("fit")
        _keep(tab, docs / "console_night.png")
        tab.value("document.documentElement.dataset.theme = 'day'")
        tab.resize(*_PHONE)
        tab.wait(f"innerWidth === {_PHONE[0]}")
        tab.click("fit")
        _keep(tab, docs / "console_phone.png")
        tab.close()
    finally:
        console.stop(10.0)


def _draw_fleet(browser: Browser, docs: Path, folder: Path) -> None:
    """Draw, rehearse and fly a route for each of three vehicles; film all of it."""
    shared, other = two_ports()
    fleet = FleetFlight(
        folder,
        (
            FleetVehicle("copter", 1, (), shared),
            FleetVehicle("px4", 2, _PX4, shared),
            FleetVehicle("rover", 3, ("--vehicle", "rover"), other),
        ),
    )
    console = Process("navigation_console", _CONSOLE, fleet.environment)
    try:
        tab = browser.open(_address(console), *_WIDE)
        tab.wait("document.querySelectorAll('#fleet button').length === 3", _TIMEOUT_S)
        _take(tab, "day")
        tab.value("document.getElementById('take-all').click()")
        with _filmed(tab, folder / "frames", docs):
            for name, route in _FLEET_ROUTES_M.items():
                _choose(tab, name)
                tab.click("fit")
                for place in route:
                    _look_on(0.7)
                    tab.drag(_on_map(tab, *place))
            _choose(tab, "/copter")
            tab.wait("document.getElementById('separation').dataset.state === 'near'", 120.0)
            _look_on(4.0)
            _keep(tab, docs / "console.png")
            tab.value("document.getElementById('fly-all').click()")
            for danger in ("danger", ""):
                tab.wait("!document.getElementById('confirm').hidden && document"
                         f".getElementById('confirm').className.trim() === '{danger}'")  # fmt: skip
                _look_on(2.0)
                tab.press(" ", "Space", 1.8)
            tab.wait(_WAITS, 120.0)
            tab.wait(_IDLE, 120.0)
        tab.close()
    finally:
        console.stop(10.0)
        fleet.close()


@contextmanager
def _filmed(tab: Tab, frames: Path, docs: Path) -> Iterator[None]:
    """Film what is seen meanwhile; write it as MP4 and GIF, faster than it was."""
    frames.mkdir()
    is_over = threading.Event()
    begun_s = time.monotonic()

    def look() -> None:
        while not is_over.wait(_FASTER / _FRAMES_HZ):
            at_ms = round(1000.0 * (time.monotonic() - begun_s))
            tab.picture(frames / f"{at_ms:08d}.png")

    camera = threading.Thread(target=look)
    camera.start()
    try:
        yield
    finally:
        is_over.set()
        camera.join()
    pictures = sorted(frames.glob("*.png"))
    times_s = [int(picture.stem) / 1000.0 / _FASTER for picture in pictures]
    _write_mp4(docs / "console_fleet.mp4", _at(_FRAMES_HZ, pictures, times_s))
    _write_gif(docs / "console_fleet.gif", _at(_GIF_HZ, pictures, times_s))


def _at(rate_hz: float, pictures: list[Path], times_s: list[float]) -> list[Path]:
    """Return the picture that is shown at each moment of a film: the last one by then."""
    shown, index = [], 0
    for number in range(int((times_s[-1] + _LAST_S) * rate_hz)):
        while index + 1 < len(pictures) and times_s[index + 1] <= number / rate_hz:
            index += 1
        shown.append(pictures[index])
    return shown


def _write_mp4(film: Path, pictures: list[Path]) -> None:
    writer = imageio_ffmpeg.write_frames(
        str(film), _WIDE, fps=_FRAMES_HZ, codec="libx264", macro_block_size=1,
        output_params=["-crf", str(_QUALITY), "-preset", "slow", "-tune", "animation",
                       "-movflags", "+faststart"],
    )  # fmt: skip
    writer.send(None)
    for picture in pictures:
        with Image.open(picture) as image:
            writer.send(image.convert("RGB").tobytes())
    writer.close()


def _write_gif(film: Path, pictures: list[Path]) -> None:
    # One palette for all: what does not change is not stored again.
    palette = _small(pictures[len(pictures) * 2 // 3]).quantize(_GIF_COLOURS)
    frames = [
        _small(picture).quantize(palette=palette, dither=Image.Dither.NONE) for picture in pictures
    ]
    frames[0].save(
        film, save_all=True, append_images=frames[1:], duration=round(1000 / _GIF_HZ), loop=0,
        optimize=True,
    )  # fmt: skip


def _small(picture: Path) -> Image.Image:
    with Image.open(picture) as image:
        return image.convert("RGB").resize(_GIF, Image.Resampling.LANCZOS)


def _address(console: Process) -> str:
    address = re.search(r"http://\S+", console.wait_for("The console is at", _TIMEOUT_S))
    assert address is not None
    return address[0]


def _take(tab: Tab, theme: str) -> None:
    tab.wait("document.body.dataset.ready === 'true'", _TIMEOUT_S)
    tab.value(f"document.documentElement.dataset.theme = '{theme}'")
    tab.press("v", "KeyV")
    tab.wait("document.body.dataset.control === 'mine'")


def _look_on(seconds: float) -> None:
    """Let the film show for a time what there is."""
    threading.Event().wait(seconds)


def _choose(tab: Tab, name: str) -> None:
    button = f'#fleet button[data-vehicle="{name}"]'
    tab.click_on(button)
    tab.wait(f"document.querySelector('{button}').getAttribute('aria-pressed') === 'true'")


def _on_map(tab: Tab, east_m: float, north_m: float) -> tuple[float, float]:
    tab.wait("document.getElementById('map').dataset.view")
    view = tab.value("document.getElementById('map').dataset.view")
    return in_box(tab.box("map"), view, east_m, north_m)


def _keep(tab: Tab, picture: Path) -> None:
    # After two frames, what was asked for has been drawn.
    frames = "new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))"
    tab.call("Runtime.evaluate", expression=frames, awaitPromise=True)
    tab.picture(picture)
    with Image.open(picture) as image:
        quantised = image.convert("RGB").quantize(_COLOURS)
    quantised.save(picture, optimize=True)


if __name__ == "__main__":
    main()
