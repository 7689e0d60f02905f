"""Where every vehicle is and may get to: reservations, and who may extend them.

Each vehicle holds a volume, out of which it does not get however it stops: by its brake, by running
out after its last setpoint, or by itself. Volumes that are held never come nearer to each other
than the separation, because none is extended into another: reserve before you enter. That is all
that safety needs, whatever is planned, and however late or wrong a plan is.

Each vehicle that flies a path also announces it, with the time at which it expects to be where.
This decides who goes first:

1. No reservation may end within the announced path of a vehicle with a better rank. So a vehicle
   that must stop, stops beside that path.
2. A vehicle that gets through such a path before the other comes may pass it, and reserves all of
   it up to behind it at once.
3. One that is within such a path from the beginning may continue, out of it.

Ranks are a total order, so the vehicle with the best rank is never kept waiting by anybody's plan,
and by reservations only until their owners have left or stand. Around what stands, and out of a
circle of vehicles that wait for each other, leads a detour, which the vehicle with the worst rank
in the circle takes (:meth:`TrafficReservations.must_give_way`).

Intruders reserve nothing. Their positions and courses block no path: it is compared with
their motion, moment by moment (:mod:`navigation_core.traffic.intruders`). A flight of an autopilot
by itself, but for a plane's leg, is not begun where they are about to pass.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Protocol, TypeAlias

import numpy as np

from navigation_core.traffic.intruders import Intruder
from navigation_core.traffic.right_of_way import Claimant, Rank, TrafficWait
from navigation_core.traffic.volumes import (
    NOWHERE,
    Array,
    Mask,
    Separation,
    Volume,
    blocks_near,
    joined,
)
from navigation_core.traffic.way_out import first_blocked, leading

__all__ = ["Agreement", "Ask", "Entry", "Grant", "Intent", "TrafficReservations", "wait_for"]

# An owner, a volume, and when the owner is at each of its points, which counts for paths only.
_Part: TypeAlias = tuple[str, Volume, Array | None]
# A vehicle that passes before another one must be through this long before it comes.
_PASS_BEFORE_MARGIN_S = 2.0
# Time after which a wish is given up if others hold a part of it; before, the worse of two ranks
# gives up its own.
_WISH_PATIENCE_S = 2.0
# Number of points ahead that are checked, and the period of the checks.
_LOOK_AHEAD_POINTS, _CHECK_PERIOD_S = 160, 0.24


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
        looked: for which path more was asked for last, and when.
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
    looked: tuple[object, float] = (None, -1e9)
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


@dataclass(frozen=True)
class Grant:
    """The answer to a wish.

    Attributes:
        granted: how many points of the path may be held.
        waiting: why it is not what was wanted, or None.
    """

    granted: int
    waiting: TrafficWait | None = None


class TrafficReservations:
    """The reservations that the vehicles of one server know of.

    It is written and read on one thread, and has no lock. Times are seconds of one clock.
    """

    def __init__(self, separation: Separation | None = None) -> None:
        """Begin with nobody."""
        self.separation = separation or Separation()
        self.entries: dict[str, Entry] = {}
        self.agreement: Agreement | None = None
        """Of other servers; None without any."""

    def entry(self, name: str) -> Entry:
        """Return what is known about a vehicle, which may be new."""
        found = self.entries.get(name)
        if found is None:
            rank = Rank(Claimant.NOTHING, 0.0, name)
            found = self.entries[name] = Entry(name, rank)
        return found

    def forget(self, name: str) -> None:
        """Forget a vehicle: what it held is known to be empty."""
        self.entries.pop(name, None)

    def others(self, name: str) -> Iterator[Entry]:
        """Return all vehicles but one, in the order of their names."""
        return (self.entries[key] for key in sorted(self.entries) if key != name)

    def _reserving(self, name: str) -> Iterator[Entry]:
        """Return all others but intruders."""
        return (other for other in self.others(name) if other.intruder is None or not other.moves)

    def intruders(self, name: str, with_standing: bool = False) -> list[tuple[str, Intruder]]:
        """Return all intruders but one, with their names, on request also those that stand."""
        return [
            (other.name, other.intruder)
            for other in self.others(name)
            if other.intruder is not None and (with_standing or other.moves)
        ]

    # --- reservations ----------------------------------------------------------------------

    def stand(self, name: str, held: Volume, now: float, moves: bool = False) -> None:
        """Hold a volume whatever others hold: the vehicle is there, or gets there anyway."""
        entry = self.entry(name)
        if entry.wish is not None:
            self.give_up_wish(name)
        entry.held, entry.intent, entry.moves, entry.heard_s = held, None, moves, now
        entry.used, entry.waiting = held, None

    def claim(
        self, name: str, volume: Volume, now: float, waits_for_intruders: bool = True
    ) -> TrafficWait | None:
        """Hold a whole volume besides, for something that the vehicle does by itself.

        Args:
            name: of the vehicle.
            volume: what it needs.
            now: time in seconds.
            waits_for_intruders: whether it must not be where one is, or is about to pass, that
                nobody leads; not if the motions are compared moment by moment.

        Returns:
            None if it is held now, else what it waits for; then it is announced.
        """
        entry = self.entry(name)
        others = [
            other for other in self.others(name) if waits_for_intruders or other.intruder is None
        ]
        blocker = self._holder(volume, others)
        if blocker is None:
            blocker = self._announced(entry, volume, others)
        if blocker is None and self._is_agreed(entry, volume):
            entry.kept, entry.waiting, entry.intent = volume, None, None
            return None
        whom, why = blocker or self._missing(name)
        entry.intent = Intent(volume, np.full(len(volume), now))
        entry.waiting = wait_for(entry.waiting, whom, why, now)
        return entry.waiting

    def keep(self, name: str, volume: Volume) -> None:
        """Hold a volume besides whatever others hold; NOWHERE to give it back."""
        entry = self.entry(name)
        entry.kept, entry.keeps_by_wish = volume, False

    def renew(self, name: str) -> None:
        """Have a vehicle ask again for what it was granted: another server must agree to it."""
        self.entry(name).is_new_to_others = True

    def give_up_wish(self, name: str) -> None:
        """Hold only what is used."""
        entry = self.entry(name)
        entry.number += 1
        entry.wish, entry.held = None, entry.used
        if entry.keeps_by_wish:
            entry.kept, entry.keeps_by_wish = NOWHERE, False

    def _is_agreed(self, entry: Entry, volume: Volume) -> bool:
        """Whether a whole volume may be kept; if not, it is wished for."""
        if self.agreement is None:
            return True
        if not entry.keeps_by_wish:
            entry.number += 1
            entry.keeps_by_wish = True
        entry.kept = volume
        if not self.agreement.is_given(entry.name, entry.number, volume):
            return False
        entry.keeps_by_wish = False
        return True

    def _missing(self, name: str) -> tuple[str, str]:
        assert self.agreement is not None
        return self.agreement.missing_from(name)

    def blocked_by(self, name: str, line: Volume, count: int | None = None) -> str | None:
        """Return who holds something of a line, or None.

        Args:
            name: of the vehicle that would fly it.
            line: all of it, from where the vehicle is; only the whole shows whether it leads out of
                what another one holds.
            count: how many of its points are asked for; None for all.
        """
        found = self._first_held(self.entry(name), line)
        return None if found is None or (count is not None and found[0] >= count) else found[1]

    def free_count(self, name: str, line: Volume) -> int:
        """Return how many points of a line, from its beginning, nobody else holds.

        With other servers it is none: they would have to agree first.
        """
        if self.agreement is not None and len(self.entries) > 1:
            return 0
        among = list(self._reserving(name))
        mine = line.pairs(self._held(line, among).volume, self.separation)[0]
        return int(mine.min()) if len(mine) else len(line)

    def is_settled(self, name: str, course: object, now: float) -> bool:
        """Whether more of a path was asked for just now, so that the next time can wait."""
        entry = self.entry(name)
        asked, looked_s = entry.looked
        return (
            self.agreement is None
            and asked is course
            and entry.intent is not None
            and now - looked_s < _CHECK_PERIOD_S
        )

    def follow(self, name: str, held: Volume, now: float) -> TrafficWait | None:
        """Hold what is left of what was granted; return what the vehicle waits for.

        Args:
            name: whose path; it must be settled.
            held: where it is, and what is left.
            now: time in seconds.
        """
        entry = self.entry(name)
        entry.moves, entry.heard_s = True, now
        entry.used = entry.held = held
        return entry.waiting

    def extend(self, name: str, ask: Ask, tail: Volume, now: float) -> Grant:
        """Hold more of a path, as far as that is free.

        Args:
            name: whose path.
            ask: what is wanted.
            tail: what the vehicle holds in any case, ahead of what is granted: where it is, and
                where it would run out to.
            now: time in seconds.
        """
        entry = self.entry(name)
        entry.moves, entry.heard_s, entry.looked = True, now, (ask.course, now)
        if self.agreement is None:
            granted, held, waiting = self._alone(entry, ask, now)
        else:
            granted, held, waiting = self._among_servers(entry, ask, now, self.agreement)
        entry.waiting = waiting
        entry.used = joined(tail, ask.path.part(0, granted))
        entry.held = entry.used if held == granted else joined(tail, ask.path.part(0, held))
        entry.intent = Intent(ask.path, now + ask.after_s)
        return Grant(granted, waiting)

    def _alone(self, entry: Entry, ask: Ask, now: float) -> tuple[int, int, TrafficWait | None]:
        """Return how much may be used and is held of a path, and what it waits for."""
        if ask.granted >= min(ask.enough, len(ask.path)):
            return ask.granted, ask.granted, None
        granted, waiting = self._extended(entry, ask, now)
        return granted, granted, waiting

    def _among_servers(
        self, entry: Entry, ask: Ask, now: float, agreement: Agreement
    ) -> tuple[int, int, TrafficWait | None]:
        """Return the same where others have to agree to each extension before it is used.

        All of the path that is free is asked for, so that agreement exists when the network is
        cut. Parts not needed yet are given back where the path of a better rank leads through.
        """
        if entry.is_new_to_others:
            self.give_up_wish(entry.name)
            ask = replace(ask, granted=0)
            entry.is_new_to_others = False
        count, granted = len(ask.path), self._still_held(entry, ask, now)
        ask = replace(ask, granted=granted, wanted=count, enough=count)
        if entry.wish is not None and entry.wish.course is not ask.course:
            self.give_up_wish(entry.name)
        if entry.wish is not None:
            count = max(entry.wish.count - ask.passed, ask.granted)
            wished = ask.path.part(0, count)
            if agreement.is_given(entry.name, entry.number, wished):
                entry.wish = None
                ask = replace(ask, granted=count)
            elif (
                now - entry.wish.since_s < _WISH_PATIENCE_S
                or self._first_held(entry, wished, ask.granted) is None
            ):
                whom, why = self._missing(entry.name)
                return ask.granted, count, wait_for(entry.waiting, whom, why, now)
            else:  # somebody has got into it, and its server never agrees
                self.give_up_wish(entry.name)
        _, held, waiting = self._alone(entry, ask, now)
        if held == ask.granted:
            return held, held, waiting
        entry.number += 1
        if agreement.is_given(entry.name, entry.number, ask.path.part(0, held)):
            return held, held, waiting
        entry.wish = Wish(ask.course, ask.passed + held, now)
        return ask.granted, held, waiting

    def _still_held(self, entry: Entry, ask: Ask, now: float) -> int:
        """Return how much of a path is held on, of what was granted."""
        if ask.granted <= ask.wanted:
            return ask.granted
        spare = ask.path.part(0, ask.granted)
        near = self._better(entry, spare, now + ask.after_s[: ask.granted])[0]
        near[: ask.wanted] = False
        if not near.any():
            return ask.granted
        self.give_up_wish(entry.name)
        return max(int(near.argmax()), ask.wanted)

    def free(self, name: str, volume: Volume) -> Mask:
        """Return which points a vehicle could hold, and stop at, shape (N,)."""
        entry = self.entry(name)
        among = list(self.others(name))
        blocked = volume.meets(self._held(volume, among).volume, self.separation)
        paths = self._paths(entry, volume, among)
        return np.asarray(~(blocked | volume.meets(paths.volume, self.separation)))

    def _extended(self, entry: Entry, ask: Ask, now: float) -> tuple[int, TrafficWait | None]:
        count = min(len(ask.path), ask.granted + _LOOK_AHEAD_POINTS)
        window = ask.path.part(0, count)
        limit, holder = count, ""
        blocked = self._first_held(entry, window, ask.granted)
        if blocked is not None:
            limit, holder = blocked
        near, late, owners = self._better(entry, window, now + ask.after_s[:count])
        inside = leading(near)
        near[:inside] = False
        late[:inside] = False
        if late[ask.granted : limit].any():
            limit = ask.granted + int(late[ask.granted : limit].argmax())
            holder = owners(limit)
        stops = np.flatnonzero(~near[ask.granted : limit])
        granted = ask.granted + int(stops[-1]) + 1 if len(stops) else ask.granted
        if len(stops) and granted > ask.wanted:
            # No further than to the first point to stop at that is far enough.
            enough = stops[stops + ask.granted + 1 >= ask.wanted]
            granted = ask.granted + int(enough[0]) + 1 if len(enough) else granted
        if granted >= min(ask.wanted, count):
            return granted, None
        if limit < count:
            why = "which has the right of way" if late[limit] else "which holds what is ahead"
        else:
            holder, why = owners(granted), "whose path leads there"
        return granted, wait_for(entry.waiting, holder, why, now)

    def _better(
        self, entry: Entry, path: Volume, times_s: Array
    ) -> tuple[Mask, Mask, Callable[[int], str]]:
        """Return where a path meets announced paths of better ranks, and where it is too late.

        The third returns whose path that is, for a point where one is met.
        """
        paths = self._paths(entry, path, self._reserving(entry.name))
        mine, theirs = path.pairs(paths.volume, self.separation)
        soonest_s = np.full(len(path), np.inf)
        np.minimum.at(soonest_s, mine, paths.arrival_s[theirs])
        near = np.isfinite(soonest_s)
        late = near & (soonest_s < times_s + _PASS_BEFORE_MARGIN_S)

        def owner(point: int) -> str:
            met = theirs[mine == point]
            return paths.owner(met[int(paths.arrival_s[met].argmin())])

        return near, late, owner

    def _paths(self, entry: Entry, near: Volume, among: Iterable[Entry]) -> _Crowd:
        """Return the announced paths near a volume of those with a better rank, as one."""
        return self._crowd(
            near,
            [
                (other.name, other.intent.volume, other.intent.arrival_s)
                for other in among
                if other.intent is not None and other.rank < entry.rank
            ],
        )

    def _held(self, near: Volume, among: Iterable[Entry]) -> _Crowd:
        """Return what others hold near a volume, as one."""
        return self._crowd(near, [(other.name, other.whole, None) for other in among])

    def _crowd(self, near: Volume, parts: list[_Part]) -> _Crowd:
        """Return those volumes, with the arrival times of each, that come near to one, as one."""
        parts = [parts[row] for row in near.near([part[1] for part in parts], self.separation)]
        if len(parts) > 1:
            lows, highs = zip(*(volume.blocks for _, volume, _ in parts), strict=True)
            blocks = (np.concatenate(lows, axis=1), np.concatenate(highs, axis=1))
            touched = blocks_near(near.blocks, blocks, self.separation).any(axis=0)
            starts = np.cumsum([0, *(low.shape[1] for low in lows[:-1])])
            is_near = np.logical_or.reduceat(touched, starts)
            parts = [part for part, kept in zip(parts, is_near, strict=True) if kept]
        return _Crowd.of(parts)

    def _first_held(
        self, entry: Entry, path: Volume, begin: int = 0, others: list[Entry] | None = None
    ) -> tuple[int, str] | None:
        """Return where a path first gets into what others hold, and whose that is."""
        among = list(self._reserving(entry.name)) if others is None else others
        found: list[tuple[int, str]] = []
        for is_kept in (False, True):
            crowd = self._crowd(
                path,
                [(other.name, other.kept if is_kept else other.held, None) for other in among],
            )
            met = first_blocked(path, crowd.volume, self.separation, begin, is_kept)
            if met is not None:
                found.append((met[0], crowd.owner(met[1])))
        return min(found, default=None)

    def _holder(self, volume: Volume, among: Sequence[Entry]) -> tuple[str, str] | None:
        held = self._held(volume, among)
        theirs = volume.pairs(held.volume, self.separation)[1]
        if not len(theirs):
            return None
        return held.owner(theirs[0]), "which holds a part of the volume that is needed"

    def _announced(
        self, entry: Entry, volume: Volume, among: Sequence[Entry]
    ) -> tuple[str, str] | None:
        """Return whose announced path has the right of way, of those who do not wait for this one.

        A vehicle that waits for this one has to let it pass first, or both would wait for ever.
        """
        for other in among:
            if other.intent is None or not other.rank < entry.rank:
                continue
            if entry.name in self._chain(other):
                continue
            if len(volume.pairs(other.intent.volume, self.separation)[0]):
                return other.name, "which has the right of way"
        return None

    def _chain(self, entry: Entry) -> list[str]:
        """Return whom a vehicle waits for, whom that one waits for, and so on."""
        names: list[str] = []
        following: Entry | None = entry
        while following is not None and following.waiting is not None:
            if following.waiting.whom in names:
                break
            names.append(following.waiting.whom)
            following = self.entries.get(following.waiting.whom)
        return names

    # --- who gives way ---------------------------------------------------------------------

    def must_give_way(self, name: str, now: float) -> bool:
        """Whether a waiting vehicle is the one that has to find another way.

        It is if what it waits for will not go away by itself, or if it has the worst rank among
        vehicles that wait for each other in a circle.
        """
        chain = self._chain(self.entry(name))
        ahead = self.entries.get(chain[0]) if chain else None
        if ahead is not None and not ahead.yields(now):
            return True
        return self.is_last_of_circle(name, now)

    def is_last_of_circle(self, name: str, now: float) -> bool:
        """Whether a vehicle has the worst rank of those that wait for each other in a circle."""
        chain = self._chain(self.entry(name))
        if name not in chain:
            return False
        circle = [self.entries[one] for one in chain[: chain.index(name) + 1]]
        able = [one for one in circle if one.yields(now)]
        return bool(able) and max(able, key=lambda one: one.rank).name == name

    def delay_s(self, name: str, path: Volume, after_s: Array, now: float) -> float:
        """Return by how much a path is best begun later; infinite if it leads through what stands.

        Args:
            name: who would fly it; those with a better rank are not hindered.
            path: its points in order.
            after_s: time until each, if it is begun now.
            now: time in seconds.
        """
        entry = self.entry(name)
        standing = [other for other in self.others(name) if not other.yields(now)]
        if self._first_held(entry, path, others=standing) is not None:
            return float("inf")
        paths = self._paths(entry, path, self.others(name))
        mine, theirs = path.pairs(paths.volume, self.separation)
        return _first_gap(paths.arrival_s[theirs] - now - after_s[mine] - _PASS_BEFORE_MARGIN_S)

    def snapshot(self) -> TrafficReservations:
        """Return a copy for a search beside the flight; volumes are never changed, and shared."""
        copy = TrafficReservations(self.separation)
        copy.entries = {name: replace(entry) for name, entry in self.entries.items()}
        return copy


@dataclass(frozen=True, eq=False)
class _Crowd:
    """Volumes of several vehicles as one.

    Attributes:
        volume: all of them.
        arrival_s: when their owners are there, shape (N,); 0 for what they hold.
        ends: where the points of each end.
        names: of the owners.
    """

    volume: Volume
    arrival_s: Array
    ends: Array
    names: tuple[str, ...]

    @classmethod
    def of(cls, parts: list[_Part]) -> _Crowd:
        volume = joined(*(part[1] for part in parts))
        arrivals_s = [part[2] for part in parts if part[2] is not None]
        arrival_s = np.concatenate(arrivals_s) if arrivals_s else np.zeros(len(volume))
        ends = np.cumsum([len(part[1]) for part in parts])
        return cls(volume, arrival_s, ends, tuple(part[0] for part in parts))

    def owner(self, point: int) -> str:
        """Return whose point that is."""
        return self.names[int(np.searchsorted(self.ends, point, side="right"))]


def _first_gap(begins_s: Array) -> float:
    """Return the least delay outside of intervals that each last twice the time to be before."""
    length_s = 2.0 * _PASS_BEFORE_MARGIN_S
    begins_s = np.sort(begins_s[begins_s + length_s > 0.0])
    if not len(begins_s) or begins_s[0] > 0.0:
        return 0.0
    gaps = np.flatnonzero(np.diff(begins_s) > length_s)
    last = int(gaps[0]) if len(gaps) else len(begins_s) - 1
    return float(begins_s[last]) + length_s


def wait_for(before: TrafficWait | None, whom: str, why: str, now: float) -> TrafficWait:
    """Return a wait that continues, perhaps for another vehicle, or begins."""
    return TrafficWait(whom, why, now if before is None else before.since_s)
