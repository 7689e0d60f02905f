"""Flies to a point."""

from __future__ import annotations

from navigation_core.geometry import KinematicState
from navigation_core.tasks.base import COPTER, Traits
from navigation_core.tasks.flying.flight import SetpointFlight
from navigation_core.tasks.flying.goto_config import GotoConfig, GotoConfigError, GotoGoal
from navigation_core.tasks.flying.itinerary import SingleStop
from navigation_core.tasks.leading.avoidance import AvoidanceConfig

__all__ = ["GotoConfig", "GotoConfigError", "GotoGoal", "fly_to"]


def fly_to(
    goal: GotoGoal,
    config: GotoConfig,
    predecessor: KinematicState | None = None,
    predecessor_yaw: float | None = None,
    predecessor_time_s: float | None = None,
    traits: Traits = COPTER,
    avoidance: AvoidanceConfig | None = None,
) -> SetpointFlight:
    """Return the task of a flight to one point; the arguments are those of :class:`SetpointFlight`.

    Args:
        goal: where to go; it is expected to have passed ``safety.check_target``.
        config: how to go there.
        predecessor: state of the setpoint that the replaced task sent last.
        predecessor_yaw: yaw of that setpoint.
        predecessor_time_s: when it was sent.
        traits: what the vehicle can do.
        avoidance: how to keep away from obstacles; None to fly straight.
    """
    return SetpointFlight(
        SingleStop(goal),
        config,
        predecessor,
        predecessor_yaw,
        predecessor_time_s,
        traits,
        avoidance,
    )
