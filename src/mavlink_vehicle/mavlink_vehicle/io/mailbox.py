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
    """Keeps work until its thread takes it, in order; a driver derives from it.

    Attributes:
        thread: the thread that does the work; None before it is started.
        works: what waits for it.
    """

    def __init__(self, owner: str) -> None:
        """Begin empty; ``owner`` is the thread's name in messages, such as "driver"."""
        self.thread: threading.Thread | None = None
        self.works: deque[tuple[Callable[[], object], Future[Any] | None]] = deque()
        self._owner = owner
        self._takes_calls = True

    def wake(self) -> None:
        """Have the thread look into the mailbox soon; called by any thread."""

    @property
    def running(self) -> bool:
        """Whether the thread is alive."""
        return self.thread is not None and self.thread.is_alive()

    def post(self, work: Callable[[], object]) -> None:
        """Run `work` on the thread, soon.

        Before the thread has started it is kept; after it has stopped it is dropped.
        """
        self.works.append((work, None))
        self.wake()

    def call(self, work: Callable[[], ResultT], timeout_s: float = 5.0) -> ResultT:
        """Run `work` on the thread and return its result; raises what it raises.

        Raises:
            DriverError: the thread isn't running, or did not get to it in time.
        """
        if threading.current_thread() is self.thread:
            return work()
        future: Future[Any] = Future()
        self.works.append((work, future))
        if not (self.running and self._takes_calls):
            raise DriverError(f"The {self._owner} is not running; start it first.")
        self.wake()
        done, _ = wait([future], timeout_s)
        if not done:
            future.cancel()
            raise DriverError(f"The {self._owner} did not answer within {timeout_s} s.")
        result: ResultT = future.result()
        return result

    def do_next(self) -> None:
        """Do the first of the work, on the thread; raises what posted work raises."""
        work, future = self.works.popleft()
        if future is None:
            work()
        elif future.set_running_or_notify_cancel():
            try:
                future.set_result(work())
            except Exception as error:  # it is raised in the caller
                future.set_exception(error)

    def drop_calls(self) -> None:
        """Drop the calls that are left; those who wait for them get a `DriverError`."""
        self._takes_calls = False
        while self.works:
            _, future = self.works.popleft()
            if future is not None and future.set_running_or_notify_cancel():
                future.set_exception(DriverError(f"The {self._owner} has stopped."))
