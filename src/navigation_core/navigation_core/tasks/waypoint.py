"""The waypoints of a route, and of a route that the vehicle flies by itself."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from navigation_core.geometry import Vector3
from navigation_core.tasks.inputs.waypoint_acts import WaitHere, WaypointAct
from navigation_core.tasks.progress import RouteProgress


class RouteError(ValueError):
    """A route cannot be flown; the sentence says why."""


@dataclass(frozen=True)
class RouteWaypoint:
    """One waypoint of a route.

    Attributes:
        position_enu_m: where, in the map frame.
        acceptance_radius_m: reached when this near.
        hold_time_s: how long to stay; 0 flies through.
        yaw_enu_rad: yaw on the way to it and at it; None for the direction of travel.
        max_speed_m_s: maximum ground speed on the way to it; None for the configured one.
        height_above_ground_m: height above the terrain, where a vehicle that knows it is to
            follow it; the position's z is then a guess. None elsewhere.
        acts: what is done once it is reached, after the hold time, in their order.
    """

    position_enu_m: Vector3
    acceptance_radius_m: float
    hold_time_s: float = 0.0
    yaw_enu_rad: float | None = None
    max_speed_m_s: float | None = None
    height_above_ground_m: float | None = None
    acts: tuple[WaypointAct, ...] = ()

    @property
    def stay_s(self) -> float:
        """How long the vehicle stays there: its hold time, and what its acts wait."""
        return self.hold_time_s + sum(
            each.act.time_s for each in self.acts if isinstance(each.act, WaitHere)
        )


@dataclass(frozen=True)
class Route:
    """Waypoints and how often they are flown; indices count from 0 at the first that is flown.

    Attributes:
        waypoints: those of one lap, at least one; they are expected to have passed
            ``safety.check_target``.
        laps: at least one.
        first: where an interrupted route continues, counted from 0 over all laps.
        route_id: a number that other waypoints or laps would not have.
    """

    waypoints: tuple[RouteWaypoint, ...]
    laps: int = 1
    first: int = 0
    route_id: int = 0

    def __post_init__(self) -> None:
        """Check the numbers.

        Raises:
            RouteError: there is no waypoint or no lap, or it begins outside.
        """
        if not self.waypoints or self.laps < 1:
            raise RouteError("A route needs at least one waypoint and one lap.")
        if not 0 <= self.first < len(self.waypoints) * self.laps:
            raise RouteError(f"Waypoint {self.first} to begin with is outside the route.")

    @property
    def total(self) -> int:
        """Waypoints that are flown to, all laps counted."""
        return len(self.waypoints) * self.laps - self.first

    @property
    def flown(self) -> tuple[RouteWaypoint, ...]:
        """The waypoints that are flown to, of all laps."""
        return (self.waypoints * self.laps)[self.first :]

    def at(self, index: int) -> RouteWaypoint:
        """Return a waypoint; the last for any index beyond it."""
        return self.waypoints[(self.first + min(index, self.total - 1)) % len(self.waypoints)]

    def numbers(self, indices: Iterable[int]) -> str:
        """Return waypoints as people count them, from 1 over all laps."""
        return ", ".join(str(self.first + index + 1) for index in indices)

    def progress(self, index: int, reached: int, missed: tuple[int, ...] = ()) -> RouteProgress:
        """Return the progress of a vehicle on its way to a waypoint; ``total`` is after the end."""
        lap, current = divmod(self.first + min(index, self.total - 1), len(self.waypoints))
        return RouteProgress(
            current=current,
            lap=lap,
            remaining=self.total - index,
            reached=reached,
            missed=tuple(self.first + each for each in missed),
            next_index=self.first + index,
            route_id=self.route_id,
        )


@dataclass(frozen=True)
class MissionPlan:
    """The plan that the vehicle flies by itself.

    Attributes:
        waypoints: in order; those of all laps.
        takeoff_from_enu_m: where it stands, if it is to take off first.
        takeoff_height_m: above the ground, then.
        speed_m_s: ground speed where a waypoint has none; None leaves it to the vehicle.
        circle_at_end: whether it cannot stand still, and circles the last waypoint instead.
    """

    waypoints: tuple[RouteWaypoint, ...]
    takeoff_from_enu_m: Vector3 | None = None
    takeoff_height_m: float = 0.0
    speed_m_s: float | None = None
    circle_at_end: bool = False
