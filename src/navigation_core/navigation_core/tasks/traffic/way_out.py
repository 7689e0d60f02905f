"""The rule by which a path may be held beside what others hold: never into it, but out of it.

The server of a vehicle applies it before it asks for a path, and other servers before they agree,
so that none asks for ever for what another one rejects.
"""

from __future__ import annotations

import numpy as np

from navigation_core.tasks.traffic.volumes import Mask, Separation, Volume

__all__ = ["first_blocked", "leading"]

# Share of the separation by which a vehicle that gets away from another one may come nearer to it:
# positions are rounded on their way between servers.
_ROUNDING_SHARE = 1e-3


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
