"""Bridge and simulated vehicle on one simulated clock: a whole goal in milliseconds."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from typing import Any, TypeVar

from mavlink_sitl import Simulation, VehicleConfig, World
from mavlink_vehicle.codec import Codec, Message
from mavlink_vehicle.vehicle import Vehicle
from navigation_bridge.bridge import Bridge
from navigation_bridge.clients.service_requests import Service
from navigation_bridge.configuration.make_config import make_config
from navigation_bridge.configuration.parameter_table import ParameterValue
from navigation_bridge.goals.goal import (
    GoalFeedback,
    GoalFinished,
    LogLine,
    ServiceDone,
)
from navigation_bridge.goals.requests import NavigateRequest, Request
from navigation_bridge.tasks.registry import TASKS
from navigation_bridge.tasks.task_kind import TaskKind
from navigation_core.geometry import Vector3
from navigation_core.safety.target_checks import Rejection
from tests.support.worlds.ground_truth import GroundTruth

_TICK_S = 0.01
_RADIUS_M = 0.5
"""The default of the server's vehicle_radius_m"""
_Output = TypeVar("_Output")


class SimulatedFlight:
    """Runs both sides tick by tick; the link between them can be cut.

    Attributes:
        link_up: whether anything passes.
        uplink_up: whether what the server sends arrives.
        unheard: types of messages of the vehicle that are lost.
    """

    def __init__(
        self,
        seed: int = 1,
        simulated: VehicleConfig | None = None,
        world: World | None = None,
        tasks: Sequence[TaskKind[Any]] = TASKS,
        **parameters: ParameterValue,
    ) -> None:
        """Start both, with parameters of the server; ``arming`` is auto unless given.

        With a world there are things around the vehicle; ``ground_truth`` knows how near it
        has come to them. Goals may ask for ``tasks``.
        """
        self._parameters: dict[str, ParameterValue] = {"arming": "auto", **parameters}
        self.config = make_config(self._parameters)
        vehicle = simulated or VehicleConfig(ready_after_s=1.0)
        self.simulation = Simulation(vehicles=[vehicle], seed=seed, world=world)
        self.ground_truth = GroundTruth(self.simulation, _RADIUS_M)
        self.vehicle = Vehicle(self.config.vehicle)
        self.bridge = Bridge(self.vehicle, self.config.bridge, tasks=tasks)
        self.now = 0.0
        self.link_up = True
        self.uplink_up = True
        self.unheard: frozenset[str] = frozenset()
        self.outputs: list[tuple[float, object]] = []
        self._by_kind: dict[type, list[object]] = {}
        self.kind = vehicle.vehicle
        self.sent: list[tuple[float, Message]] = []
        self.codec = Codec(1, 191)
        self.on_sent: Callable[[bytes], None] | None = None
        self.on_output: Callable[[object], None] | None = None
        self._ids = itertools.count(1)
        self.bridge.start(self.now)

    def tick(self) -> None:
        """Continue by one hundredth of a second."""
        self.now += _TICK_S
        self.simulation.run_for(_TICK_S)
        if self.simulation.world.obstacles:
            self.ground_truth.watch()
        for data in self.simulation.link.read_datagrams():
            if self.link_up:
                for message in self.codec.decode(data):
                    if message.get_type() not in self.unheard:
                        self.bridge.receive(message, self.now)
        deadline = self.bridge.next_deadline()
        if deadline is not None and deadline <= self.now:
            self.bridge.handle_timer(self.now)
        for message in self.bridge.messages_to_send():
            self.sent.append((self.now, message))
            data = self.codec.encode(message)
            if self.on_sent is not None:
                self.on_sent(data)
            if self.link_up and self.uplink_up:
                self.simulation.link.write(data)
        self._collect()

    def stall(self, seconds: float) -> None:
        """Let the vehicle continue for a while in which the server stands still, as after SIGSTOP.

        Messages of the vehicle wait in the link, and come at once afterwards.
        """
        end_s = self.now + seconds
        while self.now < end_s:
            self.now += _TICK_S
            self.simulation.run_for(_TICK_S)
            if self.simulation.world.obstacles:
                self.ground_truth.watch()

    def log_lines(self) -> list[LogLine]:
        """Return what was logged."""
        return self.all(LogLine)

    def _collect(self) -> None:
        while (output := self.bridge.next_output()) is not None:
            self.outputs.append((self.now, output))
            self._by_kind.setdefault(type(output), []).append(output)
            if self.on_output is not None:
                self.on_output(output)

    def hang_for(self, seconds: float) -> None:
        """Let the server's process stand still: what arrives meanwhile is read afterwards."""
        end_s = self.now + seconds
        waiting = []
        while self.now < end_s:
            self.now += _TICK_S
            self.simulation.run_for(_TICK_S)
            waiting += self.simulation.link.read_datagrams()
        for data in waiting:
            for message in self.codec.decode(data):
                self.bridge.receive(message, self.now)
        self._collect()

    def run_for(self, seconds: float) -> None:
        """Continue for a while."""
        end_s = self.now + seconds
        while self.now < end_s:
            self.tick()

    def run_until(self, condition: Callable[[], bool], timeout_s: float = 120.0) -> None:
        """Continue until ``condition`` holds; fail after ``timeout_s`` of simulated time."""
        end_s = self.now + timeout_s
        while not condition():
            assert self.now < end_s, f"not in {timeout_s:g} s; last: {self.outputs[-5:]}"
            self.tick()

    def reconfigure(self, **parameters: ParameterValue) -> None:
        """Change parameters of the server while it runs."""
        self._parameters |= parameters
        self.config = make_config(self._parameters)
        self.bridge.configure(self.config.bridge)

    def ready(self) -> SimulatedFlight:
        """Continue until goals can be taken."""
        self.run_until(lambda: self.bridge.pose is not None, 60.0)
        if self.kind == "plane":
            self.run_for(0.3)  # an ArduPlane has a position before its gyroscopes agree
        return self

    def request(
        self,
        x: float,
        y: float,
        z: float,
        speed: float = 0.0,
        frame: str = "map",
        orientation: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 1.0),
        avoid: bool = False,
    ) -> NavigateRequest:
        """Return a request."""
        return NavigateRequest(frame, (x, y, z), orientation, avoid, speed)

    def send(self, x: float, y: float, z: float, speed: float = 0.0) -> str:
        """Send a goal that must be accepted, and return its id."""
        return self.start(self.request(x, y, z, speed))

    def start(self, request: Request) -> str:
        """Send a goal of any action that must be accepted, and return its id."""
        rejection = self.bridge.goals.check(request, self.now)
        assert rejection is None, rejection
        goal_id = f"{next(self._ids):032x}"
        self.bridge.goals.start(goal_id, request, self.now)
        self._collect()
        return goal_id

    def serve(self, service: Service, mode: str = "") -> ServiceDone:
        """Call a service and return its answer."""
        number = next(self._ids)
        self.bridge.services.serve(number, service, self.now, mode)
        self._collect()
        self.run_until(lambda: any(done.number == number for done in self.all(ServiceDone)), 20.0)
        return self.all(ServiceDone)[-1]

    def check(self, request: Request) -> Rejection | None:
        """Ask whether a request would be accepted."""
        return self.bridge.goals.check(request, self.now)

    def all(self, kind: type[_Output]) -> list[_Output]:
        """Return all outputs of one kind."""
        return [output for output in self._by_kind.get(kind, ()) if isinstance(output, kind)]

    def ends(self, goal_id: str) -> list[GoalFinished]:
        """Return how often and how a goal has ended."""
        return [end for end in self.all(GoalFinished) if end.goal_id == goal_id]

    def feedback(self, goal_id: str) -> list[GoalFeedback]:
        """Return a goal's feedback."""
        return [item for item in self.all(GoalFeedback) if item.goal_id == goal_id]

    def status(self, goal_id: str) -> str:
        """Return the last status in a goal's feedback; empty before the first."""
        feedback = self.feedback(goal_id)
        return feedback[-1].status.value if feedback else ""

    def run_to_status(self, goal_id: str, status: str) -> None:
        """Continue until a goal's feedback has ``status``."""
        self.run_until(lambda: self.status(goal_id) == status)

    def run_to_end(self, goal_id: str, timeout_s: float = 120.0) -> GoalFinished:
        """Continue until a goal has ended, and 2 s further, in which nothing more may come."""
        self.run_until(lambda: bool(self.ends(goal_id)), timeout_s)
        count = len(self.feedback(goal_id))
        self.run_for(2.0)
        assert len(self.feedback(goal_id)) == count, "feedback after the end"
        (end,) = self.ends(goal_id)
        return end

    def fly_up(self) -> None:
        """Bring the vehicle into the air at (0, 0, 3)."""
        end = self.run_to_end(self.send(0.0, 0.0, 3.0))
        assert end.code.value == "SUCCESS", end.message

    def setpoint_times(self, since_s: float) -> list[float]:
        """Return when setpoints were sent."""
        return [
            time_s
            for time_s, message in self.sent
            if time_s >= since_s and message.get_type() == "SET_POSITION_TARGET_LOCAL_NED"
        ]

    def clearance_m(self) -> float:
        """Return how far the vehicle truly is from the nearest obstacle at this moment."""
        return self.simulation.vehicles[0].clearance().distance_m

    def truth(self) -> tuple[Vector3, float]:
        """Return the true position (ENU about the origin, m) and the true speed (m/s)."""
        north, east, down = (float(v) for v in self.simulation.truth.position_ned_m[0])
        velocity = self.simulation.truth.velocity_ned_m_s[0]
        return (east, north, -down), float((velocity**2).sum() ** 0.5)

    def slowest_m_s(self, seconds: float) -> float:
        """Continue for a while; return the least true speed in it (m/s)."""
        end_s, slowest = self.now + seconds, self.truth()[1]
        while self.now < end_s:
            self.run_for(0.1)
            slowest = min(slowest, self.truth()[1])
        return slowest

    def set_mode_as_pilot(self, mode: str) -> None:
        """Change the mode as a pilot's switch does."""
        assert self.simulation.vehicles[0].pilot_mode_change(mode), f"the vehicle rejected {mode}"
