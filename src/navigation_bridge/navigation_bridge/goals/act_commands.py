"""Acts of a task as commands for the vehicle. No ROS."""

from __future__ import annotations

import math

from mavlink_vehicle.positions import frames
from mavlink_vehicle.profiles import GENERIC
from mavlink_vehicle.profiles.equipment import EquipmentCommand, EquipmentRules
from mavlink_vehicle.vehicle import Vehicle
from navigation_bridge.vehicle.map_frame import MapFrame
from navigation_core.tasks.inputs.waypoint_acts import (
    PointAngle,
    PointNeutral,
    PointPosition,
    SetServo,
    TakePhoto,
    TriggerDistance,
    UseGripper,
    VehicleAct,
    WaitHere,
)

__all__ = ["commands_of", "stored_commands_of"]


def commands_of(
    act: VehicleAct, vehicle: Vehicle, map_frame: MapFrame
) -> tuple[EquipmentCommand, ...]:
    """Return the commands of an act, of which the last one's answer counts.

    Args:
        act: the act.
        vehicle: the vehicle that is to do it.
        map_frame: converts positions.
    """
    rules, address = (vehicle.profile or GENERIC).equipment, vehicle.address
    if isinstance(act, TakePhoto):
        return (rules.photo(vehicle.equipment.count_photo()),)
    commands = _commands(act, rules, map_frame, stored=False)
    if isinstance(act, PointAngle | PointPosition | PointNeutral):
        control = rules.control_gimbal(address.source_system, address.source_component)
        return (control, *commands)
    return commands


def stored_commands_of(
    act: VehicleAct | WaitHere, rules: EquipmentRules, map_frame: MapFrame
) -> tuple[EquipmentCommand, ...]:
    """Return the commands of an act in a mission, where the vehicle itself gives them."""
    if isinstance(act, WaitHere):
        return (rules.wait(act.time_s),)
    commands = _commands(act, rules, map_frame, stored=True)
    if rules.controlled_missions and isinstance(act, PointAngle | PointNeutral):
        return (rules.control_by_mission(), *commands)
    return commands


def _commands(
    act: VehicleAct, rules: EquipmentRules, map_frame: MapFrame, *, stored: bool
) -> tuple[EquipmentCommand, ...]:
    if isinstance(act, TakePhoto):
        return (rules.photo(),)
    if isinstance(act, TriggerDistance):
        return (rules.trigger_distance(act.distance_m),)
    if isinstance(act, PointPosition):
        return (rules.point_position(map_frame.geodetic(act.position_enu_m)),)
    if isinstance(act, PointNeutral):
        return (rules.end_position(), rules.point_neutral(stored=stored))
    if isinstance(act, UseGripper):
        return (rules.gripper(grabs=act.grabs),)
    if isinstance(act, SetServo):
        return (rules.servo(act.channel, act.pulse_us),)
    return (_point_angle(act, rules, stored=stored),)


def _point_angle(act: PointAngle, rules: EquipmentRules, *, stored: bool) -> EquipmentCommand:
    yaw_rad = frames.yaw_enu_to_ned(act.yaw_rad) if act.yaw_locked else -act.yaw_rad
    yaw_deg = math.degrees(math.remainder(yaw_rad, math.tau))
    pitch_deg = math.degrees(act.pitch_rad)
    return rules.point_angle(pitch_deg, yaw_deg, locked=act.yaw_locked, stored=stored)
