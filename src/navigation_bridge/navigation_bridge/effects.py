"""Effects of a turn on the vehicle: operations, setpoints, the stop at the end. No ROS."""

from __future__ import annotations

import math

from mavlink_vehicle.errors import SetpointError
from mavlink_vehicle.vehicle import SetpointNed, Vehicle
from navigation_bridge.goals.act_commands import commands_of
from navigation_bridge.goals.active_goal import ActiveGoal
from navigation_bridge.goals.goal import LogLevel
from navigation_bridge.goals.operations import STREAMED, begin_operation, begin_upload
from navigation_bridge.reporting import Reporter
from navigation_bridge.supervision.parking import Parking, hold_setpoint_ned
from navigation_bridge.vehicle.map_frame import MapFrame
from navigation_bridge.vehicle.traits import velocity_only
from navigation_core.geometry import dot, norm
from navigation_core.outcomes import OutcomeCode
from navigation_core.tasks.inputs.waypoint_acts import ActOrder
from navigation_core.tasks.intents import Fly, Outcome, Perform

__all__ = ["Effects"]


class Effects:
    """Acts on the vehicle for the active goal."""

    def __init__(
        self, vehicle: Vehicle, map_frame: MapFrame, parking: Parking, report: Reporter
    ) -> None:
        """Prepare; nothing is sent."""
        self._vehicle = vehicle
        self._map_frame = map_frame
        self._parking = parking
        self._report = report
        self._close_when_sent = False

    def perform(self, goal: ActiveGoal, intent: Perform, new: bool, now: float) -> None:
        """Begin an operation that is new, and continue one that is in progress."""
        if new:
            if intent.mission is not None:
                operation_id, mission = begin_upload(
                    self._vehicle, self._map_frame, intent.mission, now
                )
                goal.upload_began(mission)
            else:
                operation_id = begin_operation(self._vehicle, self._map_frame, intent, now)
            goal.operation.began(intent, operation_id)
        if intent.kind in STREAMED:
            self._parking.keep_streaming(now)

    def wait(self, now: float) -> None:
        """Keep a stream of setpoints open while an operation has to wait.

        A PX4 takes the end of the stream for a failure, and would return by itself.
        """
        self._parking.keep_streaming(now)

    def fly(self, goal: ActiveGoal, intent: Fly, now: float) -> Outcome | None:
        """Send a setpoint; return the end of a goal whose setpoint must not be sent."""
        if goal.operation.report is not None:
            self._vehicle.operations.abandon(now)
            goal.operation.dropped()
        try:
            self._close_when_sent = False
            if not self._vehicle.setpoints.is_open:
                self._vehicle.setpoints.open(now)
            self._vehicle.send_setpoint(intended_ned(intent), now)
        except SetpointError as error:
            return Outcome(OutcomeCode.INTERNAL_ERROR, str(error), None)
        goal.times.setpoint_sent(goal.task.may_replan, now)
        return None

    def act(self, goal: ActiveGoal, order: ActOrder | None, now: float) -> None:
        """Ask the vehicle for an act that is new; its answer comes as an event."""
        if order is None or not goal.act.is_new(order):
            return
        goal.act.began(order)
        commands = commands_of(order.act, self._vehicle, self._map_frame)
        self._vehicle.equipment.send(order.number, commands, now)

    def rest(self, goal: ActiveGoal, now: float) -> None:
        """Stop a vehicle that is still under our control, at the end of its goal."""
        vehicle = self._vehicle
        if goal.operation.report is not None:
            vehicle.operations.abandon(now)
        commanded = goal.task.commanded
        moving = commanded is not None and norm(commanded.velocity_enu_m_s) > 0.0
        still = hold_setpoint_ned(vehicle, goal.task.commanded_yaw_enu_rad)
        if (moving or velocity_only(vehicle.profile)) and vehicle.setpoints.is_open:
            # The last setpoint still carries a velocity, which an autopilot would follow
            # for seconds (ArduCopter: GUID_TIMEOUT).
            try:
                vehicle.send_setpoint(still, now)
            except SetpointError as error:
                self._report.log(LogLevel.WARN, f"The hold command could not be sent: {error}")
        if not self._parking.begin(still, now):
            self._close_when_sent = True  # ending now would drop that setpoint

    def leave(self, goal: ActiveGoal, now: float) -> None:
        """Send nothing more to a vehicle that is not under our control any more."""
        if goal.operation.report is not None:
            self._vehicle.operations.abandon(now)
        self._vehicle.setpoints.close()

    def sent(self) -> None:
        """All messages of a turn have been handed out."""
        if self._close_when_sent:
            self._close_when_sent = False
            self._vehicle.setpoints.close()


def intended_ned(intent: Fly) -> SetpointNed:
    """Convert what a task wants to be flown into the autopilot's local frame.

    The map origin is the autopilot's local origin, so only the axes are converted.
    """
    setpoint, rate_rad_s = intent.setpoint, intent.turn_rate_rad_s
    if rate_rad_s is not None:
        nose = (math.cos(setpoint.yaw_enu_rad), math.sin(setpoint.yaw_enu_rad), 0.0)
        forward_m_s = dot(setpoint.velocity_enu_m_s, nose)
        return SetpointNed(drive_frd_m_s=(forward_m_s, 0.0, 0.0), yaw_rate_rad_s=-rate_rad_s)
    if intent.by_velocity:
        return SetpointNed.of_enu(None, setpoint.velocity_enu_m_s, None, setpoint.yaw_enu_rad)
    return SetpointNed.of_enu(
        setpoint.position_enu_m,
        setpoint.velocity_enu_m_s,
        setpoint.acceleration_enu_m_s2,
        setpoint.yaw_enu_rad,
        setpoint.yaw_rate_rad_s,
    )
