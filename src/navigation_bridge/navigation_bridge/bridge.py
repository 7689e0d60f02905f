"""One vehicle of the server: goals and services in, MAVLink out, feedback back. No ROS.

The bridge puts the parts together and is what driver and clients talk to. It does no I/O and reads
no clock; the driver thread calls it with ``now`` and collects :meth:`Bridge.messages_to_send`. Its
:class:`Front` publishes :meth:`Bridge.next_output`. A goal's turn is on one page,
:mod:`navigation_bridge.engine`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from mavlink_vehicle.codec import Intake, Message, mavlink, with_source
from mavlink_vehicle.state.position_trust import PositionTrust
from mavlink_vehicle.vehicle import Vehicle
from navigation_bridge.clients.client_goals import ClientGoals
from navigation_bridge.clients.client_services import ClientServices
from navigation_bridge.clients.service_requests import ServiceRequests
from navigation_bridge.configuration.settings import BridgeConfig
from navigation_bridge.effects import Effects
from navigation_bridge.engine import Engine, Parts
from navigation_bridge.features import FEATURES
from navigation_bridge.goals.goal import Output
from navigation_bridge.measurement_intakes import MeasurementIntakes
from navigation_bridge.obstacles.obstacle_feed import ObstacleFeed
from navigation_bridge.reporting import Front, Reporter
from navigation_bridge.requests.feature import Feature, FeatureParts, Features, FeatureT
from navigation_bridge.scene import Scene
from navigation_bridge.snapshot import LocatedSnapshot
from navigation_bridge.supervision.battery_forecast import share_for_return
from navigation_bridge.supervision.observer import LatenessWatch, Observer
from navigation_bridge.supervision.overtaken_mode import OvertakenMode
from navigation_bridge.supervision.parking import Parking
from navigation_bridge.supervision.stations import Stations
from navigation_bridge.tasks.admission import Admission
from navigation_bridge.tasks.registry import TASKS
from navigation_bridge.tasks.task_kind import TaskKind
from navigation_bridge.vehicle.map_frame import MapFrame, MapPose
from navigation_bridge.vehicle_events import VehicleEvents
from navigation_core.outcomes import OutcomeCode
from navigation_core.safety.target_checks import Rejection
from navigation_core.searches import AT_ONCE, Searcher
from navigation_core.tasks.intents import Outcome

__all__ = ["Bridge", "BridgeConfig", "Front"]

_GLOBAL_POSITION = mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT
_LOCAL_POSITION = mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED


class Bridge:
    """Executes one goal at a time on one vehicle.

    Attributes:
        vehicle: the vehicle; read only.
        config: settings for future goals.
        map_frame: the frame of its positions; read only.
        lateness_watch: lateness of the setpoints and of the vehicle's data; read only.
        goals: begins and cancels goals of clients.
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
        self._name = name
        self._tasks = tasks
        self._kinds = features
        self._searcher = searcher
        self.front = Front()
        self._compose(vehicle, config, None)

    def _compose(self, vehicle: Vehicle, config: BridgeConfig, refusal: Rejection | None) -> None:
        self.vehicle = vehicle
        self.config = config
        self.map_frame = MapFrame()
        self.obstacles = ObstacleFeed(vehicle, self.map_frame, config.obstacles)
        self._report = Reporter(vehicle, self.map_frame)
        self._observer = Observer(vehicle, self.map_frame, self.obstacles, config, self._searcher)
        self._features = Features(
            self._kinds,
            FeatureParts(
                vehicle,
                self.map_frame,
                self._report,
                goals=lambda: self.goals,
                config=lambda: self.config,
                refusal=lambda: self.services.refusal,
                occupied=lambda: self.services.occupied,
                look=self._observer.look,
                searcher=self._searcher,
                name=self._name,
            ),
        )
        self._positions = PositionTrust()
        self.lateness_watch = LatenessWatch(vehicle, self._report)
        self._parking = Parking(vehicle, config.setpoint_period_s)
        self._effects = Effects(vehicle, self.map_frame, self._parking, self._report)
        parts = Parts(
            vehicle=vehicle,
            observer=self._observer,
            standing=self.obstacles.standing,
            report=self._report,
            effects=self._effects,
            lateness=self.lateness_watch,
            positions=self._positions,
            features=self._features,
            parking=self._parking,
            overtaken=OvertakenMode(vehicle, self._report),
            stations=Stations(vehicle, self._report, self._parking),
        )
        self._engine = Engine(parts, config)
        self._service_requests = ServiceRequests(vehicle, self.map_frame, self._report)
        self.services = ClientServices(
            self._engine,
            vehicle,
            self._report,
            self._parking,
            self._service_requests,
            self._features,
            refusal,
        )
        self.scene = Scene(vehicle, self.map_frame, config)
        self.goals = ClientGoals(
            self._engine,
            Admission(self._tasks, self._engine, vehicle, self._positions, self._features),
            self._report,
            self._features,
            self.services,
            self._service_requests,
        )
        self._intakes = MeasurementIntakes(
            vehicle,
            self.map_frame,
            self._report,
            self._positions,
            self._engine,
            lambda: self.front,
        )
        self._events = VehicleEvents(self._engine, parts, self.obstacles, self._service_requests)

    def feature(self, kind: type[FeatureT]) -> FeatureT:
        """Return the feature of a kind; another one after :meth:`begin_again`."""
        return self._features.of(kind)

    @property
    def is_writing(self) -> bool:
        """True while the autopilot would keep half of something if the server ended."""
        return self._features.is_writing

    @property
    def is_parking(self) -> bool:
        """True while the vehicle of a goal that has ended is being switched to its hold mode."""
        return self._parking.operation_id is not None

    @property
    def pose(self) -> MapPose | None:
        """The vehicle's pose in the map frame, or None."""
        return self.map_frame.pose(self.vehicle.state)

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
    def battery_rate_per_s(self) -> float:
        """Share of the battery that a second under way takes, as measured; NaN before that."""
        rate_per_s = self._observer.look(0.0).battery.consumption.measured_rate_per_s
        return math.nan if rate_per_s is None else rate_per_s

    def begin_again(self) -> None:
        """Reset to the state before :meth:`start`, to replay a recording again."""
        self._compose(Vehicle(self.vehicle.config), self.config, self.services.refusal)

    def refuse(self, refusal: Rejection | None) -> None:
        """Reject all goals and services from now on: there is no vehicle to execute them."""
        self.services.refusal = refusal

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
        self.config = config
        self._engine.configure(config)
        self.scene.configure(config)
        self._features.configure(config)
        self.obstacles.configure(config.obstacles)

    def start(self, now: float) -> None:
        """Start the search for the vehicle."""
        self.vehicle.start(now)
        self.obstacles.start(now)

    def overhear(self, message: Message, now: float) -> None:
        """Process a message of a ground station from another link.

        It is never telemetry of the vehicle.
        """
        self.vehicle.overhear(message, now)
        self._features.overhear(message, now)
        if (event := self.vehicle.next_event()) is not None:
            self._events.handle(event, now)
        self.front.put_out()

    def intakes(self, system: int, component: int) -> dict[int, Intake]:
        """Return what takes measurements of a sender straight from their frames, by number."""
        return self._intakes.of(system, component)

    def receive(self, message: Message, now: float) -> None:
        """Process one MAVLink message."""
        before, state = self.vehicle.states_around(message, now)
        moved = state.global_position is not before.global_position
        if moved or state.origin is not before.origin:
            self.map_frame.update(state)
            self._report.position(state)
        elif state.local_position is not before.local_position and self.map_frame.wants_pairs:
            self._intakes.learn_frame(state)
        if state is not before:
            self._positions.observe(before, state, now)
            if state.firmware_version != before.firmware_version:
                self._report.firmware(state)
        if state.heartbeats_1 != before.heartbeats_1:
            self._report.protocol(before)
        if state.battery is not before.battery:
            self._observer.battery.observe(state, self.vehicle.profile, now)
        if (event := self.vehicle.next_event()) is not None:
            self._events.handle(event, now)
        if moved:
            self._engine.position_came(now)
        else:
            self._features.hear(message, now)
        self.front.update(now)

    def handle_timer(self, now: float) -> None:
        """Do what is due."""
        is_flown = self._engine.goal is not None and self.vehicle.heartbeats.alive
        if is_flown is not self.vehicle.answers.expected:
            self.vehicle.answers.expect(is_flown, now)
        self.vehicle.handle_timer(now)
        if (event := self.vehicle.next_event()) is not None:
            self._events.handle(event, now)
        if self._parking.deadline_s is not None:
            self._parking.handle_timer(now)
        self._engine.turn(now)
        self.front.update(now)

    def next_deadline(self) -> float | None:
        """Return the time of the next call of :meth:`handle_timer`."""
        deadlines = (
            self.vehicle.next_deadline(),
            self._parking.deadline_s,
            self._engine.next_deadline(),
            self.front.next_deadline(),
        )
        return min((time for time in deadlines if time is not None), default=None)

    def messages_to_send(self) -> list[Message]:
        """Return the MAVLink messages to send now, after publishing what a request put out."""
        self.front.put_out()
        messages = self.vehicle.messages_to_send()
        if self._features.in_turns:
            address = self.vehicle.address
            source = address.source_system, address.source_component
            messages += [with_source(one, *source) for one in self._features.messages_to_send()]
        self._effects.sent()
        return messages

    def next_output(self, recorded: bool = True) -> Output | None:
        """Return the next output for ROS, the log or the recording, if there is one."""
        return self._report.next_output(recorded)
