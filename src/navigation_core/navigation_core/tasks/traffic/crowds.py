"""The volumes of several vehicles as one, and where a path meets them.

A path may be held beside what others hold: never into it, but out of it. The server of a vehicle
applies that rule (:func:`first_blocked`) before it asks for a path, and other servers before they
agree, so that none asks for ever for what another one rejects.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from navigation_core.tasks.traffic.entries import Entry, Rank
from navigation_core.tasks.traffic.volumes import (
    BLOCK,
    NOWHERE,
    Array,
    Mask,
    Separation,
    Volume,
    blocks_near,
    joined,
)

__all__ = ["PASS_BEFORE_MARGIN_S", "Crowd", "Others", "TrafficAhead", "first_blocked", "leading"]

PASS_BEFORE_MARGIN_S = 2.0
"""A vehicle that passes before another one must be through this long before it comes."""

# Share of the separation by which a vehicle that gets away from another one may come nearer to it:
# positions are rounded on their way between servers.
_ROUNDING_SHARE = 1e-3
# An owner, a volume, and when the owner is at each of its points, which counts for paths only.
_Part: TypeAlias = tuple[str, Volume, Array | None]


@dataclass(frozen=True, eq=False)
class Crowd:
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
    def near(cls, volume: Volume, parts: Sequence[_Part], separation: Separation) -> Crowd:
        """Return those that come near to a volume."""
        parts = [parts[row] for row in volume.near([part[1] for part in parts], separation)]
        if not parts:
            return _NOBODY
        if len(parts) > 1:
            lows, highs = zip(*(part[1].blocks for part in parts), strict=True)
            blocks = (np.concatenate(lows, axis=1), np.concatenate(highs, axis=1))
            touched = blocks_near(volume.blocks, blocks, separation).any(axis=0)
            starts = np.cumsum([0, *(low.shape[1] for low in lows[:-1])])
            is_near = np.logical_or.reduceat(touched, starts)
            parts = [part for part, kept in zip(parts, is_near, strict=True) if kept]
        together = joined(*(part[1] for part in parts))
        arrivals_s = [part[2] for part in parts if part[2] is not None]
        arrival_s = np.concatenate(arrivals_s) if arrivals_s else np.zeros(len(together))
        ends = np.cumsum([len(part[1]) for part in parts])
        return cls(together, arrival_s, ends, tuple(part[0] for part in parts))

    def cropped(self, region: Volume, separation: Separation) -> Crowd:
        """Return those of its points that may be near a region, without their owners."""
        if not len(self.volume):
            return self
        near = blocks_near(self.volume.blocks, region.blocks, separation).any(axis=1)
        points = np.repeat(near, BLOCK)[: len(self.volume)]
        return Crowd(Volume(self.volume.table[:, points]), self.arrival_s[points], _NONE, ())

    def owner(self, point: int) -> str:
        """Return whose point that is."""
        return self.names[int(np.searchsorted(self.ends, point, side="right"))]


_NONE = np.empty(0)
_NOBODY = Crowd(NOWHERE, _NONE, _NONE, ())


class Others:
    """The vehicles that one has to keep apart from."""

    def __init__(self, entries: Iterable[Entry], separation: Separation) -> None:
        """Take those, in the order of their names."""
        self._entries = list(entries)
        self._separation = separation

    def __iter__(self) -> Iterator[Entry]:
        """Return each."""
        return iter(self._entries)

    def __bool__(self) -> bool:
        """Whether there is any."""
        return bool(self._entries)

    def about(self, path: Volume) -> Others:
        """Return those that hold or announce anything near a path, by cuboids."""
        volumes = [
            volume
            for one in self._entries
            for volume in (one.held, one.kept, NOWHERE if one.intent is None else one.intent.volume)
        ]
        rows = {row // 3 for row in path.near(volumes, self._separation)}
        return Others((self._entries[row] for row in sorted(rows)), self._separation)

    def held(self, near: Volume) -> Crowd:
        """Return what they hold near a volume, as one."""
        parts = [(one.name, one.whole, None) for one in self._entries]
        return Crowd.near(near, parts, self._separation)

    def held_or_kept(self, near: Volume, is_kept: bool) -> Crowd:
        """Return either what they hold near a volume or what they keep besides, as one."""
        parts = [(one.name, one.kept if is_kept else one.held, None) for one in self._entries]
        return Crowd.near(near, parts, self._separation)

    def paths(self, near: Volume, rank: Rank) -> Crowd:
        """Return the announced paths near a volume of those with a better rank, as one."""
        parts = [
            (one.name, one.intent.volume, one.intent.arrival_s)
            for one in self._entries
            if one.intent is not None and one.rank < rank
        ]
        return Crowd.near(near, parts, self._separation)

    def first_held(self, path: Volume, begin: int = 0) -> tuple[int, str] | None:
        """Return where a path first gets into what they hold, and whose that is.

        Args:
            path: the path, from where the vehicle is.
            begin: how many of its points the vehicle holds already.
        """
        found: list[tuple[int, str]] = []
        for is_kept in (False, True):
            crowd = self.held_or_kept(path, is_kept)
            if not len(crowd.volume):
                continue
            met = first_blocked(path, crowd.volume, self._separation, begin, is_kept)
            if met is not None:
                found.append((met[0], crowd.owner(met[1])))
        return min(found, default=None)

    def holder(self, volume: Volume) -> str | None:
        """Return who holds a part of a volume, or None."""
        held = self.held(volume)
        theirs = volume.pairs(held.volume, self._separation)[1]
        return held.owner(theirs[0]) if len(theirs) else None

    def better_paths(
        self, path: Volume, rank: Rank, times_s: Array
    ) -> tuple[Mask, Mask, Callable[[int], str]]:
        """Return where a path meets announced paths of better ranks, and where it is too late.

        The third returns whose path that is, for a point where one is met.

        Args:
            path: the path, from where the vehicle is.
            rank: of the vehicle.
            times_s: when it is at each point.
        """
        paths = self.paths(path, rank)
        mine, theirs = path.pairs(paths.volume, self._separation)
        soonest_s = np.full(len(path), np.inf)
        np.minimum.at(soonest_s, mine, paths.arrival_s[theirs])
        near = np.isfinite(soonest_s)
        late = near & (soonest_s < times_s + PASS_BEFORE_MARGIN_S)

        def owner(point: int) -> str:
            met = theirs[mine == point]
            return paths.owner(met[int(paths.arrival_s[met].argmin())])

        return near, late, owner


@dataclass(frozen=True, eq=False)
class TrafficAhead:
    """Delays the paths of one region.

    A search for a detour compares dozens of paths with the same vehicles. It looks once which of
    their points are near any of these paths.

    Attributes:
        held: the points of those that stand and will not make room.
        kept: the points that those keep besides.
        paths: the points of announced paths that have the right of way.
        after_s: time from now until each of these is passed, shape (N,).
        separation: the distances that are kept.
    """

    held: Volume
    kept: Volume
    paths: Volume
    after_s: Array
    separation: Separation

    def delay_s(self, path: Volume, after_s: Array) -> float:
        """Return by how much a path is best begun later; infinite if it leads through what stands.

        Args:
            path: its points in order, within the region.
            after_s: time until each, if it is begun now.
        """
        for volume, is_kept in ((self.held, False), (self.kept, True)):
            if first_blocked(path, volume, self.separation, is_kept=is_kept) is not None:
                return math.inf
        if not len(self.paths):
            return 0.0
        mine, theirs = path.pairs(self.paths, self.separation)
        return _first_gap(self.after_s[theirs] - after_s[mine] - PASS_BEFORE_MARGIN_S)


def first_blocked(
    path: Volume, held: Volume, separation: Separation, begin: int = 0, is_kept: bool = False
) -> tuple[int, int] | None:
    """Return the first point of a path that another volume blocks, and a point of that.

    A vehicle may be within a volume that another keeps, which was closed by force because its
    autopilot may fly there. It may get out of it: a path that leads out counts from the point where
    it is out. A vehicle too near to what another holds, as by drifting, may get away from it, but
    never nearer to any point of that than it is.

    Args:
        path: the path, from where the vehicle is.
        held: what others hold.
        separation: what is to be kept.
        begin: how many of its points the vehicle holds already.
        is_kept: whether ``held`` was closed by force.
    """
    if not len(held):
        return None
    mine, theirs = path.pairs(held, separation)
    if not len(mine):
        return None
    near = np.ones(len(path))
    shares = path.nearness(held, mine, theirs, separation)
    np.minimum.at(near, mine, shares)
    inside = leading(near < 1.0)
    if is_kept:
        inside = 0 if inside == len(path) else inside
    elif inside:
        # It gets away from all that is held, not from one part of it to another.
        begun = path.nearness(held, np.zeros_like(mine), theirs, separation)
        lost = shares < np.minimum(begun, 1.0) - _ROUNDING_SHARE
        nearer = int(mine[lost].min()) if lost.any() else len(path)
        leads_out = inside < min(nearer, len(path))
        inside = min(inside, nearer)
        inside = inside if leads_out or near[inside - 1] > near[0] else 0
    late = mine >= max(begin, inside)
    if not late.any():
        return None
    index = int(mine[late].min())
    return index, int(theirs[mine == index][0])


def leading(flags: Mask) -> int:
    """Return how many flags are set at the beginning."""
    return len(flags) if flags.all() else int(np.argmin(flags))


def _first_gap(begins_s: Array) -> float:
    """Return the least delay outside of intervals that each last twice the time to be before."""
    length_s = 2.0 * PASS_BEFORE_MARGIN_S
    begins_s = np.sort(begins_s[begins_s + length_s > 0.0])
    if not len(begins_s) or begins_s[0] > 0.0:
        return 0.0
    gaps = np.flatnonzero(np.diff(begins_s) > length_s)
    last = int(gaps[0]) if len(gaps) else len(begins_s) - 1
    return float(begins_s[last]) + length_s
