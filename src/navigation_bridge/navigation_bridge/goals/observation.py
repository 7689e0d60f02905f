"""Observation of the vehicle for a task, made from its MAVLink state. No ROS."""

from __future__ import annotations

import math

from mavlink_vehicle.events import LandedState
from mavlink_vehicle.positions import frames
from mavlink_vehicle.profiles import Profile, SetpointField
from mavlink_vehicle.vehicle import SetpointNed, Vehicle
from navigation_bridge.goals.mission_plan import MissionTracker
from navigation_bridge.obstacles.obstacle_feed import ObstacleFeed
from navigation_bridge.vehicle.map_frame import MapFrame
from navigation_bridge.vehicle.traits import drives
from navigation_core.geometry import dot
from navigation_core.tasks.intents import Fly, Setpoint
from navigation_core.tasks.observation import (
    Observation,
    OperationReport,
    TaskOperation,
    VehicleMode,
)
from navigation_core.tasks.velocity_command import VelocityCommand
from navigation_core.traffic.view import TrafficView

_AIRBORNE: dict[LandedState, bool | None] = {
    LandedState.UNDEFINED: None,
    LandedState.ON_GROUND: False,
    LandedState.TAKEOFF: True,
    LandedState.IN_AIR: True,
    LandedState.LANDING: True,
}
_LEADING = frozenset({VehicleMode.LAND, VehicleMode.RETURN, VehicleMode.MISSION})
_LEADS_TO = frozenset({TaskOperation.LAND, TaskOperation.RETURN, TaskOperation.START_MISSION})


def vehicle_mode(profile: Profile | None, name: str) -> VehicleMode:
    """Classify a mode by the autopilot's own name."""
    if profile is None or not name:
        return VehicleMode.OTHER
    for mode, known in (
        (VehicleMode.CONTROL, profile.control_mode),
        (VehicleMode.HOLD, profile.hold_mode),
        (VehicleMode.LAND, profile.land_mode),
        (VehicleMode.RETURN, profile.return_mode),
        (VehicleMode.MISSION, profile.mission_mode),
        (VehicleMode.TAKE_OFF, profile.takeoff.mode),
    ):
        if name == known:
            return mode
    return VehicleMode.OTHER


def moves_by_itself(vehicle: Vehicle, operation: OperationReport | None) -> bool:
    """Whether the vehicle is in a mode that leads it, or was asked to be."""
    mode = vehicle_mode(vehicle.profile, vehicle.mode_name)
    return mode in _LEADING or (operation is not None and operation.kind in _LEADS_TO)


def velocity_only(profile: Profile | None) -> bool:
    """True if the vehicle receives velocities only and keeps moving with the last one."""
    return profile is not None and profile.setpoints.form is SetpointField.VELOCITY


def observe(
    vehicle: Vehicle,
    map_frame: MapFrame,
    obstacles: ObstacleFeed,
    operation: OperationReport | None,
    now: float,
    mission: MissionTracker | None = None,
    late_s: float = 0.0,
    position_doubt: str = "",
    command: VelocityCommand | None = None,
    traffic: TrafficView | None = None,
) -> Observation:
    """Build the observation of this moment."""
    state = vehicle.state
    pose = map_frame.pose(state)
    ground_enu_m = map_frame.ground_enu_m(state)
    velocity = position = None
    age_s = math.inf
    on_ground = drives(vehicle.profile)
    if state.global_position is not None and pose is not None:
        velocity = frames.ned_to_enu(state.global_position.velocity_ned_m_s)
        position = pose.position_enu_m
        if on_ground:
            # Its height is that of the ground, whatever the GPS reports.
            position = (position[0], position[1], ground_enu_m)
            velocity = (velocity[0], velocity[1], 0.0)
        age_s = max(
            now - state.global_position.time_s,
            vehicle.sample_age_s(state.global_position.time_boot_ms, now) or 0.0,
        )
    return Observation(
        time_s=now,
        position_enu_m=position,
        velocity_enu_m_s=velocity,
        yaw_enu_rad=None if pose is None else pose.yaw_enu_rad,
        armed=state.armed,
        in_control=vehicle.in_control_mode,
        airborne=_AIRBORNE[state.landed_state],
        ground_enu_m=ground_enu_m,
        position_age_s=age_s,
        connected=vehicle.connected,
        operation=operation,
        mode=vehicle_mode(vehicle.profile, vehicle.mode_name),
        home_enu_m=map_frame.home_enu_m(state),
        landing=state.landed_state is LandedState.LANDING,
        mission=None if mission is None else mission.report(state, vehicle.mission_change),
        obstacles=obstacles.obstacles,
        obstacles_seen=obstacles.seen if on_ground else None,
        obstacles_age_s=obstacles.age_s(now),
        obstacles_reach_m=obstacles.reach_m,
        moving=obstacles.moving,
        late_s=late_s,
        position_doubt=position_doubt,
        fence=obstacles.standing.fence,
        command=command,
        traffic=traffic,
    )


def intended_ned(intent: Fly) -> SetpointNed:
    """Convert what a task wants to be flown into the autopilot's frames."""
    setpoint, rate_rad_s = intent.setpoint, intent.turn_rate_rad_s
    if rate_rad_s is None:
        return setpoint_ned(setpoint, intent.by_velocity)
    nose = (math.cos(setpoint.yaw_enu_rad), math.sin(setpoint.yaw_enu_rad), 0.0)
    forward_m_s = dot(setpoint.velocity_enu_m_s, nose)
    # Seen from above, a positive rate is counter-clockwise in ENU and clockwise in NED.
    return SetpointNed(drive_frd_m_s=(forward_m_s, 0.0, 0.0), yaw_rate_rad_s=-rate_rad_s)


def setpoint_ned(setpoint: Setpoint, by_velocity: bool = False) -> SetpointNed:
    """Convert a setpoint of the map frame into the autopilot's local frame.

    The map origin is the autopilot's local origin, so only the axes are converted. ``by_velocity``
    leaves out the position.
    """
    if by_velocity:
        return SetpointNed(
            velocity_ned_m_s=frames.enu_to_ned(setpoint.velocity_enu_m_s),
            yaw_ned_rad=frames.yaw_enu_to_ned(setpoint.yaw_enu_rad),
        )
    return SetpointNed(
        position_ned_m=frames.enu_to_ned(setpoint.position_enu_m),
        velocity_ned_m_s=frames.enu_to_ned(setpoint.velocity_enu_m_s),
        acceleration_ned_m_s2=frames.enu_to_ned(setpoint.acceleration_enu_m_s2),
        yaw_ned_rad=frames.yaw_enu_to_ned(setpoint.yaw_enu_rad),
        yaw_rate_rad_s=None,
    )


# Slow enough to count as standing, but with a direction.
_NEXT_TO_NOTHING_M_S = 0.001


def hold_setpoint_ned(vehicle: Vehicle, yaw_enu_rad: float | None) -> SetpointNed:
    """Return the setpoint that stops a vehicle wherever it is: zero velocity.

    A rover or boat gets a tiny velocity along its nose instead. ArduRover and PX4's rovers take the
    direction of a zero velocity as north, and steer there while they brake (observed: turns of 88
    and 100 degrees from 3 m/s).
    """
    velocity, attitude = (0.0, 0.0, 0.0), vehicle.state.attitude
    if velocity_only(vehicle.profile) and attitude is not None:
        yaw = attitude.yaw_ned_rad
        north, east = _NEXT_TO_NOTHING_M_S * math.cos(yaw), _NEXT_TO_NOTHING_M_S * math.sin(yaw)
        velocity = (north, east, 0.0)
    return SetpointNed(
        position_ned_m=None,
        velocity_ned_m_s=velocity,
        acceleration_ned_m_s2=None,
        yaw_ned_rad=None if yaw_enu_rad is None else frames.yaw_enu_to_ned(yaw_enu_rad),
        yaw_rate_rad_s=None,
    )
