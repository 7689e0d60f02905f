"""Operations that a task or a service requests from the vehicle. No ROS."""

from __future__ import annotations

from mavlink_vehicle.vehicle import Vehicle
from navigation_bridge.goals.mission_plan import MissionTracker, plan_items
from navigation_bridge.vehicle.map_frame import MapFrame
from navigation_core.tasks.intents import Perform
from navigation_core.tasks.observation import TaskOperation
from navigation_core.tasks.waypoint import MissionPlan

# Operations during which the stream continues, where the vehicle needs one.
STREAMED = frozenset(
    {
        TaskOperation.TAKE_CONTROL,
        TaskOperation.HOLD,
        TaskOperation.LAND,
        TaskOperation.LAND_ON_TARGET,
        TaskOperation.RETURN,
    }
)


def begin_operation(vehicle: Vehicle, map_frame: MapFrame, intent: Perform, now: float) -> int:
    """Begin an operation; returns its id, which one ``OperationFinished`` carries.

    Setpoints stop for it. Exception: a PX4 gives control only to a sender that streams already, and
    treats the end of the stream as a failure until it is in another mode.
    """
    profile = vehicle.profile
    kind = intent.kind
    needs_stream = profile is not None and profile.setpoints.prestream_s > 0.0
    if not needs_stream or kind not in STREAMED:
        vehicle.setpoints.end()
    elif kind is TaskOperation.TAKE_CONTROL and not vehicle.setpoints.is_open:
        vehicle.setpoints.open(now)
    if kind is TaskOperation.TAKE_OFF and intent.height_m is not None:
        return vehicle.take_off(intent.height_m, now)
    if kind is TaskOperation.REPOSITION and intent.target_enu_m is not None:
        circle_m = None if intent.circle_m is None else -intent.circle_m
        place = map_frame.geodetic(intent.target_enu_m)
        return vehicle.reposition(*place, now, circle_m, intent.keeps_mode)
    pose = map_frame.pose(vehicle.state)
    if kind is TaskOperation.HOLD and _circles_elsewhere(vehicle) and pose is not None:
        return vehicle.reposition(*map_frame.geodetic(pose.position_enu_m), now)
    if kind is TaskOperation.CHANGE_SPEED and intent.speed_m_s is not None:
        return vehicle.change_speed(intent.speed_m_s, now)
    simple = {
        TaskOperation.TAKE_CONTROL: vehicle.take_control,
        TaskOperation.ARM: vehicle.arm,
        TaskOperation.DISARM: vehicle.disarm,
        TaskOperation.HOLD: vehicle.hold,
        TaskOperation.LAND: vehicle.land,
        TaskOperation.LAND_ON_TARGET: vehicle.land_on_target,
        TaskOperation.RETURN: vehicle.return_to_launch,
        TaskOperation.START_MISSION: vehicle.missions.start,
        TaskOperation.CLEAR_MISSION: vehicle.missions.clear,
    }
    return simple[kind](now)


def begin_upload(
    vehicle: Vehicle, map_frame: MapFrame, plan: MissionPlan, now: float
) -> tuple[int, MissionTracker]:
    """Begin to store a mission; returns the operation's id and the mission's tracker.

    Raises:
        ValueError: this vehicle flies no missions.
    """
    profile = vehicle.profile
    rules = None if profile is None else profile.missions
    if profile is None or rules is None:
        raise ValueError("This vehicle flies no missions.")
    vehicle.setpoints.end()
    items = plan_items(plan, profile, rules, map_frame, vehicle.state)
    operation_id = vehicle.missions.upload([planned.item for planned in items], now)
    return operation_id, MissionTracker(items, rules)


def _circles_elsewhere(vehicle: Vehicle) -> bool:
    """Whether it holds in the mode in which it flies to a target, and would continue to that.

    True for a PX4 plane: selecting AUTO.LOITER again has no effect.
    """
    profile = vehicle.profile
    if profile is None or not profile.reposition or not vehicle.in_control_mode:
        return False
    return profile.hold_mode == profile.control_mode
