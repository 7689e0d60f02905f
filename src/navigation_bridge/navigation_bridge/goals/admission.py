"""Admission of goals: checks a goal and makes its task. No ROS."""

from __future__ import annotations

from dataclasses import replace

from mavlink_vehicle.vehicle import Vehicle
from navigation_bridge.configuration.settings import BridgeConfig
from navigation_bridge.goals.admitted import Admitted, Handover, Situation
from navigation_bridge.goals.obstacle_admission import avoidance_of, check_obstacles
from navigation_bridge.goals.point_requests import check_request, resolve
from navigation_bridge.goals.requests import (
    LandRequest,
    NavigateRequest,
    Request,
    ReturnRequest,
    TakeoffRequest,
)
from navigation_bridge.goals.route_admission import admit_plane, admit_route
from navigation_bridge.goals.straight_legs import FlightPlan
from navigation_bridge.obstacles.obstacle_feed import ObstacleFeed
from navigation_bridge.vehicle.map_frame import MapFrame
from navigation_bridge.vehicle.traits import circle_radius_m
from navigation_core.outcomes import OutcomeCode
from navigation_core.safety.target_checks import Rejection, check_target
from navigation_core.searches import Searcher
from navigation_core.tasks.base import Task
from navigation_core.tasks.flying.goto import GotoConfig, GotoGoal, fly_to
from navigation_core.tasks.flying.route import RouteWaypoint
from navigation_core.tasks.watching.vehicle_led import (
    LAND,
    RETURN_TO_LAUNCH,
    VehicleLed,
    VehicleLedGoal,
)

__all__ = ["admit"]


def admit(
    request: Request,
    vehicle: Vehicle,
    map_frame: MapFrame,
    config: BridgeConfig,
    obstacles: ObstacleFeed,
    searcher: Searcher,
    active_goal_id: str | None,
    now: float,
) -> Admitted | Rejection:
    """Return the admitted goal for this vehicle, or the first reason for rejection."""
    if isinstance(request, NavigateRequest):
        rejection = check_request(request)
        if rejection is not None:
            return rejection
    # A vehicle without a position must still be able to land.
    needs_position = not isinstance(request, LandRequest)
    situation = _situation(vehicle, map_frame, config, obstacles, searcher, needs_position, now)
    if isinstance(situation, Rejection):
        return situation
    if active_goal_id is not None and not config.replace_active_goal:
        return Rejection(
            OutcomeCode.BUSY,
            f"Goal {active_goal_id} is active and on_new_goal is 'reject'; cancel it first.",
        )
    if isinstance(request, NavigateRequest):
        return _navigate(request, situation)
    if isinstance(request, TakeoffRequest):
        return _take_off(request, situation)
    if isinstance(request, LandRequest):
        return _vehicle_led(LAND, situation.profile.land_mode, situation)
    if isinstance(request, ReturnRequest):
        return _vehicle_led(RETURN_TO_LAUNCH, situation.profile.return_mode, situation)
    return admit_route(request, situation)


def _situation(
    vehicle: Vehicle,
    map_frame: MapFrame,
    config: BridgeConfig,
    obstacles: ObstacleFeed,
    searcher: Searcher,
    needs_position: bool,
    now: float,
) -> Situation | Rejection:
    state, profile = vehicle.state, vehicle.profile
    if not vehicle.connected or profile is None:
        return Rejection(
            OutcomeCode.NO_VEHICLE,
            "No autopilot is heard on the link; check link_url and the vehicle's power.",
        )
    if profile.unsupported is not None:
        return Rejection(OutcomeCode.UNSUPPORTED_VEHICLE, profile.unsupported)
    if profile.control_mode is None:
        return Rejection(
            OutcomeCode.UNSUPPORTED_VEHICLE,
            f"Goals on this vehicle ({profile.name}) are not supported; docs/autopilots.md lists "
            "the supported ones.",
        )
    position, pose = state.global_position, map_frame.pose(state)
    if not needs_position:
        return Situation(vehicle, profile, map_frame, pose, config, obstacles, searcher)
    if pose is None or position is None:
        return Rejection(
            OutcomeCode.NO_POSITION,
            "The autopilot has no valid position yet; wait for its GPS and estimator.",
        )
    age_s = now - position.time_s
    if age_s > config.goto.position_stale_s:
        return Rejection(
            OutcomeCode.NO_POSITION,
            f"The last GLOBAL_POSITION_INT is {age_s:.1f} s old; check the link and the message "
            "rates.",
        )
    return Situation(vehicle, profile, map_frame, pose, config, obstacles, searcher)


def _navigate(request: NavigateRequest, situation: Situation) -> Admitted | Rejection:
    rejection = situation.may_move()
    if rejection is not None:
        return rejection
    config = situation.config
    traits = situation.traits
    assert situation.pose is not None
    goal = resolve(
        request,
        situation.pose,
        situation.map_frame.enu,
        situation.ground_enu_m,
        config.volume,
        situation.speed_max_m_s,
        traits,
    )
    if isinstance(goal, Rejection):
        return goal
    warnings = check_obstacles((goal.position_enu_m,), request.avoid_obstacles, False, situation)
    if isinstance(warnings, Rejection):
        return warnings
    return _goto(goal, situation.goto, situation, warnings, request.avoid_obstacles)


def _take_off(request: TakeoffRequest, situation: Situation) -> Admitted | Rejection:
    traits = situation.traits
    if not traits.flies:
        return Rejection(OutcomeCode.UNSUPPORTED_VEHICLE, f"A {traits.name} cannot take off.")
    if situation.flies:
        return Rejection(
            OutcomeCode.ALREADY_FLYING,
            "The vehicle is already airborne; send a Navigate goal to change its altitude.",
        )
    rejection = situation.may_move()
    if rejection is not None:
        return rejection
    config = situation.config
    assert situation.pose is not None
    height_m = request.height_m or max(config.goto.takeoff_height_m, traits.takeoff_height_m)
    x, y, _ = situation.pose.position_enu_m
    target = (x, y, situation.ground_enu_m + height_m)
    rejection = check_target(target, None, situation.ground_enu_m, config.volume)
    if rejection is not None:
        return rejection
    goto = replace(config.goto, takeoff_height_m=height_m, takeoff_height_min_m=height_m)
    return _goto(GotoGoal(target, situation.pose.yaw_enu_rad), goto, situation)


def _goto(
    goal: GotoGoal,
    config: GotoConfig,
    situation: Situation,
    warnings: tuple[str, ...] = (),
    avoid: bool = False,
) -> Admitted | Rejection:
    traits = situation.traits
    if not traits.hovers:
        waypoint = RouteWaypoint(
            goal.position_enu_m,
            config.arrival_radius_m,
            yaw_enu_rad=goal.yaw_enu_rad,
            max_speed_m_s=goal.max_speed_m_s,
        )
        return admit_plane((waypoint,), 1, situation, warnings)
    x, y, z = goal.position_enu_m
    speed_m_s = goal.max_speed_m_s or config.limits.speed_horizontal_m_s

    avoidance = avoidance_of(avoid, situation)

    def make_task(handover: Handover) -> Task:
        return fly_to(
            goal,
            config,
            predecessor=handover.commanded,
            predecessor_yaw=handover.yaw_enu_rad,
            predecessor_time_s=handover.time_s,
            traits=traits,
            avoidance=avoidance,
        )

    return Admitted(
        f"map ({x:.2f}, {y:.2f}, {z:.2f}) m at up to {speed_m_s:g} m/s",
        goal.position_enu_m,
        make_task,
        warnings,
        FlightPlan((goal.position_enu_m,), (speed_m_s,), straight=avoidance is None),
    )


def _vehicle_led(
    goal: VehicleLedGoal, mode: str | None, situation: Situation
) -> Admitted | Rejection:
    traits = situation.traits
    if mode is None:
        return Rejection(
            OutcomeCode.UNSUPPORTED_VEHICLE,
            f"{situation.profile.name} has no mode for a {goal.name}; docs/autopilots.md lists "
            "what each vehicle supports.",
        )
    if not situation.vehicle.state.armed:
        return Rejection(
            OutcomeCode.NOT_FLYING, f"The vehicle is disarmed; a {goal.name} is not possible."
        )
    if traits.flies and not situation.flies:
        return Rejection(
            OutcomeCode.NOT_FLYING,
            f"The vehicle is on the ground; a {goal.name} is not possible.",
        )
    config, vehicle = situation.config.goto, situation.vehicle
    if goal is RETURN_TO_LAUNCH:
        radius_m = circle_radius_m(situation.profile, vehicle.parameters, about_launch=True)
        traits = replace(traits, circle_radius_m=radius_m)
    return Admitted(goal.name, None, lambda _handover: VehicleLed(goal, config, traits))
