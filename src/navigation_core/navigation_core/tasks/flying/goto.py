"""Flies to a point."""

from __future__ import annotations

from navigation_core.tasks.flying.flight import SetpointFlight
from navigation_core.tasks.flying.itinerary import SingleStop
from navigation_core.tasks.goto_config import GotoConfig, GotoConfigError, GotoGoal
from navigation_core.tasks.leading.flight_terms import FlightTerms

__all__ = ["FlightTerms", "GotoConfig", "GotoConfigError", "GotoGoal", "fly_to"]


def fly_to(goal: GotoGoal, terms: FlightTerms) -> SetpointFlight:
    """Return the flight to one point, which is expected to have passed ``safety.check_target``."""
    return SetpointFlight(SingleStop(goal), terms)
