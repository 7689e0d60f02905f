"""FollowVelocity: follow the velocity commands of a topic."""

from __future__ import annotations

from mavlink_vehicle.events import LandedState
from navigation_bridge.goals.admitted import Admitted, FlightPlan
from navigation_bridge.goals.obstacle_admission import avoidance_of
from navigation_bridge.goals.point_requests import check_speed
from navigation_bridge.goals.requests import VelocityRequest
from navigation_bridge.names import VELOCITY_ACTION_NAME
from navigation_bridge.snapshot import LocatedSnapshot
from navigation_bridge.tasks.task_kind import TaskKind
from navigation_core.outcomes import OutcomeCode
from navigation_core.safety.target_checks import Rejection
from navigation_core.tasks.intents import Handover
from navigation_core.tasks.leading.flight_terms import FlightTerms
from navigation_core.tasks.steering.follow_velocity import FollowVelocity
from navigation_core.tasks.steering.steersman import VelocityTerms
from navigation_core.tasks.task import Task

__all__ = ["FOLLOW_VELOCITY"]


def _admit(request: VelocityRequest, snapshot: LocatedSnapshot) -> Admitted | Rejection:
    rejection = check_speed(request.max_speed_m_s) or _check_vehicle(snapshot)
    if rejection is not None:
        return rejection
    config, traits, goto = snapshot.config, snapshot.traits, snapshot.goto
    asked_m_s = min(request.max_speed_m_s, snapshot.speed_max_m_s)
    speed_m_s = asked_m_s or goto.limits.speed_horizontal_m_s
    # A client that steers plans no path: avoidance is on as soon as any obstacle may be known.
    knows_obstacles = snapshot.has_sensor or bool(snapshot.known_obstacles)
    avoidance = avoidance_of(knows_obstacles, snapshot)

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


def _check_vehicle(snapshot: LocatedSnapshot) -> Rejection | None:
    """Return why velocity commands cannot move this vehicle now, or None."""
    traits, state = snapshot.traits, snapshot.state
    if not traits.hovers:
        return Rejection(
            OutcomeCode.UNSUPPORTED_VEHICLE,
            f"A {traits.name} cannot follow velocity commands; send it targets.",
        )
    if not traits.flies and not state.armed:
        return Rejection(
            OutcomeCode.NOT_FLYING,
            f"The {traits.name} is disarmed, and velocity commands never arm; arm it first.",
        )
    in_air = state.armed and state.landed_state is LandedState.IN_AIR
    if traits.flies and not in_air:
        return Rejection(
            OutcomeCode.NOT_FLYING,
            "The vehicle does not report that it is in the air, taking off and landing excepted, "
            "and velocity commands never take off; take off first.",
        )
    return None


FOLLOW_VELOCITY = TaskKind(VELOCITY_ACTION_NAME, VelocityRequest, _admit)
