"""The server that the package websockets brings: that of its version 13 and later, or the older.

Ubuntu 24.04 and Debian 12 have 10.4, whose server newer versions call "legacy".
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import AsyncIterator, Awaitable, Callable, Iterable
from contextlib import AbstractAsyncContextManager
from http import HTTPStatus
from typing import Any, NamedTuple, Protocol

from websockets.datastructures import Headers
from websockets.exceptions import ConnectionClosed

__all__ = ["Answer", "Connection", "ConnectionClosed", "Headers", "broadcast", "serve"]


class Answer(NamedTuple):
    """A response to a request that opens no socket."""

    status: HTTPStatus
    headers: Headers
    content: bytes


class Connection(Protocol):
    """An open socket."""

    @property
    def transport(self) -> asyncio.Transport:
        """Where what is sent waits."""
        ...

    def __aiter__(self) -> AsyncIterator[str | bytes]:
        """Return the messages that come in."""
        ...


class _Server(Protocol):
    @property
    def sockets(self) -> Iterable[Any]: ...


Answering = Callable[[str, Headers], Awaitable["Answer | None"]]
"""Takes the path, with the query, and the headers of a GET; None opens the socket"""

broadcast: Callable[[Iterable[Any], str], None]
"""Sends a text to all of some connections, without waiting for one"""
_newer: Any = None
try:
    from websockets.asyncio import server as _newer

    broadcast = _newer.broadcast
except ModuleNotFoundError:
    from websockets.legacy import protocol as _older

    broadcast = _older.broadcast


def serve(
    talk: Callable[[Any], Awaitable[None]],
    answer: Answering,
    address: tuple[str, int],
    size_max_bytes: int,
    logger: logging.Logger,
) -> AbstractAsyncContextManager[_Server]:
    """Return a server, which listens while it is entered.

    Args:
        talk: called with each `Connection`, which is closed when it returns.
        answer: called with each request.
        address: host, and port of TCP.
        size_max_bytes: of a message; a longer one ends its connection.
        logger: of what clients do.
    """
    host, port = address
    options: dict[str, Any] = {
        "compression": None,
        "max_size": size_max_bytes,
        "server_header": None,
        "logger": logger,
        "ping_interval": 10.0,
        "ping_timeout": 10.0,
        "close_timeout": 1.0,
    }
    if _newer is None:
        from websockets.legacy.server import serve as older  # noqa: PLC0415 - deprecated

        # It takes the answer as it is.
        return older(talk, host, port, process_request=answer, **options)

    async def process(_: object, request: Any) -> Any:
        from websockets.http11 import Response  # noqa: PLC0415

        given = await answer(request.path, request.headers)
        if given is None:
            return None
        return Response(given.status.value, given.status.phrase, given.headers, given.content)

    server: AbstractAsyncContextManager[_Server] = _newer.serve(
        talk, host, port, process_request=process, **options
    )
    return server
