"""Waits in an executor's thread for an answer of the driver's thread."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Generic, TypeVar

AnswerT = TypeVar("AnswerT")

_LOOK_S = 0.1
STOPPED = "The server is being stopped."


class Waiting(Generic[AnswerT]):
    """One request's answer; `take` is called on the driver's thread."""

    def __init__(self) -> None:
        """Wait for nothing yet."""
        self._done = threading.Event()
        self.answer: AnswerT | None = None

    def take(self, answer: AnswerT) -> None:
        """Take the answer."""
        self.answer = answer
        self._done.set()

    def wait(
        self,
        timeout_s: float,
        closed: Callable[[], bool],
        look: Callable[[], bool] = lambda: False,
    ) -> AnswerT | None:
        """Return the answer; None if it did not come.

        Args:
            timeout_s: how long to wait, from the last time that `look` returned True.
            closed: whether the server is being stopped.
            look: called ten times a second; returns whether there was progress.
        """
        silent_s = 0.0
        while not self._done.wait(_LOOK_S) and silent_s < timeout_s and not closed():
            silent_s = 0.0 if look() else silent_s + _LOOK_S
        return self.answer
