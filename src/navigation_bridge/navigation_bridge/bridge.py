"""One vehicle of the server: goals and services in, MAVLink out, feedback back. No ROS.

The bridge puts the parts together and is what driver and clients talk to. It does no I/O and reads
no clock; the driver thread calls it with ``now`` and collects :meth:`Bridge.messages_to_send`. Its
:class:`Front` publishes :meth:`Bridge.next_output`. A goal's turn is on one page,
:mod:`navigation_bridge.engine`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial
from typing import Any

from mavlink_vehicle.codec import Intake, Message, mavlink, with_source
from mavlink_vehicle.positions.projections import Geodetic
from mavlink_vehicle.state.position_trust import PositionTrust
from mavlink_vehicle.state.vehicle_state import VehicleState
from mavlink_vehicle.vehicle import Vehicle
from navigation_bridge.client_services import ClientServices
from navigation_bridge.configuration.settings import BridgeConfig
from navigation_bridge.effects import Effects
from navigation_bridge.engine import Engine, Parts
from navigation_bridge.features import FEATURES
from navigation_bridge.goals.active_goal import ActiveGoal
from navigation_bridge.goals.goal import LogLevel, Output
from navigation_bridge.goals.requests import Request
from navigation_bridge.obstacles.obstacle_feed import ObstacleFeed
from navigation_bridge.reporting import Front, Reporter
from navigation_bridge.requests.feature import Feature, FeatureParts, Features, FeatureT
from navigation_bridge.scene import Scene
from navigation_bridge.services import ServiceDesk
from navigation_bridge.snapshot import LocatedSnapshot, Observer
from navigation_bridge.supervision.battery_forecast import share_for_return
from navigation_bridge.supervision.data_watches import LatenessWatch
from navigation_bridge.supervision.overtaken_mode import OvertakenMode
from navigation_bridge.supervision.parking import Parking
from navigation_bridge.supervision.stations import Stations
from navigation_bridge.tasks.admission import Admission
from navigation_bridge.tasks.registry import TASKS, task_of
from navigation_bridge.tasks.task_kind import TaskKind
from navigation_bridge.traffic.shared_traffic import SharedTraffic
from navigation_bridge.traffic.vehicle_separation import VehicleSeparation
from navigation_bridge.vehicle.map_frame import MapFrame, MapPose, still_has_pose
from navigation_bridge.vehicle_events import VehicleEvents
from navigation_core.geometry import Vector3
from navigation_core.outcomes import OutcomeCode
from navigation_core.safety.lateness import Lateness
from navigation_core.safety.target_checks import Rejection
from navigation_core.searches import AT_ONCE, Searcher
from navigation_core.tasks.intents import Outcome

__all__ = ["Bridge", "BridgeConfig", "Front"]

_GLOBAL_POSITION = mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT
_LOCAL_POSITION = mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED


class Bridge:
    """Executes one goal at a time on one vehicle.

    Attributes:
        recorded_goal_id: in a replay, the goal of the server that was recorded, or None.
        services: answers services of clients.
        scene: fence, flight volume, mission and rally points in the map frame.
        obstacles: obstacles; accepts readings of ROS sensors.
        front: publishes the outputs.
    """

    def __init__(
        self,
        vehicle: Vehicle,
        config: BridgeConfig,
        searcher: Searcher = AT_ONCE,
        tasks: Sequence[TaskKind[Any]] = TASKS,
        features: Sequence[type[Feature]] = FEATURES,
        name: str = "",
    ) -> None:
        """Assemble the parts; nothing happens before :meth:`start`.

        Args:
            vehicle: the vehicle.
            config: settings for goals.
            searcher: runs the path searches.
            tasks: what goals may ask for.
            features: what is answered beside goals.
            name: of the vehicle among those of the server.
        """
        self._shared_traffic: SharedTraffic | None = None
        self._name = name
        self._tasks = tasks
        self._kinds = features
        self._refusal: Rejection | None = None
        self._searcher = searcher
        self.front = Front()
        self._compose(vehicle, config)

    def _compose(self, vehicle: Vehicle, config: BridgeConfig) -> None:
        self._vehicle = vehicle
        self._config = config
        self._map_frame = MapFrame()
        self.obstacles = ObstacleFeed(vehicle, self._map_frame, config.obstacles)
        self._report = Reporter(vehicle, self._map_frame)
        self._features = Features(
            self._kinds,
            FeatureParts(
                vehicle,
                self._map_frame,
                self._report,
                goals=self,
                config=lambda: self._config,
                refusal=lambda: self._refusal,
                occupied=lambda: self.services.occupied,
            ),
        )
        self._observer = Observer(vehicle, self._map_frame, self.obstacles, config, self._searcher)
        self._traffic = VehicleSeparation(
            vehicle,
            self._map_frame,
            config,
            self._searcher,
            self._shared_traffic,
            self._name,
            self._observer.look,
        )
        self._positions = PositionTrust()
        self._lateness = LatenessWatch(vehicle, self._report)
        self._parking = Parking(vehicle, config.setpoint_period_s)
        self._effects = Effects(vehicle, self._map_frame, self._parking, self._report)
        parts = Parts(
            vehicle=vehicle,
            observer=self._observer,
            standing=self.obstacles.standing,
            report=self._report,
            effects=self._effects,
            lateness=self._lateness,
            positions=self._positions,
            features=self._features,
            parking=self._parking,
            overtaken=OvertakenMode(vehicle, self._report),
            stations=Stations(vehicle, self._report, self._parking),
            traffic=self._traffic,
        )
        self._engine = Engine(parts, config)
        self._desk = ServiceDesk(vehicle, self._map_frame, self._report)
        self.services = ClientServices(
            self._engine,
            vehicle,
            self._report,
            self._parking,
            self._desk,
            self._features,
            self._refusal,
        )
        self.scene = Scene(vehicle, self._map_frame, config)
        self._admission = Admission(
            self._tasks, self._engine, vehicle, self._positions, self._features
        )
        self._events = VehicleEvents(self._engine, parts, self.obstacles, self._desk)
        self.recorded_goal_id: str | None = None

    @property
    def active_goal(self) -> ActiveGoal | None:
        """The active goal; read only."""
        return self._engine.goal

    @property
    def active_goal_id(self) -> str | None:
        """UUID of the active goal, live or in the recording, as hexadecimal digits."""
        goal = self._engine.goal
        return self.recorded_goal_id if goal is None else goal.goal_id

    def feature(self, kind: type[FeatureT]) -> FeatureT:
        """Return the feature of a kind; another one after :meth:`begin_again`."""
        return self._features.of(kind)

    @property
    def is_idle(self) -> bool:
        """True without an active goal, those that commands have started included."""
        return self._engine.goal is None

    @property
    def is_writing(self) -> bool:
        """True while the autopilot would keep half of something if the server ended."""
        return self._features.is_writing

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
        return self._lateness.lateness

    @property
    def data_age_s(self) -> float | None:
        """Age of the vehicle's data when it was last read in a goal; None while unknown."""
        return self._lateness.data_age_s

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
    def battery_for_return(self) -> float:
        """Share of the battery that a return from here takes; NaN if unknown."""
        # Of the snapshot only the position counts, not how old it is.
        snapshot = self._observer.look(0.0)
        return share_for_return(snapshot) if isinstance(snapshot, LocatedSnapshot) else math.nan

    @property
    def battery_reserve(self) -> float:
        """Share of the battery that should remain after the return."""
        return self._config.safety.battery_reserve

    def share_traffic(self, traffic: SharedTraffic) -> None:
        """Keep the vehicle apart from the others of a traffic."""
        self._shared_traffic = traffic
        self._traffic.share(traffic)

    def begin_again(self) -> None:
        """Reset to the state before :meth:`start`, to replay a recording again."""
        self._compose(Vehicle(self._vehicle.config), self._config)

    def refuse(self, refusal: Rejection) -> None:
        """Reject all goals and services from now on: there is no vehicle to execute them."""
        self._refusal = self.services.refusal = refusal

    # --- goals and commands of clients -------------------------------------------------

    def check(self, request: Request, now: float) -> Rejection | None:
        """Return whether a goal would be accepted now; a rejection is also logged."""
        admitted = self._refusal or self._admission.admit(request, self.active_goal_id, now)
        if not isinstance(admitted, Rejection):
            return None
        self._report.rejected(admitted)
        return admitted

    def reject(self, rejection: Rejection) -> None:
        """Report a goal that was rejected before it reached the bridge."""
        self._report.rejected(rejection)

    def start_goal(self, goal_id: str, request: Request, now: float) -> None:
        """Begin an accepted goal; it replaces the active one.

        A condition that has failed since :meth:`check` ends the goal at once, with the same code.
        """
        admitted = self._refusal or self._admission.redeem(request, self.active_goal_id, now)
        if isinstance(admitted, Rejection):
            action = task_of(request, self._tasks).action
            self._report.rejected_at_start(goal_id, action, admitted)
            return
        self._features.give_way("A goal was started.")
        previous, goal = self._engine.begin(goal_id, admitted, now)
        self._desk.give_up("A new goal was started.", now)
        if previous is not None:
            replaced = Outcome(OutcomeCode.PREEMPTED, "Replaced by another goal.", None)
            self._report.ended(previous, replaced, now)
        self._engine.start_task(goal, now)

    def cancel_goal(self, goal_id: str, now: float, action: str = "") -> bool:
        """Cancel a goal; True if it is active and will end.

        Args:
            goal_id: UUID of the goal as hexadecimal digits.
            now: time in seconds.
            action: name of its action, within which the id is unique; empty for any.
        """
        goal = self._engine.goal
        if goal is None or goal.goal_id != goal_id or action not in ("", goal.kind):
            return False
        if goal.cancel_requested_s is None:
            goal.begin_cancel(now)
            self._report.log(LogLevel.INFO, f"Goal {goal.short_id}: cancel requested")
        return True

    def shut_down(self, now: float) -> None:
        """Stop the vehicle where it is and end the active goal with SHUTTING_DOWN."""
        self._features.shut_down()
        goal = self._engine.goal
        if goal is None or goal.closing is not None:
            return
        text = "The navigation server was stopped."
        goal.stop(Outcome(OutcomeCode.SHUTTING_DOWN, text, None), now)

    def release(self, now: float) -> None:
        """End the active goal and command a hold, although the vehicle may still move."""
        goal = self._engine.goal
        if goal is None:
            return
        text = "The navigation server was stopped. Whether the vehicle has stopped is unknown."
        if goal.takeover is not None:
            self._engine.abandon(OutcomeCode.SHUTTING_DOWN, text, now)
        else:
            self._engine.end(goal, Outcome(OutcomeCode.SHUTTING_DOWN, text, None), now)

    def fail(self, error: Exception, now: float) -> None:
        """End the active goal after an internal error; the vehicle holds."""
        self.front.fail(error)
        goal = self._engine.goal
        if goal is not None:
            text = f"Internal server error ({error}); hold was commanded."
            self._engine.end(goal, Outcome(OutcomeCode.INTERNAL_ERROR, text, None), now)
        self.front.put_out()

    def give_up(self, error: Exception) -> None:
        """Have the goals ended by the front: the bridge is not called again."""
        self.front.give_up(error)

    # --- called by the driver -------------------------------------------------------

    def configure(self, config: BridgeConfig) -> None:
        """Use other settings for future goals; the active one keeps its own."""
        self._config = config
        self._engine.configure(config)
        self.scene.configure(config)
        self._traffic.configure(config)
        self.obstacles.configure(config.obstacles)

    def start(self, now: float) -> None:
        """Start the search for the vehicle."""
        self._vehicle.start(now)
        self.obstacles.start(now)

    def overhear(self, message: Message, now: float) -> None:
        """Process a message of a ground station from another link; it is never telemetry."""
        self._vehicle.overhear(message, now)
        self._events.handle(now)
        self.front.put_out()

    def intakes(self, system: int, component: int) -> dict[int, Intake]:
        """Return what takes measurements of a sender straight from their frames, by number."""
        intakes = self._vehicle.intakes(system, component)
        for number, take in (
            (_GLOBAL_POSITION, self._take_position),
            (_LOCAL_POSITION, self._take_local),
        ):
            if number in intakes:
                intakes[number] = partial(take, intakes[number])
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
        self._engine.position_came(now)
        self.front.update(now)
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
            self._observer.battery.observe(state, self._vehicle.profile, now)
        self._events.handle(now)
        if moved:
            self._engine.position_came(now)
        elif message.get_type() == "ADSB_VEHICLE":
            self._traffic.hear(message, now)
        self.front.update(now)

    def handle_timer(self, now: float) -> None:
        """Do what is due."""
        is_flown = self._engine.goal is not None and self._vehicle.heartbeats.alive
        self._vehicle.answers.expect(is_flown, now)
        self._vehicle.handle_timer(now)
        self._events.handle(now)
        self._parking.handle_timer(now)
        self._engine.turn(now)
        self.front.update(now)

    def next_deadline(self) -> float | None:
        """Return the time of the next call of :meth:`handle_timer`."""
        deadlines = (
            self._vehicle.next_deadline(),
            self._parking.next_deadline(),
            self._engine.next_deadline(),
            self.front.next_deadline(),
        )
        return min((time for time in deadlines if time is not None), default=None)

    def messages_to_send(self) -> list[Message]:
        """Return the MAVLink messages to send now, after publishing what a request put out."""
        self.front.put_out()
        messages = self._vehicle.messages_to_send()
        for message in self._traffic.announcements.take():
            address = self._vehicle.address
            messages.append(with_source(message, address.source_system, address.source_component))
        self._effects.sent()
        return messages

    def next_output(self, recorded: bool = True) -> Output | None:
        """Return the next output for ROS, the log or the recording, if there is one."""
        return self._report.next_output(recorded)
