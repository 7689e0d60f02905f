"""Sentences about the active goal, each for as long as it holds. No ROS."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass
class Remarks:
    """The sentences about one goal.

    A status comes with its reason, which holds until the next status. What is said in between,
    such as what a ground station did, often leads to the next status, and holds until that ends.

    Attributes:
        notes: those that the goal's end will repeat.
    """

    notes: tuple[str, ...] = ()
    _status: str | None = None
    _reason: str = ""
    _said: list[str] = field(default_factory=list)
    _led_here: list[str] = field(default_factory=list)

    def hear(self, status: str, text: str) -> None:
        """Take a GoalEvent: a new status with its reason, or the same with a sentence."""
        if status == self._status:
            self._said.append(text)
            return
        self._status, self._reason = status, text
        self._led_here, self._said = self._said, []

    def sentences(self) -> list[str]:
        """Return those that hold, each once."""
        all_of_them = (*self.notes, *self._led_here, self._reason, *self._said)
        return [text for text in dict.fromkeys(all_of_them) if text]
