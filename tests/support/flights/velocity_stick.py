"""A client that steers a simulated flight by velocity commands."""

from __future__ import annotations

import itertools
import math

from mavlink_sitl import VehicleConfig, World
from navigation_bridge.clients.service_requests import Service
from navigation_bridge.configuration.parameter_table import ParameterValue
from navigation_bridge.goals.goal import GoalFinished
from navigation_bridge.goals.requests import TakeoffRequest, VelocityRequest
from navigation_bridge.tasks.velocity_commands import VelocityCommands
from navigation_core.geometry import Vector3
from navigation_core.tasks.inputs.velocity_command import VelocityCommand, VelocityFrame
from tests.support.flights.simulated_flight import SimulatedFlight

__all__ = ["SteeredFlight"]

_PERIOD_S = 0.1
_ids = itertools.count(0xC0)


class SteeredFlight(SimulatedFlight):
    """Publishes velocities at 10 Hz, as a joystick's node does."""

    def __init__(
        self,
        kind: str = "copter",
        autopilot: str = "ardupilot",
        world: World | None = None,
        vehicle_parameters: dict[str, float] | None = None,
        **parameters: ParameterValue,
    ) -> None:
        """Start, and bring what flies into the air, or arm what drives."""
        vehicle = VehicleConfig(
            vehicle=kind,
            autopilot=autopilot,
            ready_after_s=1.0,
            heading_deg=0.0,
            parameters=vehicle_parameters or {},
        )
        super().__init__(simulated=vehicle, world=world, **parameters)  # type: ignore[arg-type]
        self.ready()
        if kind == "copter":
            self.fly_up()
            self.run_for(1.0)
        elif kind == "plane":
            self.start(TakeoffRequest(50.0))
            self.run_until(lambda: self.truth()[0][2] > 45.0)
        else:
            assert self.serve(Service.ARM).success
        self.started = ""

    def begin(self, max_speed_m_s: float = 0.0) -> str:
        """Start a goal that follows commands."""
        goal_id = self.start(VelocityRequest(max_speed_m_s))
        self.run_until(lambda: self.status(goal_id) == "HOLDING")
        return goal_id

    def tell(self, linear: Vector3, rate: float = 0.0, frame: str = "base_link") -> None:
        """Give one command; ``started`` is then the goal that it may have started."""
        idle, goal_id = self.bridge.goals.active is None, f"{next(_ids):032x}"
        command = VelocityCommand(self.now, VelocityFrame(frame), linear, rate)
        self.bridge.feature(VelocityCommands).follow(command, goal_id, self.now)
        self._collect()
        if idle and self.bridge.goals.active is not None:
            self.started = goal_id

    def steer(
        self, seconds: float, linear: Vector3, rate: float = 0.0, frame: str = "base_link"
    ) -> None:
        """Give a command for a while."""
        end_s = self.now + seconds
        while self.now < end_s:
            self.tell(linear, rate, frame)
            self.run_for(_PERIOD_S)

    def steer_to_end(self, goal_id: str, linear: Vector3, timeout_s: float = 30.0) -> GoalFinished:
        """Give a command until a goal has ended."""
        end_s = self.now + timeout_s
        while not self.ends(goal_id):
            assert self.now < end_s, self.outputs[-5:]
            self.steer(_PERIOD_S, linear)
        (end,) = self.ends(goal_id)
        return end

    @property
    def speed_m_s(self) -> float:
        """The true speed."""
        return self.truth()[1]

    @property
    def yaw_enu_rad(self) -> float:
        """The true heading, counter-clockwise from east."""
        return math.remainder(0.5 * math.pi - float(self.simulation.truth.yaw_rad[0]), math.tau)

    @property
    def said(self) -> str:
        """All that was logged."""
        return "\n".join(line.text for line in self.log_lines())
