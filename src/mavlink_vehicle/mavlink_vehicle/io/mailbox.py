"""Work that other threads hand to the thread of a driver."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future, wait
from typing import Any, TypeVar

from mavlink_vehicle.errors import DriverError

ResultT = TypeVar("ResultT")


class Mailbox:
    """Keeps work until its thread takes it, in order.

    Attributes:
        thread: the thread that does the work; None before it is started.
    """

    def __init__(self, owner: str, wake: Callable[[], object]) -> None:
        """Begin empty.

        Args:
            owner: what the thread is, for messages: "driver".
            wake: makes the thread look into the mailbox soon; called by any thread.
        """
        self.thread: threading.Thread | None = None
        self._owner = owner
        self._wake = wake
        self._closed = False
        self._works: deque[tuple[Callable[[], object], Future[Any] | None]] = deque()

    def __len__(self) -> int:
        """How much work waits."""
        return len(self._works)

    @property
    def running(self) -> bool:
        """Whether the thread is alive."""
        return self.thread is not None and self.thread.is_alive()

    def post(self, work: Callable[[], object]) -> None:
        """Have work done soon; nobody waits for it."""
        self._works.append((work, None))
        self._wake()

    def call(self, work: Callable[[], ResultT], timeout_s: float) -> ResultT:
        """Have work done and return its result; raises what it raises.

        Raises:
            DriverError: the thread isn't running, or did not get to it in time.
        """
        if threading.current_thread() is self.thread:
            return work()
        future: Future[Any] = Future()
        self._works.append((work, future))
        if not self.running or self._closed:
            raise DriverError(f"The {self._owner} is not running; start it first.")
        self._wake()
        done, _ = wait([future], timeout_s)
        if not done:
            future.cancel()
            raise DriverError(f"The {self._owner} did not answer within {timeout_s} s.")
        result: ResultT = future.result()
        return result

    def do_next(self) -> None:
        """Do the first of the work, on the thread; raises what posted work raises."""
        work, future = self._works.popleft()
        if future is None:
            work()
        elif future.set_running_or_notify_cancel():
            try:
                future.set_result(work())
            except Exception as error:  # it is raised in the caller
                future.set_exception(error)

    def close(self) -> None:
        """Drop the calls that are left; those who wait for them get a `DriverError`."""
        self._closed = True
        while self._works:
            _, future = self._works.popleft()
            if future is not None and future.set_running_or_notify_cancel():
                future.set_exception(DriverError(f"The {self._owner} has stopped."))
