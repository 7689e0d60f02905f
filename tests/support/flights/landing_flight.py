"""A simulated flight above a landing target that a seeded camera sees."""

from __future__ import annotations

import math

from drone_navigation.server.frames.transform_tree import Placed, TransformTree
from mavlink_sitl import Mark, MarkCamera, Sighting, VehicleConfig, Wind, World
from navigation_bridge.goals.requests import LandRequest
from navigation_bridge.tasks.followed_target import FollowedTarget
from navigation_bridge.vehicle.odom_frame import at_time_of_position
from navigation_core.geometry import Vector3
from navigation_core.tasks.inputs.tracked_target import TargetSample
from tests.support.flights.simulated_flight import SimulatedFlight

__all__ = ["CAMERA", "PRECISION", "LandingFlight"]

PRECISION = {"PLND_ENABLED": 1.0, "PLND_TYPE": 1.0}
"""Parameters with which an ArduCopter lands on a target."""
CAMERA = MarkCamera()
_PERIOD_S = 0.1


class LandingFlight(SimulatedFlight):
    """Looks down with the camera of the simulated world.

    Its sightings, along the axes of the vehicle, become positions of the map by the vehicle's
    estimated pose at the time of the picture, as the server does it with its transforms.

    Attributes:
        target: true position of the target, in the map frame.
        is_covered: whether the camera does not see it, wherever it is.
        covered_below_m: height below which it does not.
        samples: the positions of the target that were seen, in the map frame.
    """

    def __init__(
        self,
        autopilot: str = "ardupilot",
        target: Vector3 = (2.0, 3.0, 0.0),
        height_m: float = 10.0,
        wind_m_s: float = 0.0,
        seed: int = 1,
        parameters: dict[str, float] | None = None,
        camera: MarkCamera = CAMERA,
    ) -> None:
        """Start, and bring the vehicle into the air."""
        if parameters is None:
            parameters = PRECISION if autopilot == "ardupilot" else {}
        vehicle = VehicleConfig(autopilot=autopilot, ready_after_s=1.0, parameters=parameters)
        east_m, north_m, up_m = target
        mark = Mark((north_m, east_m), up_m)
        world = World(wind=Wind((wind_m_s, 0.0, 0.0)), mark=mark, camera=camera)
        self._tree = TransformTree()
        self._placed_s = -math.inf
        super().__init__(seed=seed, simulated=vehicle, world=world)
        self.target = target
        self.is_covered = False
        self.covered_below_m = 0.0
        self.samples: list[Vector3] = []
        self.ready()
        self.run_to_end(self.send(0.0, 0.0, height_m))
        self.run_for(1.0)

    def tick(self) -> None:
        """Continue, and remember where the vehicle was by its own estimate."""
        super().tick()
        position, pose = self.vehicle.state.global_position, self.bridge.pose
        if position is None or pose is None or position.time_s == self._placed_s:
            return
        self._placed_s = position.time_s
        pose = at_time_of_position(pose, self.vehicle.state)
        x, y, z, w = pose.orientation_xyzw
        placed = Placed(pose.position_enu_m, (w, x, y, z), position.time_s)
        self._tree.take("base_link", "map", placed)

    def land(self, request: LandRequest, timeout_s: float = 200.0) -> str:
        """Fly a goal to its end, and return its id."""
        goal_id, end_s = self.start(request), self.now + timeout_s
        while not self.ends(goal_id):
            assert self.now < end_s, self.outputs[-3:]
            self.look()
            self.run_for(_PERIOD_S)
        return goal_id

    def passed_errors_m(self, east_m: float) -> list[float]:
        """Fly to the east at the same height; return how far off, over ground, each sample is."""
        self.look()
        self.samples.clear()
        goal_id = self.send(east_m, 0.0, self.truth()[0][2])
        while not self.ends(goal_id):
            self.run_for(_PERIOD_S)
            self.look()
        return [math.dist(place[:2], self.target[:2]) for place in self.samples]

    def look(self) -> None:
        """Give the bridge what the camera has seen since it was looked at last."""
        is_covered = self.is_covered or self.truth()[0][2] < self.covered_below_m
        feature = self.bridge.feature(FollowedTarget)
        for sighting in self.simulation.sightings():
            sample = self._sample(sighting)
            if sample is None or is_covered:
                continue
            self.samples.append(sample.position_enu_m)
            if feature.source is not None:
                feature.offer(feature.source, sample, self.now)

    def _sample(self, sighting: Sighting) -> TargetSample | None:
        measured_s = 1e-6 * sighting.measured_us
        placed = self._tree.pose("base_link", "map", measured_s)
        if placed is None:
            return None
        forward, right, down = sighting.body_frd_m
        return TargetSample(measured_s, placed.of((forward, -right, -down)))

    @property
    def off_m(self) -> float:
        """True distance to the target, over ground."""
        x, y, _ = self.truth()[0]
        return math.hypot(self.target[0] - x, self.target[1] - y)
