"""The true state of all vehicles at one moment, as arrays."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from mavlink_sitl.array_ops import Lane

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
Offset = tuple[float, float, float]


class FleetState(NamedTuple):
    """The bodies of one kind at that moment.

    Attributes:
        rows: their places in `Simulation.vehicles`.
        body: their state, in lanes; steps replace it and never change it.
        unpack: makes a lane a list.
        collided: shape (len(rows),); replaced when it changes, as the body is.
    """

    rows: Sequence[int]
    body: Any
    unpack: Callable[[Lane], list[float]]
    collided: Flags


class Truth:
    """The true state of the vehicles at the moment when it was asked for. Row i is vehicle i.

    A snapshot: it stays as it is when time passes. Its arrays are made when they are first read,
    since a condition of `Simulation.run_until` reads one of them, at each tick.

    Attributes:
        position_ned_m: shape (N, 3), from each vehicle's home.
        velocity_ned_m_s: shape (N, 3).
        yaw_rad: shape (N,), clockwise from North.
        on_ground: shape (N,).
        collided: shape (N,), vehicles that have hit an obstacle and no longer fly.
    """

    __slots__ = ("_collided", "_fleets", "_offsets_ned_m", "_on_ground", "_position", "_rest")

    def __init__(self, fleets: Sequence[FleetState], offsets_ned_m: Sequence[Offset]) -> None:
        self._fleets = fleets
        self._offsets_ned_m = offsets_ned_m
        self._position: Floats | None = None
        self._on_ground: Flags | None = None
        self._collided: Flags | None = None
        self._rest: Floats | None = None

    @property
    def position_ned_m(self) -> Floats:
        """Shape (N, 3), from each vehicle's home."""
        if self._position is None:
            self._position = self._positions()
        return self._position

    @property
    def velocity_ned_m_s(self) -> Floats:
        """Shape (N, 3)."""
        return self._velocity_and_yaw()[:, :3]

    @property
    def yaw_rad(self) -> Floats:
        """Shape (N,), clockwise from North."""
        return self._velocity_and_yaw()[:, 3]

    @property
    def on_ground(self) -> Flags:
        """Shape (N,)."""
        if self._on_ground is None:
            self._on_ground = self._table("on_ground")[:, 0] > 0.5
        return self._on_ground

    @property
    def collided(self) -> Flags:
        """Shape (N,), the vehicles that have hit an obstacle and no longer fly."""
        if self._collided is None:
            self._collided = np.zeros(len(self._offsets_ned_m), dtype=np.bool_)
            for fleet in self._fleets:
                self._collided[fleet.rows] = fleet.collided
        return self._collided

    def _positions(self) -> Floats:
        if len(self._offsets_ned_m) == 1:
            body, ((north, east, down),) = self._fleets[0].body, self._offsets_ned_m
            return np.array([[body.north_m + north, body.east_m + east, body.down_m + down]])
        return self._table("north_m", "east_m", "down_m") + self._offsets_ned_m

    def _velocity_and_yaw(self) -> Floats:
        if self._rest is None:
            names = ("velocity_north_m_s", "velocity_east_m_s", "velocity_down_m_s", "yaw_rad")
            self._rest = self._table(*names)
        return self._rest

    def _table(self, *names: str) -> Floats:
        """Fields of the bodies, shape (N, len(names))."""
        if len(self._offsets_ned_m) == 1:  # its lanes are floats
            body = self._fleets[0].body
            return np.array([[getattr(body, name) for name in names]], dtype=np.float64)
        table = np.empty((len(self._offsets_ned_m), len(names)))
        for rows, body, unpack, _ in self._fleets:
            table[rows] = np.array([unpack(getattr(body, name)) for name in names]).T
        return table
