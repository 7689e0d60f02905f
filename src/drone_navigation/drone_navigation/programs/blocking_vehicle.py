"""A vehicle for programs without an event loop, made of the one for those with one."""

from __future__ import annotations

import asyncio
import inspect
import threading
from collections.abc import Callable, Coroutine, Iterator
from typing import Any, TypeVar

from drone_navigation.client.events import Telemetry
from drone_navigation.programs.async_vehicle import AsyncVehicle
from drone_navigation.programs.flown_goal import FlownGoal

__all__ = ["BlockingVehicle"]

_T = TypeVar("_T")


class BlockingVehicle:
    """The methods of the other `Vehicle`, each of which returns when it is done.

    A goal takes ``wait=False`` in addition and then returns at once: iterate what it returns for
    feedback, or call its methods. Ctrl-C cancels the goal that is waited for.
    """

    def __init__(
        self, name: str = "", timeout_s: float = 10.0, origin: str = "", leased: bool = False
    ) -> None:
        """Prepare; as the other."""
        self._vehicle = AsyncVehicle(name, timeout_s, origin, leased)
        self._loop = asyncio.new_event_loop()

    def __enter__(self) -> BlockingVehicle:
        """Start an event loop in a thread, and find the server."""
        threading.Thread(target=self._turn, daemon=True).start()
        try:
            self._run(self._vehicle.__aenter__())
        except BaseException:
            self._loop.call_soon_threadsafe(self._loop.stop)
            raise
        return self

    def __exit__(self, *reason: object) -> None:
        """Cancel what is still flown, and end."""
        try:
            self._run(self._vehicle.__aexit__(None, None, None))
        finally:
            self._loop.call_soon_threadsafe(self._loop.stop)

    def _turn(self) -> None:
        self._loop.run_forever()
        self._loop.close()

    def _run(self, work: Coroutine[Any, Any, _T]) -> _T:
        """Wait for work in the event loop; what interrupts the wait cancels it, and is raised."""
        future = asyncio.run_coroutine_threadsafe(work, self._loop)
        try:
            return future.result()
        except BaseException:
            future.cancel()
            raise

    def __getattr__(self, name: str) -> Any:
        """Return the attribute of the other vehicle, its methods as ones that wait."""
        attribute = getattr(self._vehicle, name)
        return _blocking(attribute, self._run) if callable(attribute) else attribute


def _blocking(method: Callable[..., Any], run: Callable[..., Any]) -> Callable[..., Any]:
    """Return a method of an object of the event loop as one that waits for its result."""

    def call(*args: Any, wait: bool = True, **options: Any) -> Any:
        async def begin() -> Any:
            begun = method(*args, **options)
            if isinstance(begun, FlownGoal):
                return await begun if wait else _BlockingGoal(begun, run)
            return await begun if inspect.isawaitable(begun) else begun

        return run(begin())

    return call


class _BlockingGoal:
    """A goal of a program without an event loop."""

    def __init__(self, goal: FlownGoal, run: Callable[..., Any]) -> None:
        self._goal, self._run = goal, run

    def wait(self) -> Any:
        """Wait for the end; as ``await``."""

        async def end() -> Any:
            return await self._goal

        return self._run(end())

    def __iter__(self) -> Iterator[Telemetry]:
        """Give feedback until the end; as ``async for``."""
        feedback = aiter(self._goal)

        async def newest() -> Telemetry | None:
            return await anext(feedback, None)

        while (telemetry := self._run(newest())) is not None:
            yield telemetry

    def __getattr__(self, name: str) -> Any:
        """Return another method of the goal, as one that waits."""
        attribute = getattr(self._goal, name)
        return _blocking(attribute, self._run) if callable(attribute) else attribute
