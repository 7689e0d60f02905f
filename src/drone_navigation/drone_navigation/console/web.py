"""The web server of the console: its page, and one WebSocket for each that is open."""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import json
import logging
import time
from collections.abc import Callable
from http import HTTPStatus
from importlib.resources import files
from urllib.parse import urlsplit

from drone_navigation.console.access import Access
from drone_navigation.console.fleet import Fleet
from drone_navigation.console.messages import SIZE_MAX_BYTES
from drone_navigation.console.serving.web_sockets import (
    Answer,
    Connection,
    ConnectionClosed,
    Headers,
    broadcast,
    serve,
)
from drone_navigation.console.session import Page, Rules
from drone_navigation.console.shown_values import ShownValues
from drone_navigation.console.tiles.folder import Tiles, media_type, tile_of

__all__ = ["Web"]

_PERIOD_S = 0.1
_SOCKET = "/socket"
_TYPES = {
    "html": "text/html; charset=utf-8",
    "css": "text/css; charset=utf-8",
    "js": "text/javascript; charset=utf-8",
    "svg": "image/svg+xml",
}
# A page that does not read is closed, not waited for.
_UNREAD_MAX_BYTES = 8_000_000
_PAGES_MAX = 32
# Rejected connections are counted; the broken handshakes of strangers need no traceback.
_SILENT = logging.getLogger("drone_navigation.console")
_SILENT.setLevel(logging.CRITICAL)


class Web:
    """Serves one console."""

    def __init__(
        self, fleet: Fleet, board: ShownValues, token: str, tiles: Tiles | None = None
    ) -> None:
        """Read the files of the page.

        Args:
            fleet: the ROS client.
            board: what pages show.
            token: what every address must carry.
            tiles: what is drawn below the map.
        """
        self._fleet = fleet
        self._tiles = tiles
        self._board = board
        self._token = token
        self._rules = Rules(fleet, board)
        self._pages: dict[Connection, Page] = {}
        self._numbers = itertools.count(1)
        self._files = {
            f"/{file.name}": file.read_bytes()
            # The map is that of the reports, too.
            for folder in (files(__package__) / "page", files("flight_reports") / "page" / "map")
            for file in folder.iterdir()
            if file.name.rpartition(".")[2] in _TYPES
        }
        self._version = 0
        self._last_sent: dict[str, object] = {}
        self._access: Access | None = None
        self._stop = asyncio.Event()

    def stop(self) -> None:
        """End :meth:`run`; from the event loop."""
        self._stop.set()

    async def run(self, host: str, port: int, ready: Callable[[int], None]) -> None:
        """Serve until :meth:`stop`.

        Args:
            host: name or address to listen on.
            port: of TCP; 0 for a free one.
            ready: called with the port as soon as it is open.

        Raises:
            OSError: it cannot be opened.
        """
        async with serve(self._talk, self._serve, (host, port), SIZE_MAX_BYTES, _SILENT) as server:
            port = next(iter(server.sockets)).getsockname()[1]
            self._access = Access(self._token, host, port)
            ready(port)
            pusher = asyncio.create_task(self._push())
            await self._stop.wait()
            pusher.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await pusher

    # --- HTTP -------------------------------------------------------------------------------

    async def _serve(self, target: str, headers: Headers) -> Answer | None:
        """Return a file or a rejection, None to open the socket. Only GET gets here."""
        assert self._access is not None
        path = urlsplit(target).path
        denied = self._access.check(
            target,
            headers.get_all("Host"),
            headers.get_all("Origin"),
            token=path in ("/", _SOCKET) or path.startswith("/tile/"),
            origin=path == _SOCKET,
        )
        if denied is not None:
            self._rules.reject(denied.kind)
            return _response(HTTPStatus(denied.status), denied.sentence.encode())
        if path == _SOCKET:
            if len(self._pages) >= _PAGES_MAX:
                return _response(HTTPStatus.SERVICE_UNAVAILABLE, b"Too many pages are open.")
            return None
        tile = tile_of(path)
        if tile is not None and self._tiles is not None:
            return await self._serve_tile(self._tiles, *tile)
        content = self._files.get("/index.html" if path == "/" else path)
        if content is None:
            return _response(HTTPStatus.NOT_FOUND, b"There is no such file.")
        kind = "html" if path == "/" else path.rpartition(".")[2]
        socket = f"ws://{headers['Host']}"
        return _response(HTTPStatus.OK, content, _TYPES[kind], socket)

    @staticmethod
    async def _serve_tile(tiles: Tiles, zoom: int, x: int, y: int) -> Answer:
        content = await asyncio.to_thread(tiles.read, zoom, x, y)
        kind = None if content is None else media_type(content)
        if content is None or kind is None:
            # A map has gaps: for a browser, "not found" would be an error.
            return _response(HTTPStatus.NO_CONTENT, b"")
        return _response(HTTPStatus.OK, content, kind)

    # --- the socket -------------------------------------------------------------------------

    async def _talk(self, connection: Connection) -> None:
        loop = asyncio.get_running_loop()

        def tell(message: dict[str, object]) -> None:
            with contextlib.suppress(RuntimeError):  # the loop has ended
                loop.call_soon_threadsafe(_send, connection, message)

        page = Page(next(self._numbers), tell, time.monotonic())
        alone = not self._pages
        self._pages[connection] = page
        version, changes = self._board.since(0)
        # Changes that this page gets here and again with the next ones do no harm.
        first = {
            "type": "state",
            "page": page.number,
            "vehicles": changes,
            "trails": self._board.trails(),
            "tiles": self._tiles and {"min": self._tiles.zoom_min, "max": self._tiles.zoom_max},
            **self._control(),
        }
        if alone:
            self._version = version
        _send(connection, first)
        self._fleet.watch(True)
        try:
            async for data in connection:
                self._rules.take(page, data, time.monotonic())
        except ConnectionClosed:
            pass
        finally:
            del self._pages[connection]
            self._rules.close(page, time.monotonic())
            if not self._pages:
                self._fleet.watch(False)

    def _control(self) -> dict[str, object]:
        """Return who has control, how many look, and what was rejected."""
        self._rules.leases.expire(time.monotonic())
        return {
            "control": {name: self._rules.leases.holder(name) for name in self._board.vehicles()},
            "pages": len(self._pages),
            "rejected": dict(self._rules.rejected),
        }

    async def _push(self) -> None:
        """Send all pages what has changed."""
        due_s = time.monotonic()
        while True:
            # Late once, it does not hurry afterwards.
            due_s = max(due_s + _PERIOD_S, time.monotonic())
            await asyncio.sleep(due_s - time.monotonic())
            if not self._pages:
                continue
            version, changes = self._board.since(self._version)
            self._version = version
            control = self._control()
            message = {
                key: value for key, value in control.items() if self._last_sent.get(key) != value
            }
            self._last_sent = control
            if changes:
                message["vehicles"] = changes
            if message:
                text = json.dumps({"type": "state", **message}, allow_nan=False)
                broadcast(self._pages, text)
            for connection in list(self._pages):
                if connection.transport.get_write_buffer_size() > _UNREAD_MAX_BYTES:
                    connection.transport.abort()


def _send(connection: Connection, message: dict[str, object]) -> None:
    broadcast([connection], json.dumps(message, allow_nan=False))


def _response(
    status: HTTPStatus, content: bytes, kind: str = "text/plain; charset=utf-8", socket: str = ""
) -> Answer:
    """Return a response that the browser neither keeps nor lets others use."""
    connections = socket or "'none'"
    policy = (
        "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self'; "
        f"connect-src {connections}; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    )
    headers = Headers(
        {
            "Content-Type": kind,
            "Content-Length": str(len(content)),
            "Content-Security-Policy": policy,
            "Cache-Control": "no-store",
            "Cross-Origin-Opener-Policy": "same-origin",
            "Cross-Origin-Resource-Policy": "same-origin",
            "Referrer-Policy": "no-referrer",
            "X-Content-Type-Options": "nosniff",
            "X-Frame-Options": "DENY",
            "Connection": "close",
        }
    )
    return Answer(status, headers, content)
