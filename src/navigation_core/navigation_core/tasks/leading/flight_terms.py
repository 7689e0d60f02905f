"""Terms of a flight by setpoints: limits, frames and traits, whatever its target."""

from __future__ import annotations

from dataclasses import dataclass

from navigation_core.safety.speed_at_bounds import Bounds
from navigation_core.tasks.goto_config import GotoConfig
from navigation_core.tasks.intents import NOTHING_SENT, Handover
from navigation_core.tasks.leading.avoidance import AvoidanceConfig
from navigation_core.tasks.traits import COPTER, Traits


@dataclass(frozen=True)
class FlightTerms:
    """The terms of a flight.

    Attributes:
        config: how to go there.
        handover: what the replaced task sent last, from which this one continues without a jump.
        traits: what the vehicle can do.
        avoidance: how to keep away from obstacles; None to fly straight.
        bounds: what it stays within if its server dies; None for anywhere.
    """

    config: GotoConfig
    handover: Handover = NOTHING_SENT
    traits: Traits = COPTER
    avoidance: AvoidanceConfig | None = None
    bounds: Bounds | None = None
