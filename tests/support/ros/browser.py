"""Chromium without a window, driven over its DevTools protocol: clicks, keys, what it reports.

https://chromedevtools.github.io/devtools-protocol/
"""

from __future__ import annotations

import base64
import itertools
import json
import re
import shutil
import threading
import time
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from websockets.sync.client import connect

from tests.support.processes import Process, patient_s

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
_ARGUMENTS = (
    "--headless", "--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-sync",
    "--disable-background-networking", "--disable-component-update", "--disable-dev-shm-usage",
    "--disable-background-timer-throttling", "--hide-scrollbars", "--remote-debugging-port=0",
)  # fmt: skip
_KEY_CODES = {
    " ": 32, "Backspace": 8, "Enter": 13, "End": 35, "Home": 36, "ArrowUp": 38, "ArrowDown": 40,
}  # fmt: skip
_STARTED_S = 40.0
_ANSWER_S = 30.0
_LOOK_S = 0.1


def in_box(
    box: tuple[float, float, float, float], view: str, east_m: float, north_m: float
) -> tuple[float, float]:
    """Return where a place of the map is on the page, in pixels.

    Args:
        box: of the map: left, top, width and height.
        view: its middle, east and north in metres, and its pixels for each metre.
        east_m: of the place.
        north_m: of the place.
    """
    x, y, scale = map(float, view.split())
    left, top, width, height = box
    off_x, off_y = (east_m - x) * scale, (north_m - y) * scale
    # A click beside the map would be lost without a word.
    share = max(abs(off_x) / width, abs(off_y) / height)
    assert share < 0.5, f"East {east_m}, north {north_m} m is not on the map that shows {view}."
    return left + width / 2 + off_x, top + height / 2 - off_y


class Browser:
    """A browser with a profile of its own."""

    def __init__(self, folder: Path) -> None:
        """Start it, with its profile in a folder."""
        assert CHROMIUM is not None
        arguments = [CHROMIUM, *_ARGUMENTS, f"--user-data-dir={folder}", "about:blank"]
        self._process = Process("chromium", arguments)
        line = self._process.wait_for("DevTools listening on", _STARTED_S)
        address = re.search(r"ws://\S+", line)
        assert address is not None
        self._on_exit = ExitStack()
        self._on_exit.callback(self._process.stop)
        self._socket = self._on_exit.enter_context(
            connect(address[0], max_size=None, compression=None, ping_interval=None)
        )
        self._numbers = itertools.count(1)
        self._lock = threading.Lock()
        self.events: list[dict[str, Any]] = []

    def call(self, method: str, session: str = "", **params: Any) -> Any:
        """Call a method of the protocol and return its result."""
        with self._lock:
            number = next(self._numbers)
            request: dict[str, Any] = {"id": number, "method": method, "params": params}
            if session:
                request["sessionId"] = session
            self._socket.send(json.dumps(request))
            while True:
                answer = json.loads(self._socket.recv(timeout=_ANSWER_S))
                if answer.get("id") == number:
                    assert "error" not in answer, answer
                    return answer["result"]
                self.events.append(answer)

    def open(self, address: str, width: int = 1400, height: int = 900) -> Tab:
        """Open a page in a tab of a size in pixels."""
        target = self.call("Target.createTarget", url="about:blank")["targetId"]
        session = self.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        tab = Tab(self, target, session)
        for domain in ("Runtime", "Log", "Network", "Page"):
            tab.call(f"{domain}.enable")
        tab.resize(width, height)
        tab.call("Page.navigate", url=address)
        return tab

    def requests(self) -> set[str]:
        """Return all addresses that pages have asked for."""
        told = [event for event in self.events if event.get("method", "").startswith("Network.")]
        asked = (event["params"].get("request", {}) for event in told)
        sent = [request["url"] for request in asked if "url" in request]
        sockets = [e["params"]["url"] for e in told if e["method"].endswith("webSocketCreated")]
        return {address for address in (*sent, *sockets) if not address.startswith("blob:")}

    def errors(self) -> list[str]:
        """Return what pages have put on the browser's console, and exceptions."""
        kinds = ("Log.entryAdded", "Runtime.exceptionThrown", "Runtime.consoleAPICalled")
        return [json.dumps(e["params"]) for e in self.events if e.get("method") in kinds]

    def close(self) -> None:
        """End it."""
        self._on_exit.close()


class Tab:
    """A page that is open."""

    def __init__(self, browser: Browser, target: str, session: str) -> None:
        """Use :meth:`Browser.open`."""
        self.browser = browser
        self._target = target
        self._session = session

    def call(self, method: str, **params: Any) -> Any:
        """Call a method of the protocol for this page."""
        return self.browser.call(method, self._session, **params)

    def close(self) -> None:
        """Close it."""
        self.browser.call("Target.closeTarget", targetId=self._target)

    def resize(self, width: int, height: int) -> None:
        """Set the size of the page, in pixels."""
        self.call(
            "Emulation.setDeviceMetricsOverride",
            width=width, height=height, deviceScaleFactor=1, mobile=False,
        )  # fmt: skip

    def value(self, expression: str) -> Any:
        """Return the value of a JavaScript expression, None if it cannot be told yet."""
        answer = self.call("Runtime.evaluate", expression=expression, returnByValue=True)
        return None if "exceptionDetails" in answer else answer["result"].get("value")

    def wait(self, expression: str, timeout_s: float = 20.0) -> None:
        """Wait until an expression is true."""
        deadline_s = time.monotonic() + patient_s(timeout_s)
        while not self.value(expression):
            if time.monotonic() > deadline_s:
                text = self.value("document.body.innerText")
                raise AssertionError(f"{expression} did not happen. The page shows:\n{text}")
            time.sleep(_LOOK_S)

    def text(self, element: str) -> str:
        """Return the text of the element with an id."""
        return str(self.value(f"document.getElementById('{element}').textContent"))

    def click(self, element: str) -> None:
        """Click in the middle of the element with an id, enabled, after scrolling to it."""
        self.wait(f"!document.getElementById('{element}').disabled")
        self.value(f"document.getElementById('{element}').scrollIntoView({{block: 'nearest'}})")
        left, top, width, height = self.box(element)
        self.drag((left + width / 2, top + height / 2))

    def click_on(self, selector: str) -> None:
        """Click in the middle of the first element of a CSS selector, after scrolling to it."""
        found = f"document.querySelector({json.dumps(selector)})"
        self.value(f"{found}.scrollIntoView({{block: 'nearest'}})")
        left, top, width, height = self.value(
            f"(() => {{ const b = {found}.getBoundingClientRect();"
            " return [b.left, b.top, b.width, b.height]; })()"
        )
        self.drag((left + width / 2, top + height / 2))

    def type(self, text: str) -> None:
        """Type a text; a backspace is one."""
        if text == "\b":
            self.press("Backspace", "Backspace")
        else:
            self.call("Input.insertText", text=text)

    def box(self, element: str) -> tuple[float, float, float, float]:
        """Return left, top, width and height of the element with an id, in pixels."""
        found = self.value(
            f"(() => {{ const b = document.getElementById('{element}').getBoundingClientRect();"
            " return [b.left, b.top, b.width, b.height]; })()"
        )
        return tuple(found)

    def point_at(self, place: tuple[float, float]) -> None:
        """Move the mouse to a place."""
        self._mouse("mouseMoved", place)

    def drag(self, *places: tuple[float, float]) -> None:
        """Press the mouse at the first place, and release it at the last one."""
        self._mouse("mouseMoved", places[0])
        self._mouse("mousePressed", places[0])
        for place in places[1:]:
            self._mouse("mouseMoved", place)
        self._mouse("mouseReleased", places[-1])

    def _mouse(self, kind: str, place: tuple[float, float]) -> None:
        x, y = place
        button = "none" if kind == "mouseMoved" and not self._pressed else "left"
        self._pressed = kind != "mouseReleased" and (kind == "mousePressed" or self._pressed)
        self.call(
            "Input.dispatchMouseEvent",
            type=kind, x=x, y=y, button=button, buttons=int(self._pressed), clickCount=1,
        )  # fmt: skip

    _pressed = False

    def press(self, key: str, code: str, held_s: float = 0.0) -> None:
        """Press a key, and release it after a time in s."""
        # The browser knows the keys on which it acts itself by a number.
        number = _KEY_CODES.get(key, 0)
        event = {"key": key, "code": code, "windowsVirtualKeyCode": number}
        self.call("Input.dispatchKeyEvent", type="rawKeyDown", **event)
        time.sleep(held_s)
        self.call("Input.dispatchKeyEvent", type="keyUp", **event)

    def picture(self, file: Path) -> None:
        """Write a picture of what is seen, as PNG."""
        answer = self.call("Page.captureScreenshot", format="png")
        file.write_bytes(base64.b64decode(answer["data"]))
