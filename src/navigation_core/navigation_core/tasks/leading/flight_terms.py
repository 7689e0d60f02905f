"""Terms of a flight by setpoints: limits, frames, traits, and how obstacles are avoided."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass

from navigation_core.safety.speed_at_bounds import Bounds
from navigation_core.searches import AT_ONCE, Searcher
from navigation_core.tasks.goto_config import GotoConfig
from navigation_core.tasks.intents import NOTHING_SENT, Handover
from navigation_core.tasks.traits import COPTER, Traits

# Shares of the margin that are kept in flight, and at all. They are nested on purpose: what was
# planned with the whole margin is not in conflict at once because a sensor sees an edge a little
# elsewhere, and the brake is the last to act.
_CONFLICT_SHARE = 0.6
_BRAKE_SHARE = 0.2


class AvoidanceConfigError(ValueError):
    """A setting of how obstacles are avoided makes no sense."""


@dataclass(frozen=True)
class AvoidanceConfig:
    """Settings of obstacle avoidance.

    Attributes:
        vehicle_radius_m: half of the vehicle's greatest width.
        margin_m: kept to every obstacle beside that radius when a path is planned.
        blocked_timeout_s: longest time to wait for a path, or for the sensor.
        sensor_timeout_s: silence of the sensor after which the vehicle is stopped.
        heights_m: lowest and highest map z of a path; None for what drives.
        corner_allowance_m: room for cut corners that is asked for beyond the margin, where
            there is as much.
        reaction_s: time before a vehicle begins to brake, the age of a measurement included.
        retry_s: time between two searches for a path while there is none.
        elective_s: least time between two looks for a shorter path while the present one is sound.
        elective_gain: share by which a path must be shorter to be taken instead of a sound one.
        emergency_factor: how many times harder than a flight's own limits a vehicle may brake and
            give way when those limits would not do.
        give_way_reach_m: how far the vehicle goes out of the way of what comes near.
        search_timeout_s: longest time that a search for a path may take.
        searcher: who searches.
    """

    vehicle_radius_m: float = 0.5
    margin_m: float = 1.0
    blocked_timeout_s: float = 30.0
    sensor_timeout_s: float = 2.0
    heights_m: tuple[float, float] | None = None
    corner_allowance_m: float = 0.5
    reaction_s: float = 0.3
    retry_s: float = 0.5
    elective_s: float = 3.0
    elective_gain: float = 0.15
    emergency_factor: float = 2.0
    give_way_reach_m: float = 6.0
    search_timeout_s: float = 2.0
    searcher: Searcher = dataclasses.field(default=AT_ONCE, compare=False, repr=False)

    def __post_init__(self) -> None:
        """Reject settings that make no sense.

        Raises:
            AvoidanceConfigError: a number is NaN, infinite or not positive, or the heights are
                not in order.
        """
        for field in dataclasses.fields(self):
            value = getattr(self, field.name)
            if not isinstance(value, (int, float)):
                continue
            if not (math.isfinite(value) and value > 0.0):
                raise AvoidanceConfigError(
                    f"{field.name} is {value}; give a finite number above 0."
                )
        if self.heights_m is not None and not self.heights_m[0] < self.heights_m[1]:
            low, high = self.heights_m
            raise AvoidanceConfigError(
                f"heights_m is {low} m to {high} m; give the lowest height first."
            )

    @property
    def plan_clearance_m(self) -> float:
        """The clearance with which a path is planned."""
        return self.vehicle_radius_m + self.margin_m

    @property
    def flown_clearance_m(self) -> float:
        """The clearance a trajectory must keep to be flown, its first turn and corners included."""
        return self.vehicle_radius_m + 0.5 * (1.0 + _CONFLICT_SHARE) * self.margin_m

    @property
    def conflict_clearance_m(self) -> float:
        """Nearer than this, a path that is being flown is replanned."""
        return self.vehicle_radius_m + _CONFLICT_SHARE * self.margin_m

    @property
    def brake_clearance_m(self) -> float:
        """Nearer than this, the vehicle is stopped, whatever is planned."""
        return self.vehicle_radius_m + _BRAKE_SHARE * self.margin_m


@dataclass(frozen=True)
class FlightTerms:
    """The terms of a flight.

    Attributes:
        config: how to go there.
        handover: what the replaced task sent last, from which this one continues without a jump.
        traits: what the vehicle can do.
        avoidance: how to keep away from obstacles; None to fly straight.
        bounds: what it stays within if its server dies; None for anywhere.
        turn_rate_rad_s: with which a copter turns on and on while it moves, counter-clockwise; 0
            for the yaw of the flight.
    """

    config: GotoConfig
    handover: Handover = NOTHING_SENT
    traits: Traits = COPTER
    avoidance: AvoidanceConfig | None = None
    bounds: Bounds | None = None
    turn_rate_rad_s: float = 0.0
