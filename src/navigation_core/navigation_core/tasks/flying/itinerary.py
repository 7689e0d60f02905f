"""The itinerary of a flight: sections that each end in a stop."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from navigation_core.geometry import Vector3
from navigation_core.outcomes import OutcomeCode
from navigation_core.tasks.goto_config import GotoGoal
from navigation_core.tasks.intents import Outcome
from navigation_core.tasks.progress import Progress
from navigation_core.trajectories.route_trajectory import RoutePoint


@dataclass(frozen=True)
class Section:
    """The part of a flight up to its next stop.

    Attributes:
        goal: the stop.
        points: the points on the way, the stop as the last; empty for the straight path.
        yaws_enu_rad: for each point the yaw on the way to it, None for the direction of travel.
        radius_m: how near to the stop is near enough; None for the configured radius.
        hold_time_s: how long to stay there.
    """

    goal: GotoGoal
    points: tuple[RoutePoint, ...] = ()
    yaws_enu_rad: tuple[float | None, ...] = ()
    radius_m: float | None = None
    hold_time_s: float = 0.0


class Itinerary(Protocol):
    """The sections of a flight, and how far they are flown."""

    def begin_section(self) -> Section:
        """Return what is to be flown from now on, up to the next stop."""

    def note_place(self, position_enu_m: Vector3 | None, passed: int, leaves: bool) -> bool:
        """Record where the vehicle is, and return whether to replan from there.

        Args:
            position_enu_m: its position in the map frame.
            passed: the points of the section that the setpoint has passed.
            leaves: whether it drives away from its path, to come back to it.
        """

    def point_to_meet(self) -> int | None:
        """Return the point of the section beyond which a vehicle that drives must not look yet."""

    def arrive(self, error_m: float) -> Outcome | None:
        """Record the stop as reached; returns how the flight ends, or None if it continues.

        Args:
            error_m: how far from the stop the vehicle is.
        """

    def total(
        self, progress: Progress, position_enu_m: Vector3 | None, is_straight: bool
    ) -> Progress:
        """Return the progress of the whole flight.

        Args:
            progress: that of the section.
            position_enu_m: where the vehicle is, in the map frame.
            is_straight: whether the section was taken for a straight line to its stop.
        """


class SingleStop:
    """The itinerary of a flight to one point."""

    def __init__(self, goal: GotoGoal) -> None:
        """Go there."""
        self._section = Section(goal)

    def begin_section(self) -> Section:
        """Return the only section."""
        return self._section

    def note_place(self, position_enu_m: Vector3 | None, passed: int, leaves: bool) -> bool:
        """Nothing is to be met on the way."""
        return False

    def point_to_meet(self) -> int | None:
        """Nothing is to be met on the way."""
        return None

    def arrive(self, error_m: float) -> Outcome | None:
        """End with success."""
        return Outcome(OutcomeCode.SUCCESS, f"Arrived, {error_m:.2f} m from the target.", error_m)

    def total(
        self, progress: Progress, position_enu_m: Vector3 | None, is_straight: bool
    ) -> Progress:
        """Return that of the section."""
        return progress
