"""Admitted goals, and the permission to start a vehicle. No ROS."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass

from mavlink_vehicle.events import LandedState
from navigation_bridge.goals.requests import TargetSource
from navigation_bridge.snapshot import Snapshot
from navigation_core.geometry import Vector3, distance
from navigation_core.outcomes import OutcomeCode
from navigation_core.safety.target_checks import Rejection
from navigation_core.tasks.intents import Handover
from navigation_core.tasks.task import Task

__all__ = ["Admitted", "FlightPlan", "may_move"]


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
        followed: source of the target that it follows, or None.
    """

    description: str
    target_enu_m: Vector3 | None
    make_task: Callable[[Handover], Task]
    warnings: tuple[str, ...] = ()
    plan: FlightPlan | None = None
    action: str = ""
    follows_commands: bool = False
    followed: TargetSource | None = None


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
        on_ground = snapshot.state.landed_state is LandedState.ON_GROUND
        where = "is on the ground" if on_ground else "does not report that it is airborne"
        return Rejection(
            OutcomeCode.TAKEOFF_NOT_ALLOWED,
            f"The vehicle {where} and parameter arming is 'never'; take off yourself, or "
            "set arming to 'pilot', so that goals take off once the vehicle is armed.",
        )
    return None


@dataclass(frozen=True)
class FlightPlan:
    """Targets of a goal and the straight legs between them.

    Attributes:
        targets_enu_m: targets in the map frame, in order; none for a goal without one, which a
            client steers.
        speeds_m_s: ground speed on the leg to each.
        laps: number of laps.
        hold_s: hold time in one lap.
        straight: whether it is flown in straight lines; otherwise around obstacles and along the
            fence.
        margin_m: least distance of the targets to a bound of the flight volume or the fence.
    """

    targets_enu_m: tuple[Vector3, ...]
    speeds_m_s: tuple[float, ...]
    laps: int = 1
    hold_s: float = 0.0
    straight: bool = True
    margin_m: float = 0.0

    def duration_s(self, start_enu_m: Vector3) -> float:
        """Return the flight time from a position, without starting and stopping."""
        targets, speeds = self.targets_enu_m, self.speeds_m_s
        if not targets:
            return self.hold_s
        approach_s = distance(start_enu_m, targets[0]) / speeds[0]
        lap_s = math.fsum(
            distance(a, b) / speed
            for (a, b), speed in zip(itertools.pairwise(targets), speeds[1:], strict=True)
        )
        again_s = distance(targets[-1], targets[0]) / speeds[0]
        return approach_s + self.laps * (lap_s + self.hold_s) + (self.laps - 1) * again_s
