"""One arithmetic for one vehicle and for many.

The models (`dynamics`, the controllers in `autopilot`, the sensors in `world`) are written
once, over *lanes*: a lane is a Python float when there is one vehicle and an array of shape
(N,) when there are N. numpy on arrays of one element costs ten times a float, so one
vehicle runs on floats; a thousand vehicles run on numpy. `+ - * /` work on both; everything
else goes through an `Ops`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

Lane = Any
"""A float (one vehicle) or an array of shape (N,). Any, since both sides of it do arithmetic
with each other and with plain numbers."""


class Ops:
    """Arithmetic on lanes of one vehicle, which are floats.

    Attributes:
        count: how many vehicles.
        sqrt: square root of x >= 0.
        hypot: length of (x, y).
        atan2: angle of (x, y), radians, given y and x.
        sin: of an angle in radians.
        cos: the same.
    """

    count = 1
    sqrt: Callable[[Lane], Lane] = staticmethod(math.sqrt)
    hypot: Callable[[Lane, Lane], Lane] = staticmethod(math.hypot)
    atan2: Callable[[Lane, Lane], Lane] = staticmethod(math.atan2)
    sin: Callable[[Lane], Lane] = staticmethod(math.sin)
    cos: Callable[[Lane], Lane] = staticmethod(math.cos)

    def full(self, value: float) -> Lane:
        """The same number in every lane."""
        return float(value)

    def pack(self, values: list[float]) -> Lane:
        """A lane from one number per vehicle."""
        return float(values[0])

    @staticmethod
    def unpack(lane: Lane) -> list[float]:
        """One Python float per vehicle."""
        return [lane]

    @staticmethod
    def minimum(x: Lane, y: Lane) -> Lane:
        """The smaller one, lane by lane."""
        return x if x < y else y  # noqa: FURB136 - twice as fast as min()

    @staticmethod
    def maximum(x: Lane, y: Lane) -> Lane:
        """The larger one, lane by lane."""
        return x if x > y else y  # noqa: FURB136 - twice as fast as max()

    @staticmethod
    def clip(x: Lane, low: Lane, high: Lane) -> Lane:
        """X limited to low..high; low <= high."""
        return low if x < low else (high if x > high else x)  # noqa: FURB136 - the same

    @staticmethod
    def where(condition: Lane, x: Lane, y: Lane) -> Lane:
        """X where the condition holds, else y."""
        return x if condition else y

    @staticmethod
    def wrap_pi(angle: Lane) -> Lane:
        """An angle moved into -pi..pi."""
        return math.remainder(angle, math.tau)


class ArrayOps(Ops):
    """The same on lanes of N vehicles, which are arrays of shape (N,)."""

    sqrt = staticmethod(np.sqrt)
    hypot = staticmethod(np.hypot)
    atan2 = staticmethod(np.arctan2)
    sin = staticmethod(np.sin)
    cos = staticmethod(np.cos)
    minimum: Any = staticmethod(np.minimum)
    maximum: Any = staticmethod(np.maximum)
    where: Any = staticmethod(np.where)

    def __init__(self, count: int) -> None:
        self.count = count

    def full(self, value: float) -> Lane:
        """An array with the number in every place."""
        return np.full(self.count, value, dtype=np.float64)

    def pack(self, values: list[float]) -> Lane:
        """An array from the list."""
        return np.array(values, dtype=np.float64)

    @staticmethod
    def unpack(lane: Lane) -> list[float]:
        """A list of Python floats."""
        return list(lane.tolist())

    @staticmethod
    def clip(x: Lane, low: Lane, high: Lane) -> Lane:
        """X limited to low..high; two ufuncs, since np.clip is slower on short arrays."""
        return np.minimum(np.maximum(x, low), high)

    @staticmethod
    def wrap_pi(angle: Lane) -> Lane:
        """Angles moved into -pi..pi."""
        return angle - math.tau * np.round(angle / math.tau)


def ops_for(count: int) -> Ops:
    """The arithmetic for `count` vehicles (>= 1)."""
    return Ops() if count == 1 else ArrayOps(count)
