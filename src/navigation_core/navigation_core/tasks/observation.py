"""The observation of the vehicle that a task gets at each step."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum

from navigation_core.geometry import Vector3
from navigation_core.mapping.moving_obstacles import Moving
from navigation_core.mapping.obstacles import NOTHING, Obstacles
from navigation_core.safety.fences import Fence
from navigation_core.tasks.inputs.tracked_target import TrackedTarget
from navigation_core.tasks.inputs.velocity_command import VelocityCommand
from navigation_core.tasks.inputs.waypoint_acts import ActReport
from navigation_core.trajectories.timed_trajectory import TimedTrajectory


class TaskOperation(Enum):
    """Something that takes the vehicle a while and that it may reject."""

    TAKE_CONTROL = "TAKE_CONTROL"
    ARM = "ARM"
    DISARM = "DISARM"
    TAKE_OFF = "TAKE_OFF"
    HOLD = "HOLD"
    LAND = "LAND"
    LAND_ON_TARGET = "LAND_ON_TARGET"
    RETURN = "RETURN"
    REPOSITION = "REPOSITION"
    CHANGE_SPEED = "CHANGE_SPEED"
    UPLOAD_MISSION = "UPLOAD_MISSION"
    START_MISSION = "START_MISSION"
    CLEAR_MISSION = "CLEAR_MISSION"


class VehicleMode(Enum):
    """The purpose of the vehicle's mode, independent of its firmware's name for it."""

    CONTROL = "CONTROL"
    """It follows setpoints."""
    HOLD = "HOLD"
    """It holds by itself; a plane circles."""
    TAKE_OFF = "TAKE_OFF"
    LAND = "LAND"
    RETURN = "RETURN"
    MISSION = "MISSION"
    OTHER = "OTHER"


class OperationStatus(Enum):
    """The state of an operation. All but PENDING are final."""

    PENDING = "PENDING"
    ACHIEVED = "ACHIEVED"
    REFUSED = "REFUSED"
    TIMED_OUT = "TIMED_OUT"
    CANCELLED = "CANCELLED"
    LINK_LOST = "LINK_LOST"
    LATE = "LATE"
    """The server was too late; the vehicle is not to blame."""


@dataclass(frozen=True)
class OperationReport:
    """The state of the operation that the task requested last.

    Attributes:
        kind: which operation.
        state: how it stands. ACHIEVED means that the vehicle's own state shows it.
        reason: what the vehicle gave as its reason; empty if it gave none.
    """

    kind: TaskOperation
    state: OperationStatus
    reason: str


@dataclass(frozen=True)
class MissionReport:
    """The state of the mission in the autopilot.

    Attributes:
        time_s: when the vehicle said so.
        current: the waypoint that it is on its way to, from 0 and over all laps.
        reached: the waypoints that it has said to have reached.
        complete: whether it says that the mission is over.
        changed: how the mission in the autopilot is not ours any more; empty if it is.
    """

    time_s: float
    current: int
    reached: frozenset[int]
    complete: bool
    changed: str = ""


class OtherVehicles:
    """The other vehicles, for those parts of a task that keep apart from them."""


@dataclass(frozen=True)
class Observation:
    """The known state of the vehicle at one moment.

    Attributes:
        time_s: the moment.
        position_enu_m: position in the map frame, or None.
        velocity_enu_m_s: velocity in the map frame, or None.
        yaw_enu_rad: yaw in the map frame, or None.
        armed: whether the motors may turn.
        in_control: whether the vehicle is in the mode in which it obeys setpoints.
        airborne: whether it flies; None if it does not say.
        ground_enu_m: map z of the ground, usually of home.
        position_age_s: time since the position was received; infinite without one.
        connected: whether the vehicle is heard.
        operation: state of the operation that the task asked for last, or None.
        mode: what the vehicle's mode is good for.
        home_enu_m: the launch point in the map frame, or None.
        landing: whether it says that it is landing.
        mission: how the uploaded mission stands, or None.
        obstacles: the known obstacles; the same object until something about it is new.
        obstacles_seen: those, without where something that moves is about to be, for what drives;
            None for the same.
        obstacles_age_s: time since the sensor that sees the obstacles was last heard; 0 when none
            is expected to be heard.
        obstacles_reach_m: how far the sensor of the obstacles sees; infinite without one.
        moving: those of them that move.
        corners_enu_m: ends of those that hide something from the sensor, east and north.
        late_s: by how much setpoints were late of late, at worst.
        position_doubt: why the position is not to be relied on, though it is given; empty while it
            is. The velocity is still good enough to stand still by.
        fence: the vehicle's own fence, or None while it is not known.
        command: the last velocity command, for a task that follows them; None without one.
        followed: the target of a goal that follows one; None without one.
        trajectory: the last trajectory of a client, for a task that flies them; None without one.
        traffic: the other vehicles; None where nobody keeps apart from them.
        act: the end of the act that the task has ordered last, or None.
    """

    time_s: float
    position_enu_m: Vector3 | None
    velocity_enu_m_s: Vector3 | None
    yaw_enu_rad: float | None
    armed: bool
    in_control: bool
    airborne: bool | None
    ground_enu_m: float
    position_age_s: float
    connected: bool
    operation: OperationReport | None
    mode: VehicleMode = VehicleMode.OTHER
    home_enu_m: Vector3 | None = None
    landing: bool = False
    mission: MissionReport | None = None
    obstacles: Obstacles = NOTHING
    obstacles_seen: Obstacles | None = None
    obstacles_age_s: float = 0.0
    obstacles_reach_m: float = math.inf
    moving: tuple[Moving, ...] = ()
    corners_enu_m: tuple[tuple[float, float], ...] = ()
    late_s: float = 0.0
    position_doubt: str = ""
    fence: Fence | None = None
    command: VelocityCommand | None = None
    followed: TrackedTarget | None = None
    trajectory: TimedTrajectory | None = None
    traffic: OtherVehicles | None = None
    act: ActReport | None = None

    @property
    def obstacles_now(self) -> Obstacles:
        """The obstacles where they are, not where they are about to be."""
        return self.obstacles if self.obstacles_seen is None else self.obstacles_seen
