"""Right of way: a total order of vehicles, and why one waits for another."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

__all__ = ["Claimant", "Rank", "TrafficWait", "wait_for"]


class Claimant(IntEnum):
    """The cause of a vehicle's motion; the lesser goes first."""

    FIRMWARE = 0
    """It flies by itself: a failsafe, a pilot, a mission. No server can make it wait."""
    GOAL = 1
    """It flies a goal of a server."""
    NOTHING = 2
    """It stands, and has no goal."""


@dataclass(frozen=True, order=True)
class Rank:
    """The right of way of a vehicle. Ranks are a total order; the lesser goes first.

    The age of a goal is part of it. Every goal that ends makes all later ones older in comparison,
    so that each is the oldest in the end: nobody waits for ever for those who came later.

    Attributes:
        claimant: what moves it.
        since_s: when its goal was accepted, on the clock of the shared reservations.
        name: of the vehicle; decides between equals.
    """

    claimant: Claimant
    since_s: float
    name: str


@dataclass(frozen=True)
class TrafficWait:
    """Why a vehicle waits.

    Attributes:
        whom: the vehicle that it waits for.
        why: the reason, as the end of a sentence: "which holds the position ahead".
        since_s: since when.
    """

    whom: str
    why: str
    since_s: float

    @property
    def text(self) -> str:
        """The reason as a sentence."""
        return f"Waits for {self.whom}, {self.why}."


def wait_for(before: TrafficWait | None, whom: str, why: str, now: float) -> TrafficWait:
    """Return a wait that continues, perhaps for another vehicle, or begins."""
    return TrafficWait(whom, why, now if before is None else before.since_s)
