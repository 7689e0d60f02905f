"""Grants parts of a path: those that are free, and that other servers agree to."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from navigation_core.tasks.traffic.crowds import Others, leading
from navigation_core.tasks.traffic.entries import Agreement, Ask, Entry, TrafficWait, Wish, wait_for

__all__ = ["extended", "extended_by_agreement"]

# Time after which a wish is given up if others hold a part of it; before, the worse of two ranks
# gives up its own.
_WISH_PATIENCE_S = 2.0
# Number of points ahead that are checked.
_LOOK_AHEAD_POINTS = 160


def extended(entry: Entry, ask: Ask, others: Others, now: float) -> tuple[int, TrafficWait | None]:
    """Return how many points of a path may be held, and what the vehicle waits for.

    Args:
        entry: of the vehicle.
        ask: what is wanted.
        others: what they hold and announce.
        now: time in seconds.
    """
    if ask.is_enough:
        return ask.granted, None
    count = min(len(ask.path), ask.granted + _LOOK_AHEAD_POINTS)
    window = ask.path.part(0, count)
    limit, holder = count, ""
    blocked = others.first_held(window, ask.granted)
    if blocked is not None:
        limit, holder = blocked
    near, late, owners = others.better_paths(window, entry.rank, now + ask.after_s[:count])
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


def extended_by_agreement(
    entry: Entry, ask: Ask, others: Others, now: float, agreement: Agreement
) -> tuple[int, int, TrafficWait | None]:
    """Return how much may be used and is held of a path, and what the vehicle waits for.

    Other servers have to agree to each extension before it is used. All of the path that is free is
    asked for, so that agreement exists when the network is cut. Parts not needed yet are given back
    where the path of a better rank leads through.

    Args:
        entry: of the vehicle; its wish changes.
        ask: what is wanted.
        others: what they hold and announce.
        now: time in seconds.
        agreement: of the other servers.
    """
    if entry.is_new_to_others:
        entry.give_up_wish()
        ask = replace(ask, granted=0)
        entry.is_new_to_others = False
    count, granted = len(ask.path), _still_held(entry, ask, others, now)
    ask = replace(ask, granted=granted, wanted=count, enough=count)
    if entry.wish is not None and entry.wish.course is not ask.course:
        entry.give_up_wish()
    if entry.wish is not None:
        count = max(entry.wish.count - ask.passed, ask.granted)
        wished = ask.path.part(0, count)
        if agreement.is_given(entry.name, entry.number, wished):
            entry.wish = None
            ask = replace(ask, granted=count)
        elif (
            now - entry.wish.since_s < _WISH_PATIENCE_S
            or others.first_held(wished, ask.granted) is None
        ):
            whom, why = agreement.missing_from(entry.name)
            return ask.granted, count, wait_for(entry.waiting, whom, why, now)
        else:  # somebody has got into it, and its server never agrees
            entry.give_up_wish()
    held, waiting = extended(entry, ask, others, now)
    if held == ask.granted:
        return held, held, waiting
    entry.number += 1
    if agreement.is_given(entry.name, entry.number, ask.path.part(0, held)):
        return held, held, waiting
    entry.wish = Wish(ask.course, ask.passed + held, now)
    return ask.granted, held, waiting


def _still_held(entry: Entry, ask: Ask, others: Others, now: float) -> int:
    """Return how much of a path is held on, of what was granted."""
    if ask.granted <= ask.wanted:
        return ask.granted
    spare = ask.path.part(0, ask.granted)
    near = others.better_paths(spare, entry.rank, now + ask.after_s[: ask.granted])[0]
    near[: ask.wanted] = False
    if not near.any():
        return ask.granted
    entry.give_up_wish()
    return max(int(near.argmax()), ask.wanted)
