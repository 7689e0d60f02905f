"""A vehicle that moves as the setpoints of a task say, without an autopilot."""

from __future__ import annotations

from dataclasses import replace

from navigation_core.geometry import Vector3
from navigation_core.tasks.goto_config import GotoConfig
from navigation_core.tasks.intents import Fly, Intent, Outcome, Wait
from navigation_core.tasks.observation import VehicleMode
from navigation_core.tasks.progress import Status
from navigation_core.tasks.task import Task
from navigation_core.tasks.traits import Traits
from tests.support.models.observations import HOVERING

__all__ = ["PERIOD_S", "SteeredVehicle"]

PERIOD_S = 0.05


class SteeredVehicle:
    """A task, and the vehicle that it steers."""

    def __init__(self, task: Task, traits: Traits, config: GotoConfig, **seen: object) -> None:
        self.task = task
        self._gain_1_s = config.following_gain_per_s
        self.now = 100.0
        self.traits = traits
        self.seen = replace(
            HOVERING,
            time_s=self.now,
            position_enu_m=(0.0, 0.0, 10.0 if traits.flies else 0.0),
            airborne=True if traits.flies else None,
            mode=VehicleMode.CONTROL,
        )
        self.seen = replace(self.seen, **seen)  # type: ignore[arg-type]
        self.answer: Intent | Outcome = Wait()
        self.task.start(self.seen, self.now)

    @property
    def place(self) -> Vector3:
        assert self.seen.position_enu_m is not None
        return self.seen.position_enu_m

    @property
    def velocity(self) -> Vector3:
        assert self.seen.velocity_enu_m_s is not None
        return self.seen.velocity_enu_m_s

    @property
    def status(self) -> Status:
        return self.task.progress(self.seen, self.now).status

    def step(self) -> Intent | Outcome:
        """Continue by one period."""
        self.now += PERIOD_S
        self.seen = replace(self.seen, time_s=self.now)
        self.answer = self.task.step(self.seen, self.now)
        if isinstance(self.answer, Fly):
            self._obey(self.answer)
        return self.answer

    def _obey(self, fly: Fly) -> None:
        x, y, z = self.place
        velocity, yaw = fly.setpoint.velocity_enu_m_s, fly.setpoint.yaw_enu_rad
        if self.traits.flies and not fly.by_velocity:
            error = (a - b for a, b in zip(fly.setpoint.position_enu_m, (x, y, z), strict=True))
            velocity = tuple(  # type: ignore[assignment]
                v + self._gain_1_s * e for v, e in zip(velocity, error, strict=True)
            )
        if fly.turn_rate_rad_s is not None:
            yaw += fly.turn_rate_rad_s * PERIOD_S
        moved = (
            x + velocity[0] * PERIOD_S,
            y + velocity[1] * PERIOD_S,
            z + velocity[2] * PERIOD_S,
        )
        self.seen = replace(
            self.seen, position_enu_m=moved, velocity_enu_m_s=velocity, yaw_enu_rad=yaw
        )

    def outcome(self) -> Outcome:
        assert isinstance(self.answer, Outcome), self.answer
        return self.answer
