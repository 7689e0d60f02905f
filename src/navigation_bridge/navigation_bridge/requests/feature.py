"""The interface of the features of a bridge: what it answers beside goals. No ROS."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeVar

from mavlink_vehicle.events import VehicleEvent
from mavlink_vehicle.vehicle import Vehicle
from navigation_bridge.reporting import Reporter
from navigation_bridge.vehicle.map_frame import MapFrame
from navigation_core.outcomes import Rejection

__all__ = ["Feature", "FeatureParts", "Features"]


@dataclass(frozen=True)
class FeatureParts:
    """The parts of a bridge that features work with.

    Attributes:
        vehicle: the vehicle.
        map_frame: its map frame.
        report: takes log lines.
        refusal: returns why nothing is accepted: there is no vehicle to execute it; or None.
        occupied: returns why the vehicle is left alone: the same, or an active goal; or None.
    """

    vehicle: Vehicle
    map_frame: MapFrame
    report: Reporter
    refusal: Callable[[], Rejection | None]
    occupied: Callable[[], Rejection | None]

    @property
    def unreached(self) -> str:
        """Why nothing reaches the vehicle, a sentence; empty while it is reached."""
        refusal = self.refusal()
        if refusal is not None:
            return refusal.message
        return "" if self.vehicle.connected else "There is no connection to a vehicle."


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

    @property
    def is_writing(self) -> bool:
        """Whether any of them is writing."""
        return any(feature.is_writing for feature in self._features)

    def objection(self, now: float) -> Rejection | None:
        """Return the first objection."""
        found = (feature.objection(now) for feature in self._features)
        return next((objection for objection in found if objection is not None), None)
