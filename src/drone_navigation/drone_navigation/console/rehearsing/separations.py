"""Least separation along time of vehicles whose flights are known. No ROS, no I/O, no clock."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from navigation_core.geometry import Vector3
from navigation_core.tasks.traffic.volumes import Separation

__all__ = ["Meeting", "TimedFlight", "meetings"]

_STEP_S = 0.1
"""Flights are compared this often: at 10 m/s each, every 2 m"""
_SAMPLES_MAX = 4000
_MOVED_M = 0.5
"""A vehicle that was parked is not any more once it is this far from where it was"""


@dataclass(frozen=True)
class TimedFlight:
    """Where a vehicle will be, and when.

    Attributes:
        points_m: in one frame for all flights: ENU metres.
        times_s: of the points, rising, from a common start; before the first and after the last
            the vehicle stays.
        parked: whether it is disarmed on the ground at the start.
    """

    points_m: tuple[Vector3, ...]
    times_s: tuple[float, ...]
    parked: bool


@dataclass(frozen=True)
class Meeting:
    """Where two vehicles are nearest to each other.

    Attributes:
        vehicles: their names.
        time_s: when, from the start. Of a pair that comes too near: while it is.
        distance_m: between them then.
        horizontal_m: beside each other then.
        vertical_m: above each other then.
        required_m: what is to be kept, horizontally or else vertically.
        is_too_near: whether both are less than that.
        positions_m: where the two are then.
    """

    vehicles: tuple[str, str]
    time_s: float
    distance_m: float
    horizontal_m: float
    vertical_m: float
    required_m: tuple[float, float]
    is_too_near: bool
    positions_m: tuple[Vector3, Vector3]


def meetings(flights: Mapping[str, TimedFlight], separation: Separation) -> tuple[Meeting, ...]:
    """Return where each pair is nearest, the worst pair first.

    Args:
        flights: by the vehicles' names.
        separation: what is to be kept.
    """
    end_s = max((flight.times_s[-1] for flight in flights.values()), default=0.0)
    times_s = np.linspace(0.0, end_s, min(int(end_s / _STEP_S) + 2, _SAMPLES_MAX))
    tracks = {name: _sampled(flight, times_s) for name, flight in flights.items()}
    found = [
        _nearest((a, b), tracks[a], tracks[b], times_s, separation)
        for a, b in itertools.combinations(flights, 2)
    ]
    return tuple(sorted(found, key=lambda meeting: (not meeting.is_too_near, meeting.distance_m)))


@dataclass(frozen=True)
class _Sampled:
    """Positions, shape (N, 3), and whether it is parked then, shape (N,)."""

    positions_m: NDArray[np.float64]
    parked: NDArray[np.bool_]


def _sampled(flight: TimedFlight, times_s: NDArray[np.float64]) -> _Sampled:
    points = np.array(flight.points_m, dtype=np.float64).reshape(-1, 3)
    columns = [np.interp(times_s, flight.times_s, points[:, axis]) for axis in range(3)]
    positions_m = np.column_stack(columns)
    left = np.linalg.norm(positions_m - positions_m[0], axis=1) > _MOVED_M
    parked = ~np.logical_or.accumulate(left) if flight.parked else np.zeros(len(left), np.bool_)
    return _Sampled(positions_m, parked)


def _nearest(
    names: tuple[str, str],
    a: _Sampled,
    b: _Sampled,
    times_s: NDArray[np.float64],
    separation: Separation,
) -> Meeting:
    gaps = np.abs(a.positions_m - b.positions_m)
    horizontal_m, vertical_m = np.hypot(gaps[:, 0], gaps[:, 1]), gaps[:, 2]
    one_is_parked = a.parked | b.parked
    horizontal_least_m = np.where(one_is_parked, separation.parked_m, separation.horizontal_m)
    vertical_least_m = np.where(one_is_parked, separation.parked_m, separation.vertical_m)
    too_near = (horizontal_m < horizontal_least_m) & (vertical_m < vertical_least_m)
    # Two that stay parked are as they were put.
    too_near &= ~(a.parked & b.parked)
    is_too_near = bool(too_near.any())
    distances_m = np.hypot(horizontal_m, vertical_m)
    at = int(np.argmin(np.where(too_near, distances_m, np.inf) if is_too_near else distances_m))
    return Meeting(
        names,
        float(times_s[at]),
        float(distances_m[at]),
        float(horizontal_m[at]),
        float(vertical_m[at]),
        (float(horizontal_least_m[at]), float(vertical_least_m[at])),
        is_too_near,
        (_vector(a.positions_m[at]), _vector(b.positions_m[at])),
    )


def _vector(row: NDArray[np.float64]) -> Vector3:
    east, north, up = row.tolist()
    return east, north, up
