"""Effect of the vehicle's events on the active goal and on what is under way beside it. No ROS."""

from __future__ import annotations

from dataclasses import replace

from mavlink_vehicle.events import (
    EquipmentAnswered,
    ModeChanged,
    ModeOvertaken,
    OperationFinished,
    OperationResult,
    StationActed,
    VehicleEvent,
    VehicleRebooted,
)
from mavlink_vehicle.ranges import RangesMeasured
from navigation_bridge import notes
from navigation_bridge.clients.service_requests import ServiceRequests
from navigation_bridge.engine import Engine, Parts
from navigation_bridge.goals.goal import LogLevel
from navigation_bridge.obstacles.obstacle_feed import ObstacleFeed
from navigation_bridge.supervision.station_rules import takes_vehicle
from navigation_bridge.vehicle.traits import vehicle_mode
from navigation_core.outcomes import OutcomeCode
from navigation_core.safety.late_setpoints import TOO_LATE_S
from navigation_core.tasks.observation import OperationStatus

__all__ = ["VehicleEvents"]

# MAV_STATE (common.xml) of a restarted autopilot: BOOT, and CALIBRATING, which an ArduPilot reports
# before it is ready.
_STARTING = (1, 2)


class VehicleEvents:
    """Hands the vehicle's events to those whom they concern."""

    def __init__(
        self,
        engine: Engine,
        parts: Parts,
        obstacles: ObstacleFeed,
        service_requests: ServiceRequests,
    ) -> None:
        """Hand them to these."""
        self._engine = engine
        self._parts = parts
        self._report = parts.report
        self._vehicle = parts.vehicle
        self._obstacles = obstacles
        self._service_requests = service_requests

    def handle(self, first: VehicleEvent, now: float) -> None:
        """Process all events that have come, the first of which has been taken."""
        events = [first]
        while (event := self._vehicle.next_event()) is not None:
            events.append(event)
        if len(events) > 1:
            # A restart also appears as a mode change and a disarming, so it is checked first.
            events.sort(key=lambda event: not isinstance(event, VehicleRebooted))
        for event in events:
            self._take(event, now)

    def _take(self, event: VehicleEvent, now: float) -> None:
        if isinstance(event, OperationFinished):
            self._finish_operation(event, now)
        elif isinstance(event, RangesMeasured):
            self._obstacles.take_ranges(event, now)
        elif isinstance(event, ModeOvertaken):
            self._restore_mode(event, now)
        elif isinstance(event, ModeChanged):
            self._change_mode(event, now)
        elif isinstance(event, StationActed):
            self._take_act(event, now)
        elif isinstance(event, EquipmentAnswered) and event.number > 0:
            self._answer_act(event)
        elif isinstance(event, VehicleRebooted):
            self._report.log(LogLevel.WARN, "The autopilot restarted")
            self._parts.features.lose_vehicle()
            self._give_up_restarted(now)
        elif not self._parts.features.take(event):
            self._report.vehicle(event)

    def _take_act(self, acted: StationActed, now: float) -> None:
        if takes_vehicle(acted):
            self._parts.features.give_vehicle_away()
        on_pause = self._engine.config.on_station_pause
        self._parts.stations.take(acted, self._engine.goal, on_pause, now)

    def _answer_act(self, event: EquipmentAnswered) -> None:
        goal, failure = self._engine.goal, event.failure
        order = None if goal is None else goal.act.ended(event.number, failure)
        if goal is None or order is None:
            return
        name = order.act.name
        text = f"Act {name} was not done: {failure}." if failure else f"Act {name} done."
        level = LogLevel.WARN if failure else LogLevel.INFO
        self._report.log(level, f"Goal {goal.short_id}: {text}")
        self._report.remark(goal, text)

    def _finish_operation(self, event: OperationFinished, now: float) -> None:
        self._report.operation(event)
        goal = self._engine.goal
        restored = self._parts.overtaken.finish(event)
        if restored is not None:
            if goal is not None and goal.takeover is not None:
                is_restored = event.result is OperationResult.ACHIEVED
                goal.taken(replace(goal.takeover, overtaken=restored, restored=is_restored))
            return
        parked, served = self._parts.parking.finish(event), self._service_requests.finish(event)
        if parked or served:
            return
        if goal is None or not goal.operation.is_pending(event.operation_id):
            return
        status = OperationStatus[event.result.name]
        late = self._parts.lateness.recent_s(now) >= TOO_LATE_S
        if status is OperationStatus.TIMED_OUT and late:
            status = OperationStatus.LATE
        goal.operation_ended(status, event.reason, now)
        if event.result is not OperationResult.ACHIEVED:
            self._report.log(LogLevel.WARN, event.reason)

    def _change_mode(self, event: ModeChanged, now: float) -> None:
        self._report.note(notes.text(f"mode {event.name}"))
        self._report.log(LogLevel.INFO, f"Vehicle mode: {event.name}")
        self._parts.stations.leave_mode()
        if event.requested:
            return
        goal = self._engine.goal
        mode = vehicle_mode(self._vehicle.profile, event.name)
        if goal is None or not goal.task.accepts_mode(mode):
            self._parts.features.lose_vehicle()
        if self._parts.stations.change_mode(event, goal, now):
            return
        if goal is not None and goal.task.accepts_mode(mode):
            return
        if self._vehicle.state.system_status in _STARTING:
            self._give_up_restarted(now)
        elif goal is not None and goal.takeover is None:
            mode_number = self._vehicle.state.custom_mode
            self._parts.stations.take_away(goal, event.name, now, mode_number)

    def _restore_mode(self, event: ModeOvertaken, now: float) -> None:
        """Give the vehicle back to the one whose chosen mode our request has overtaken."""
        goal = self._engine.goal
        if goal is not None and goal.takeover is None and not goal.paused_by:
            self._parts.stations.take_away(goal, event.chosen_name, now)
        self._parts.features.lose_vehicle()
        self._parts.parking.give_up()
        self._vehicle.setpoints.close()
        self._parts.overtaken.restore(event, now)

    def _give_up_restarted(self, now: float) -> None:
        text = "The autopilot restarted while the goal was active; check the vehicle."
        self._engine.abandon(OutcomeCode.VEHICLE_REBOOTED, text, now)
