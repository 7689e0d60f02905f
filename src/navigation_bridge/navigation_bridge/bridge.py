"""Composition of task and vehicle: goals in, MAVLink out, feedback back. No ROS.

The bridge owns at most one goal. Its task decides what should happen
(:mod:`navigation_core.tasks`), and the vehicle does it (:mod:`mavlink_vehicle.vehicle`). The bridge
monitors both: it ends the goal when the pilot takes over, the link is lost, the autopilot restarts
or a failsafe takes control. It does no I/O and reads no clock; the driver thread calls it with
``now`` and collects :meth:`Bridge.messages_to_send` and :meth:`Bridge.next_output`.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import Any

from mavlink_vehicle.codec import Intake, Message, mavlink, with_source
from mavlink_vehicle.errors import SetpointError
from mavlink_vehicle.events import (
    ModeChanged,
    ModeOvertaken,
    OperationFinished,
    OperationResult,
    StationActed,
    VehicleEvent,
    VehicleRebooted,
)
from mavlink_vehicle.positions.projections import Geodetic
from mavlink_vehicle.protocols.streams.external_position import ExternalPose, ExternalPositionError
from mavlink_vehicle.protocols.streams.rtcm import RtcmError
from mavlink_vehicle.ranges import RangesMeasured
from mavlink_vehicle.state.vehicle_state import VehicleState
from mavlink_vehicle.vehicle import Vehicle
from navigation_bridge import notes
from navigation_bridge.configuration.settings import BridgeConfig, TrafficConflict
from navigation_bridge.goals.admitted import Admitted
from navigation_bridge.goals.goal import ActiveGoal, LogLevel, Output
from navigation_bridge.goals.lifecycle import GoalEvent
from navigation_bridge.goals.operations import STREAMED, begin_operation, begin_upload
from navigation_bridge.goals.requests import NavigateRequest, Request, VelocityRequest
from navigation_bridge.goals.setpoints import hold_setpoint_ned, intended_ned
from navigation_bridge.goals.velocity_commands import VelocityCommands
from navigation_bridge.log_desk import LogDesk
from navigation_bridge.obstacles.obstacle_feed import ObstacleFeed
from navigation_bridge.reporting import Reporter
from navigation_bridge.scene import Scene
from navigation_bridge.services import Service, ServiceDesk
from navigation_bridge.snapshot import Observer, Snapshot
from navigation_bridge.storage.desk import StorageDesk
from navigation_bridge.supervision.guard import Guard
from navigation_bridge.supervision.overtaken_mode import OvertakenMode
from navigation_bridge.supervision.parking import Parking
from navigation_bridge.supervision.position_watch import PositionWatch
from navigation_bridge.supervision.station_rules import takes_vehicle
from navigation_bridge.supervision.stations import Stations
from navigation_bridge.tasks.admission import admit
from navigation_bridge.tasks.registry import TASKS, task_of
from navigation_bridge.tasks.task_kind import TaskKind
from navigation_bridge.traffic.conduct import TrafficConduct
from navigation_bridge.traffic.shared_traffic import SharedTraffic
from navigation_bridge.vehicle.map_frame import MapFrame, MapPose, still_has_pose
from navigation_bridge.vehicle.modes import vehicle_mode, velocity_only
from navigation_bridge.vehicle.takeover import Takeover
from navigation_core.geometry import Vector3, norm
from navigation_core.outcomes import OutcomeCode
from navigation_core.safety.lateness import TOO_LATE_S, Lateness
from navigation_core.safety.target_checks import Rejection
from navigation_core.searches import AT_ONCE, Searcher
from navigation_core.tasks.intents import Fly, Handover, Outcome, Perform
from navigation_core.tasks.observation import (
    OperationReport,
    OperationStatus,
    TaskOperation,
    VehicleMode,
)
from navigation_core.tasks.progress import Progress, Status
from navigation_core.tasks.velocity_command import VelocityCommand

__all__ = ["Bridge", "BridgeConfig"]

# MAV_STATE (common.xml) of a restarted autopilot: BOOT, and CALIBRATING, which an ArduPilot reports
# before it is ready.
_STARTING = (1, 2)
_GLOBAL_POSITION = mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT
_LOCAL_POSITION = mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED
# Within this time of a mode change either an answer comes, or the link is found to be one way.
_ANSWERS_S = 2.0
_PARAMETERS_MAX = 100
_PARAMETER = re.compile("[A-Z0-9_]{1,16}")
# Minimum interval of warnings about a late loop.
_LATE_TOLD_S = 2.0
# Beyond what a fast vehicle moves between the two.
_EXTERNAL_OFF_M = 3.0
# The ends that a vehicle that was slowed down or not listened to may come to.
_BY_LATENESS = frozenset({OutcomeCode.NO_POSITION, OutcomeCode.TIMEOUT})
# Modes in which a vehicle moves without setpoints, and operations that lead to one.
_LEADING = frozenset({VehicleMode.LAND, VehicleMode.RETURN, VehicleMode.MISSION})
_LEADS_TO = frozenset({TaskOperation.LAND, TaskOperation.RETURN, TaskOperation.START_MISSION})
_OF_ONE_MISSION = frozenset(
    {TaskOperation.UPLOAD_MISSION, TaskOperation.START_MISSION, TaskOperation.CLEAR_MISSION}
)


class Bridge:
    """Executes one goal at a time on one vehicle.

    Attributes:
        recorded_goal_id: in a replay, the goal of the server that was recorded, or None.
    """

    def __init__(
        self,
        vehicle: Vehicle,
        config: BridgeConfig,
        searcher: Searcher = AT_ONCE,
        tasks: Sequence[TaskKind[Any]] = TASKS,
        traffic: SharedTraffic | None = None,
        name: str = "",
    ) -> None:
        """Assemble the parts; nothing happens before :meth:`start`.

        Args:
            vehicle: the vehicle.
            config: settings for goals.
            searcher: runs the path searches.
            tasks: what goals may ask for.
            traffic: shared with the other vehicles of the server; None: there are none.
            name: of the vehicle among them.
        """
        self._shared_traffic = traffic
        self._name = name
        self._tasks = tasks
        self._refusal: Rejection | None = None
        self._searcher = searcher
        self._compose(vehicle, config)

    def _compose(self, vehicle: Vehicle, config: BridgeConfig) -> None:
        self._vehicle = vehicle
        self._config = config
        self._map_frame = MapFrame()
        self._obstacles = ObstacleFeed(vehicle, self._map_frame, config.obstacles)
        self._report = Reporter(vehicle, self._map_frame)
        self._guard = Guard(config, self._obstacles.standing)
        self._observer = Observer(vehicle, self._map_frame, self._obstacles, config, self._searcher)
        self._traffic = TrafficConduct(
            vehicle,
            self._map_frame,
            config,
            self._searcher,
            self._shared_traffic,
            self._name,
            self._observer.look,
        )
        self._positions = PositionWatch(self._report, config.safety.position_doubt_timeout_s)
        self._goal: ActiveGoal | None = None
        self._commands = VelocityCommands()
        self._lateness = Lateness()
        self._late_told_s = -math.inf
        self._data_time_ms: int | None = None
        self._data_age_s: float | None = None
        self.recorded_goal_id: str | None = None
        self._close_when_sent = False
        self._parking = Parking(vehicle, config.setpoint_period_s)
        self._overtaken = OvertakenMode(vehicle, self._report)
        self._scene = Scene(vehicle, self._map_frame, config)
        self._desk = ServiceDesk(vehicle, self._map_frame, self._report)
        self._storage = StorageDesk(vehicle, self._map_frame, self._report, self._occupied)
        self._stations = Stations(vehicle, self._report, self._parking)
        self._logs = LogDesk(vehicle, self._report.put_out, self._log_refusal)

    @property
    def active_goal_id(self) -> str | None:
        """UUID of the active goal, live or in the recording, as hexadecimal digits."""
        return self.recorded_goal_id if self._goal is None else self._goal.goal_id

    @property
    def command_timeout_s(self) -> float:
        """Age from which a velocity command counts no more."""
        return self._config.commands.timeout_s

    @property
    def is_idle(self) -> bool:
        """True without an active goal, those that commands have started included."""
        return self._goal is None

    @property
    def is_parking(self) -> bool:
        """True while the vehicle of a goal that has ended is being switched to its hold mode."""
        return self._parking.operation_id is not None

    @property
    def vehicle(self) -> Vehicle:
        """The vehicle; read only."""
        return self._vehicle

    @property
    def pose(self) -> MapPose | None:
        """The vehicle's pose in the map frame, or None."""
        return self._map_frame.pose(self._vehicle.state)

    @property
    def has_pose(self) -> bool:
        """Whether there is a `pose`."""
        return self._map_frame.has_pose(self._vehicle.state)

    @property
    def lateness(self) -> Lateness:
        """Lateness of the setpoints; read only."""
        return self._lateness

    @property
    def data_age_s(self) -> float | None:
        """Age of the vehicle's data when it was last read in a goal; None while unknown."""
        return self._data_age_s

    @property
    def map_origin(self) -> Geodetic | None:
        """Latitude, longitude and altitude (above mean sea level) of the map's origin, or None."""
        return self._map_frame.origin

    def to_map(self, place: Geodetic) -> Vector3 | None:
        """Return a place in the map frame; None while its origin is unknown."""
        return None if self._map_frame.frame is None else self._map_frame.enu(place)

    @property
    def home_enu_m(self) -> Vector3 | None:
        """The launch point in the map frame, or None."""
        return self._map_frame.home_enu_m(self._vehicle.state)

    @property
    def height_m(self) -> float | None:
        """The vehicle's height above the ground, or None."""
        return self._report.height_m

    @property
    def obstacles(self) -> ObstacleFeed:
        """Obstacles; accepts readings of ROS sensors."""
        return self._obstacles

    @property
    def logs(self) -> LogDesk:
        """The autopilot's own logs; takes requests."""
        return self._logs

    @property
    def scene(self) -> Scene:
        """Fence, flight volume, mission and rally points in the map frame."""
        return self._scene

    @property
    def storage(self) -> StorageDesk:
        """Requests about fence, rally points and parameters of the autopilot."""
        return self._storage

    @property
    def battery_for_return(self) -> float:
        """Share of the battery that a return from here takes; NaN if unknown."""
        # Of the snapshot only the position counts, not how old it is.
        return self._guard.battery_for_return(self._observer.look(0.0))

    @property
    def battery_reserve(self) -> float:
        """Share of the battery that should remain after the return."""
        return self._config.safety.battery_reserve

    def begin_again(self) -> None:
        """Reset to the state before :meth:`start`, to replay a recording again."""
        self._compose(Vehicle(self._vehicle.config), self._config)

    def refuse(self, refusal: Rejection) -> None:
        """Reject all goals and services from now on: there is no vehicle to execute them."""
        self._refusal = refusal

    # --- requests from clients -------------------------------------------------------

    def check(self, request: Request, now: float) -> Rejection | None:
        """Return whether a goal would be accepted now; a rejection is also logged."""
        result = self._admit(request, now)
        if not isinstance(result, Rejection):
            return None
        self._report.rejected(result)
        return result

    def reject(self, rejection: Rejection) -> None:
        """Report a goal that was rejected before it reached the bridge."""
        self._report.rejected(rejection)

    def start_goal(self, goal_id: str, request: Request, now: float) -> None:
        """Begin an accepted goal; it replaces the active one.

        A condition that has failed since :meth:`check` ends the goal at once, with the same code.
        """
        action = task_of(request, self._tasks).action
        admitted = self._admit(request, now)
        if isinstance(admitted, Rejection):
            self._report.stillborn(goal_id, action, admitted)
            return
        previous = self._goal
        self._logs.give_way("A goal was started.")
        goal = self._goal = self._new_goal(goal_id, admitted, now)
        self._desk.give_up("A new goal was started.", now)
        if previous is not None:
            replaced = Outcome(OutcomeCode.PREEMPTED, f"Replaced by goal {goal_id}.", None)
            self._report.ended(previous, replaced, now)
        goal.apply(GoalEvent.EXECUTE)
        goal.kind = action
        goal.follows_commands = isinstance(request, VelocityRequest)
        self._commands.goal_began()
        self._positions.begin(goal)
        self._report.accepted(goal)
        if goal.plan is not None:
            self._stations.free(now)
        goal.task.start(self._look(goal, now), now)

    def cancel_goal(self, goal_id: str, now: float, action: str = "") -> bool:
        """Cancel a goal; True if it is active and will end.

        Args:
            goal_id: UUID of the goal as hexadecimal digits.
            now: time in seconds.
            action: name of its action, within which the id is unique; empty for any.
        """
        goal = self._goal
        if goal is None or goal.goal_id != goal_id or action not in ("", goal.kind):
            return False
        if goal.cancel_requested_s is None:
            goal.begin_cancel(now)
            self._report.log(LogLevel.INFO, f"Goal {goal.short_id}: cancel requested")
        return True

    def command_velocity(self, command: VelocityCommand, goal_id: str, now: float) -> None:
        """Process a velocity command of a client.

        It is followed by a goal that follows commands; without a goal it may start one.

        Args:
            command: the command; its numbers need not be finite.
            goal_id: UUID of the goal that it starts, if it does.
            now: time in seconds.
        """
        fault = self._commands.take(command, self._config.commands.timeout_s)
        if fault:
            self._ignored(f"A velocity command cannot be used: {fault}", now)
            return
        goal = self._goal
        if goal is not None and goal.follows_commands:
            return
        active = "" if goal is None else f"goal {goal.short_id} ({goal.kind})"
        may_start = self._config.commands.start_goal
        starts, why = self._commands.starts_goal(active, self._vehicle.in_control_mode, may_start)
        if why:
            self._ignored(f"Velocity commands are ignored: {why}.", now)
        request = VelocityRequest()
        if starts and self.check(request, now) is None:
            self.start_goal(goal_id, request, now)

    def reject_command(self, fault: str, now: float) -> None:
        """Process a velocity command that cannot be used; the vehicle stops.

        Args:
            fault: why, as a sentence.
            now: time in seconds.
        """
        self._commands.drop()
        self._ignored(f"A velocity command cannot be used: {fault}", now)

    def _ignored(self, text: str, now: float) -> None:
        if self._commands.is_to_tell(now):
            self._report.log(LogLevel.WARN, text)

    def pause(self, now: float) -> tuple[bool, str]:
        """Pause the active goal until :meth:`resume`; return success and a sentence."""
        goal, why_not = self._pausable_goal()
        if goal is None:
            return False, why_not
        rejection = goal.task.pause(now)
        if rejection is not None:
            return False, rejection.message
        goal.paused_by_client = True
        goal.next_step_s = min(goal.next_step_s, now)
        self._report.log(LogLevel.INFO, f"Goal {goal.short_id}: paused")
        return True, f"Goal {goal.goal_id} is paused."

    def resume(self, now: float) -> tuple[bool, str]:
        """Resume a paused goal; return success and a sentence."""
        goal, why_not = self._pausable_goal()
        if goal is None:
            return False, why_not
        goal.paused_by_client = False
        if goal.paused_by:
            # The person who stopped the vehicle may be standing beside it.
            text = f"{goal.paused_by} Only a ground station can resume the goal, or cancel it here."
            return False, text
        goal.task.unpause(now)
        goal.next_step_s = min(goal.next_step_s, now)
        self._report.log(LogLevel.INFO, f"Goal {goal.short_id}: resumed")
        return True, f"Goal {goal.goal_id} is resumed."

    def _pausable_goal(self) -> tuple[ActiveGoal | None, str]:
        """Return the active goal unless it is being cancelled; else None and why."""
        goal = self._goal
        if goal is None:
            return None, "No goal is active."
        if goal.cancel_requested_s is not None:
            return None, f"Goal {goal.goal_id} is being cancelled."
        return goal, ""

    def serve(self, number: int, service: Service, now: float, mode: str = "") -> None:
        """Execute a service request; a ``ServiceDone`` with its number is the response.

        Args:
            number: number of the request.
            service: the service.
            now: time in seconds.
            mode: for SET_MODE, the firmware's name of the mode.
        """
        if self._refusal is not None:
            self._report.served(number, False, self._refusal.message)
            return
        goal = self._goal
        text = self._occupied()
        if text is not None and service is not Service.HOLD:
            self._report.served(number, False, text)
            return
        if service is Service.ARM and not self._config.goto.may_leave_ground:
            text = (
                "Parameter arming is 'never'; arm it yourself, or set arming to 'pilot' or 'auto'."
            )
            self._report.served(number, False, text)
            return
        self._logs.give_way(f"The {service.value} service was called.")
        if goal is not None:
            text = "The hold service was called."
            self._end(goal, Outcome(OutcomeCode.PREEMPTED, text, None), now)
        if service is Service.HOLD and self._parking.operation_id is not None:
            self._desk.wait_for(number, self._parking.operation_id)
        else:
            self._parking.give_up()
            self._desk.begin(number, service, now, mode)

    def _occupied(self) -> str | None:
        """Return why the vehicle is left alone, a sentence, or None."""
        if self._refusal is not None:
            return self._refusal.message
        goal = self._goal
        return None if goal is None else f"Goal {goal.goal_id} is active; cancel it first."

    def read_parameters(self, names: Sequence[str], now: float) -> list[float]:
        """Return parameters of the vehicle; those not known yet are NaN, and are asked for.

        Raises:
            ValueError: a name that no parameter can have, or too many of them.
        """
        if len(names) > _PARAMETERS_MAX or not all(map(_PARAMETER.fullmatch, names)):
            raise ValueError(f"Give at most {_PARAMETERS_MAX} names such as WPNAV_SPEED.")
        values = self._vehicle.read_parameters(names, now)
        return [math.nan if value is None else value for value in values]

    def correct_gps(self, data: bytes, now: float) -> None:
        """Send RTCM corrections to the vehicle.

        Args:
            data: whole RTCM 3 messages, one after the other.
            now: time in seconds.

        Raises:
            RtcmError: they are not sent, and why.
        """
        if self._refusal is not None:
            raise RtcmError(self._refusal.message)
        if not self._vehicle.connected:
            raise RtcmError("There is no connection to a vehicle.")
        self._vehicle.rtcm.offer(data, now)

    def take_external_pose(self, pose: ExternalPose, now: float) -> None:
        """Send a pose from outside, such as a camera's, to the autopilot's estimator.

        Args:
            pose: of the vehicle, in the local frame.
            now: time in seconds.

        Raises:
            ExternalPositionError: it is not sent, and why.
        """
        if self._refusal is not None:
            raise ExternalPositionError(self._refusal.message)
        if not self._vehicle.connected:
            raise ExternalPositionError("There is no connection to a vehicle.")
        self._vehicle.send_external_pose(pose, now)

    def shut_down(self, now: float) -> None:
        """Stop the vehicle where it is and end the active goal with SHUTTING_DOWN."""
        self._commands.goal_ended(OutcomeCode.SHUTTING_DOWN)  # so that no command starts another
        goal = self._goal
        if goal is None or goal.closing is not None:
            return
        text = "The navigation server was stopped."
        self._stop_for(goal, Outcome(OutcomeCode.SHUTTING_DOWN, text, None), now)

    def release(self, now: float) -> None:
        """End the active goal and command a hold, although the vehicle may still move."""
        goal = self._goal
        if goal is None:
            return
        text = "The navigation server was stopped. Whether the vehicle has stopped is unknown."
        if goal.takeover is not None:
            self._abandon(OutcomeCode.SHUTTING_DOWN, text, now)
        else:
            self._end(goal, Outcome(OutcomeCode.SHUTTING_DOWN, text, None), now)

    def fail(self, text: str, now: float) -> None:
        """End the active goal after an internal error; the vehicle holds."""
        if self._goal is not None:
            self._end(self._goal, Outcome(OutcomeCode.INTERNAL_ERROR, text, None), now)

    # --- called by the driver -------------------------------------------------------

    def configure(self, config: BridgeConfig) -> None:
        """Use other settings for future goals; the active one keeps its own."""
        self._config = self._observer.config = config
        self._guard.configure(config)
        self._scene.configure(config)
        self._traffic.configure(config)
        self._positions.configure(config.safety.position_doubt_timeout_s)
        self._obstacles.configure(config.obstacles)

    def start(self, now: float) -> None:
        """Start the search for the vehicle."""
        self._vehicle.start(now)
        self._obstacles.start(now)

    def overhear(self, message: Message, now: float) -> None:
        """Process a message of a ground station from another link; it is never telemetry."""
        self._vehicle.overhear(message, now)
        self._handle_events(now)

    def intakes(self, system: int, component: int) -> dict[int, Intake]:
        """Return what takes measurements of a sender straight from their frames, by number."""
        intakes = self._vehicle.intakes(system, component)
        take_position = intakes.get(_GLOBAL_POSITION)
        if take_position is not None:
            intakes[_GLOBAL_POSITION] = partial(self._take_position, take_position)
        take_local = intakes.get(_LOCAL_POSITION)
        if take_local is not None:
            intakes[_LOCAL_POSITION] = partial(self._take_local, take_local)
        return intakes

    def _take_local(self, take: Intake, data: bytes, now: float) -> bool:
        """Do what `receive` does for a local position."""
        if not take(data, now):
            return False
        if self._map_frame.wants_pairs:
            self._learn_frame(self._vehicle.state)
        return True

    def _learn_frame(self, state: VehicleState) -> None:
        """Learn the map frame from a local position: it may come just after the global one."""
        if state.last_heartbeat_s is None:
            return  # The firmware's projection is not known yet.
        was_known = self._map_frame.frame is not None
        self._map_frame.update(state)
        if self._map_frame.frame is not None and not was_known:
            self._report.position()

    def _take_position(self, take: Intake, data: bytes, now: float) -> bool:
        """Do what `receive` does for a position that is nothing but one."""
        live = self._vehicle.live
        before = live.global_position
        if not take(data, now):
            return False
        here = live.global_position
        if self._map_frame.wants_pairs:
            self._map_frame.update(self._vehicle.state)
        if not (self._report.has_position and still_has_pose(live.known, here)):
            self._report.position()
        self._positions.follow(before, live.known, here, now)
        goal = self._goal
        if self._traffic.is_due(now):
            self._traffic.update(goal, self._look(goal, now))
        if goal is not None:
            self._feed_back(goal, now)
        return True

    def receive(self, message: Message, now: float) -> None:
        """Process one MAVLink message."""
        before = self._vehicle.state
        self._vehicle.receive(message, now)
        state = self._vehicle.state
        moved = state.global_position is not before.global_position
        if moved or state.origin is not before.origin:
            self._map_frame.update(state)
            self._report.position()
        elif state.local_position is not before.local_position and self._map_frame.wants_pairs:
            self._learn_frame(state)
        if state is not before:
            self._positions.observe(before, state, now)
        if state.speaks_mavlink_1 is not before.speaks_mavlink_1:
            self._report.protocol()
        if state.battery is not before.battery:
            self._guard.observe_battery(state, self._vehicle.profile, now)
        self._handle_events(now)
        goal = self._goal
        if moved:
            if self._traffic.is_due(now):
                self._traffic.update(goal, self._look(goal, now))
        elif message.get_type() == "ADSB_VEHICLE":
            self._traffic.hear(message, now)
        if goal is not None and moved:
            self._feed_back(goal, now)

    def _feed_back(self, goal: ActiveGoal, now: float) -> None:
        """Give feedback of a new position, if it is due."""
        # A position that arrives slightly early still counts; otherwise positions at 20 Hz would
        # give feedback at 6.7 Hz instead of 10.
        early_s = 0.25 * self._config.feedback_period_s
        if now >= goal.feedback_due_s - early_s:
            self._give_feedback(goal, self._look(goal, now))

    def handle_timer(self, now: float) -> None:
        """Do what is due."""
        self._vehicle.expect_answers(self._goal is not None, now)
        self._vehicle.handle_timer(now)
        self._handle_events(now)
        self._parking.handle_timer(now)
        goal = self._goal
        snapshot: Snapshot | None = None
        if goal is not None and now >= goal.think_s:
            goal.think_s = math.inf
            goal.task.think(self._look(goal, now), now)
        if goal is not None and now >= goal.next_step_s:
            self._note_lateness(now - goal.next_step_s, now)
            self._note_data_age(now)
            goal.next_step_s = _next_on_grid(goal.next_step_s, self._config.setpoint_period_s, now)
            snapshot = self._look(goal, now)
            self._step(goal, snapshot)
        goal = self._goal
        if self._traffic.is_due(now):
            self._traffic.update(goal, snapshot or self._look(goal, now))
        if goal is not None and now >= self._feedback_deadline(goal):
            self._give_feedback(goal, snapshot or self._look(goal, now))

    def _note_lateness(self, late_s: float, now: float) -> None:
        if self._lateness.note(late_s, now) and now - self._late_told_s >= _LATE_TOLD_S:
            self._late_told_s = now
            self._report.log(
                LogLevel.WARN,
                f"The control loop is {late_s:.2f} s late; the vehicle is slowed down, and stopped "
                f"from {TOO_LATE_S:g} s on. Reduce the load on this machine.",
            )

    def _note_data_age(self, now: float) -> None:
        """Count data that was old when it was read as lateness: the vehicle is elsewhere by now."""
        time_ms = self._vehicle.live.boot_time_ms
        if time_ms == self._data_time_ms:
            return  # nothing came: that is for those who watch the link
        self._data_time_ms = time_ms
        self._data_age_s = self._vehicle.sample_age_s(time_ms, now)
        age_s = self._data_age_s or 0.0
        if self._lateness.note(age_s, now) and now - self._late_told_s >= _LATE_TOLD_S:
            self._late_told_s = now
            self._report.log(
                LogLevel.WARN,
                f"The vehicle's data is {age_s:.2f} s old when it is read; the vehicle is slowed "
                f"down, and stopped from {TOO_LATE_S:g} s on. Reduce the load on this machine, or "
                "check the link.",
            )

    def next_deadline(self) -> float | None:
        """Return the time of the next call of :meth:`handle_timer`."""
        goal = self._goal
        own = None if goal is None else self._goal_deadline(goal)
        deadlines = (self._vehicle.next_deadline(), self._parking.next_deadline(), own)
        return min((time for time in deadlines if time is not None), default=None)

    def _goal_deadline(self, goal: ActiveGoal) -> float:
        # A task thinks once its setpoint has been sent, and finishes before the next.
        return min(goal.next_step_s, goal.think_s, self._feedback_deadline(goal))

    def messages_to_send(self) -> list[Message]:
        """Return the MAVLink messages to send now."""
        messages = self._vehicle.messages_to_send()
        for message in self._traffic.announcements():
            address = self._vehicle.address
            messages.append(with_source(message, address.source_system, address.source_component))
        if self._close_when_sent:
            self._close_when_sent = False
            self._vehicle.close_stream()
        return messages

    def next_output(self) -> Output | None:
        """Return the next output for ROS, the log or the recording."""
        return self._report.next_output()

    # --- goals -------------------------------------------------------------------------

    def _admit(self, request: Request, now: float) -> Admitted | Rejection:
        if self._refusal is not None:
            return self._refusal
        snapshot = self._look(None, now)
        self._guard.bound(snapshot)
        admitted = admit(request, self._tasks, snapshot, self.active_goal_id)
        if isinstance(admitted, Rejection):
            return admitted
        checked = self._guard.check(admitted, snapshot)
        if isinstance(checked, Rejection) or checked.plan is None:
            return checked
        if self._storage.writes_list:
            text = "The vehicle's fence or rally points are being written; send the goal again."
            return Rejection(OutcomeCode.BUSY, text)
        off_m = self._vehicle.external_difference_m(now)
        if off_m is not None and off_m > _EXTERNAL_OFF_M:
            # A PX4 with EKF2_HGT_REF 3 counts these heights from sea level, not from the origin.
            text = (
                f"The vehicle's position is {off_m:.1f} m from that of external_odometry_topic; "
                "check the autopilot's origin, its altitude included, and its estimator."
            )
            return Rejection(OutcomeCode.UNHEALTHY, text)
        checked = self._among_others(checked, request, now)
        if isinstance(checked, Rejection):
            return checked
        doubt, note = self._positions.check(now)
        if doubt is not None:
            return doubt
        return replace(checked, warnings=(*checked.warnings, note)) if note else checked

    def _among_others(
        self, admitted: Admitted, request: Request, now: float
    ) -> Admitted | Rejection:
        """Check a target against those of other vehicles; it may be moved."""
        found = self._traffic.check_target(admitted.target_enu_m, now)
        if isinstance(found, Rejection):
            return found
        if not found:
            return admitted
        if self._config.traffic.conflict is TrafficConflict.REROUTE:
            moved = self._rerouted(admitted, request, now)
            if moved is not None:
                return moved
        return replace(admitted, warnings=(*admitted.warnings, found))

    def _rerouted(self, admitted: Admitted, request: Request, now: float) -> Admitted | None:
        """Return the goal with the nearest free target; None if there is none."""
        assert admitted.target_enu_m is not None
        if not isinstance(request, NavigateRequest) or request.frame_id == "base_link":
            return None
        place = self._traffic.free_target(admitted.target_enu_m, now)
        if place is None:
            return None
        moved = self._admit(replace(request, frame_id="map", position=place), now)
        if isinstance(moved, Rejection):
            return None
        text = "The target was moved to the nearest position that is free of other vehicles."
        return replace(moved, warnings=(*moved.warnings, text))

    def _log_refusal(self) -> Rejection | None:
        """Return why logs are not transferred now."""
        if self._refusal is not None or self._goal is None:
            return self._refusal
        text = f"Goal {self._goal.goal_id} is active; cancel it first."
        return Rejection(OutcomeCode.BUSY, text)

    def _new_goal(self, goal_id: str, admitted: Admitted, now: float) -> ActiveGoal:
        """Create a goal that continues from the state of the active one, if any."""
        previous = self._goal
        handover, next_step_s = Handover(), now
        if previous is not None and (
            previous.takeover is not None
            or previous.yielded is not None
            or self._stations.ignores_setpoints
        ):
            previous = None  # its last setpoint is obsolete
        if previous is not None:
            handover = Handover(
                previous.task.commanded,
                previous.task.commanded_yaw_enu_rad,
                previous.setpoint_s,
                by_itself=self._moves_by_itself(previous.operation),
            )
            next_step_s = previous.next_step_s
        goal = ActiveGoal(
            goal_id,
            admitted.description,
            admitted.target_enu_m,
            admitted.make_task(handover),
            now,
            next_step_s,
            now,
            notes=list(admitted.warnings),
            plan=admitted.plan,
        )
        if previous is None:
            return goal
        # The new goal also needs an arming or a take-off in progress, but not another mission.
        if previous.operation is not None and previous.operation.kind not in _OF_ONE_MISSION:
            goal.operation, goal.operation_id = previous.operation, previous.operation_id
            goal.asked = previous.asked
        return goal

    def _moves_by_itself(self, operation: OperationReport | None) -> bool:
        """Whether the vehicle is in a mode that leads it, or was asked to be."""
        mode = vehicle_mode(self._vehicle.profile, self._vehicle.mode_name)
        return mode in _LEADING or (operation is not None and operation.kind in _LEADS_TO)

    def _step(self, goal: ActiveGoal, snapshot: Snapshot) -> None:
        now = snapshot.time_s
        if goal.takeover is not None:
            self._judge_takeover(goal, goal.takeover, now)
        elif not snapshot.connected:
            self._step_without_link(goal, snapshot)
        elif snapshot.one_way:
            self._lose_uplink(now)
        elif snapshot.mode_unseen:
            self._show_status(goal, snapshot)
        elif self._parking.operation_id is None and self._overtaken.operation_id is None:
            # Else the requested mode change is pending.
            self._watch(goal, snapshot)
            if self._guard.bounded_s == now:
                snapshot = self._observer.bounded(snapshot)
            if self._stations.yields(goal, snapshot):
                self._step_yielded(goal, snapshot)
            else:
                self._step_task(goal, snapshot)

    def _judge_takeover(self, goal: ActiveGoal, takeover: Takeover, now: float) -> None:
        """End a goal whose vehicle has left our control, once the origin is known."""
        goal.takeover = takeover = takeover.watched(self._vehicle.state)
        if self._vehicle.is_one_way:
            self._lose_uplink(now)
            return
        judged = takeover.judge(self._vehicle.state, now)
        if self._overtaken.is_open:
            return
        answered_s = now - self._vehicle.unanswered_s(now)
        if judged is None or (answered_s < takeover.seen_s and now - takeover.seen_s < _ANSWERS_S):
            return  # a PX4 that gets no more setpoints leaves OFFBOARD before that is known
        code, text = judged
        if code is OutcomeCode.PILOT_OVERRIDE and goal.cancelled_by:
            code = OutcomeCode.CANCELED  # it has ended already
        self._abandon(code, text, now)

    def _step_yielded(self, goal: ActiveGoal, snapshot: Snapshot) -> None:
        outcome = self._stations.step(goal, snapshot)
        if outcome is not None:
            self._end(goal, outcome, snapshot.time_s)
        else:
            self._show_status(goal, snapshot)

    def _step_task(self, goal: ActiveGoal, snapshot: Snapshot) -> None:
        now = snapshot.time_s
        intent = goal.task.step(snapshot, now)
        if goal.operation is not None and goal.operation.state is not OperationStatus.PENDING:
            goal.operation = None  # the task knows the result
        if isinstance(intent, Outcome):
            self._end(goal, self._own_share(intent, snapshot.late_s), now)
            return
        if isinstance(intent, Perform):
            if self._waits_with(goal, intent, snapshot):
                return
            self._perform(goal, intent, now)
            if intent.kind in STREAMED:
                self._parking.keep_streaming(now)
        elif isinstance(intent, Fly):
            self._fly(goal, self._traffic.tempered(goal, intent, snapshot), now)
        if self._goal is goal:
            self._show_status(goal, snapshot)
            self._report.plan(goal, goal.task.path_enu_m)

    @staticmethod
    def _own_share(outcome: Outcome, late_s: float) -> Outcome:
        """Return the outcome, with the server's own lateness as its reason if it is one."""
        if late_s < TOO_LATE_S or outcome.code not in _BY_LATENESS:
            return outcome
        text = f"{outcome.message} This server was {late_s:.1f} s late itself."
        return replace(outcome, code=OutcomeCode.SERVER_LATE, message=text)

    def _waits_with(self, goal: ActiveGoal, intent: Perform, snapshot: Snapshot) -> bool:
        """Whether an operation has to wait until others have left what it needs."""
        if not self._is_new(goal, intent):
            return False
        now = snapshot.time_s
        waiting = self._traffic.gate(goal, intent, snapshot)
        if waiting is None:
            return False
        # A PX4 takes the end of the stream for a failure, and would return by itself.
        self._parking.keep_streaming(now)
        if self._traffic.is_over(goal, now):
            self._end(goal, Outcome(OutcomeCode.TRAFFIC, waiting.text, None), now)
            return True
        goal.task.postpone(now)
        self._show_status(goal, snapshot)
        return True

    @staticmethod
    def _is_new(goal: ActiveGoal, intent: Perform) -> bool:
        elsewhere = goal.asked is None or goal.asked.target_enu_m != intent.target_enu_m
        return goal.operation is None or goal.operation.kind is not intent.kind or elsewhere

    def _stop_for(self, goal: ActiveGoal, outcome: Outcome, now: float) -> None:
        """Have the task stop the vehicle; the goal then ends with this outcome."""
        goal.closing = outcome
        goal.task.cancel(now)
        goal.next_step_s = min(goal.next_step_s, now)

    def _watch(self, goal: ActiveGoal, snapshot: Snapshot) -> None:
        outcome = self._positions.watch(goal, snapshot)
        known = len(goal.notes)
        outcome = outcome or self._guard.watch(goal, snapshot)
        if outcome is not None:
            self._report.log(LogLevel.WARN, f"Goal {goal.short_id}: {outcome.message}")
            self._stop_for(goal, outcome, snapshot.time_s)
        for note in goal.notes[known:]:
            self._report.log(LogLevel.WARN, f"Goal {goal.short_id}: {note}")

    def _perform(self, goal: ActiveGoal, intent: Perform, now: float) -> None:
        if not self._is_new(goal, intent):
            return
        goal.asked = intent
        if intent.kind is TaskOperation.UPLOAD_MISSION:
            goal.operation_id, goal.mission = begin_upload(
                self._vehicle, self._map_frame, intent, now
            )
        else:
            goal.operation_id = begin_operation(self._vehicle, self._map_frame, intent, now)
        goal.operation = OperationReport(intent.kind, OperationStatus.PENDING, "")

    def _fly(self, goal: ActiveGoal, intent: Fly, now: float) -> None:
        if goal.operation is not None:
            self._vehicle.cancel_operation(now)
            goal.operation = goal.operation_id = None
        try:
            self._close_when_sent = False
            if not self._vehicle.stream_open:
                self._vehicle.open_stream(now)
            self._vehicle.send_setpoint(intended_ned(intent), now)
            goal.setpoint_s = goal.think_s = now
        except SetpointError as error:
            self._end(goal, Outcome(OutcomeCode.INTERNAL_ERROR, str(error), None), now)

    def _step_without_link(self, goal: ActiveGoal, snapshot: Snapshot) -> None:
        """Wait for the vehicle, up to a timeout; no motion command is sent."""
        heard_s, now = snapshot.state.last_heartbeat_s, snapshot.time_s
        silence_s = math.inf if heard_s is None else now - heard_s
        asked_s = goal.cancel_requested_s
        if asked_s is not None and now - asked_s >= self._config.goto.cancel_timeout_s:
            text = (
                f"The vehicle has been silent for {silence_s:.1f} s; whether it has stopped is "
                "unknown."
            )
            self._abandon(OutcomeCode.CANCELED, text, now)
        elif silence_s >= self._config.link_lost_abort_s:
            text = (
                f"No HEARTBEAT for {silence_s:.1f} s; the vehicle's own failsafe decides what "
                "it does. The goal is not resumed."
            )
            self._abandon(OutcomeCode.LINK_LOST, text, now)
        else:
            self._show_status(goal, snapshot)

    def _lose_uplink(self, now: float) -> None:
        text = (
            "The link is one way: telemetry arrives, but nothing was answered for "
            f"{self._vehicle.unanswered_s(now):.1f} s. The vehicle's own failsafe decides what it "
            "does. The goal is not resumed."
        )
        self._abandon(OutcomeCode.LINK_LOST, text, now)

    def _end(self, goal: ActiveGoal, outcome: Outcome, now: float) -> None:
        """End the active goal and stop a vehicle that is still under our control."""
        self._goal = None
        outcome = self._stations.name(outcome, now)
        vehicle = self._vehicle
        if goal.operation is not None:
            vehicle.cancel_operation(now)
        commanded = goal.task.commanded
        moving = commanded is not None and norm(commanded.velocity_enu_m_s) > 0.0
        still = hold_setpoint_ned(vehicle, goal.task.commanded_yaw_enu_rad)
        if (moving or velocity_only(vehicle.profile)) and vehicle.stream_open:
            # The last setpoint still carries a velocity, which an autopilot would follow
            # for seconds (ArduCopter: GUID_TIMEOUT).
            try:
                vehicle.send_setpoint(still, now)
            except SetpointError as error:
                self._report.log(LogLevel.WARN, f"The hold command could not be sent: {error}")
        if not self._parking.begin(still, now):
            self._close_when_sent = True  # ending now would drop that setpoint
        goal.progress = goal.task.progress(self._look(goal, now), now)
        self._conclude(goal, outcome, now)

    def _abandon(self, code: OutcomeCode, text: str, now: float) -> None:
        """End the active goal because control was lost; send nothing."""
        goal = self._goal
        if goal is None:
            return
        self._goal = None
        if goal.operation is not None:
            self._vehicle.cancel_operation(now)
        self._vehicle.close_stream()
        self._conclude(goal, Outcome(code, text, None), now)

    def _conclude(self, goal: ActiveGoal, outcome: Outcome, now: float) -> None:
        self._positions.conclude(goal, now)
        if goal.follows_commands:
            self._commands.goal_ended(goal.end_of(outcome).code)
        self._report.ended(goal, outcome, now)

    # --- events from the vehicle -------------------------------------------------------

    def _handle_events(self, now: float) -> None:
        events: list[VehicleEvent] = []
        while (event := self._vehicle.next_event()) is not None:
            events.append(event)
        if len(events) > 1:
            # A restart also appears as a mode change and a disarming, so it is checked first.
            events.sort(key=lambda event: not isinstance(event, VehicleRebooted))
        for event in events:
            if isinstance(event, OperationFinished):
                self._finish_operation(event, now)
            elif isinstance(event, RangesMeasured):
                self._obstacles.take_ranges(event, now)
            elif isinstance(event, (ModeChanged, ModeOvertaken)):
                self._change_mode(event, now)
            elif isinstance(event, StationActed):
                self._take_act(event, now)
            elif isinstance(event, VehicleRebooted):
                self._report.log(LogLevel.WARN, "The autopilot restarted")
                self._commands.lose_vehicle()
                self._give_up_restarted(now)
            elif not (self._storage.take(event) or self._logs.take(event)):
                self._report.vehicle(event)

    def _take_act(self, acted: StationActed, now: float) -> None:
        if takes_vehicle(acted):
            self._commands.give_vehicle_away()
        self._stations.take(acted, self._goal, self._config.on_station_pause, now)

    def _finish_operation(self, event: OperationFinished, now: float) -> None:
        self._report.operation(event)
        restored = self._overtaken.finish(event)
        if restored is not None:
            goal = self._goal
            if goal is not None and goal.takeover is not None:
                achieved = event.result is OperationResult.ACHIEVED
                goal.takeover = replace(goal.takeover, overtaken=restored, restored=achieved)
            return
        parked, served = self._parking.finish(event), self._desk.finish(event)
        if parked or served:
            return
        goal = self._goal
        if goal is None or goal.operation is None or goal.operation_id != event.operation_id:
            return
        state = OperationStatus[event.result.name]
        late = self._lateness.recent_s(now) >= TOO_LATE_S
        if state is OperationStatus.TIMED_OUT and late:
            state = OperationStatus.LATE
        goal.operation = OperationReport(goal.operation.kind, state, event.reason)
        goal.next_step_s = min(goal.next_step_s, now)
        if event.result is not OperationResult.ACHIEVED:
            self._report.log(LogLevel.WARN, event.reason)

    def _change_mode(self, event: ModeChanged | ModeOvertaken, now: float) -> None:
        if isinstance(event, ModeOvertaken):
            self._restore_mode(event, now)
            return
        self._report.note(notes.text(f"mode {event.name}"))
        self._report.log(LogLevel.INFO, f"Vehicle mode: {event.name}")
        self._stations.leave_mode()
        if event.requested:
            return
        goal = self._goal
        mode = vehicle_mode(self._vehicle.profile, event.name)
        if goal is None or not goal.task.accepts_mode(mode):
            self._commands.lose_vehicle()
        if self._stations.change_mode(event, goal, now):
            return
        if goal is not None and goal.task.accepts_mode(mode):
            return
        if self._vehicle.state.system_status in _STARTING:
            self._give_up_restarted(now)
        elif goal is not None and goal.takeover is None:
            self._stations.take_away(goal, event.name, now)

    def _restore_mode(self, event: ModeOvertaken, now: float) -> None:
        """Give the vehicle back to the one whose chosen mode our request has overtaken."""
        goal = self._goal
        if goal is not None and goal.takeover is None and not goal.paused_by:
            self._stations.take_away(goal, event.chosen_name, now)
        self._commands.lose_vehicle()
        self._parking.give_up()
        self._vehicle.close_stream()
        self._overtaken.restore(event, now)

    def _give_up_restarted(self, now: float) -> None:
        text = "The autopilot restarted while the goal was active; check the vehicle."
        self._abandon(OutcomeCode.VEHICLE_REBOOTED, text, now)

    # --- progress ------------------------------------------------------------------------

    def _look(self, goal: ActiveGoal | None, now: float) -> Snapshot:
        """Return all that is known now, for a goal or for admission."""
        traffic = self._traffic.view()
        if goal is None:
            return self._observer.look(now, traffic=traffic)
        tracker, mission = goal.mission, None
        if tracker is not None:
            mission = tracker.report(self._vehicle.state, self._vehicle.mission_change)
        return self._observer.look(
            now,
            operation=goal.operation,
            mission=mission,
            fault=self._positions.fault(goal),
            late_s=self._lateness.recent_s(now),
            command=self._commands.current if goal.follows_commands else None,
            traffic=traffic,
        )

    def _progress(self, goal: ActiveGoal, snapshot: Snapshot) -> Progress:
        progress = goal.task.progress(snapshot, snapshot.time_s)
        progress = goal.progress = self._traffic.progress(progress)
        if not snapshot.connected:
            return replace(progress, status=Status.LINK_LOST)
        if goal.yielded is None:
            return progress
        status = Status.CANCELLING if goal.ending else Status.PAUSED
        return replace(progress, status=status)

    def _feedback_deadline(self, goal: ActiveGoal) -> float:
        # Positions trigger feedback; without one for half a period, a timer does.
        return goal.feedback_due_s + 0.5 * self._config.feedback_period_s

    def _show_status(self, goal: ActiveGoal, snapshot: Snapshot) -> None:
        """Report a status that is new, with feedback: a short one would pass between two."""
        if self._report.status(goal, self._progress(goal, snapshot)):
            self._give_feedback(goal, snapshot)

    def _give_feedback(self, goal: ActiveGoal, snapshot: Snapshot) -> None:
        # Counted from now, not on a grid, so that feedback keeps in step with the positions.
        goal.feedback_due_s = snapshot.time_s + self._config.feedback_period_s
        self._report.feedback(goal, self._progress(goal, snapshot), snapshot)


def _next_on_grid(due_s: float, period_s: float, now: float) -> float:
    """Return the first time after ``now`` on the grid of ``period_s`` through ``due_s``."""
    following = due_s + period_s
    if following > now:
        return following
    return due_s + (math.floor((now - due_s) / period_s) + 1) * period_s
