"""Vehicles of one kind move in one pipeline; a simulation has one for each kind.

Part of `simulation` (the same layer).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from mavlink_sitl.config import VehicleConfig
from mavlink_sitl.physics.copter_pipeline import DT_S, Physics, PhysicsStart, Px4Physics
from mavlink_sitl.physics.traveller_pipeline import (
    BoatPhysics,
    PlanePhysics,
    Px4BoatPhysics,
    Px4PlanePhysics,
    Px4RoverPhysics,
    RoverPhysics,
)

PIPELINES: dict[str, type[Physics]] = {
    "copter": Physics,
    "px4copter": Px4Physics,
    "rover": RoverPhysics,
    "boat": BoatPhysics,
    "plane": PlanePhysics,
    "px4rover": Px4RoverPhysics,
    "px4boat": Px4BoatPhysics,
    "px4plane": Px4PlanePhysics,
}


class Fleet(NamedTuple):
    """Vehicles of one kind.

    Attributes:
        rows: their places in `Simulation.vehicles`, in the order of the lanes.
        physics: their bodies, batteries, sensors and controllers.
    """

    rows: list[int]
    physics: Physics


def make_fleets(configs: Sequence[VehicleConfig], seed: int, dt_s: float = DT_S) -> list[Fleet]:
    """Sort vehicles by kind, in the order in which the kinds first appear."""
    rows: dict[str, list[int]] = {}
    for row, config in enumerate(configs):
        rows.setdefault(config.personality().kind, []).append(row)
    return [
        Fleet(
            places,
            PIPELINES[kind](
                PhysicsStart(
                    [math.radians(configs[row].heading_deg) for row in places],
                    configs[places[0]].battery,
                    [configs[row].battery_remaining for row in places],
                    seed + 1_000_003 * number,  # each kind draws other noise
                    dt_s,
                )
            ),
        )
        for number, (kind, places) in enumerate(rows.items())
    ]
