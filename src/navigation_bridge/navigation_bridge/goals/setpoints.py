"""Setpoints of the map frame in the autopilot's local frame. No ROS."""

from __future__ import annotations

import math

from mavlink_vehicle.positions import frames
from mavlink_vehicle.vehicle import SetpointNed, Vehicle
from navigation_bridge.vehicle.modes import velocity_only
from navigation_core.geometry import dot
from navigation_core.tasks.intents import Fly, Setpoint


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
