"""Clearance of a path: the least, where that is, and to which obstacle."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from navigation_core.geometry import Vector3
from navigation_core.mapping.obstacles import KnownObstacle, Obstacles

__all__ = ["SENSED", "Approach", "Surroundings"]

SENSED = "a sensed obstacle"
_STEP_M = 0.1
"""Points of a path that are looked at are this far apart, less than any hull is wide"""


@dataclass(frozen=True)
class Approach:
    """Where a path comes nearest to an obstacle, or first hits one.

    Attributes:
        obstacle: its name, or what it is.
        position_enu_m: where the vehicle is then.
        along_m: the length of the path up to there.
        clearance_m: from its hull; 0: it hits.
        margin_m: the clearance that is required.
        is_too_near: whether it hits, or keeps less than that.
    """

    obstacle: str
    position_enu_m: Vector3
    along_m: float
    clearance_m: float
    margin_m: float
    is_too_near: bool


class Surroundings:
    """The known and the sensed obstacles about a vehicle."""

    def __init__(
        self, known: Sequence[KnownObstacle], sensed: Obstacles, hull_m: float, margin_m: float
    ) -> None:
        """Take them.

        Args:
            known: those of a file, with their names.
            sensed: those that sensors have seen.
            hull_m: radius of the vehicle.
            margin_m: clearance that its hull is to keep.
        """
        self._known = tuple(known)
        self._sensed = sensed
        self._all = Obstacles.of(self._known).joined(sensed)
        self._hull_m = hull_m
        self._margin_m = margin_m

    def approach(self, path_enu_m: Sequence[Vector3]) -> Approach | None:
        """Return the first hit of a path, else where it is nearest; None without obstacles."""
        if not len(self._all):
            return None
        points, along_m = _resampled(np.array(path_enu_m, dtype=np.float64).reshape(-1, 3))
        gaps = np.maximum(self._all.clearance_m(points) - self._hull_m, 0.0)
        (hits,) = np.nonzero(gaps <= 0.0)
        at = int(hits[0]) if len(hits) else int(np.argmin(gaps))
        east, north, up = points[at].tolist()
        clearance_m = float(gaps[at])
        return Approach(
            self._name_at(points[at : at + 1]),
            (east, north, up),
            float(along_m[at]),
            clearance_m,
            self._margin_m,
            not clearance_m >= self._margin_m,
        )

    def _name_at(self, point: np.ndarray) -> str:
        """Return the name of the obstacle that is nearest to a point."""
        gaps = {
            f"'{each.name}'": float(Obstacles.of((each,)).clearance_m(point)[0])
            for each in self._known
        }
        gaps[SENSED] = float(self._sensed.clearance_m(point)[0])
        return min(gaps, key=lambda name: gaps[name])


def _resampled(path: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return points along a path in small steps, and their distances along it."""
    corners_m = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))])
    steps = int(corners_m[-1] / _STEP_M)
    along_m = np.union1d(corners_m, np.linspace(0.0, corners_m[-1], steps + 2))
    points = [np.interp(along_m, corners_m, path[:, axis]) for axis in range(3)]
    return np.column_stack(points), along_m
