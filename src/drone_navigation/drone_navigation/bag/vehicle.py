"""Vehicles of a recording, each with a bridge and the topics of its server."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

from drone_navigation.bag.goals import BagGoals
from drone_navigation.bag.mcap_bag import Bag
from drone_navigation.bag.topics import BagClock, BagNode
from drone_navigation.server.frame_names import FrameNames
from drone_navigation.server.publishing.topics import Topics
from drone_navigation.server.vehicle_outputs import VehicleOutputs
from flight_logs.vehicles import Source
from mavlink_vehicle.codec import Codec, Message
from mavlink_vehicle.io.endpoints import LinkStatistics
from mavlink_vehicle.vehicle import Vehicle
from navigation_bridge.bridge import Bridge
from navigation_bridge.configuration.make_config import make_config
from navigation_bridge.goals.goal import GoalFeedback, GoalFinished, GoalHappened, Output


class RecordedVehicle(VehicleOutputs):
    """One vehicle of a recording: its bridge, with a bag in place of ROS.

    Attributes:
        system: MAVLink system of its autopilot.
        bridge: the bridge that the recording is played to.
    """

    def __init__(self, source: Source, name: str, codec: Codec, bag: Bag, clock: BagClock) -> None:
        """Write what its server published.

        Args:
            source: MAVLink system and component of its autopilot.
            name: its namespace; empty for none.
            codec: decodes the recording, and knows what is missing in it.
            bag: where to.
            clock: the recorder's.
        """
        system, component = source
        config = make_config({"target_system": system})
        vehicle = Vehicle(replace(config.vehicle, target_component=component))
        self.bridge = Bridge(vehicle, config.bridge)
        super().__init__(self.bridge)
        self.system = system
        self._codec = codec
        self._bag_clock = clock
        self._heard = 0
        node = BagNode(bag, clock, name)
        frames = FrameNames.of(name)
        self.attach_topics(Topics(node, self.bridge, self._statistics, frames))
        self._goals = BagGoals(node, frames)

    def receive(self, message: Message, now: float) -> None:
        """Process a message and publish the results."""
        self._heard += message.get_srcSystem() == self.system
        self.bridge.receive(message, now)

    def update(self, now: float) -> None:
        """Publish at a time of the recording."""
        self._bag_clock.move(now)
        super().update(now)

    def take_note(self, message: Message, now: float) -> None:
        """Publish the notes of the server."""
        self._bag_clock.move(now)
        super().take_note(message, now)

    def _put_out(self, output: Output) -> None:
        if isinstance(output, GoalHappened) and output.event == "ACCEPTED":
            self._goals.accept(output.goal_id, self._noted.action_of(output.goal_id))
        elif isinstance(output, GoalFeedback):
            self._goals.feedback(output)
        elif isinstance(output, GoalFinished):
            self._goals.finish(output)
        super()._put_out(output)

    def _statistics(self) -> LinkStatistics:
        lost = self._codec.statistics.lost.items()
        own = {source: count for source, count in lost if source[0] == self.system}
        return LinkStatistics(frames=self._heard, lost=own)


class RecordedFleet:
    """Several vehicles of a recording, as one application."""

    def __init__(self, vehicles: Sequence[RecordedVehicle], others: Collection[int] = ()) -> None:
        """Put together.

        Args:
            vehicles: at least one.
            others: MAVLink system ids of vehicles that are in the recording, too.
        """
        self._vehicles = tuple(vehicles)
        self._others = others
        self._by_system = {vehicle.system: vehicle for vehicle in vehicles}
        self._only = vehicles[0] if len(vehicles) == 1 else None

    def start(self, now: float) -> None:
        """Start all."""
        for vehicle in self._vehicles:
            vehicle.bridge.start(now)

    def receive(self, message: Message, now: float) -> None:
        """Pass a message to the vehicle that sent it, or that it is addressed to."""
        vehicle = self._only or self._of(message)
        if vehicle is not None:
            vehicle.receive(message, now)

    def overhear(self, message: Message, now: float) -> None:
        """Pass a message of a ground station to its target vehicle."""
        vehicle = self._only or self._of(message)
        if vehicle is not None:
            vehicle.bridge.overhear(message, now)

    def handle_timer(self, now: float) -> None:
        """Run the due timers."""
        for vehicle in self._vehicles:
            deadline = vehicle.bridge.next_deadline()
            if deadline is not None and deadline <= now:
                vehicle.bridge.handle_timer(now)

    def next_deadline(self) -> float | None:
        """Return the earliest deadline."""
        deadlines = [vehicle.bridge.next_deadline() for vehicle in self._vehicles]
        return min((time_s for time_s in deadlines if time_s is not None), default=None)

    def messages_to_send(self) -> list[Message]:
        """Return what would be sent."""
        bridges = [vehicle.bridge for vehicle in self._vehicles]
        return [message for bridge in bridges for message in bridge.messages_to_send()]

    def take_note(self, message: Message, now: float) -> None:
        """Hand a note to the vehicle that it is about: that of the same system.

        Before a server has heard its vehicle, its notes are from a system that need not be.
        """
        system = message.get_srcSystem()
        vehicle = self._by_system.get(system)
        if vehicle is None and system not in self._others:
            vehicle = self._only
        if vehicle is not None:
            vehicle.take_note(message, now)

    def _of(self, message: Message) -> RecordedVehicle | None:
        vehicle = self._by_system.get(message.get_srcSystem())
        return vehicle or self._by_system.get(getattr(message, "target_system", 0))
