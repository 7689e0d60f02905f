"""Draw docs/console.png and docs/console_phone.png: ``python scripts/draw_console.py [FILM]``.

Flies the simulated copter of ``make console`` through its obstacles from a page in Chromium. With
a name, such as out/console.mp4, the flight is filmed, too.
"""

from __future__ import annotations

import re
import sys
import tempfile
import time
from pathlib import Path

import imageio_ffmpeg
from PIL import Image

from drone_navigation.processes import Process

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from tests.support.ros.browser import Browser, Tab  # noqa: E402

WIDE, PHONE = ROOT / "docs/console.png", ROOT / "docs/console_phone.png"
_SIZE = (1400, 860)
_COLOURS = 128
_FRAMES_HZ = 5.0
_ROUTE = ((7.0, 5.5), (16.0, 1.0), (22.0, 7.0))
_TIMEOUT_S = 60.0


def main() -> None:
    """Fly, and keep what the page shows on the way."""
    command = ["python", "-m", "drone_navigation.simulated_console", "--no-browser"]
    console = Process("console", command)
    with tempfile.TemporaryDirectory() as folder:
        browser = None
        try:
            address = re.search(r"http://\S+", console.wait_for("The console is at", _TIMEOUT_S))
            assert address is not None
            browser = Browser(Path(folder, "browser"))
            tab = browser.open(address[0], *_SIZE)
            _fly(tab)
            _keep(tab, WIDE, Path(folder, "wide.png"))
            tab.resize(400, 800)
            tab.wait("innerWidth === 400")
            tab.click("fit")
            _keep(tab, PHONE, Path(folder, "phone.png"))
            if len(sys.argv) > 1:
                tab.resize(*_SIZE)
                _film(tab, Path(sys.argv[1]), Path(folder, "frame.png"))
        finally:
            if browser is not None:
                browser.close()
            console.stop(10.0)


def _fly(tab: Tab) -> None:
    tab.wait("document.body.dataset.ready === 'true'", _TIMEOUT_S)
    tab.press("v", "KeyV")
    tab.wait("document.body.dataset.control === 'mine'")
    tab.value("document.documentElement.dataset.theme = 'day'")
    tab.wait("document.getElementById('avoid').checked", _TIMEOUT_S)
    for _ in range(2):
        tab.press("-", "Minus")
    for place in _ROUTE:
        tab.drag(_on_map(tab, *place))
    tab.press("g", "KeyG")
    tab.press(" ", "Space", 1.8)
    tab.wait("document.body.dataset.goal !== ''")
    tab.wait("document.getElementById('progress').textContent.includes('waypoint 2')", _TIMEOUT_S)
    tab.wait("parseFloat(document.querySelector('#out-distance b').textContent) < 17", _TIMEOUT_S)
    tab.click("fit")


def _film(tab: Tab, film: Path, shot: Path) -> None:
    """Film the rest of the flight as it is seen, in real time."""
    film.parent.mkdir(parents=True, exist_ok=True)
    writer = imageio_ffmpeg.write_frames(
        str(film), _SIZE, fps=_FRAMES_HZ, codec="libx264", macro_block_size=1
    )
    writer.send(None)
    begun_s, frames = time.monotonic(), 0
    while tab.value("document.body.dataset.goal !== ''"):
        tab.picture(shot)
        with Image.open(shot) as image:
            picture = image.convert("RGB").tobytes()
        # A picture that came late is shown for longer.
        for _ in range(round((time.monotonic() - begun_s) * _FRAMES_HZ) - frames):
            writer.send(picture)
            frames += 1
    writer.close()


def _on_map(tab: Tab, east_m: float, north_m: float) -> tuple[float, float]:
    tab.wait("document.getElementById('map').dataset.view")
    x, y, scale = map(float, tab.value("document.getElementById('map').dataset.view").split())
    left, top, width, height = tab.box("map")
    return left + width / 2 + (east_m - x) * scale, top + height / 2 - (north_m - y) * scale


def _keep(tab: Tab, picture: Path, shot: Path) -> None:
    # After two frames, what was asked for has been drawn.
    frames = "new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))"
    tab.call("Runtime.evaluate", expression=frames, awaitPromise=True)
    tab.picture(shot)
    with Image.open(shot) as image:
        image.convert("RGB").quantize(_COLOURS).save(picture, optimize=True)


if __name__ == "__main__":
    main()
