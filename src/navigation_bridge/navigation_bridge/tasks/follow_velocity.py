"""FollowVelocity: follow the velocity commands of a topic."""

from __future__ import annotations

from navigation_bridge.goals.admitted import Admitted, FlightPlan
from navigation_bridge.goals.obstacle_admission import avoidance_of
from navigation_bridge.goals.point_requests import check_speed
from navigation_bridge.goals.requests import VelocityRequest
from navigation_bridge.names import VELOCITY_ACTION_NAME
from navigation_bridge.snapshot import LocatedSnapshot
from navigation_bridge.tasks.steering_admission import check_steered
from navigation_bridge.tasks.task_kind import TaskKind
from navigation_core.safety.target_checks import Rejection
from navigation_core.tasks.intents import Handover
from navigation_core.tasks.leading.flight_terms import FlightTerms
from navigation_core.tasks.steering.follow_velocity import FollowVelocity
from navigation_core.tasks.steering.steersman import VelocityTerms
from navigation_core.tasks.task import Task

__all__ = ["FOLLOW_VELOCITY"]


def _admit(request: VelocityRequest, snapshot: LocatedSnapshot) -> Admitted | Rejection:
    rejection = check_speed(request.max_speed_m_s) or check_steered(
        snapshot, "a velocity command", "follow velocity commands"
    )
    if rejection is not None:
        return rejection
    config, traits, goto = snapshot.config, snapshot.traits, snapshot.goto
    asked_m_s = min(request.max_speed_m_s, snapshot.speed_max_m_s)
    speed_m_s = asked_m_s or goto.limits.speed_horizontal_m_s
    # A client that steers plans no path: avoidance is on as soon as any obstacle may be known.
    avoidance = avoidance_of(snapshot.knows_obstacles, snapshot)

    def make_task(handover: Handover) -> Task:
        return FollowVelocity(
            VelocityTerms(
                FlightTerms(goto, handover, traits, avoidance),
                config.volume,
                config.safety.fence_margin_m,
                config.commands.timeout_s,
                speed_m_s,
            )
        )

    return Admitted(
        f"velocity commands at up to {speed_m_s:g} m/s",
        None,
        make_task,
        plan=FlightPlan((), (speed_m_s,), straight=False),
    )


FOLLOW_VELOCITY = TaskKind(VELOCITY_ACTION_NAME, VelocityRequest, _admit)
