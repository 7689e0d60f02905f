"""The interface of the features of a bridge: what it answers beside goals. No ROS."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol, TypeVar

from mavlink_vehicle.events import VehicleEvent
from mavlink_vehicle.vehicle import Vehicle
from navigation_bridge.configuration.settings import BridgeConfig
from navigation_bridge.goals.active_goal import ActiveGoal
from navigation_bridge.goals.requests import Request
from navigation_bridge.reporting import Reporter
from navigation_bridge.vehicle.map_frame import MapFrame
from navigation_core.outcomes import OutcomeCode, Rejection
from navigation_core.tasks.velocity_command import VelocityCommand

__all__ = ["Feature", "FeatureParts", "Features"]


class Goals(Protocol):
    """The goals of a bridge."""

    @property
    def active(self) -> ActiveGoal | None:
        """The active goal."""

    def check(self, request: Request, now: float) -> Rejection | None:
        """Return whether a goal would be accepted now; a rejection is also logged."""

    def start(self, goal_id: str, request: Request, now: float) -> None:
        """Begin an accepted goal; it replaces the active one."""


@dataclass(frozen=True)
class FeatureParts:
    """The parts of a bridge that features work with.

    Attributes:
        vehicle: the vehicle.
        map_frame: its map frame.
        report: takes log lines.
        goals: returns what begins goals.
        config: returns the settings for goals.
        refusal: returns why nothing is accepted: there is no vehicle to execute it; or None.
        occupied: returns why the vehicle is left alone: the same, or an active goal; or None.
    """

    vehicle: Vehicle
    map_frame: MapFrame
    report: Reporter
    goals: Callable[[], Goals]
    config: Callable[[], BridgeConfig]
    refusal: Callable[[], Rejection | None]
    occupied: Callable[[], Rejection | None]

    @property
    def unreached(self) -> str:
        """Why nothing reaches the vehicle, a sentence; empty while it is reached."""
        refusal = self.refusal()
        if refusal is not None:
            return refusal.message
        return "" if self.vehicle.heartbeats.alive else "There is no connection to a vehicle."


class Feature:
    """One feature; what it does not care about it leaves as it is here."""

    def __init__(self, parts: FeatureParts) -> None:
        """Prepare."""
        self.parts = parts

    def take(self, event: VehicleEvent) -> bool:
        """Process an event of the vehicle; return whether it was about this feature."""
        return False

    def give_way(self, reason: str) -> None:
        """End what must not continue: the vehicle is about to be flown."""

    def goal_began(self) -> None:
        """Process the start of any goal: its client has given the vehicle to the server."""

    def goal_ended(self, goal: ActiveGoal, code: OutcomeCode) -> None:
        """Process the end of a goal."""

    def give_vehicle_away(self) -> None:
        """Process an act of a ground station that flies the vehicle itself."""

    def lose_vehicle(self) -> None:
        """Process a mode change that the server did not ask for, or a restart."""

    def shut_down(self) -> None:
        """Start no goal any more: the server stops."""

    @property
    def command(self) -> VelocityCommand | None:
        """The last velocity command, for a goal that follows commands."""
        return None

    @property
    def is_writing(self) -> bool:
        """Whether the autopilot would keep half of something if the server ended now."""
        return False

    def objection(self, now: float) -> Rejection | None:
        """Return why no goal with setpoints may begin, or None."""
        return None


FeatureT = TypeVar("FeatureT", bound=Feature)


class Features(Feature):
    """The features of one bridge, as one."""

    def __init__(self, kinds: Sequence[type[Feature]], parts: FeatureParts) -> None:
        """Make one of each kind."""
        super().__init__(parts)
        self._features = [kind(parts) for kind in kinds]

    def of(self, kind: type[FeatureT]) -> FeatureT:
        """Return the feature of a kind.

        Raises:
            LookupError: the bridge was made without it.
        """
        for feature in self._features:
            if isinstance(feature, kind):
                return feature
        raise LookupError(f"This bridge has no {kind.__name__}.")

    def take(self, event: VehicleEvent) -> bool:
        """Let the first one that it is about process an event."""
        return any(feature.take(event) for feature in self._features)

    def give_way(self, reason: str) -> None:
        """Let all of them give way."""
        for feature in self._features:
            feature.give_way(reason)

    def goal_began(self) -> None:
        """Let all of them process a start."""
        for feature in self._features:
            feature.goal_began()

    def goal_ended(self, goal: ActiveGoal, code: OutcomeCode) -> None:
        """Let all of them process an end."""
        for feature in self._features:
            feature.goal_ended(goal, code)

    def give_vehicle_away(self) -> None:
        """Let all of them give the vehicle away."""
        for feature in self._features:
            feature.give_vehicle_away()

    def lose_vehicle(self) -> None:
        """Let all of them lose the vehicle."""
        for feature in self._features:
            feature.lose_vehicle()

    def shut_down(self) -> None:
        """Shut all of them down."""
        for feature in self._features:
            feature.shut_down()

    @property
    def command(self) -> VelocityCommand | None:
        """The command of the one that has one."""
        commands = (feature.command for feature in self._features)
        return next((command for command in commands if command is not None), None)

    @property
    def is_writing(self) -> bool:
        """Whether any of them is writing."""
        return any(feature.is_writing for feature in self._features)

    def objection(self, now: float) -> Rejection | None:
        """Return the first objection."""
        found = (feature.objection(now) for feature in self._features)
        return next((objection for objection in found if objection is not None), None)
