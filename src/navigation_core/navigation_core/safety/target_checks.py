"""Checks of a target before anything moves."""

from __future__ import annotations

import math
from dataclasses import dataclass

from navigation_core.geometry import Vector3, horizontal_norm, is_finite
from navigation_core.outcomes import OutcomeCode, Rejection

__all__ = [
    "RESOLUTION_M",
    "FlightVolume",
    "MapBounds",
    "Rejection",
    "VolumeError",
    "beside",
    "check_target",
]

RESOLUTION_M = 1e-3
"""Nearer to a bound than this a target counts as on it: messages and conversions round."""
# The height of the ground is known to this: the position wanders while the vehicle stands.
_HEIGHT_RESOLUTION_M = 0.1
_DIGITS = range(2, 7)


def beside(value: float, bound: float) -> str:
    """Return a number with two digits, or as many as show that it is not the bound."""
    for digits in _DIGITS:
        text = f"{round(value, digits) + 0.0:.{digits}f}"  # without a minus before zero
        if float(text) != bound:
            return text
    return repr(value)


class VolumeError(ValueError):
    """A flight volume is configured that contains nothing or is not a number."""


@dataclass(frozen=True)
class MapBounds:
    """Axis-aligned bounds in the map frame, in metres; both corners belong to it.

    Attributes:
        minimum_enu_m: the corner with the smallest coordinates.
        maximum_enu_m: the corner with the largest coordinates.
    """

    minimum_enu_m: Vector3
    maximum_enu_m: Vector3

    def __post_init__(self) -> None:
        """Reject a box without inside.

        Raises:
            VolumeError: a number is not finite, or a minimum is not below its maximum.
        """
        corners = (self.minimum_enu_m, self.maximum_enu_m)
        if not all(is_finite(corner) for corner in corners) or not all(
            low < high for low, high in zip(*corners, strict=True)
        ):
            raise VolumeError(
                f"The box {corners} m is empty; give finite minimum_enu_m below maximum_enu_m."
            )

    def contains(self, position_enu_m: Vector3, tolerance_m: float = 0.0) -> bool:
        """Whether a point lies inside or on the surface, or by less than a tolerance beyond."""
        return all(
            low - tolerance_m <= value <= high + tolerance_m
            for low, value, high in zip(
                self.minimum_enu_m, position_enu_m, self.maximum_enu_m, strict=True
            )
        )


@dataclass(frozen=True)
class FlightVolume:
    """The volume of accepted targets: a cylinder around the map origin, and optionally a box.

    Attributes:
        radius_max_m: greatest horizontal distance from the map origin.
        altitude_min_m: least altitude above the ground.
        altitude_max_m: greatest altitude above the ground.
        box: further bounds in the map frame, or None.
    """

    radius_max_m: float
    altitude_min_m: float
    altitude_max_m: float
    box: MapBounds | None = None

    def left_by_m(self, position_enu_m: Vector3, ground_enu_m: float) -> float:
        """Return how far a position is beyond the radius, the greatest altitude or the box.

        Negative inside. The least altitude is for targets only: every flight begins on the
        ground.
        """
        x, y, z = position_enu_m
        beyond = [
            horizontal_norm(position_enu_m) - self.radius_max_m,
            z - ground_enu_m - self.altitude_max_m,
        ]
        if self.box is not None:
            low, high = self.box.minimum_enu_m, self.box.maximum_enu_m
            beyond += [low[0] - x, x - high[0], low[1] - y, y - high[1], z - high[2]]
        return max(beyond)

    def nearest(self, position_enu_m: Vector3, ground_enu_m: float, room_m: float) -> Vector3:
        """Return the position inside that is nearest to one, with room to each bound.

        Where there is not as much room, it is in the middle.

        Args:
            position_enu_m: in the map frame.
            ground_enu_m: map z of the ground, usually of home.
            room_m: the room.
        """
        x, y, z = position_enu_m
        if self.box is not None:
            low, high = self.box.minimum_enu_m, self.box.maximum_enu_m
            x = _between(x, low[0] + room_m, high[0] - room_m)
            y = _between(y, low[1] + room_m, high[1] - room_m)
            z = min(z, high[2] - room_m)
        far_m = math.hypot(x, y)
        if far_m > 0.0:
            share = min(max(self.radius_max_m - room_m, 0.0) / far_m, 1.0)
            x, y = share * x, share * y
        low_m, high_m = ground_enu_m + self.altitude_min_m, ground_enu_m + self.altitude_max_m
        return (x, y, _between(z, low_m + room_m, high_m - room_m))

    def __post_init__(self) -> None:
        """Reject a volume without inside.

        Raises:
            VolumeError: a number is NaN, the radius is not positive, or the altitudes are
                not in ascending order.
        """
        if not self.radius_max_m > 0.0:
            raise VolumeError(f"radius_max_m is {self.radius_max_m} m; give a positive radius.")
        if not self.altitude_min_m < self.altitude_max_m:
            raise VolumeError(
                f"altitude_min_m is {self.altitude_min_m} m and altitude_max_m is "
                f"{self.altitude_max_m} m; give a minimum below the maximum."
            )


def _between(number: float, low: float, high: float) -> float:
    return min(max(number, low), high) if low <= high else 0.5 * (low + high)


def check_target(
    position_enu_m: Vector3,
    max_speed_m_s: float | None,
    ground_enu_m: float,
    volume: FlightVolume,
    yaw_enu_rad: float | None = None,
) -> Rejection | None:
    """Return why a target cannot be accepted.

    Heights count to 0.1 m and other bounds to a millimetre; a target that is nearer to a bound is
    on it.

    Args:
        position_enu_m: target in the map frame.
        max_speed_m_s: wanted maximum ground speed; None or 0 for the default.
        ground_enu_m: map z of the ground, usually of home.
        volume: where targets are accepted.
        yaw_enu_rad: wanted yaw, or None for the direction of travel.

    Returns:
        The first reason against it, or None if it is sound.
    """
    numbers = _check_numbers(position_enu_m, max_speed_m_s, yaw_enu_rad)
    if numbers is not None:
        return numbers
    x, y, z = position_enu_m
    where = f"The target ({x:.2f}, {y:.2f}, {z:.2f}) m"
    altitude_m = z - ground_enu_m
    if altitude_m < -_HEIGHT_RESOLUTION_M:
        return Rejection(
            OutcomeCode.BELOW_GROUND,
            f"{where} is {-altitude_m:.2f} m below the ground, which is at z = {ground_enu_m:.2f} "
            "m; z points up.",
        )
    radius_m = horizontal_norm(position_enu_m)
    text = None
    low_m, high_m = volume.altitude_min_m, volume.altitude_max_m
    if radius_m > volume.radius_max_m + RESOLUTION_M:
        text = (
            f"is {beside(radius_m, volume.radius_max_m)} m from the map origin; the "
            f"flight volume ends at {volume.radius_max_m:g} m."
        )
    elif not low_m - _HEIGHT_RESOLUTION_M <= altitude_m <= high_m + _HEIGHT_RESOLUTION_M:
        height = beside(altitude_m, low_m if altitude_m < low_m else high_m)
        text = (
            f"is {height} m above the ground; the flight volume reaches from "
            f"{low_m:g} m to {high_m:g} m."
        )
    elif volume.box is not None and not volume.box.contains(position_enu_m, RESOLUTION_M):
        where = f"The target {position_enu_m} m"
        text = (
            f"is outside the box from {volume.box.minimum_enu_m} m to {volume.box.maximum_enu_m} m."
        )
    return None if text is None else Rejection(OutcomeCode.OUTSIDE_VOLUME, f"{where} {text}")


def _check_numbers(
    position_enu_m: Vector3, max_speed_m_s: float | None, yaw_enu_rad: float | None
) -> Rejection | None:
    if not is_finite(position_enu_m):
        return Rejection(
            OutcomeCode.INVALID_NUMBER,
            f"The target {position_enu_m} m has a NaN or infinite coordinate; send three finite "
            "numbers.",
        )
    if max_speed_m_s is not None and not 0.0 <= max_speed_m_s < math.inf:
        negative = -math.inf < max_speed_m_s < 0.0
        return Rejection(
            OutcomeCode.NEGATIVE_SPEED if negative else OutcomeCode.INVALID_NUMBER,
            f"The maximum speed is {max_speed_m_s:g} m/s; send a "
            f"{'positive' if negative else 'finite'} number, or 0 for the default.",
        )
    if yaw_enu_rad is not None and not math.isfinite(yaw_enu_rad):
        return Rejection(
            OutcomeCode.INVALID_NUMBER,
            f"The yaw is {yaw_enu_rad} rad; send a finite number.",
        )
    return None
