"""Admission of a landing on a target."""

from __future__ import annotations

import math

from navigation_bridge.goals.admitted import Admitted
from navigation_bridge.goals.obstacle_admission import avoidance_of
from navigation_bridge.goals.point_requests import volume_for
from navigation_bridge.goals.requests import LandRequest, TargetSource
from navigation_bridge.snapshot import Snapshot
from navigation_bridge.tasks.target_admission import topic_fault
from navigation_core.outcomes import OutcomeCode
from navigation_core.safety.target_checks import Rejection, check_target
from navigation_core.tasks.flying.target_landing import TargetLanding, TargetLandingGoal
from navigation_core.tasks.intents import Handover
from navigation_core.tasks.leading.flight_terms import FlightTerms
from navigation_core.tasks.task import Task

__all__ = ["admit_on_target", "check_target_landing"]


def check_target_landing(request: LandRequest, snapshot: Snapshot) -> Rejection | None:
    """Return why a target is not landed on with these numbers and this vehicle, or None."""
    topic, height_m = request.target_topic, request.search_height_m
    if not math.isfinite(height_m):
        text = f"search_height is {height_m}; every number must be finite."
        return Rejection(OutcomeCode.INVALID_NUMBER, text)
    if height_m < 0.0:
        text = f"search_height is {height_m:g} m; give 0 (as high as the vehicle is) or more."
        return Rejection(OutcomeCode.INVALID_NUMBER, text)
    if not topic and (request.target_required or request.retries or height_m):
        text = "target_required, retries and search_height need a target_topic."
        return Rejection(OutcomeCode.INVALID_TARGET, text)
    if not topic:
        return None
    fault = topic_fault("target_topic", topic, request.topic_types)
    if fault is not None:
        return Rejection(OutcomeCode.INVALID_TARGET, fault)
    return _check_vehicle(snapshot)


def _check_vehicle(snapshot: Snapshot) -> Rejection | None:
    """Return why this vehicle does not land on targets, or None."""
    profile, known = snapshot.profile, snapshot.parameters
    rules = profile.landing_target
    if rules is None:
        text = f"{profile.name} does not land on targets; only copters do."
        return Rejection(OutcomeCode.UNSUPPORTED_VEHICLE, text)
    wanted = rules.to_set(known)
    if wanted:
        text = f"The vehicle does not land on targets yet: set {wanted}, and restart it."
        return Rejection(OutcomeCode.UNSUPPORTED_VEHICLE, text)
    if snapshot.pose is None:
        text = "The vehicle's position is unknown; a landing on a target needs it."
        return Rejection(OutcomeCode.NO_POSITION, text)
    return None


def admit_on_target(request: LandRequest, snapshot: Snapshot) -> Admitted | Rejection:
    """Return the goal of a checked request that names a target."""
    traits, pose = snapshot.traits, snapshot.pose
    height_m, search_up_m = request.search_height_m, None
    if height_m and pose is not None:
        east, north, _ = pose.position_enu_m
        search_up_m = snapshot.ground_enu_m + height_m
        volume = volume_for(snapshot.config.volume, traits)
        place = (east, north, search_up_m)
        rejection = check_target(place, None, snapshot.ground_enu_m, volume)
        if rejection is not None:
            return Rejection(rejection.code, f"Where it searches: {rejection.message}")
    goal = TargetLandingGoal(request.target_required, request.retries, search_up_m)
    avoidance = avoidance_of(snapshot.knows_obstacles, snapshot)

    def make_task(handover: Handover) -> Task:
        bounds = snapshot.bounds
        return TargetLanding(goal, FlightTerms(snapshot.goto, handover, traits, avoidance, bounds))

    source = TargetSource(request.target_topic)
    return Admitted(f"landing on the target of {source}", None, make_task, followed=source)
