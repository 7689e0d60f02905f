"""The true result of a run as JSON: `--summary FILE`."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

from mavlink_sitl.simulation import Simulation


class Summary:
    """Watches how near each vehicle comes to obstacles, and whether it hits one."""

    def __init__(self, simulation: Simulation) -> None:
        self._simulation = simulation
        self._nearest: list[tuple[float, str, float]] = [
            (math.inf, "", 0.0) for _ in simulation.vehicles
        ]
        self._collided = [False for _ in simulation.vehicles]

    def watch(self) -> None:
        """Look at this moment."""
        simulation = self._simulation
        if not simulation.world.obstacles:
            return
        for index, vehicle in enumerate(simulation.vehicles):
            near = vehicle.clearance()
            if near.distance_m < self._nearest[index][0]:
                self._nearest[index] = (near.distance_m, near.obstacle, simulation.time_s)
            if simulation.truth.collided[index]:
                self._collided[index] = True

    def as_dict(self) -> dict[str, Any]:
        """Return it as what JSON can hold; a vehicle that met nothing has no clearance."""
        vehicles = []
        for vehicle, (distance_m, obstacle, time_s), collided in zip(
            self._simulation.vehicles, self._nearest, self._collided, strict=True
        ):
            met = math.isfinite(distance_m)
            vehicles.append(
                {
                    "system_id": vehicle.system_id,
                    "collided": collided,
                    "least_clearance_m": round(distance_m, 3) if met else None,
                    "nearest_obstacle": obstacle if met else None,
                    "nearest_at_s": round(time_s, 2) if met else None,
                }
            )
        return {"simulated_s": round(self._simulation.time_s, 2), "vehicles": vehicles}

    def write(self, path: Path) -> None:
        """Write it as JSON.

        Raises:
            OSError: the file cannot be written.
        """
        path.write_text(json.dumps(self.as_dict(), indent=1) + "\n", encoding="utf-8")
