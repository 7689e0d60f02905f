"""Values that all pages show, by vehicle and name, with their changes. No I/O, no clock.

The ROS thread writes, the event loop reads.
"""

from __future__ import annotations

import math
import threading
from collections import deque
from typing import Any, TypeAlias

__all__ = ["Changes", "ShownValues"]

Changes: TypeAlias = dict[str, dict[str, object]]
"""Values by vehicle (its namespace, "/" without one) and name."""

_TRAIL_MAX = 600
_TRAIL_STEP_M = 0.5


class ShownValues:
    """Values that JSON can write."""

    def __init__(self) -> None:
        """Start empty."""
        self._lock = threading.Lock()
        self._values: Changes = {}
        self._versions: dict[str, dict[str, int]] = {}
        self._trails: dict[str, deque[list[float]]] = {}
        self._version = 0

    def put(self, vehicle: str, name: str, value: object) -> None:
        """Set a value; one that equals the present one is no change."""
        with self._lock:
            values = self._values.setdefault(vehicle, {})
            if name in values and values[name] == value:
                return
            self._version += 1
            values[name] = value
            self._versions.setdefault(vehicle, {})[name] = self._version

    def get(self, vehicle: str, name: str) -> Any:
        """Return a value, None if there is none."""
        with self._lock:
            return self._values.get(vehicle, {}).get(name)

    def vehicles(self) -> list[str]:
        """Return the names of all vehicles, sorted."""
        with self._lock:
            return sorted(self._values)

    def pass_through(self, vehicle: str, position_enu_m: list[float]) -> None:
        """Add a position to a vehicle's trail, if it has moved. Pages continue it themselves."""
        with self._lock:
            trail = self._trails.setdefault(vehicle, deque(maxlen=_TRAIL_MAX))
            if not trail or math.dist(trail[-1], position_enu_m) >= _TRAIL_STEP_M:
                trail.append(position_enu_m)

    def restart_trail(self, vehicle: str) -> None:
        """Forget where a vehicle has been."""
        with self._lock:
            self._trails.pop(vehicle, None)

    def trails(self) -> dict[str, list[list[float]]]:
        """Return where the vehicles have been, ENU metres."""
        with self._lock:
            return {vehicle: list(trail) for vehicle, trail in self._trails.items()}

    def since(self, version: int) -> tuple[int, Changes]:
        """Return the present version, and what has changed after another one; 0 for all."""
        with self._lock:
            changes: Changes = {}
            for vehicle, versions in self._versions.items():
                newer = {
                    name: self._values[vehicle][name]
                    for name, at in versions.items()
                    if at > version
                }
                if newer:
                    changes[vehicle] = newer
            return self._version, changes
