"""A simulated flight beside a target, whose true motion is known."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TypeAlias

import numpy as np

from mavlink_sitl import VehicleConfig, World
from navigation_bridge.clients.service_requests import Service
from navigation_bridge.configuration.parameter_table import ParameterValue
from navigation_bridge.goals.requests import FollowRequest
from navigation_bridge.tasks.followed_target import FollowedTarget
from navigation_core.geometry import Vector3
from navigation_core.tasks.inputs.tracked_target import TargetSample
from navigation_core.tasks.progress import FollowState
from tests.support.flights.simulated_flight import SimulatedFlight

__all__ = ["FollowFlight", "Motion"]

Motion: TypeAlias = Callable[[float], Vector3]
"""The true position of a target, for the time since the goal began."""

_PERIOD_S = 0.1


class FollowFlight(SimulatedFlight):
    """Measures the target at 10 Hz, and watches the vehicle.

    Attributes:
        motion: of the target.
        is_seen: whether it is measured.
        nearest_m: least true distance to it since the goal began.
        fastest_m_s: highest true speed of the vehicle since then.
        places: true places of the vehicle and of the target, at each measurement.
        times_s: times of these since the goal began.
    """

    def __init__(
        self,
        motion: Motion,
        kind: str = "copter",
        autopilot: str = "ardupilot",
        world: World | None = None,
        noise_m: float = 0.0,
        **parameters: ParameterValue,
    ) -> None:
        """Start, and bring a copter into the air, or arm what drives.

        The target is measured with noise of this standard deviation on each axis.
        """
        vehicle = VehicleConfig(vehicle=kind, autopilot=autopilot, ready_after_s=1.0)
        super().__init__(simulated=vehicle, world=world, **parameters)  # type: ignore[arg-type]
        self.motion = motion
        self._noise_m, self._random = noise_m, np.random.default_rng(1)
        self.is_seen = True
        self.nearest_m, self.fastest_m_s = math.inf, 0.0
        self.places: list[tuple[Vector3, Vector3]] = []
        self.times_s: list[float] = []
        self.began_s = 0.0
        self.ready()
        if kind == "copter":
            self.fly_up()
            self.run_for(1.0)
        else:
            assert self.serve(Service.ARM).success

    @property
    def target(self) -> Vector3:
        """Where the target is."""
        return self.motion(self.now - self.began_s)

    def follow(self, request: FollowRequest) -> str:
        """Start a goal; the target's motion begins with it."""
        self.began_s = self.now
        return self.start(request)

    def chase(self, seconds: float) -> None:
        """Continue for a while, or until the goal ends; the target is measured."""
        end_s = self.now + seconds
        while self.now < end_s and self.bridge.goals.active is not None:
            source = self.bridge.feature(FollowedTarget).source
            if self.is_seen and source is not None:
                x, y, z = self._random.normal(self.target, self._noise_m)
                self.measure(TargetSample(self.now, (float(x), float(y), float(z))))
            self.run_for(_PERIOD_S)
            place, speed_m_s = self.truth()
            self.places.append((place, self.target))
            self.times_s.append(self.now - self.began_s)
            self.nearest_m = min(self.nearest_m, math.dist(place, self.target))
            self.fastest_m_s = max(self.fastest_m_s, speed_m_s)

    def measure(self, sample: TargetSample | str) -> None:
        """Give a sample of the target."""
        feature = self.bridge.feature(FollowedTarget)
        assert feature.source is not None
        feature.offer(feature.source, sample, self.now)

    def state(self, goal_id: str) -> FollowState:
        """Return how the target is followed, by the last feedback."""
        follow = self.feedback(goal_id)[-1].follow
        assert follow is not None
        return follow.state

    def error_m(self, offset_m: Vector3) -> float:
        """Return the true distance to a place beside the target, in the axes of the map."""
        place = tuple(a + b for a, b in zip(self.target, offset_m, strict=True))
        return math.dist(self.truth()[0], place)
