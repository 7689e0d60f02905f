"""The progress of a task, for feedback."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from enum import Enum

from navigation_core.geometry import Vector3


class Status(str, Enum):
    """The status of a goal in its feedback."""

    PREPARING = "PREPARING"
    ARMING = "ARMING"
    TAKING_OFF = "TAKING_OFF"
    NAVIGATING = "NAVIGATING"
    TURNING = "TURNING"
    CLIMBING = "CLIMBING"
    DESCENDING = "DESCENDING"
    SETTLING = "SETTLING"
    HOLDING = "HOLDING"
    PAUSED = "PAUSED"
    BLOCKED = "BLOCKED"
    WAITING_FOR_TRAFFIC = "WAITING_FOR_TRAFFIC"
    UPLOADING = "UPLOADING"
    RETURNING = "RETURNING"
    LANDING = "LANDING"
    CANCELLING = "CANCELLING"
    LINK_LOST = "LINK_LOST"


@dataclass(frozen=True)
class RouteProgress:
    """Progress along a route.

    Attributes:
        current: the waypoint that the vehicle is on its way to, from 0.
        lap: the lap, from 0.
        remaining: waypoints that are left, the current one and all laps included.
        reached: waypoints that were reached, all laps counted.
        missed: those that were passed outside their radius, from 0 over all laps.
        next_index: the first waypoint that is left, from 0 over all laps; one beyond the last at
            the end.
        route_id: number of the route, see `Route`.
    """

    current: int
    lap: int
    remaining: int
    reached: int
    missed: tuple[int, ...] = ()
    # For the result alone, not for feedback.
    next_index: int = field(default=0, compare=False)
    route_id: int = field(default=0, compare=False)


@dataclass(frozen=True)
class OrbitProgress:
    """Progress on a circle.

    Attributes:
        laps_flown: laps that are flown, or driven.
        radius_error_m: distance to the centre minus the radius; NaN while the circle is not flown.
    """

    laps_flown: float
    radius_error_m: float


class FollowState(str, Enum):
    """How a target is followed."""

    ACQUIRING = "ACQUIRING"
    """It has not been measured yet."""
    FOLLOWING = "FOLLOWING"
    LOST = "LOST"
    """It was not measured for too long; the vehicle holds."""


@dataclass(frozen=True)
class FollowProgress:
    """Progress of following a target.

    Attributes:
        state: whether it is known where the target is.
        distance_m: distance to the target, over ground for what drives; NaN before it is known.
        age_s: time since the target was measured; infinite before that.
        position_enu_m: where the target is expected, in the map; None before it is known.
    """

    state: FollowState
    distance_m: float
    age_s: float
    position_enu_m: Vector3 | None = None


@dataclass(frozen=True)
class TrajectoryProgress:
    """Progress along a trajectory of another program.

    Attributes:
        error_m: distance between the vehicle and where the trajectory is now; NaN without one.
        time_scale: share of the planned speed at which it is flown.
        limited_by: why it is or was last flown slower; empty if it never was.
        replacements: number of trajectories that have replaced the first.
    """

    error_m: float = math.nan
    time_scale: float = 1.0
    limited_by: str = ""
    replacements: int = 0


@dataclass(frozen=True)
class Progress:
    """Progress of a task. Both numbers are always finite and not negative.

    Attributes:
        status: what is happening.
        distance_remaining_m: length of the path that is left.
        time_remaining_s: estimated time to the end.
        route: how far the route is flown, for a task that has one.
        replans: how often the path was replanned because of obstacles.
        blocked: why obstacles leave no path, or for whom it waits; empty otherwise.
        orbit: how far the circle is flown, for a task that has one.
        follow: how the target is followed, for a task that has one.
        trajectory: how a trajectory is flown, for a task that has one.
    """

    status: Status
    distance_remaining_m: float
    time_remaining_s: float
    route: RouteProgress | None = None
    replans: int = 0
    blocked: str = ""
    orbit: OrbitProgress | None = None
    follow: FollowProgress | None = None
    trajectory: TrajectoryProgress | None = None
