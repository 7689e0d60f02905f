"""The common base of the pipelines of rovers, boats and planes. Part of `simulation`."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ClassVar

from mavlink_sitl.array_ops import ops_for
from mavlink_sitl.dynamics import battery
from mavlink_sitl.exchange import Guidance, Vector
from mavlink_sitl.physics.copter_pipeline import Physics, PhysicsStart


class TravellerPhysics(Physics):
    """`Physics` of bodies with one motor, whose controllers follow a guidance of their own.

    Attributes:
        full_current_a: what the motor draws at full throttle.
        guidance_type: the guidance, which begins with doing nothing.
        targets_of: makes lanes of it.
        at_rest: makes the bodies as they stand at first, of height (down), yaw and lanes.
        law: the module of the controllers, with `initial` and `step`.
    """

    full_current_a: ClassVar[float]
    guidance_type: ClassVar[type[Guidance]]
    targets_of: ClassVar[Callable[..., Any]]
    at_rest: ClassVar[Callable[..., Any]]
    law: Any

    def __init__(self, start: PhysicsStart) -> None:
        super().__init__(start)
        self._told: list[Any] = [self.guidance_type() for _ in range(self.count)]
        self._told_lanes = self.targets_of(self._told, self.o)
        self.body = self.at_rest(self.o.full(0.0), self.o.pack(start.yaw_rad), self.o)
        self.gps_sample = (0.0, self.body, self.error)
        self._control: Any = self.law.initial(self.o)

    def step_batteries(self, dt: float) -> None:
        """Draw current for dt seconds: in proportion to the throttle."""
        current = self.full_current_a * abs(self.body.throttle)
        load = (current / self.pack.hover_current_a) ** (1.0 / self.pack.current_exponent)
        self.battery = battery.step(self.battery, load, dt, self.pack, self.o)

    def guide(self, index: int, guidance: Guidance) -> None:
        """Give a vehicle's controllers new guidance."""
        if not isinstance(guidance, self.guidance_type):
            guidance = self.guidance_type(motors=guidance.motors)  # a firmware that shuts down
        self._told[index] = guidance
        if self.count == 1:
            self._told_lanes = self.targets_of(self._told, self.o)
            return
        one = self.targets_of([guidance], ops_for(1))
        for lane, value in zip(self._told_lanes, one, strict=True):
            lane[index] = value

    def moving_target(self, index: int) -> Vector:
        """The destination of a vehicle."""
        told = self._told[index]
        return told.north_m, told.east_m, told.down_m
