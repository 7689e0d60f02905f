"""Trajectories as a planner would send them, flown by simulated copters, with their error."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from mavlink_sitl import VehicleConfig, World
from navigation_bridge.configuration.parameter_table import ParameterValue
from navigation_bridge.goals.requests import TrajectoryRequest
from navigation_bridge.requests.trajectory_commands import TrajectoryCommands
from navigation_core.geometry import Vector3, add, scale
from navigation_core.trajectories.timed_point import TimedPoint
from tests.support.flights.simulated_flight import SimulatedFlight

__all__ = ["Curve", "Errors", "TrajectoryFlight", "circle", "lissajous"]

_PERIOD_S = 0.1
_STEP_S = 1e-3
# Slower than this, a copter has no direction of travel to face; and it has to turn to it first.
_COURSE_M_S, _TURNED_S = 1.0, 5.0


@dataclass(frozen=True)
class Curve:
    """A motion of a planner.

    Attributes:
        place: returns the position at a time, in the map frame.
        duration_s: its duration.
    """

    place: Callable[[float], Vector3]
    duration_s: float

    def points(self, begin_s: float = 0.0, end_s: float = math.inf) -> tuple[TimedPoint, ...]:
        """Return points each tenth of a second, with velocities and accelerations."""
        end_s = min(end_s, self.duration_s)
        count = max(round((end_s - begin_s) / _PERIOD_S), 1)
        return tuple(
            self._point(begin_s + (end_s - begin_s) * i / count, begin_s) for i in range(count + 1)
        )

    def _point(self, time_s: float, begin_s: float) -> TimedPoint:
        before, here, after = (self.place(time_s + k * _STEP_S) for k in (-1, 0, 1))
        rows = list(zip(before, here, after, strict=True))
        x, y, z = ((c - a) / (2.0 * _STEP_S) for a, _, c in rows)
        a_x, a_y, a_z = ((a - 2.0 * b + c) / _STEP_S**2 for a, b, c in rows)
        return TimedPoint(time_s - begin_s, here, (x, y, z), (a_x, a_y, a_z))


def _eased(time_s: float, rise_s: float, duration_s: float) -> float:
    """Return a phase in seconds that begins and ends at rest, and passes at 1 s/s between."""

    def rise(share: float) -> float:
        share = min(max(share, 0.0), 1.0)
        return share**4 * (2.5 - 3.0 * share + share * share)

    # The integral of the quintic step 10 u^3 - 15 u^4 + 6 u^5.
    begin = rise_s * rise(time_s / rise_s)
    middle = max(min(time_s, duration_s - rise_s) - rise_s, 0.0)
    left = (duration_s - time_s) / rise_s
    end = rise_s * (rise(1.0) - rise(left)) if left < 1.0 else 0.0
    return begin + middle + end


def circle(start: Vector3, radius_m: float, speed_m_s: float, laps: float = 2.0) -> Curve:
    """Return laps around a centre west of the start, from rest to rest."""
    rise_s = max(2.5 * speed_m_s / 2.0, 1.0)
    duration_s = laps * math.tau * radius_m / speed_m_s + rise_s
    x, y, z = start

    def place(time_s: float) -> Vector3:
        angle = _eased(time_s, rise_s, duration_s) * speed_m_s / radius_m
        return (x - radius_m + radius_m * math.cos(angle), y + radius_m * math.sin(angle), z)

    return Curve(place, duration_s)


def lissajous(start: Vector3, size_m: float, speed_m_s: float, laps: float = 1.0) -> Curve:
    """Return a figure of eight around the start, from rest to rest, that climbs a little."""
    rate = speed_m_s / (size_m * math.sqrt(2.0))
    rise_s = max(2.5 * speed_m_s / 2.0, 1.0)
    duration_s = laps * math.tau / rate + rise_s
    x, y, z = start

    def place(time_s: float) -> Vector3:
        angle = rate * _eased(time_s, rise_s, duration_s)
        return (
            x + size_m * math.sin(angle),
            y + 0.5 * size_m * math.sin(2.0 * angle),
            z + 0.5 * (1.0 - math.cos(angle)),
        )

    return Curve(place, duration_s)


@dataclass(frozen=True)
class Errors:
    """How far a vehicle was from its trajectory, by the simulation's truth.

    Attributes:
        largest_m: greatest distance to where the trajectory was at the time.
        yaw_deg: root mean square of the angle between the nose and the direction of travel.
    """

    largest_m: float
    yaw_deg: float


class TrajectoryFlight(SimulatedFlight):
    """A copter in the air that flies trajectories."""

    def __init__(
        self,
        autopilot: str = "ardupilot",
        world: World | None = None,
        onboard: Mapping[str, float] | None = None,
        **parameters: ParameterValue,
    ) -> None:
        """Start, with parameters of the autopilot and of the server, and take off."""
        vehicle = VehicleConfig(
            autopilot=autopilot, ready_after_s=1.0, heading_deg=0.0, parameters=dict(onboard or {})
        )
        super().__init__(simulated=vehicle, world=world, **parameters)  # type: ignore[arg-type]
        self.ready()
        self.fly_up()
        self.run_for(3.0)

    @property
    def here(self) -> Vector3:
        """The measured position in the map frame."""
        pose = self.bridge.map_frame.pose(self.vehicle.live.get())
        assert pose is not None
        return pose.position_enu_m

    @property
    def yaw_enu_rad(self) -> float:
        """The true yaw."""
        return 0.5 * math.pi - float(self.simulation.truth.yaw_rad[0])

    def offer(self, request: TrajectoryRequest) -> None:
        """Publish a trajectory on the topic."""
        self.bridge.feature(TrajectoryCommands).replace(request, self.now)
        self._collect()

    def errors(self, goal_id: str, timeout_s: float = 200.0) -> Errors:
        """Fly a goal without yaws to its end; return how far it was from its trajectory.

        The trajectory's time is that of the setpoint: it is held while the vehicle lags.
        """
        largest_m, end_s = 0.0, self.now + timeout_s
        off_rad: list[float] = []
        flown_since_s = math.inf
        while not self.ends(goal_id):
            assert self.now < end_s
            self.tick()
            goal = self.bridge.goals.active
            commanded = None if goal is None else goal.task.commanded
            if goal is None or commanded is None or self.status(goal_id) != "NAVIGATING":
                continue
            flown_since_s = min(flown_since_s, self.now)
            since_s = self.now - (goal.times.setpoint_s or self.now)
            moved = scale(commanded.velocity_enu_m_s, since_s)
            error_m = math.dist(self.truth()[0], add(commanded.position_enu_m, moved))
            largest_m = max(largest_m, error_m)
            gained = scale(commanded.acceleration_enu_m_s2, since_s)
            east, north, _ = add(commanded.velocity_enu_m_s, gained)
            turned = self.now > flown_since_s + _TURNED_S
            if turned and math.hypot(east, north) > _COURSE_M_S:
                course = math.atan2(north, east)
                off_rad.append(math.remainder(self.yaw_enu_rad - course, math.tau))
        mean = sum(each * each for each in off_rad) / max(len(off_rad), 1)
        return Errors(largest_m, math.degrees(math.sqrt(mean)))
