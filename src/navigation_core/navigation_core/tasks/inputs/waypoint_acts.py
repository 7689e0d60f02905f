"""Acts at a waypoint: photos, the gimbal, the gripper, a servo output, a wait."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

from navigation_core.geometry import Vector3

__all__ = [
    "ActOrder",
    "ActReport",
    "PointAngle",
    "PointNeutral",
    "PointPosition",
    "SetServo",
    "TakePhoto",
    "TriggerDistance",
    "UseGripper",
    "VehicleAct",
    "WaitHere",
    "WaypointAct",
]


@dataclass(frozen=True)
class TakePhoto:
    """Take one photo."""

    name = "PHOTO"


@dataclass(frozen=True)
class TriggerDistance:
    """Take a photo each time that a distance was flown; 0 ends that."""

    distance_m: float
    name = "TRIGGER_DISTANCE"


@dataclass(frozen=True)
class PointAngle:
    """Point the gimbal.

    Attributes:
        pitch_rad: angle above the horizon.
        yaw_rad: counter-clockwise, from the nose, or from east of the map.
        yaw_locked: whether it is from east, and kept while the vehicle turns.
    """

    pitch_rad: float
    yaw_rad: float
    yaw_locked: bool = False
    name = "POINT"


@dataclass(frozen=True)
class PointPosition:
    """Point the gimbal at a position in the map frame until it is pointed otherwise."""

    position_enu_m: Vector3
    name = "POINT"


@dataclass(frozen=True)
class PointNeutral:
    """Return the gimbal to its own default."""

    name = "POINT"


@dataclass(frozen=True)
class UseGripper:
    """Close the gripper, or open it."""

    grabs: bool
    name = "GRIPPER"


@dataclass(frozen=True)
class SetServo:
    """Set a servo output, counted from 1, to a pulse width in microseconds."""

    channel: int
    pulse_us: int
    name = "SERVO"


@dataclass(frozen=True)
class WaitHere:
    """Hold for a time."""

    time_s: float
    name = "WAIT"


VehicleAct: TypeAlias = (
    TakePhoto | TriggerDistance | PointAngle | PointPosition | PointNeutral | UseGripper | SetServo
)
"""An act that the vehicle is asked for."""


@dataclass(frozen=True)
class WaypointAct:
    """One act at a waypoint.

    Attributes:
        act: what is done.
        required: whether the goal ends if the vehicle does not do it.
    """

    act: VehicleAct | WaitHere
    required: bool = False


@dataclass(frozen=True)
class ActOrder:
    """An act that a task asks the vehicle for.

    Attributes:
        number: counts the orders of a task from 1.
        act: what is to be done.
    """

    number: int
    act: VehicleAct


@dataclass(frozen=True)
class ActReport:
    """The end of an act that a task has asked for.

    Attributes:
        number: that of the order.
        failure: why it was not done, as a sentence without its subject; empty if it was.
    """

    number: int
    failure: str = ""
