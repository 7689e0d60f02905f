"""Whether a goal can be taken now, and what it means in the map frame. No ROS."""

from __future__ import annotations

from drone_navigation.map_frame import MapFrame
from drone_navigation.requests import NavigateRequest, check_request, resolve
from drone_navigation.settings import BridgeConfig
from mavlink_vehicle.vehicle import Vehicle
from navigation_core.outcomes import OutcomeCode
from navigation_core.safety import Rejection
from navigation_core.tasks.goto import GotoGoal


def admit(
    request: NavigateRequest,
    vehicle: Vehicle,
    map_frame: MapFrame,
    config: BridgeConfig,
    active_goal_id: str | None,
    now: float,
) -> GotoGoal | Rejection:
    """Return the target in the map frame, or the first reason against it."""
    rejection = check_request(request) or _check_vehicle(vehicle, map_frame, config, now)
    if rejection is not None:
        return rejection
    if active_goal_id is not None and not config.replace_active_goal:
        return Rejection(
            OutcomeCode.BUSY,
            f"Goal {active_goal_id} is active and on_new_goal is 'reject'; cancel it first.",
        )
    state = vehicle.state
    pose = map_frame.pose(state)
    assert pose is not None  # _check_vehicle saw to it
    return resolve(
        request, pose, map_frame.ground_enu_m(state), config.volume, config.speed_max_m_s
    )


def _check_vehicle(
    vehicle: Vehicle, map_frame: MapFrame, config: BridgeConfig, now: float
) -> Rejection | None:
    state, profile = vehicle.state, vehicle.profile
    if not vehicle.connected or profile is None:
        return Rejection(
            OutcomeCode.NO_VEHICLE,
            "No autopilot is heard on the link; check link_url and that the vehicle is on.",
        )
    if profile.control_mode is None:
        return Rejection(
            OutcomeCode.UNSUPPORTED_VEHICLE,
            f"Goals on this vehicle ({profile.name}) are not supported; docs/autopilots.md lists "
            "those that are.",
        )
    position = state.global_position
    if map_frame.pose(state) is None or position is None:
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
    if not state.armed and not config.goto.may_arm:
        return Rejection(
            OutcomeCode.ARMING_NOT_ALLOWED,
            "The vehicle is disarmed and the parameter arming is 'never'; arm and take off "
            "yourself, or set arming to 'auto'.",
        )
    return None
