"""Rows of a table brought together by a key."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray


def groups(keys: NDArray[np.integer]) -> Iterator[tuple[int, NDArray[np.int64]]]:
    """Yield each key, rising, and the places where it stands, in their order.

    Args:
        keys: from -32768 to 32767, shape (n,).
    """
    if len(keys) == 0:
        return
    short = keys.astype(np.int16)
    order = np.argsort(short, kind="stable")
    ordered = short[order]
    firsts = [0, *(np.flatnonzero(np.diff(ordered)) + 1).tolist(), len(order)]
    for first, last in pairwise(firsts):
        yield int(ordered[first]), order[first:last]
