"""Whether a goal can be taken now, and the task that it becomes. No ROS."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

from drone_navigation.flight_plan import FlightPlan
from drone_navigation.map_frame import MapFrame
from drone_navigation.requests import (
    LandRequest,
    MapPose,
    NavigateRequest,
    Request,
    ReturnRequest,
    TakeoffRequest,
    WaypointsRequest,
    check_request,
    resolve,
)
from drone_navigation.route_requests import MISSION_WAYPOINTS_MAX, resolve_waypoints
from drone_navigation.settings import BridgeConfig
from drone_navigation.traits import traits_of
from mavlink_vehicle.events import LandedState
from mavlink_vehicle.profiles import Profile
from mavlink_vehicle.vehicle import Vehicle
from navigation_core.geometry import KinematicState, Vector3, horizontal_norm
from navigation_core.outcomes import OutcomeCode
from navigation_core.safety import Rejection, check_target
from navigation_core.tasks.base import Task, Traits
from navigation_core.tasks.goto import Goto, GotoConfig, GotoGoal
from navigation_core.tasks.mission import FlyMission
from navigation_core.tasks.plane import FlyPlane
from navigation_core.tasks.plane_route import circle_max_m
from navigation_core.tasks.route import FlyRoute, RouteWaypoint
from navigation_core.tasks.vehicle_led import (
    LAND,
    RETURN_TO_LAUNCH,
    VehicleLed,
    VehicleLedGoal,
)

# Assumed speed of a plane that none is asked of (FW_AIRSPD_TRIM; ArduPlane's is more).
_PLANE_M_S = 15.0
_NO_YAW = "The orientation was ignored: a plane circles its target."
_AIRSPEED = "A plane's max_speed is an airspeed; its ground speed differs by the wind."
_NO_SPEED = "max_speed was ignored: this plane's speed is not changed by command."
_NO_OBSTACLE_SOURCE = "No obstacle source is configured, so the flight was planned straight."


class Handover(NamedTuple):
    """The setpoint that the replaced goal sent last; all None when there was none."""

    commanded: KinematicState | None = None
    yaw_enu_rad: float | None = None
    time_s: float | None = None


@dataclass(frozen=True)
class Admitted:
    """A request that can be worked on.

    Attributes:
        description: what it aims at, for the log.
        target_enu_m: where it ends, in the map frame; None when the vehicle decides that.
        make_task: makes the task, which goes on from a replaced goal's last setpoint.
        warnings: sentences to tell people, and to add to the final message.
        plan: the straight ways that are flown; None when the vehicle decides.
    """

    description: str
    target_enu_m: Vector3 | None
    make_task: Callable[[Handover], Task]
    warnings: tuple[str, ...] = ()
    plan: FlightPlan | None = None


@dataclass(frozen=True)
class Situation:
    """What admission looks at, gathered once.

    Attributes:
        vehicle: the vehicle, which is connected and has a profile.
        profile: that profile.
        map_frame: its map frame.
        pose: its pose in it; None only for what needs no position.
        config: how goals are treated.
    """

    vehicle: Vehicle
    profile: Profile
    map_frame: MapFrame
    pose: MapPose | None
    config: BridgeConfig

    @property
    def ground_enu_m(self) -> float:
        """Height of the ground in the map frame."""
        return self.map_frame.ground_enu_m(self.vehicle.state)

    @property
    def flies(self) -> bool:
        """Whether it is armed and in the air, as far as it says."""
        state = self.vehicle.state
        return state.armed and state.landed_state not in (
            LandedState.ON_GROUND,
            LandedState.UNDEFINED,
        )


def admit(
    request: Request,
    vehicle: Vehicle,
    map_frame: MapFrame,
    config: BridgeConfig,
    active_goal_id: str | None,
    now: float,
) -> Admitted | Rejection:
    """Return what a request means for this vehicle, or the first reason against it."""
    if isinstance(request, NavigateRequest):
        rejection = check_request(request)
        if rejection is not None:
            return rejection
    # Who has lost the position must still be able to land.
    needs_position = not isinstance(request, LandRequest)
    situation = _situation(vehicle, map_frame, config, needs_position, now)
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
    return _route(request, situation)


def _situation(
    vehicle: Vehicle, map_frame: MapFrame, config: BridgeConfig, needs_position: bool, now: float
) -> Situation | Rejection:
    state, profile = vehicle.state, vehicle.profile
    if not vehicle.connected or profile is None:
        return Rejection(
            OutcomeCode.NO_VEHICLE,
            "No autopilot is heard on the link; check link_url and that the vehicle is on.",
        )
    if profile.unsupported is not None:
        return Rejection(OutcomeCode.UNSUPPORTED_VEHICLE, profile.unsupported)
    if profile.control_mode is None:
        return Rejection(
            OutcomeCode.UNSUPPORTED_VEHICLE,
            f"Goals on this vehicle ({profile.name}) are not supported; docs/autopilots.md lists "
            "those that are.",
        )
    position, pose = state.global_position, map_frame.pose(state)
    if not needs_position:
        return Situation(vehicle, profile, map_frame, pose, config)
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
    return Situation(vehicle, profile, map_frame, pose, config)


def _may_move(situation: Situation) -> Rejection | None:
    if situation.vehicle.state.armed or situation.config.goto.may_arm:
        return None
    return Rejection(
        OutcomeCode.ARMING_NOT_ALLOWED,
        "The vehicle is disarmed and the parameter arming is 'never'; arm and take off "
        "yourself, or set arming to 'auto'.",
    )


def _navigate(request: NavigateRequest, situation: Situation) -> Admitted | Rejection:
    rejection = _may_move(situation)
    if rejection is not None:
        return rejection
    config = situation.config
    traits = traits_of(situation.profile)
    assert situation.pose is not None
    goal = resolve(
        request,
        situation.pose,
        situation.map_frame.enu,
        situation.ground_enu_m,
        config.volume,
        _speed_max_m_s(config, traits),
        traits,
    )
    if isinstance(goal, Rejection):
        return goal
    warnings = (_NO_OBSTACLE_SOURCE,) if request.avoid_obstacles else ()
    return _goto(goal, config.goto, situation, warnings)


def _take_off(request: TakeoffRequest, situation: Situation) -> Admitted | Rejection:
    traits = traits_of(situation.profile)
    if not traits.flies:
        return Rejection(
            OutcomeCode.UNSUPPORTED_VEHICLE, f"A {traits.name} cannot take off; it drives."
        )
    if situation.flies:
        return Rejection(
            OutcomeCode.ALREADY_FLYING,
            "The vehicle flies already; send a Navigate goal to change its height.",
        )
    rejection = _may_move(situation)
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
    goal: GotoGoal, config: GotoConfig, situation: Situation, warnings: tuple[str, ...] = ()
) -> Admitted | Rejection:
    traits = traits_of(situation.profile)
    if not traits.hovers:
        waypoint = RouteWaypoint(
            goal.position_enu_m,
            config.arrival_radius_m,
            yaw_enu_rad=goal.yaw_enu_rad,
            max_speed_m_s=goal.max_speed_m_s,
        )
        return _plane((waypoint,), 1, situation, warnings)
    x, y, z = goal.position_enu_m
    speed_m_s = goal.max_speed_m_s or config.limits.speed_horizontal_m_s

    def make_task(handover: Handover) -> Task:
        return Goto(
            goal,
            config,
            predecessor=handover.commanded,
            predecessor_yaw=handover.yaw_enu_rad,
            predecessor_time_s=handover.time_s,
            traits=traits,
        )

    return Admitted(
        f"map ({x:.2f}, {y:.2f}, {z:.2f}) m at up to {speed_m_s:g} m/s",
        goal.position_enu_m,
        make_task,
        warnings,
        FlightPlan((goal.position_enu_m,), (speed_m_s,)),
    )


def _route(request: WaypointsRequest, situation: Situation) -> Admitted | Rejection:
    rejection = _may_move(situation)
    if rejection is not None:
        return rejection
    config, traits = situation.config, traits_of(situation.profile)
    rules = situation.profile.missions
    if request.by_mission and rules is None:
        return Rejection(
            OutcomeCode.UNSUPPORTED_VEHICLE,
            f"How {situation.profile.name} takes missions is not known; use setpoints.",
        )
    waypoints = resolve_waypoints(
        request,
        situation.map_frame,
        situation.vehicle.state,
        config.volume,
        _speed_max_m_s(config, traits),
        config.goto.arrival_radius_m,
        traits,
        follows_terrain=(
            request.by_mission
            and rules is not None
            and rules.terrain
            and situation.vehicle.state.terrain_ready is True
        ),
    )
    if isinstance(waypoints, Rejection):
        return waypoints
    laps = max(request.laps, 1)
    if request.by_mission:
        return _mission(request, waypoints, laps, situation)
    warnings = (_NO_OBSTACLE_SOURCE,) if request.avoid_obstacles else ()
    if not traits.hovers:
        return _plane(waypoints, laps, situation, warnings)

    def make_task(handover: Handover) -> Task:
        return FlyRoute(
            waypoints,
            laps,
            config.goto,
            predecessor=handover.commanded,
            predecessor_yaw=handover.yaw_enu_rad,
            predecessor_time_s=handover.time_s,
            traits=traits,
        )

    return Admitted(
        f"route of {len(waypoints)} waypoints, {laps} x",
        waypoints[-1].position_enu_m,
        make_task,
        warnings,
        _plan(waypoints, laps, config.goto.limits.speed_horizontal_m_s),
    )


def _plan(waypoints: tuple[RouteWaypoint, ...], laps: int, speed_m_s: float) -> FlightPlan:
    return FlightPlan(
        tuple(waypoint.position_enu_m for waypoint in waypoints),
        tuple(waypoint.max_speed_m_s or speed_m_s for waypoint in waypoints),
        laps,
        sum(waypoint.hold_time_s for waypoint in waypoints),
    )


def _mission(
    request: WaypointsRequest,
    waypoints: tuple[RouteWaypoint, ...],
    laps: int,
    situation: Situation,
) -> Admitted | Rejection:
    count = len(waypoints) * laps
    if count > MISSION_WAYPOINTS_MAX:
        return Rejection(
            OutcomeCode.INVALID_WAYPOINTS,
            f"The mission has {count} waypoints over all laps; at most {MISSION_WAYPOINTS_MAX} are "
            "stored in a vehicle. Use setpoints.",
        )
    config, traits = situation.config.goto, traits_of(situation.profile)
    rejection = None if traits.hovers else _check_circles(waypoints, situation)
    if rejection is not None:
        return rejection
    # A plane keeps to its own airspeeds unless it is asked for another.
    speed_m_s = config.limits.speed_horizontal_m_s if traits.hovers else None
    if request.max_speed_m_s > 0.0:
        speed_m_s = min(request.max_speed_m_s, _speed_max_m_s(situation.config, traits))
    return Admitted(
        f"mission of {len(waypoints)} waypoints, {laps} x",
        waypoints[-1].position_enu_m,
        lambda _handover: FlyMission(waypoints, laps, config, traits, speed_m_s),
        (_NO_OBSTACLE_SOURCE,) if request.avoid_obstacles else (),
        _plan(waypoints, laps, speed_m_s or config.limits.speed_horizontal_m_s),
    )


def _speed_max_m_s(config: BridgeConfig, traits: Traits) -> float:
    """Return the highest speed that may be asked for; a plane must fly faster than others."""
    return config.speed_max_m_s if traits.hovers else math.inf


def _check_circles(waypoints: tuple[RouteWaypoint, ...], situation: Situation) -> Rejection | None:
    """Say which waypoint a plane cannot circle: too low, or too near to the volume's edge."""
    traits, ground_m = traits_of(situation.profile), situation.ground_enu_m
    radius_m, volume = traits.circle_radius_m, situation.config.volume
    for index, waypoint in enumerate(waypoints):
        height_m = waypoint.position_enu_m[2] - ground_m
        if height_m < traits.height_min_m:
            name = f"Waypoint {index}" if len(waypoints) > 1 else "The target"
            return Rejection(
                OutcomeCode.UNSUPPORTED_VEHICLE,
                f"{name} is {height_m:.1f} m above the ground; a {traits.name} cannot hover and "
                f"circles its targets, so give at least {traits.height_min_m:g} m.",
            )
        away_m, circle_m = horizontal_norm(waypoint.position_enu_m), circle_max_m(radius_m)
        if away_m + circle_m > volume.radius_max_m:
            return Rejection(
                OutcomeCode.OUTSIDE_VOLUME,
                f"Waypoint {index} is {away_m:.0f} m from the map origin and a plane's circle "
                f"reaches {circle_m:.0f} m further, but the flight volume ends at "
                f"{volume.radius_max_m:g} m.",
            )
    return None


def _plane(
    waypoints: tuple[RouteWaypoint, ...],
    laps: int,
    situation: Situation,
    warnings: tuple[str, ...],
) -> Admitted | Rejection:
    """Return what a goal means for a plane, which is sent to places and circles the last."""
    traits, ground_m = traits_of(situation.profile), situation.ground_enu_m
    rejection = _check_circles(waypoints, situation)
    if rejection is not None:
        return rejection
    if any(waypoint.yaw_enu_rad is not None for waypoint in waypoints):
        warnings += (_NO_YAW,)
    if any(waypoint.max_speed_m_s is not None for waypoint in waypoints):
        known = situation.profile.speed_command is not None
        warnings += (_AIRSPEED if known else _NO_SPEED,)
    config = situation.config.goto
    # It turns back only from a safe height, and climbs on to the target's on its way.
    first_m = waypoints[0].position_enu_m[2] - ground_m
    takeoff_m = min(first_m, max(config.takeoff_height_m, traits.takeoff_height_m))
    return Admitted(
        f"circle about the last of {len(waypoints)} waypoints, {laps} x",
        waypoints[-1].position_enu_m,
        lambda _handover: FlyPlane(waypoints, laps, config, traits, takeoff_m),
        warnings,
        _plan(waypoints, laps, _PLANE_M_S),
    )


def _vehicle_led(
    goal: VehicleLedGoal, mode: str | None, situation: Situation
) -> Admitted | Rejection:
    traits = traits_of(situation.profile)
    if mode is None:
        return Rejection(
            OutcomeCode.UNSUPPORTED_VEHICLE,
            f"{situation.profile.name} has no mode for a {goal.name}; docs/autopilots.md says what "
            "each vehicle can do.",
        )
    if not situation.vehicle.state.armed:
        return Rejection(
            OutcomeCode.NOT_FLYING, f"The vehicle is disarmed, so there is no {goal.name} to do."
        )
    if traits.flies and not situation.flies:
        return Rejection(
            OutcomeCode.NOT_FLYING,
            f"The vehicle is on the ground, so there is no {goal.name} to do.",
        )
    config = situation.config.goto
    return Admitted(goal.name, None, lambda _handover: VehicleLed(goal, config, traits))
