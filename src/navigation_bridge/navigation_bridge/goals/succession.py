"""A goal that replaces another continues from its state. No ROS."""

from __future__ import annotations

from dataclasses import replace

from navigation_bridge.goals.active_goal import ActiveGoal, GoalTimes, PositionDoubt
from navigation_bridge.goals.admitted import Admitted
from navigation_bridge.goals.goal_operation import GoalOperation
from navigation_bridge.goals.lifecycle import GoalEvent
from navigation_core.tasks.intents import Handover
from navigation_core.tasks.observation import TaskOperation, VehicleMode

__all__ = ["successor"]

# Modes in which a vehicle moves without setpoints, and operations that lead to one.
_LEADING = frozenset({VehicleMode.LAND, VehicleMode.RETURN, VehicleMode.MISSION})
_LEADS_TO = frozenset(
    {
        TaskOperation.LAND,
        TaskOperation.LAND_ON_TARGET,
        TaskOperation.RETURN,
        TaskOperation.START_MISSION,
    }
)
_OF_ONE_MISSION = frozenset(
    {TaskOperation.UPLOAD_MISSION, TaskOperation.START_MISSION, TaskOperation.CLEAR_MISSION}
)


def successor(
    goal_id: str,
    admitted: Admitted,
    previous: ActiveGoal | None,
    mode: VehicleMode,
    jumps_ned_m: tuple[float, float],
    now: float,
) -> ActiveGoal:
    """Return an executing goal.

    Args:
        goal_id: UUID as hexadecimal digits.
        admitted: the admitted request.
        previous: the goal from whose last setpoint and operation it continues; None if it
            continues from none.
        mode: the vehicle's.
        jumps_ned_m: sum of the position's jumps so far, north and east.
        now: time in seconds.
    """
    handover, next_step_s = Handover(), now
    operation = None if previous is None else previous.operation.report
    if previous is not None:
        leads = operation is not None and operation.kind in _LEADS_TO
        handover = Handover(
            previous.task.commanded,
            previous.task.commanded_yaw_enu_rad,
            previous.times.setpoint_s,
            by_itself=mode in _LEADING or leads,
        )
        next_step_s = previous.times.next_step_s
    # The new goal also needs an arming or a take-off in progress, but not another mission.
    continues = operation is not None and operation.kind not in _OF_ONE_MISSION
    goal = ActiveGoal(
        goal_id,
        admitted.description,
        admitted.target_enu_m,
        admitted.make_task(handover),
        now,
        GoalTimes(next_step_s, feedback_due_s=now),
        replace(previous.operation) if previous is not None and continues else GoalOperation(),
        notes=list(admitted.warnings),
        plan=admitted.plan,
        kind=admitted.action,
        follows_commands=admitted.follows_commands,
        followed=admitted.followed,
        doubt=PositionDoubt(jumps_ned_m),
    )
    goal.apply(GoalEvent.EXECUTE)
    return goal
