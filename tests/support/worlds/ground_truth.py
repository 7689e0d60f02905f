"""Ground truth of a simulated vehicle and the obstacles of its world.

Distances come from the simulator's own shapes, never from what the bridge believes.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from mavlink_sitl import Shapes, Simulation

STANDS_M_S = 0.3
STOOD_S = 1.0
ESCAPE_M = (0.5, 1.0, 1.5, 2.0)
ESCAPE_DIRECTIONS = 16


@dataclass(frozen=True)
class Encounter:
    """A moment near an obstacle.

    Attributes:
        time_s: of the simulation.
        distance_m: from the vehicle's place to the obstacle's surface.
        obstacle: its name.
        moves: whether the obstacle is one that moves.
        speed_m_s: the vehicle's own.
        stood_s: for how long it had been standing.
        could_escape: whether it could have gone 2 m straight on in some level direction.
        place_ned_m: the vehicle's.
    """

    time_s: float
    distance_m: float
    obstacle: str
    moves: bool
    speed_m_s: float
    stood_s: float
    could_escape: bool
    place_ned_m: tuple[float, float, float]

    @property
    def was_avoidable(self) -> bool:
        """Whether the vehicle could have kept away.

        It could not only if all of this holds: the obstacle moves and came to it, it had been
        standing for more than a second, and no way out of 2 m was free.
        """
        return not (self.moves and self.stood_s > STOOD_S and not self.could_escape)


class GroundTruth:
    """Watches the first vehicle of a simulation whose world has its origin where that stands.

    Args:
        simulation: it.
        radius_m: of the vehicle; to come nearer is a hit.

    Attributes:
        nearest: the moment of least distance so far; None without obstacles.
        hits: the first moment of each time that the vehicle was nearer than its radius.
        flown_m: the length of its path so far.
    """

    def __init__(self, simulation: Simulation, radius_m: float) -> None:
        """See the class."""
        self.nearest: Encounter | None = None
        self.hits: list[Encounter] = []
        self.flown_m = 0.0
        self._simulation = simulation
        self._radius_m = radius_m
        self._shapes = Shapes(simulation.world.obstacles)
        self._inside = False
        self._stood_since_s = simulation.time_s
        self._place = simulation.truth.position_ned_m[0]

    @property
    def collided(self) -> bool:
        """Whether the simulator says that it has flown into something."""
        return bool(self._simulation.truth.collided[0])

    def watch(self) -> None:
        """Look at this moment."""
        truth, now_s = self._simulation.truth, self._simulation.time_s
        place = truth.position_ned_m[0]
        speed_m_s = float(np.linalg.norm(truth.velocity_ned_m_s[0]))
        self.flown_m += float(np.linalg.norm(place - self._place))
        self._place = place
        if speed_m_s > STANDS_M_S:
            self._stood_since_s = now_s
        near = self._simulation.vehicles[0].clearance()
        inside = near.distance_m < self._radius_m
        nearer = self.nearest is None or near.distance_m < self.nearest.distance_m
        if near.obstacle and (nearer or (inside and not self._inside)):
            moment = Encounter(
                now_s,
                near.distance_m,
                near.obstacle,
                near.moves,
                speed_m_s,
                now_s - self._stood_since_s,
                inside and self._can_escape(place, now_s),
                (float(place[0]), float(place[1]), float(place[2])),
            )
            self.nearest = moment if nearer else self.nearest
            if inside and not self._inside:
                self.hits.append(moment)
        self._inside = inside

    def _can_escape(self, place_ned_m: np.ndarray, now_s: float) -> bool:
        self._shapes.move_to(now_s)
        angles = np.arange(ESCAPE_DIRECTIONS) * math.tau / ESCAPE_DIRECTIONS
        way = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(ESCAPE_DIRECTIONS)])
        points = (place_ned_m + np.array(ESCAPE_M)[:, None, None] * way).reshape(-1, 3)
        apart = np.hypot(self._shapes.gaps(points), self._shapes.heights_apart(points[:, 2]))
        free = apart.min(axis=1).reshape(len(ESCAPE_M), -1) >= self._radius_m
        return bool(free.all(axis=0).any())
