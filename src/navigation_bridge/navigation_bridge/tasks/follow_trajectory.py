"""FollowTrajectory: fly a trajectory that another program has planned."""

from __future__ import annotations

from dataclasses import replace

from navigation_bridge.goals.admitted import Admitted, FlightPlan
from navigation_bridge.goals.obstacle_admission import avoidance_of
from navigation_bridge.goals.requests import TrajectoryRequest
from navigation_bridge.names import TRAJECTORY_ACTION_NAME
from navigation_bridge.requests.trajectory_requests import (
    limits_of_trajectories,
    resolve_trajectory,
)
from navigation_bridge.snapshot import LocatedSnapshot
from navigation_bridge.tasks.steering_admission import check_steered
from navigation_bridge.tasks.task_kind import TaskKind
from navigation_core.geometry import KinematicState
from navigation_core.outcomes import OutcomeCode, Rejection
from navigation_core.tasks.intents import Handover
from navigation_core.tasks.leading.flight_terms import FlightTerms
from navigation_core.tasks.steering.follow_trajectory import FollowTrajectory, TrajectoryTerms
from navigation_core.tasks.steering.steersman import VelocityTerms
from navigation_core.tasks.task import Task

__all__ = ["FOLLOW_TRAJECTORY"]


def _admit(request: TrajectoryRequest, snapshot: LocatedSnapshot) -> Admitted | Rejection:
    if not snapshot.traits.flies:
        return Rejection(
            OutcomeCode.UNSUPPORTED_VEHICLE,
            f"A {snapshot.traits.name} cannot drive trajectories of other programs; send it "
            "targets.",
        )
    rejection = check_steered(snapshot, "a trajectory", "fly trajectories of other programs")
    if rejection is not None:
        return rejection
    timed = None
    if request.points or request.fault:
        here = KinematicState(snapshot.position_enu_m, snapshot.velocity_enu_m_s)
        resolved = resolve_trajectory(request, snapshot, here)
        if isinstance(resolved, Rejection):
            return resolved
        timed = resolved
    config, limits = snapshot.config, limits_of_trajectories(snapshot)
    goto = replace(snapshot.goto, limits=limits)
    # The topic is not known before: avoidance is on as soon as any obstacle may be known.
    avoidance = avoidance_of(snapshot.knows_obstacles, snapshot)

    def make_task(handover: Handover) -> Task:
        flight = FlightTerms(goto, handover, snapshot.traits, avoidance, snapshot.bounds)
        margin_m = config.safety.fence_margin_m
        steering = VelocityTerms(flight, config.volume, margin_m)
        return FollowTrajectory(TrajectoryTerms(steering, timed))

    speed_m_s = limits.speed_horizontal_m_s
    if timed is None:
        plan = FlightPlan((), (speed_m_s,), straight=False)
        return Admitted("the trajectories of a topic", None, make_task, plan=plan)
    end_enu_m, duration_s = timed.trajectory.end_position_enu_m, timed.trajectory.duration_s
    slower = ""
    if timed.why_slower:
        slower = f"{timed.why_slower} The trajectory is flown {timed.slower:.2f} times slower."
    return Admitted(
        f"a trajectory of {len(timed.times_s)} points in {duration_s:.1f} s",
        end_enu_m,
        make_task,
        (slower,) if slower else (),
        plan=FlightPlan((end_enu_m,), (speed_m_s,), hold_s=duration_s, straight=False),
    )


FOLLOW_TRAJECTORY = TaskKind(TRAJECTORY_ACTION_NAME, TrajectoryRequest, _admit)
