"""A point-mass vehicle for the tests of tasks: no sockets, no clock, no MAVLink.

It follows a setpoint with a limited speed and acceleration, arms and takes off in the time
it is given, and rejects what it is told to reject. It is a model for tests of the core; how
real autopilots behave is tested against the simulator.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

from navigation_core.geometry import Vector3, add, limit_norm, norm, scale, subtract
from navigation_core.mapping.obstacles import NOTHING, Obstacles
from navigation_core.tasks.inputs.waypoint_acts import ActReport
from navigation_core.tasks.intents import Fly, Intent, Outcome, Perform
from navigation_core.tasks.observation import (
    Observation,
    OperationReport,
    OperationStatus,
    TaskOperation,
)
from navigation_core.tasks.task import Task

_FINAL = {
    OperationStatus.REFUSED,
    OperationStatus.TIMED_OUT,
    OperationStatus.CANCELLED,
    OperationStatus.LINK_LOST,
}


@dataclass
class PointMass:
    """A vehicle and the little of a bridge that a task sees of it.

    Attributes:
        position: map position in metres.
        velocity: map velocity in metres per second.
        yaw: heading in radians.
        wind: velocity that the air moves it with while it flies.
        obstacles: what is told to be in the way.
        obstacles_age_s: for how long the sensor has been silent.
        position_doubt: why its position is not to be relied on.
        believed_off: how far its estimate is from the truth, by a jump.
        results: how an operation ends, if not ACHIEVED.
        delays: how long an operation takes, in seconds.
        act: the answer to the last act.
    """

    position: Vector3 = (0.0, 0.0, 0.0)
    velocity: Vector3 = (0.0, 0.0, 0.0)
    yaw: float = 0.0
    armed: bool = False
    in_control: bool = False
    airborne: bool | None = False
    connected: bool = True
    position_known: bool = True
    position_age_s: float = 0.0
    wind: Vector3 = (0.0, 0.0, 0.0)
    obstacles: Obstacles = NOTHING
    obstacles_age_s: float = 0.0
    position_doubt: str = ""
    believed_off: Vector3 = (0.0, 0.0, 0.0)
    speed_max_m_s: float = 12.0
    acceleration_max_m_s2: float = 6.0
    obeys: bool = True
    results: dict[TaskOperation, OperationStatus] = field(default_factory=dict)
    delays: dict[TaskOperation, float] = field(default_factory=dict)
    reason: str = ""
    now: float = 100.0
    act: ActReport | None = None
    requests: list[Perform] = field(default_factory=list)
    _pending: Perform | None = None
    _report: OperationReport | None = None
    _asked_s: float = 0.0
    _target: Fly | None = None

    def observe(self) -> Observation:
        """Say what a task would be told now."""
        return Observation(
            time_s=self.now,
            position_enu_m=self._believed if self.position_known else None,
            velocity_enu_m_s=self.velocity if self.position_known else None,
            yaw_enu_rad=self.yaw if self.position_known else None,
            armed=self.armed,
            in_control=self.in_control,
            airborne=self.airborne,
            ground_enu_m=0.0,
            position_age_s=self.position_age_s if self.position_known else math.inf,
            connected=self.connected,
            operation=self._report,
            obstacles=self.obstacles,
            obstacles_age_s=self.obstacles_age_s,
            position_doubt=self.position_doubt,
            act=self.act,
        )

    @property
    def _believed(self) -> Vector3:
        return add(self.position, self.believed_off)

    def obey(self, intent: Intent) -> None:
        """Take an intent, as a bridge would."""
        if self._report is not None and self._report.state is not OperationStatus.PENDING:
            self._report = None
        if isinstance(intent, Perform):
            if self._pending is None or self._pending.kind is not intent.kind:
                self._pending, self._asked_s = intent, self.now
                self.requests.append(intent)
                self._report = OperationReport(intent.kind, OperationStatus.PENDING, "")
        elif isinstance(intent, Fly):
            self._pending = self._report = None
            self._target = intent

    def advance(self, dt_s: float) -> None:
        """Let time pass."""
        self.now += dt_s
        if self._pending is not None:
            self._work_on(self._pending, dt_s)
        elif (
            self._target is not None
            and self.airborne is not False
            and self.obeys
            and self.in_control
        ):
            self._follow(self._target, dt_s)
        elif self.airborne:
            self.velocity = scale(self.velocity, math.exp(-dt_s / 0.3))
        self.position = add(self.position, scale(self.velocity, dt_s))

    def _work_on(self, request: Perform, dt_s: float) -> None:
        kind = request.kind
        if kind is TaskOperation.TAKE_OFF and kind not in self.results:
            if not self._climb(request, dt_s):
                return
        elif self.now - self._asked_s < self.delays.get(kind, 0.3):
            return
        result = self.results.get(kind, OperationStatus.ACHIEVED)
        if result is OperationStatus.ACHIEVED:
            if kind is TaskOperation.TAKE_CONTROL:
                self.in_control = True
            elif kind in (TaskOperation.ARM, TaskOperation.DISARM):
                self.armed = kind is TaskOperation.ARM
        elif result not in _FINAL:
            return
        self._pending = None
        self._report = OperationReport(kind, result, self.reason if result in _FINAL else "")

    def _climb(self, request: Perform, dt_s: float) -> bool:
        if self.now - self._asked_s < self.delays.get(TaskOperation.TAKE_OFF, 1.0):
            return False
        self.airborne = None if self.airborne is None else True
        assert request.height_m is not None
        reached = self.position[2] >= request.height_m
        self.velocity = (0.0, 0.0, 0.0 if reached else 1.0)
        return reached

    def _follow(self, fly: Fly, dt_s: float) -> None:
        setpoint = fly.setpoint
        error = subtract(setpoint.position_enu_m, self._believed)
        if fly.by_velocity:
            error = (0.0, 0.0, 0.0)
        wanted = add(setpoint.velocity_enu_m_s, scale(error, 1.5))
        wanted = limit_norm(wanted, self.speed_max_m_s)
        wanted = add(wanted, self.wind)
        change = scale(subtract(wanted, self.velocity), 1.0 / max(dt_s, 0.2))
        change = limit_norm(change, self.acceleration_max_m_s2)
        self.velocity = add(self.velocity, scale(change, dt_s))
        self.yaw = setpoint.yaw_enu_rad

    @property
    def speed(self) -> float:
        """Speed over ground and in height together."""
        return norm(self.velocity)


@dataclass
class Flight:
    """The steps of a task: (time, observation, answer)."""

    steps: list[tuple[float, Observation, Intent | Outcome]] = field(default_factory=list)

    @property
    def outcome(self) -> Outcome:
        """The one outcome, which must be the last answer."""
        outcomes = [answer for _, _, answer in self.steps if isinstance(answer, Outcome)]
        assert len(outcomes) == 1, f"{len(outcomes)} outcomes"
        assert self.steps[-1][2] is outcomes[0]
        return outcomes[0]

    @property
    def setpoints(self) -> list[tuple[float, Fly]]:
        """All setpoints with their times."""
        return [(t, answer) for t, _, answer in self.steps if isinstance(answer, Fly)]


def fly(
    task: Task,
    vehicle: PointMass,
    each_step: Callable[[float], None] | None = None,
    time_max_s: float = 300.0,
    dt_s: float = 0.05,
    start: bool = True,
) -> Flight:
    """Fly a task to its end.

    Args:
        task: what to fly.
        vehicle: what to fly it with.
        each_step: called before each step with the time since the beginning.
        time_max_s: limit; a task that has not ended by then fails the test.
        dt_s: time between two steps.
        start: whether to start the task first.
    """
    begun_s = vehicle.now
    flight = Flight()
    if start:
        task.start(vehicle.observe(), vehicle.now)
    while vehicle.now - begun_s < time_max_s:
        if each_step is not None:
            each_step(vehicle.now - begun_s)
        if vehicle.connected:
            observation = vehicle.observe()
            answer = task.step(observation, vehicle.now)
            flight.steps.append((vehicle.now, observation, answer))
            progress = task.progress(observation, vehicle.now)
            assert math.isfinite(progress.distance_remaining_m)
            assert math.isfinite(progress.time_remaining_s)
            assert progress.distance_remaining_m >= 0.0
            assert progress.time_remaining_s >= 0.0
            if isinstance(answer, Outcome):
                return flight
            vehicle.obey(answer)
            if isinstance(answer, Fly):
                task.replan(observation, vehicle.now)
        vehicle.advance(dt_s)
    raise AssertionError(f"the task had not ended after {time_max_s} s")
