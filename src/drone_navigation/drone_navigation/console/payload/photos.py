"""Where the photos of a vehicle were taken, in its map. One thread only."""

from __future__ import annotations

import math
from collections import deque

from custom_interfaces.msg import ImageCaptured
from drone_navigation.console import plans
from drone_navigation.console.shown_values import ShownValues

__all__ = ["Photos"]

_PHOTOS_MAX = 500


class Photos:
    """Puts the places of photos on the board."""

    def __init__(self, board: ShownValues, name: str) -> None:
        """Begin without one.

        Args:
            board: what the vehicle's values are put on.
            name: of the vehicle.
        """
        self._board, self._name = board, name
        self._places: deque[list[float]] = deque(maxlen=_PHOTOS_MAX)

    def hear(self, message: ImageCaptured) -> None:
        """Take the report of a photo; one that failed, or has no place, is not shown."""
        geodetic = (message.latitude, message.longitude, message.altitude)
        if not message.success or not all(map(math.isfinite, geodetic)):
            return
        status = self._board.get(self._name, "status") or {}
        home = self._board.get(self._name, "home")
        try:
            frame, _ = plans.vehicle_map(status.get("autopilot", ""), home)
        except plans.PlanError:
            return
        north_m, east_m, _ = frame.ned_m(geodetic)
        self._places.append([round(east_m, 2), round(north_m, 2)])
        self._board.put(self._name, "photos", list(self._places))
