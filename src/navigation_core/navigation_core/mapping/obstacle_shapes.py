"""The shapes of known obstacles: an upright cylinder and an upright box."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TypeAlias

__all__ = ["Box", "Cylinder", "KnownObstacle", "ObstacleError"]


class ObstacleError(ValueError):
    """An obstacle has no sound shape; the sentence says which number is wrong."""


@dataclass(frozen=True)
class Cylinder:
    """An upright cylinder.

    Attributes:
        name: for display.
        centre_enu_m: east and north of its axis, in the map frame.
        radius_m: above 0.
        bottom_m: map z of its lower side; may be minus infinity.
        top_m: map z of its upper side; may be infinity.
    """

    name: str
    centre_enu_m: tuple[float, float]
    radius_m: float
    bottom_m: float = -math.inf
    top_m: float = math.inf

    def __post_init__(self) -> None:
        """Reject what has no shape.

        Raises:
            ObstacleError: a number is NaN, or the radius or the height is not positive.
        """
        _check(self.name, self.centre_enu_m, (self.radius_m,), self.bottom_m, self.top_m)


@dataclass(frozen=True)
class Box:
    """An upright box; a wall is a thin one.

    Attributes:
        name: for display.
        centre_enu_m: east and north of its middle, in the map frame.
        size_m: length along its own x axis and along its own y axis, each at least 0.
        yaw_enu_rad: how its x axis is turned from east, counter-clockwise.
        bottom_m: map z of its lower side; may be minus infinity.
        top_m: map z of its upper side; may be infinity.
    """

    name: str
    centre_enu_m: tuple[float, float]
    size_m: tuple[float, float]
    yaw_enu_rad: float = 0.0
    bottom_m: float = -math.inf
    top_m: float = math.inf

    def __post_init__(self) -> None:
        """Reject what has no shape.

        Raises:
            ObstacleError: a number is NaN, or both sides are 0, or the height is not positive.
        """
        place = (*self.centre_enu_m, self.yaw_enu_rad)
        _check(self.name, place, self.size_m, self.bottom_m, self.top_m)
        if min(self.size_m) < 0.0:
            raise ObstacleError(
                f"Obstacle {self.name}: a side of {min(self.size_m)} m; give 0 or more."
            )


KnownObstacle: TypeAlias = Cylinder | Box


def _check(
    name: str, place: tuple[float, ...], sizes: tuple[float, ...], bottom_m: float, top_m: float
) -> None:
    if not all(math.isfinite(value) for value in (*place, *sizes)):
        raise ObstacleError(
            f"Obstacle {name}: {(*place, *sizes)} holds a value that is not finite."
        )
    if max(sizes) <= 0.0:
        raise ObstacleError(f"Obstacle {name}: a size of {max(sizes)} m; give more than 0.")
    if not bottom_m < top_m:
        raise ObstacleError(
            f"Obstacle {name}: its bottom at {bottom_m} m is not below its top at {top_m} m."
        )
