"""The reservations of each vehicle as they are known, its right of way, and questions for more."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import IntEnum
from typing import Protocol

from navigation_core.tasks.traffic.intruders import Intruder
from navigation_core.tasks.traffic.volumes import NOWHERE, Array, Volume, joined

__all__ = [
    "Agreement",
    "Ask",
    "Claimant",
    "Entry",
    "Grant",
    "Intent",
    "Rank",
    "TrafficWait",
    "Wish",
    "wait_for",
    "waits_through",
]


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


@dataclass(frozen=True, eq=False)
class Intent:
    """The announced path of a vehicle.

    Attributes:
        volume: where it goes, in order.
        arrival_s: when it expects to be at each point.
    """

    volume: Volume
    arrival_s: Array


@dataclass(frozen=True)
class Wish:
    """A part of a path that other servers have to agree to.

    Attributes:
        course: identifies the path.
        count: how many of its points are wished for, from its beginning.
        since_s: since when.
    """

    course: object
    count: int
    since_s: float


class Agreement(Protocol):
    """Asks other servers whether they agree to what a vehicle would like to hold."""

    def is_given(self, name: str, number: int, volume: Volume) -> bool:
        """Whether all that may be concerned agree to a wish."""

    def missing_from(self, name: str) -> tuple[str, str]:
        """Return who has not agreed to a wish, and why, as :class:`TrafficWait` says it."""


@dataclass
class Entry:
    """The reservations of one vehicle: its reservation, its announced path, its rank.

    Attributes:
        name: its name.
        rank: its right of way.
        held: the volume that it holds.
        kept: what it holds besides, until that is given back: the volume of a take-off, a return.
        intent: its announced path, or None.
        target: where its goal leads, or None.
        moves: whether it is expected to leave what it holds without anybody's help.
        waiting: what it waits for, or None.
        stuck_until_s: until when there is no use in asking it to give way.
        settled: for which path more was asked for last, and until when that is enough.
        heard_s: when this was known last.
        used: what it holds and all servers have agreed to, besides what it keeps.
        wish: what it would like to hold beyond that, or None.
        keeps_by_wish: whether what it keeps is not agreed to yet.
        number: counts its wishes.
        intruder: where it is and how it moves, if nobody here or on another server leads it; else
            None. One that does not move is kept clear of by what it holds.
        is_new_to_others: whether what it was granted is to be agreed to by a server heard since.
    """

    name: str
    rank: Rank
    held: Volume = NOWHERE
    kept: Volume = NOWHERE
    intent: Intent | None = None
    target: Volume | None = None
    moves: bool = False
    waiting: TrafficWait | None = None
    stuck_until_s: float = -1e9
    settled: tuple[object, float] = (None, -1e9)
    heard_s: float = 0.0
    used: Volume = NOWHERE
    wish: Wish | None = None
    keeps_by_wish: bool = False
    number: int = 0
    intruder: Intruder | None = None
    is_new_to_others: bool = False
    _whole: tuple[Volume, Volume, Volume] | None = field(default=None, repr=False)

    @property
    def whole(self) -> Volume:
        """All that it holds."""
        if not len(self.kept):
            return self.held
        if self._whole is None or self._whole[:2] != (self.held, self.kept):
            self._whole = (self.held, self.kept, joined(self.held, self.kept))
        return self._whole[2]

    def yields(self, now: float) -> bool:
        """Whether it is expected to get out of the way."""
        return self.moves and now >= self.stuck_until_s

    def give_up_wish(self) -> None:
        """Hold only what is used."""
        self.number += 1
        self.wish, self.held = None, self.used
        if self.keeps_by_wish:
            self.kept, self.keeps_by_wish = NOWHERE, False


def waits_through(entry: Entry, entries: Mapping[str, Entry]) -> list[str]:
    """Return whom a vehicle waits for, whom that one waits for, and so on."""
    names: list[str] = []
    following: Entry | None = entry
    while following is not None and following.waiting is not None:
        if following.waiting.whom in names:
            break
        names.append(following.waiting.whom)
        following = entries.get(following.waiting.whom)
    return names


@dataclass(frozen=True, eq=False)
class Ask:
    """A wish to hold more of a path.

    Attributes:
        path: the path from where the setpoint is to its end.
        after_s: time until the vehicle is at each point, shape (N,).
        granted: how many of the points it holds already.
        wanted: how many it would like to hold.
        enough: with how many it does not ask for more.
        course: identifies the path.
        passed: how many of its points were left behind.
    """

    path: Volume
    after_s: Array
    granted: int
    wanted: int
    enough: int
    course: object = None
    passed: int = 0

    @property
    def is_enough(self) -> bool:
        """Whether it holds enough already."""
        return self.granted >= min(self.enough, len(self.path))


@dataclass(frozen=True)
class Grant:
    """The answer to a wish.

    Attributes:
        granted: how many points of the path may be held.
        waiting: why it is not what was wanted, or None.
    """

    granted: int
    waiting: TrafficWait | None = None
