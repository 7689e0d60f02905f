"""A simulated flight above a landing target that a seeded camera sees."""

from __future__ import annotations

import math

import numpy as np

from mavlink_sitl import VehicleConfig, Wind, World
from navigation_bridge.goals.requests import LandRequest
from navigation_bridge.tasks.followed_target import FollowedTarget
from navigation_core.geometry import Vector3
from navigation_core.tasks.inputs.tracked_target import TargetSample
from tests.support.flights.simulated_flight import SimulatedFlight

__all__ = ["PRECISION", "LandingFlight"]

PRECISION = {"PLND_ENABLED": 1.0, "PLND_TYPE": 1.0}
"""Parameters with which an ArduCopter lands on a target."""
_PERIOD_S = 0.1
_HALF_VIEW_RAD = math.radians(35.0)
_LOST_SHARE = 0.1
# Error of a measured position, for each metre of distance.
_NOISE = 0.01


class LandingFlight(SimulatedFlight):
    """Looks down with a camera at 10 Hz: with noise, loss and a field of view, no delay.

    Attributes:
        target: true position of the target, in the map frame.
        is_covered: whether the camera does not see it, wherever it is.
        covered_below_m: height below which it does not.
    """

    def __init__(
        self,
        autopilot: str = "ardupilot",
        target: Vector3 = (2.0, 3.0, 0.0),
        height_m: float = 10.0,
        wind_m_s: float = 0.0,
        seed: int = 1,
        parameters: dict[str, float] | None = None,
    ) -> None:
        """Start, and bring the vehicle into the air."""
        if parameters is None:
            parameters = PRECISION if autopilot == "ardupilot" else {}
        vehicle = VehicleConfig(autopilot=autopilot, ready_after_s=1.0, parameters=parameters)
        world = World(wind=Wind((wind_m_s, 0.0, 0.0))) if wind_m_s else None
        super().__init__(seed=seed, simulated=vehicle, world=world)
        self.target = target
        self.is_covered = False
        self.covered_below_m = 0.0
        self._random = np.random.default_rng(seed)
        self.ready()
        self.run_to_end(self.send(0.0, 0.0, height_m))
        self.run_for(1.0)

    def land(self, request: LandRequest, timeout_s: float = 200.0) -> str:
        """Fly a goal to its end, and return its id."""
        goal_id, end_s = self.start(request), self.now + timeout_s
        while not self.ends(goal_id):
            assert self.now < end_s, self.outputs[-3:]
            self.look()
            self.run_for(_PERIOD_S)
        return goal_id

    def look(self) -> None:
        """Give the bridge what the camera sees now, in the map frame by the vehicle's estimate."""
        pose, feature = self.bridge.pose, self.bridge.feature(FollowedTarget)
        if pose is None or feature.source is None or not self._sees():
            return
        away = np.array(self.target) - np.array(self.truth()[0])
        noise = self._random.normal(0.0, _NOISE * float(np.linalg.norm(away)), 3)
        x, y, z = np.array(pose.position_enu_m) + away + noise
        sample = TargetSample(self.now, (float(x), float(y), float(z)))
        feature.offer(feature.source, sample, self.now)

    def _sees(self) -> bool:
        x, y, z = self.truth()[0]
        off_m = math.hypot(self.target[0] - x, self.target[1] - y)
        in_view = math.atan2(off_m, max(z - self.target[2], 1e-3)) < _HALF_VIEW_RAD
        lost = self._random.random() < _LOST_SHARE
        return in_view and not lost and not self.is_covered and z >= self.covered_below_m

    @property
    def off_m(self) -> float:
        """True distance to the target, over ground."""
        x, y, _ = self.truth()[0]
        return math.hypot(self.target[0] - x, self.target[1] - y)
