"""Admitted goals, and the permission to start a vehicle. No ROS."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from mavlink_vehicle.events import LandedState
from navigation_bridge.goals.straight_legs import FlightPlan
from navigation_bridge.snapshot import Snapshot
from navigation_core.geometry import Vector3
from navigation_core.outcomes import OutcomeCode
from navigation_core.safety.target_checks import Rejection
from navigation_core.tasks.intents import Handover
from navigation_core.tasks.task import Task

__all__ = ["Admitted", "may_move"]


@dataclass(frozen=True)
class Admitted:
    """An admitted request.

    Attributes:
        description: description of the goal for the log.
        target_enu_m: final target in the map frame; None if the vehicle decides it.
        make_task: makes the task, which continues from a replaced goal's last setpoint.
        warnings: sentences for the log and the final message.
        plan: the straight legs that are flown; None if the vehicle decides.
        action: name of its action.
        follows_commands: whether it follows velocity commands.
    """

    description: str
    target_enu_m: Vector3 | None
    make_task: Callable[[Handover], Task]
    warnings: tuple[str, ...] = ()
    plan: FlightPlan | None = None
    action: str = ""
    follows_commands: bool = False


def may_move(snapshot: Snapshot) -> Rejection | None:
    """Return the reason why a goal may not start the vehicle, or None."""
    goto = snapshot.config.goto
    if not snapshot.armed and not goto.may_arm:
        word = "pilot" if goto.may_take_off else "never"
        by_hand = "arm and take off" if snapshot.traits.flies and word == "never" else "arm it"
        return Rejection(
            OutcomeCode.ARMING_NOT_ALLOWED,
            f"The vehicle is disarmed and parameter arming is '{word}'; {by_hand} "
            "yourself, or set arming to 'auto'.",
        )
    if snapshot.traits.flies and not snapshot.flies and not goto.may_leave_ground:
        told = snapshot.state.landed_state is LandedState.ON_GROUND
        where = "is on the ground" if told else "does not report that it is airborne"
        return Rejection(
            OutcomeCode.TAKEOFF_NOT_ALLOWED,
            f"The vehicle {where} and parameter arming is 'never'; take off yourself, or "
            "set arming to 'pilot', so that goals take off once the vehicle is armed.",
        )
    return None
