"""Flies to a point."""

from __future__ import annotations

from navigation_core.tasks.flying.flight import SetpointFlight
from navigation_core.tasks.flying.itinerary import SingleStop
from navigation_core.tasks.goto_config import GotoConfig, GotoConfigError, GotoGoal
from navigation_core.tasks.intents import NOTHING_SENT, Handover
from navigation_core.tasks.leading.avoidance import AvoidanceConfig
from navigation_core.tasks.traits import COPTER, Traits

__all__ = ["GotoConfig", "GotoConfigError", "GotoGoal", "fly_to"]


def fly_to(
    goal: GotoGoal,
    config: GotoConfig,
    handover: Handover = NOTHING_SENT,
    traits: Traits = COPTER,
    avoidance: AvoidanceConfig | None = None,
) -> SetpointFlight:
    """Return the task of a flight to one point; the arguments are those of :class:`SetpointFlight`.

    Args:
        goal: where to go; it is expected to have passed ``safety.check_target``.
        config: how to go there.
        handover: what the replaced task sent last.
        traits: what the vehicle can do.
        avoidance: how to keep away from obstacles; None to fly straight.
    """
    return SetpointFlight(
        SingleStop(goal),
        config,
        handover,
        traits,
        avoidance,
    )
