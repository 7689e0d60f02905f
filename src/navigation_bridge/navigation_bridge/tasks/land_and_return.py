"""Land and ReturnToLaunch: modes of the vehicle, which the bridge monitors."""

from __future__ import annotations

import math
from dataclasses import replace

from navigation_bridge.goals.admitted import Admitted
from navigation_bridge.goals.obstacle_admission import avoidance_of
from navigation_bridge.goals.requests import LandRequest, ReturnRequest
from navigation_bridge.names import LAND_ACTION_NAME, RETURN_ACTION_NAME
from navigation_bridge.snapshot import Snapshot
from navigation_bridge.tasks.target_landing import admit_on_target, check_target_landing
from navigation_bridge.tasks.task_kind import TaskKind
from navigation_bridge.vehicle.traits import circle_radius_m
from navigation_core.outcomes import OutcomeCode
from navigation_core.safety.target_checks import Rejection
from navigation_core.tasks.flying.room_making import RoomMaking
from navigation_core.tasks.intents import Handover
from navigation_core.tasks.leading.flight_terms import FlightTerms
from navigation_core.tasks.task import Task
from navigation_core.tasks.watching import vehicle_led


def _admit(
    goal: vehicle_led.VehicleLedGoal, mode: str | None, snapshot: Snapshot
) -> Admitted | Rejection:
    traits = snapshot.traits
    if mode is None:
        return Rejection(
            OutcomeCode.UNSUPPORTED_VEHICLE,
            f"{snapshot.profile.name} has no mode for a {goal.name}; docs/autopilots.md lists "
            "what each vehicle supports.",
        )
    if not snapshot.armed:
        return Rejection(
            OutcomeCode.NOT_FLYING, f"The vehicle is disarmed; a {goal.name} is not possible."
        )
    if traits.flies and not snapshot.flies:
        return Rejection(
            OutcomeCode.NOT_FLYING,
            f"The vehicle is on the ground; a {goal.name} is not possible.",
        )
    config = snapshot.config.goto
    warnings = _warnings(goal, snapshot)
    # It makes room once its position is recent.
    makes_room = traits.flies and traits.hovers and snapshot.pose is not None
    avoidance = avoidance_of(makes_room, snapshot)
    if goal is vehicle_led.RETURN_TO_LAUNCH:
        radius_m = circle_radius_m(snapshot.profile, snapshot.parameters, about_launch=True)
        traits = replace(traits, circle_radius_m=radius_m)

    def make_task(_handover: Handover) -> Task:
        def make_led() -> Task:
            return vehicle_led.VehicleLed(goal, config, traits)

        if not makes_room:
            return make_led()
        terms = FlightTerms(config, traits=traits, avoidance=avoidance, bounds=snapshot.bounds)
        return RoomMaking(make_led, terms, leaves_parked=goal is vehicle_led.RETURN_TO_LAUNCH)

    description = f"{goal.name} without a recent position" if warnings else goal.name
    return Admitted(description, None, make_task, warnings)


def _warnings(goal: vehicle_led.VehicleLedGoal, snapshot: Snapshot) -> tuple[str, ...]:
    """Return what to report of a goal that begins without a recent position."""
    age_s = snapshot.arrival_age_s
    if age_s <= snapshot.config.goto.position_stale_s:
        return ()
    position = f"is {age_s:.1f} s old" if math.isfinite(age_s) else "is unknown"
    text = f"The position {position}; the autopilot carries out the {goal.name} by itself."
    return (text,)


def _admit_land(request: LandRequest, snapshot: Snapshot) -> Admitted | Rejection:
    admitted = _admit(vehicle_led.LAND, snapshot.profile.land_mode, snapshot)
    if isinstance(admitted, Rejection):
        return admitted
    rejection = check_target_landing(request, snapshot)
    if rejection is not None or not request.target_topic:
        return rejection or admitted
    return admit_on_target(request, snapshot)


def _admit_return(_request: ReturnRequest, snapshot: Snapshot) -> Admitted | Rejection:
    return _admit(vehicle_led.RETURN_TO_LAUNCH, snapshot.profile.return_mode, snapshot)


# A vehicle whose position is not received must still be able to land, and to return: whether it
# can is known to its autopilot, which rejects the mode otherwise.
LAND = TaskKind(LAND_ACTION_NAME, LandRequest, _admit_land, _admit_land)
RETURN_TO_LAUNCH = TaskKind(RETURN_ACTION_NAME, ReturnRequest, _admit_return, _admit_return)
