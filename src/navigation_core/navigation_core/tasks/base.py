"""The interface of tasks: observations, intents and outcomes.

A task is a pure state machine. Its owner calls :meth:`Task.step` at the setpoint rate with
what is known about the vehicle, carries out the intent that comes back, and stops calling
once the answer is an outcome. Positions are in the ENU map frame, times are seconds of
whatever clock the owner uses.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum, Flag, auto
from typing import NamedTuple, Protocol

from navigation_core.geometry import KinematicState, Vector3, is_finite
from navigation_core.mapping.moving_obstacles import Moving
from navigation_core.mapping.obstacles import NOTHING, Obstacles
from navigation_core.outcomes import OutcomeCode, Rejection
from navigation_core.tasks.waypoint import MissionPlan

__all__ = [
    "COPTER",
    "NOTHING_SENT",
    "Fly",
    "Handover",
    "Intent",
    "MissionReport",
    "Observation",
    "OperationKind",
    "OperationReport",
    "OperationStatus",
    "Outcome",
    "OutcomeCode",
    "Perform",
    "Progress",
    "Rejection",
    "Requirement",
    "RouteProgress",
    "Setpoint",
    "Status",
    "Task",
    "Traits",
    "VehicleMode",
    "Wait",
    "check_requirements",
]


class Status(str, Enum):
    """The status of a goal in its feedback."""

    PREPARING = "PREPARING"
    ARMING = "ARMING"
    TAKING_OFF = "TAKING_OFF"
    NAVIGATING = "NAVIGATING"
    SETTLING = "SETTLING"
    HOLDING = "HOLDING"
    PAUSED = "PAUSED"
    BLOCKED = "BLOCKED"
    UPLOADING = "UPLOADING"
    RETURNING = "RETURNING"
    LANDING = "LANDING"
    CANCELLING = "CANCELLING"
    LINK_LOST = "LINK_LOST"


class OperationKind(Enum):
    """Something that takes the vehicle a while and that it may reject."""

    TAKE_CONTROL = "TAKE_CONTROL"
    ARM = "ARM"
    DISARM = "DISARM"
    TAKE_OFF = "TAKE_OFF"
    HOLD = "HOLD"
    LAND = "LAND"
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


@dataclass(frozen=True)
class Traits:
    """The capabilities of a vehicle type.

    Attributes:
        name: for sentences: "copter", "rover".
        flies: whether it leaves the ground.
        hovers: whether it can stand still away from the ground, or on it. A plane cannot.
        control_before_takeoff: whether it must be in the mode in which it follows setpoints
            before it takes off (ArduCopter), or must not (PX4).
        lands_itself: whether it can be told to land where it is.
        circle_radius_m: radius of the circle that it flies instead of standing still.
        turning_radius_m: least radius of a turn on the ground; 0 if it can turn on the spot.
        turn_rate_rad_s: fastest turn on the ground, at any speed.
        arrival_radius_m: how near to a point it can be expected to stop at all.
        speed_max_m_s: how fast its autopilot drives at most.
        acceleration_m_s2: how fast its autopilot speeds up at most.
        braking_m_s2: how hard it is meant to brake on the ground.
        brake_lag_s: by which time its speed is late then.
        height_min_m: least height above the ground that it is sent to.
        takeoff_height_m: height above the ground of a take-off when none is asked for.
        setpoint_timeout_s: for how long it goes on with the velocity and the acceleration of the
            last setpoint when none follows; 0 if it does not.
        accelerates_on: whether it gathers speed by the last setpoint's acceleration in that time.
    """

    name: str = "copter"
    flies: bool = True
    hovers: bool = True
    control_before_takeoff: bool = True
    lands_itself: bool = True
    circle_radius_m: float = 0.0
    turning_radius_m: float = 0.0
    turn_rate_rad_s: float = 1.0
    arrival_radius_m: float = 0.0
    speed_max_m_s: float = math.inf
    acceleration_m_s2: float = math.inf
    braking_m_s2: float = 0.6
    brake_lag_s: float = 0.3
    height_min_m: float = 0.0
    takeoff_height_m: float = 0.0
    setpoint_timeout_s: float = 0.0
    accelerates_on: bool = False


COPTER = Traits()


class OperationStatus(Enum):
    """The state of an operation. All but PENDING are final."""

    PENDING = "PENDING"
    ACHIEVED = "ACHIEVED"
    REFUSED = "REFUSED"
    TIMED_OUT = "TIMED_OUT"
    CANCELLED = "CANCELLED"
    LINK_LOST = "LINK_LOST"


@dataclass(frozen=True)
class OperationReport:
    """The state of the operation that the task requested last.

    Attributes:
        kind: which operation.
        state: how it stands. ACHIEVED means that the vehicle's own state shows it.
        reason: what the vehicle gave as its reason; empty if it gave none.
    """

    kind: OperationKind
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
        obstacles_age_s: time since the sensor that tells about them was last heard; 0 when none
            is expected to be heard.
        obstacles_reach_m: how far the sensor sees that tells about them; infinite without one.
        moving: those of them that move.
        late_s: by how much setpoints were late of late, at worst.
        position_doubt: why the position is not to be relied on, though it is given; empty while it
            is. The velocity is still good enough to stand still by.
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
    obstacles_age_s: float = 0.0
    obstacles_reach_m: float = math.inf
    moving: tuple[Moving, ...] = ()
    late_s: float = 0.0
    position_doubt: str = ""


@dataclass(frozen=True)
class Setpoint:
    """The setpoint for the present moment.

    Attributes:
        position_enu_m: position in the map frame.
        velocity_enu_m_s: velocity feed-forward.
        acceleration_enu_m_s2: acceleration feed-forward.
        yaw_enu_rad: yaw.
    """

    position_enu_m: Vector3
    velocity_enu_m_s: Vector3
    acceleration_enu_m_s2: Vector3
    yaw_enu_rad: float


class Handover(NamedTuple):
    """The setpoint that a replaced task sent last, from which its successor goes on.

    Attributes:
        commanded: its state in the map frame; None to begin at the measured state.
        yaw_enu_rad: its yaw.
        time_s: when it was sent; None for the time of the start.
    """

    commanded: KinematicState | None = None
    yaw_enu_rad: float | None = None
    time_s: float | None = None


NOTHING_SENT = Handover()


@dataclass(frozen=True)
class Wait:
    """Send nothing that moves the vehicle."""


@dataclass(frozen=True)
class Perform:
    """Have an operation done.

    Returned at every step until the report says that the operation has finished; it is to
    be started once.

    Attributes:
        kind: which operation.
        height_m: for TAKE_OFF, the height above the ground to climb to.
        target_enu_m: for REPOSITION, where to go.
        speed_m_s: for CHANGE_SPEED.
        mission: for UPLOAD_MISSION, what is to be flown.
    """

    kind: OperationKind
    height_m: float | None = None
    target_enu_m: Vector3 | None = None
    speed_m_s: float | None = None
    mission: MissionPlan | None = None


@dataclass(frozen=True)
class Fly:
    """Send this setpoint now. A pending operation is to be given up for it.

    Attributes:
        setpoint: what to send.
        by_velocity: only its velocity and yaw are to be followed: an estimate that jumps would
            make the vehicle fly the jump back.
    """

    setpoint: Setpoint
    by_velocity: bool = False


Intent = Wait | Perform | Fly


@dataclass(frozen=True)
class Outcome:
    """The one end of a task.

    Attributes:
        code: stable reason.
        message: one sentence for display.
        final_error_m: measured distance to the target, or None if it was not measured.
    """

    code: OutcomeCode
    message: str
    final_error_m: float | None


@dataclass(frozen=True)
class RouteProgress:
    """Progress along a route.

    Attributes:
        current: the waypoint that the vehicle is on its way to, from 0.
        lap: the lap, from 0.
        remaining: waypoints that are left, the current one and all laps included.
        reached: waypoints that were reached, all laps counted.
        missed: those that were passed outside their radius, from 0 over all laps.
    """

    current: int
    lap: int
    remaining: int
    reached: int
    missed: tuple[int, ...] = ()


@dataclass(frozen=True)
class Progress:
    """Progress of a task. Both numbers are always finite and not negative.

    Attributes:
        status: what is happening.
        distance_remaining_m: length of the path that is left.
        time_remaining_s: estimated time to the end.
        route: how far the route is flown, for a task that has one.
        replans: how often the path was replanned because of obstacles.
        blocked: why obstacles leave no way to go on; empty while they do.
    """

    status: Status
    distance_remaining_m: float
    time_remaining_s: float
    route: RouteProgress | None = None
    replans: int = 0
    blocked: str = ""


class Requirement(Flag):
    """A precondition of starting a task."""

    NONE = 0
    CONNECTION = auto()
    POSITION = auto()
    VELOCITY = auto()
    YAW = auto()


class Task(Protocol):
    """Something that flies the vehicle towards an aim."""

    @property
    def requires(self) -> Requirement:
        """The preconditions of :meth:`start`."""

    @property
    def commanded(self) -> KinematicState | None:
        """State of the setpoint sent last, for a successor; None before the first."""

    @property
    def commanded_yaw_enu_rad(self) -> float | None:
        """Yaw of the setpoint sent last; None before the first."""

    @property
    def path_enu_m(self) -> tuple[Vector3, ...]:
        """The path that is planned, in the map frame; the same object until it is replanned."""

    def start(self, observation: Observation, now: float) -> None:
        """Begin."""

    def step(self, observation: Observation, now: float) -> Intent | Outcome:
        """Return what to do now, or how it ended."""

    def think(self, observation: Observation, now: float) -> None:
        """Do what takes long, once the setpoint of the step before is out; steps show what came."""

    def cancel(self, now: float) -> None:
        """Ask for an early end; the steps that follow bring the vehicle to a stop."""

    def pause(self, now: float) -> Rejection | None:
        """Stop and hold until :meth:`unpause`; says why if this cannot be paused."""

    def unpause(self, now: float) -> None:
        """Resume after a pause."""

    def take_up(self, now: float) -> None:
        """Resume with a vehicle that another station had stopped in another mode.

        Called before the next step; where the task was, and what it commanded, is past.
        """

    def accepts_mode(self, mode: VehicleMode) -> bool:
        """Whether the vehicle may get into this mode by itself at this point of the task.

        Any other change of mode that nobody here asked for is somebody taking over.
        """

    def resume(self, observation: Observation, now: float) -> None:
        """Resume after a time without steps."""

    def progress(self, observation: Observation, now: float) -> Progress:
        """Return the progress."""


def check_requirements(
    requires: Requirement, observation: Observation, position_timeout_s: float
) -> Rejection | None:
    """Return what a task lacks.

    Args:
        requires: what the task needs.
        observation: what is known now.
        position_timeout_s: age from which a position is no position.

    Returns:
        The first thing that is missing, or None.
    """
    if Requirement.CONNECTION in requires and not observation.connected:
        return Rejection(OutcomeCode.NO_VEHICLE, "No vehicle is detected on the link.")
    lacking = []
    if Requirement.POSITION in requires and not _known(observation.position_enu_m):
        lacking.append("position")
    if Requirement.VELOCITY in requires and not _known(observation.velocity_enu_m_s):
        lacking.append("velocity")
    if Requirement.YAW in requires and not _known(observation.yaw_enu_rad):
        lacking.append("yaw")
    if lacking:
        return Rejection(
            OutcomeCode.NO_POSITION, f"The vehicle reports no valid {' and no '.join(lacking)} yet."
        )
    if Requirement.POSITION in requires and not observation.position_age_s <= position_timeout_s:
        return Rejection(
            OutcomeCode.NO_POSITION,
            f"The last position is {observation.position_age_s:.1f} s old; at most "
            f"{position_timeout_s:g} s is allowed.",
        )
    return None


def _known(value: Vector3 | float | None) -> bool:
    if value is None:
        return False
    return is_finite(value) if isinstance(value, tuple) else is_finite((value, 0.0, 0.0))
