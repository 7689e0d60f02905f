"""The common base of the pipelines of rovers, boats and planes. Part of `simulation`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, ClassVar

from mavlink_sitl.dynamics import battery
from mavlink_sitl.exchange import Guidance
from mavlink_sitl.lanes import ops_for
from mavlink_sitl.physics.copter_pipeline import Physics


class ToldPhysics(Physics):
    """`Physics` of bodies with one motor, whose controllers follow a guidance of their own.

    Attributes:
        full_current_a: what the motor draws at full throttle.
        guidance_type: the guidance, which begins with doing nothing.
        targets_of: makes lanes of it.
        at_rest: makes the bodies as they stand at first, of height (down), yaw and lanes.
    """

    full_current_a: ClassVar[float]
    guidance_type: ClassVar[type[Guidance]]
    targets_of: ClassVar[Callable[..., Any]]
    at_rest: ClassVar[Callable[..., Any]]

    def __init__(
        self,
        yaw_rad: Sequence[float],
        pack: battery.BatteryModel,
        remaining: Sequence[float],
        seed: int,
        wind_ned_m_s: tuple[float, float, float],
    ) -> None:
        """See `Physics`."""
        super().__init__(yaw_rad, pack, remaining, seed, wind_ned_m_s)
        self._told: list[Any] = [self.guidance_type() for _ in range(self.count)]
        self._told_lanes = self.targets_of(self._told, self.o)
        self.body_model: Any = self._model()
        self.body = self.at_rest(self.o.full(0.0), self.o.pack(list(yaw_rad)), self.o)
        self.gps_sample = (0.0, self.body, self.error)
        self._control: Any = self._controller()

    def _model(self) -> Any:
        """Return the model of the bodies."""
        raise NotImplementedError

    def _controller(self) -> Any:
        """Return the controllers' state at first."""
        raise NotImplementedError

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

    def moving_target(self, index: int) -> tuple[float, float, float]:
        """The destination of a vehicle."""
        told = self._told[index]
        return told.north_m, told.east_m, told.down_m
