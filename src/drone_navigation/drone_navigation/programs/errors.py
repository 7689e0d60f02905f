"""The one exception of flying from Python."""

from __future__ import annotations

from drone_navigation.client.events import Ended

__all__ = ["NO_SERVER", "REQUEST_REJECTED", "NavigationError", "error_of"]

NO_SERVER = "NO_SERVER"
"""No server was found, it did not answer, or it went away: no code of GoalCode.msg"""

REQUEST_REJECTED = "REQUEST_REJECTED"
"""A request that is no goal, such as a mode, was not done: these have a sentence and no code"""


class NavigationError(Exception):
    """A goal or a request that was not done.

    Attributes:
        code: a name of GoalCode.msg such as OUTSIDE_VOLUME, or NO_SERVER, or REQUEST_REJECTED.
        message: a sentence for people.
        end: where and when the goal ended; None if it never began, or nothing is known of its end.
    """

    def __init__(self, code: str, message: str, end: Ended | None = None) -> None:
        """Hold what happened."""
        super().__init__(f"{code}: {message}")
        self.code = code
        self.message = message
        self.end = end


def error_of(end: Ended) -> NavigationError | None:
    """Return the error that the end of a goal is; None for a success."""
    if end.state == "SUCCEEDED":
        return None
    return NavigationError(end.code, end.message.removeprefix(f"{end.code}: "), end)
