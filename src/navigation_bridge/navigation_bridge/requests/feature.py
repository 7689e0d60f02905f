"""The interface of the features of a bridge: what it answers beside goals. No ROS."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import ClassVar, Protocol, TypeVar

from mavlink_vehicle.codec import Message
from mavlink_vehicle.events import VehicleEvent
from mavlink_vehicle.vehicle import Vehicle
from navigation_bridge.configuration.settings import BridgeConfig
from navigation_bridge.goals.active_goal import ActiveGoal
from navigation_bridge.goals.admitted import Admitted
from navigation_bridge.goals.requests import Request
from navigation_bridge.reporting import Reporter
from navigation_bridge.snapshot import Snapshot
from navigation_bridge.vehicle.map_frame import MapFrame
from navigation_core.outcomes import OutcomeCode, Rejection
from navigation_core.searches import Searcher
from navigation_core.tasks.inputs.tracked_target import TrackedTarget
from navigation_core.tasks.inputs.velocity_command import VelocityCommand
from navigation_core.tasks.intents import Fly, Outcome, Perform
from navigation_core.tasks.observation import OtherVehicles
from navigation_core.tasks.progress import Progress
from navigation_core.trajectories.timed_trajectory import TimedTrajectory

__all__ = ["Delay", "Feature", "FeatureParts", "Features", "Redirection"]


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
        look: returns what is known at a time, between two turns.
        searcher: runs searches beside the turns.
        name: of the vehicle among those of the server.
        in_turns: features that have to do with the turns of goals, which they add themselves.
    """

    vehicle: Vehicle
    map_frame: MapFrame
    report: Reporter
    goals: Callable[[], Goals]
    config: Callable[[], BridgeConfig]
    refusal: Callable[[], Rejection | None]
    occupied: Callable[[], Rejection | None]
    look: Callable[[float], Snapshot]
    searcher: Searcher
    name: str
    in_turns: list[Feature] = field(default_factory=list)

    @property
    def unreached(self) -> str:
        """Why nothing reaches the vehicle, a sentence; empty while it is reached."""
        refusal = self.refusal()
        if refusal is not None:
            return refusal.message
        return "" if self.vehicle.heartbeats.alive else "There is no connection to a vehicle."


@dataclass(frozen=True)
class Delay:
    """Why an operation is not requested now.

    Attributes:
        outcome: the end of the goal once the delay has lasted too long, or None until then.
    """

    outcome: Outcome | None = None


@dataclass(frozen=True)
class Redirection:
    """Another request in place of one that was admitted.

    Attributes:
        request: the other request.
        note: warning of a goal that is redirected.
        otherwise: the goal if the other request is rejected.
    """

    request: Request
    note: str
    otherwise: Admitted


class Feature:
    """One feature; what it does not care about it leaves as it is here.

    Attributes:
        hears: types of the messages for :meth:`hear`.
        overhears: those of them that ground stations may send, too, from links of their own.
    """

    hears: ClassVar[frozenset[str]] = frozenset()
    overhears: ClassVar[frozenset[str]] = frozenset()

    def __init__(self, parts: FeatureParts) -> None:
        """Prepare."""
        self.parts = parts

    def configure(self, config: BridgeConfig) -> None:
        """Apply other settings."""

    def hear(self, message: Message, now: float) -> None:
        """Process a message of the vehicle of one of the types in `hears`."""

    def messages_to_send(self) -> list[Message]:
        """Return and clear the messages to the vehicle."""
        return []

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
    def followed(self) -> TrackedTarget | None:
        """The target of a goal that follows one."""
        return None

    @property
    def trajectory(self) -> TimedTrajectory | None:
        """The last trajectory of a client, for a goal that flies them."""
        return None

    @property
    def is_writing(self) -> bool:
        """Whether the autopilot would keep half of something if the server ended now."""
        return False

    def objection(self, now: float) -> Rejection | None:
        """Return why no goal with setpoints may begin, or None."""
        return None

    # --- of a goal --------------------------------------------------------------------------

    @property
    def traffic(self) -> OtherVehicles | None:
        """The other vehicles, for tasks; None where nobody keeps apart from them."""
        return None

    def consider(
        self, admitted: Admitted, request: Request, snapshot: Snapshot
    ) -> Admitted | Redirection | Rejection:
        """Return an admitted goal, perhaps with another warning, or what happens instead."""
        return admitted

    def is_due(self, now: float) -> bool:
        """Whether `update` has something to do."""
        return False

    def update(self, goal: ActiveGoal | None, snapshot: Snapshot) -> None:
        """Do what is due, with or without a goal."""

    def delay(self, goal: ActiveGoal, intent: Perform, snapshot: Snapshot) -> Delay | None:
        """Return why a new operation has to wait, or None."""
        return None

    def limited(self, goal: ActiveGoal, intent: Fly, snapshot: Snapshot) -> Fly:
        """Return a setpoint, perhaps a slower one."""
        return intent

    def progress(self, progress: Progress) -> Progress:
        """Return the progress of a task with what this feature adds."""
        return progress


FeatureT = TypeVar("FeatureT", bound=Feature)


class Features(Feature):
    """The features of one bridge, as one.

    Attributes:
        in_turns: those that have to do with the turns of goals now. Without any, a turn need not
            ask for messages, traffic, what is due, delays, limits or progress.
    """

    def __init__(self, kinds: Sequence[type[Feature]], parts: FeatureParts) -> None:
        """Make one of each kind."""
        super().__init__(parts)
        self._features = [kind(parts) for kind in kinds]
        self._hearing = {name: one for one in self._features for name in one.hears}
        self.in_turns = parts.in_turns

    def of(self, kind: type[FeatureT]) -> FeatureT:
        """Return the feature of a kind.

        Raises:
            LookupError: the bridge was made without it.
        """
        for feature in self._features:
            if isinstance(feature, kind):
                return feature
        raise LookupError(f"This bridge has no {kind.__name__}.")

    def configure(self, config: BridgeConfig) -> None:
        """Let all of them apply other settings."""
        for feature in self._features:
            feature.configure(config)

    def hear(self, message: Message, now: float) -> None:
        """Let the one that hears messages of its type process it."""
        feature = self._hearing.get(message.get_type())
        if feature is not None:
            feature.hear(message, now)

    def overhear(self, message: Message, now: float) -> None:
        """Let the one that takes such a message from ground stations process it."""
        kind = message.get_type()
        feature = self._hearing.get(kind)
        if feature is not None and kind in feature.overhears:
            feature.hear(message, now)

    def messages_to_send(self) -> list[Message]:
        """Return and clear the messages of all."""
        return [message for one in self.in_turns for message in one.messages_to_send()]

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
    def followed(self) -> TrackedTarget | None:
        """The target of the one that has one."""
        targets = (feature.followed for feature in self._features)
        return next((target for target in targets if target is not None), None)

    @property
    def trajectory(self) -> TimedTrajectory | None:
        """The trajectory of the one that has one."""
        found = (feature.trajectory for feature in self._features)
        return next((trajectory for trajectory in found if trajectory is not None), None)

    @property
    def is_writing(self) -> bool:
        """Whether any of them is writing."""
        return any(feature.is_writing for feature in self._features)

    def objection(self, now: float) -> Rejection | None:
        """Return the first objection."""
        found = (feature.objection(now) for feature in self._features)
        return next((objection for objection in found if objection is not None), None)

    # --- of a goal --------------------------------------------------------------------------

    @property
    def traffic(self) -> OtherVehicles | None:
        """The other vehicles, of the feature that knows of any."""
        for feature in self.in_turns:
            found = feature.traffic
            if found is not None:
                return found
        return None

    def consider(
        self, admitted: Admitted, request: Request, snapshot: Snapshot
    ) -> Admitted | Redirection | Rejection:
        """Let all of them consider a goal; the first that redirects or rejects it decides."""
        considered: Admitted | Redirection | Rejection = admitted
        for feature in self._features:
            considered = feature.consider(admitted, request, snapshot)
            if not isinstance(considered, Admitted):
                return considered
            admitted = considered
        return considered

    def is_due(self, now: float) -> bool:
        """Whether any has something to do."""
        return any(feature.is_due(now) for feature in self.in_turns)

    def update(self, goal: ActiveGoal | None, snapshot: Snapshot) -> None:
        """Let those that are due do it."""
        for feature in self.in_turns:
            if feature.is_due(snapshot.time_s):
                feature.update(goal, snapshot)

    def delay(self, goal: ActiveGoal, intent: Perform, snapshot: Snapshot) -> Delay | None:
        """Return the first delay."""
        found = (feature.delay(goal, intent, snapshot) for feature in self.in_turns)
        return next((delay for delay in found if delay is not None), None)

    def limited(self, goal: ActiveGoal, intent: Fly, snapshot: Snapshot) -> Fly:
        """Return a setpoint that is as slow as any of them demands."""
        for feature in self.in_turns:
            intent = feature.limited(goal, intent, snapshot)
        return intent

    def progress(self, progress: Progress) -> Progress:
        """Return the progress with what all of them add."""
        for feature in self.in_turns:
            progress = feature.progress(progress)
        return progress
