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
their motion, moment by moment (:mod:`navigation_core.tasks.traffic.intruders`). A flight of an
autopilot by itself, but for a plane's leg, is not begun where they are about to pass.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from navigation_core.tasks.traffic.crowds import Others, TrafficAhead
from navigation_core.tasks.traffic.entries import (
    Agreement,
    Ask,
    Claimant,
    Entry,
    Grant,
    Intent,
    Rank,
    TrafficWait,
    wait_for,
    waits_through,
)
from navigation_core.tasks.traffic.intruders import Intruder
from navigation_core.tasks.traffic.path_grants import extended, extended_by_agreement
from navigation_core.tasks.traffic.volumes import Array, Mask, Separation, Volume, joined

__all__ = ["TrafficReservations"]

# Period in which more of a path is asked for, and while no other vehicle holds or announces
# anything near the path. It is less than what is reserved ahead of what a vehicle needs to stop.
_CHECK_PERIOD_S, _FAR_PERIOD_S = 0.24, 0.72


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
            found = Entry(name, Rank(Claimant.NOTHING, 0.0, name))
            # In the order of names, so that nobody has to sort them.
            self.entries = dict(sorted([*self.entries.items(), (name, found)]))
        return found

    def forget(self, name: str) -> None:
        """Forget a vehicle: what it held is known to be empty."""
        self.entries.pop(name, None)

    def others(self, name: str) -> list[Entry]:
        """Return all vehicles but one, in the order of their names."""
        return [entry for key, entry in self.entries.items() if key != name]

    def _reserving(self, name: str) -> Others:
        """Return all others but intruders."""
        return Others(
            (other for other in self.others(name) if other.intruder is None or not other.moves),
            self.separation,
        )

    def intruders(self, name: str, with_standing: bool = False) -> list[tuple[str, Intruder]]:
        """Return all intruders but one, with their names, on request also those that stand."""
        return [
            (other.name, other.intruder)
            for other in self.others(name)
            if other.intruder is not None and (with_standing or other.moves)
        ]

    @property
    def has_intruders(self) -> bool:
        """Whether there is any intruder, moving or not."""
        return any(entry.intruder is not None for entry in self.entries.values())

    # --- reservations ----------------------------------------------------------------------

    def stand(self, name: str, held: Volume, now: float, moves: bool = False) -> None:
        """Hold a volume whatever others hold: the vehicle is there, or gets there anyway."""
        entry = self.entry(name)
        if entry.wish is not None:
            entry.give_up_wish()
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
        others = Others(
            (one for one in self.others(name) if waits_for_intruders or one.intruder is None),
            self.separation,
        )
        whom, why = others.holder(volume), "which holds a part of the volume that is needed"
        if whom is None:
            whom, why = self._announced(entry, volume, others), "which has the right of way"
        agreement = self.agreement
        if whom is None and agreement is not None and not _is_agreed(agreement, entry, volume):
            whom, why = agreement.missing_from(name)
        if whom is None:
            entry.kept, entry.waiting, entry.intent = volume, None, None
            return None
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

    def blocked_by(self, name: str, line: Volume, count: int | None = None) -> str | None:
        """Return who holds something of a line, or None.

        Args:
            name: of the vehicle that would fly it.
            line: all of it, from where the vehicle is; only the whole shows whether it leads out of
                what another one holds.
            count: how many of its points are asked for; None for all.
        """
        found = self._reserving(name).first_held(line)
        return None if found is None or (count is not None and found[0] >= count) else found[1]

    def free_count(self, name: str, line: Volume) -> int:
        """Return how many points of a line, from its beginning, nobody else holds.

        With other servers it is none: they would have to agree first.
        """
        if self.agreement is not None and len(self.entries) > 1:
            return 0
        mine = line.pairs(self._reserving(name).held(line).volume, self.separation)[0]
        return int(mine.min()) if len(mine) else len(line)

    def is_settled(self, name: str, course: object, now: float) -> bool:
        """Whether more of a path was asked for just now, so that the next time can wait."""
        entry = self.entry(name)
        asked, until_s = entry.settled
        return (
            self.agreement is None
            and asked is course
            and entry.intent is not None
            and now < until_s
        )

    def stay(self, name: str, now: float) -> TrafficWait | None:
        """Hold what is held already; return what the vehicle waits for.

        Args:
            name: whose path; it must be settled.
            now: time in seconds.
        """
        entry = self.entry(name)
        entry.moves, entry.heard_s = True, now
        return entry.waiting

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
        entry.moves, entry.heard_s = True, now
        others = self._reserving(name).about(ask.path)
        if self.agreement is not None:
            granted, held, waiting = extended_by_agreement(entry, ask, others, now, self.agreement)
        else:
            granted, waiting = extended(entry, ask, others, now)
            held = granted
        is_far = waiting is None and not others and not self.has_intruders
        entry.settled = ask.course, now + (_FAR_PERIOD_S if is_far else _CHECK_PERIOD_S)
        entry.waiting = waiting
        entry.used = joined(tail, ask.path.part(0, granted))
        entry.held = entry.used if held == granted else joined(tail, ask.path.part(0, held))
        entry.intent = Intent(ask.path, now + ask.after_s)
        return Grant(granted, waiting)

    def free(self, name: str, volume: Volume) -> Mask:
        """Return which points a vehicle could hold, and stop at, shape (N,)."""
        others = Others(self.others(name), self.separation)
        blocked = volume.meets(others.held(volume).volume, self.separation)
        paths = others.paths(volume, self.entry(name).rank)
        return np.asarray(~(blocked | volume.meets(paths.volume, self.separation)))

    def _announced(self, entry: Entry, volume: Volume, others: Others) -> str | None:
        """Return whose announced path has the right of way, of those who do not wait for this one.

        A vehicle that waits for this one has to let it pass first, or both would wait for ever.
        """
        for other in others:
            if other.intent is None or not other.rank < entry.rank:
                continue
            if entry.name in waits_through(other, self.entries):
                continue
            if len(volume.pairs(other.intent.volume, self.separation)[0]):
                return other.name
        return None

    # --- who gives way ---------------------------------------------------------------------

    def must_give_way(self, name: str, now: float) -> bool:
        """Whether a waiting vehicle is the one that has to find another way.

        It is if what it waits for will not go away by itself, or if it has the worst rank among
        vehicles that wait for each other in a circle.
        """
        chain = waits_through(self.entry(name), self.entries)
        ahead = self.entries.get(chain[0]) if chain else None
        if ahead is not None and not ahead.yields(now):
            return True
        return self.is_last_of_circle(name, now)

    def is_last_of_circle(self, name: str, now: float) -> bool:
        """Whether a vehicle has the worst rank of those that wait for each other in a circle."""
        chain = waits_through(self.entry(name), self.entries)
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
        return self.ahead(name, path, now).delay_s(path, after_s)

    def ahead(self, name: str, region: Volume, now: float) -> TrafficAhead:
        """Return what may delay a vehicle on any path within a region.

        Args:
            name: who would fly there; those with a better rank are not hindered.
            region: a volume about all those paths.
            now: time in seconds.
        """
        others = Others(self.others(name), self.separation)
        standing = Others((one for one in others if not one.yields(now)), self.separation)
        paths = others.paths(region, self.entry(name).rank).cropped(region, self.separation)
        return TrafficAhead(
            standing.held_or_kept(region, False).cropped(region, self.separation).volume,
            standing.held_or_kept(region, True).cropped(region, self.separation).volume,
            paths.volume,
            paths.arrival_s - now,
            self.separation,
        )

    def snapshot(self) -> TrafficReservations:
        """Return a copy for a search beside the flight; volumes are never changed, and shared."""
        copy = TrafficReservations(self.separation)
        copy.entries = {name: replace(entry) for name, entry in self.entries.items()}
        return copy


def _is_agreed(agreement: Agreement, entry: Entry, volume: Volume) -> bool:
    """Whether a whole volume may be kept; if not, it is wished for."""
    if not entry.keeps_by_wish:
        entry.number += 1
        entry.keeps_by_wish = True
    entry.kept = volume
    if not agreement.is_given(entry.name, entry.number, volume):
        return False
    entry.keeps_by_wish = False
    return True
