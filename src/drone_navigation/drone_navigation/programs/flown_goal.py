"""A goal that a program has sent: awaited for its end, iterated for its feedback."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator, Callable, Generator
from functools import partial
from typing import TypeVar

from drone_navigation.client.client_goal import ClientGoal
from drone_navigation.client.events import Ended, Telemetry
from drone_navigation.programs.errors import NO_SERVER, NavigationError, error_of
from drone_navigation.programs.server_link import ServerLink, TrackedGoal

__all__ = ["FlownGoal"]

_T = TypeVar("_T")
_STOP_S = 30.0
"""Longest wait for the end of a goal that is cancelled"""


class FlownGoal:
    """A goal, from its sending to its end.

    ``await`` gives the end of a goal that has succeeded, and raises a `NavigationError` for any
    other. ``async for`` gives feedback, the newest to a slow loop, and then raises in the same way.
    Where the waiting task is cancelled, so is the goal.
    """

    def __init__(
        self, link: ServerLink, client_goal: ClientGoal, origin: str = "", leased: bool = False
    ) -> None:
        """Send it at once; called in the event loop.

        Args:
            link: to the server.
            client_goal: what is sent.
            origin: the program's name for itself; empty for none.
            leased: whether the server ends it once this process is not heard any more.
        """
        self._link = link
        self._loop = asyncio.get_running_loop()
        self._accepted: asyncio.Future[None] = self._loop.create_future()
        self._end: asyncio.Future[Ended] = self._loop.create_future()
        self._newest: Telemetry | None = None
        self._news = asyncio.Event()
        self._tracked: TrackedGoal | None = None
        self._cancels = False
        link.post(partial(self._send, client_goal, origin, leased))

    # --- the thread of ROS ---------------------------------------------------------------

    def _send(self, client_goal: ClientGoal, origin: str, leased: bool) -> None:
        self._tracked = self._link.send(client_goal, self, origin, leased)
        self._tracked.cancels = self._cancels

    def _cancel(self) -> None:
        if self._tracked is not None:
            self._tracked.cancels = True

    def accept(self) -> None:
        """The server has accepted it."""
        self._call(self._take_acceptance)

    def feed(self, telemetry: Telemetry) -> None:
        """A feedback."""
        self._call(partial(self._take, telemetry))

    def finish(self, end: Ended | NavigationError) -> None:
        """Its end; or nothing is known of it, or it was rejected."""
        self._call(partial(self._take_end, end))

    def _call(self, work: Callable[[], None]) -> None:
        with contextlib.suppress(RuntimeError):  # the loop is closed
            self._loop.call_soon_threadsafe(work)

    # --- the event loop ------------------------------------------------------------------

    def _take_acceptance(self) -> None:
        if not self._accepted.done():
            self._accepted.set_result(None)

    def _take(self, telemetry: Telemetry) -> None:
        self._newest = telemetry
        self._news.set()

    def _take_end(self, end: Ended | NavigationError) -> None:
        if self._end.done():
            return
        error = end if isinstance(end, NavigationError) else error_of(end)
        if error is None:
            assert isinstance(end, Ended)
            self._take_acceptance()
            self._end.set_result(end)
        else:
            self._end.set_exception(error)
            if error.code in ("PREEMPTED", "CANCELED"):
                self._end.exception()  # asked for: not reported as never retrieved
            if not self._accepted.done():
                self._accepted.set_exception(error)
                self._accepted.exception()
        self._news.set()

    @property
    def is_over(self) -> bool:
        """Whether it has ended, was rejected or is given up."""
        return self._end.done()

    async def accepted(self) -> None:
        """Wait until the server has accepted it.

        Raises:
            NavigationError: it was rejected, or nobody answered.
        """
        await self._until(self._accepted)

    async def cancel(self) -> Ended | None:
        """Cancel it, and wait until the vehicle has stopped.

        Returns:
            Its end, whichever that was; None if nothing was flown.

        Raises:
            NavigationError: with NO_SERVER, if nothing is known of its end.
        """
        self._cancels = True
        self._link.post(self._cancel)
        try:
            return await asyncio.wait_for(asyncio.shield(self._end), _STOP_S)
        except NavigationError as error:
            if error.code == NO_SERVER:
                raise
            return error.end
        except asyncio.TimeoutError:
            text = f"The goal did not end within {_STOP_S:g} s after its cancel."
            raise NavigationError(NO_SERVER, text) from None

    def __await__(self) -> Generator[object, None, Ended]:
        """Wait for the end."""
        return self._until(self._end).__await__()

    async def _until(self, future: asyncio.Future[_T]) -> _T:
        try:
            return await asyncio.shield(future)
        except asyncio.CancelledError:
            with contextlib.suppress(NavigationError):
                await self.cancel()
            raise

    async def __aiter__(self) -> AsyncIterator[Telemetry]:
        """Give feedback until the end."""
        while not self._end.done():
            self._news.clear()
            try:
                await self._news.wait()
            except asyncio.CancelledError:
                with contextlib.suppress(NavigationError):
                    await self.cancel()
                raise
            if self._newest is not None and not self._end.done():
                yield self._newest
        await self
