"""Groups the rows of a table by a key."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray


def grouped(keys: NDArray[np.integer]) -> tuple[NDArray[np.int64], list[tuple[int, slice]]]:
    """Bring equal keys together.

    Args:
        keys: from -32768 to 32767, shape (n,).

    Returns:
        The places of the keys in an order in which equal ones follow each other, each in their
        own order; and for each key, rising, where it stands in that order.
    """
    short = keys.astype(np.int16)
    order = np.argsort(short, kind="stable")
    if len(order) == 0:
        return order, []
    ordered = short[order]
    firsts = [0, *(np.flatnonzero(np.diff(ordered)) + 1).tolist(), len(order)]
    return order, [(int(ordered[first]), slice(first, last)) for first, last in pairwise(firsts)]
