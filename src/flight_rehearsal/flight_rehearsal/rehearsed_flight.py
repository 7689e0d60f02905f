"""The bridge and a simulated vehicle on one clock, the vehicle placed as an order says.

They talk in MAVLink frames, as always, but in memory. To be fast, time goes in longer steps, and
telemetry, setpoints and feedback come less often than in a flight.
"""

from __future__ import annotations

import math

import numpy as np

from flight_rehearsal.approaches import Surroundings
from flight_rehearsal.flight_parameters import KINDS
from flight_rehearsal.request import RehearsalRequest, RequestError
from flight_rehearsal.settings import home_point, origin_of, server_config, vehicle_config, world
from mavlink_sitl import ConfigurationError, Simulation, UnknownParameterError
from mavlink_sitl.autopilot.px4.vehicle import Px4Vehicle
from mavlink_vehicle.codec import Codec, make
from mavlink_vehicle.vehicle import Vehicle
from navigation_bridge.bridge import Bridge
from navigation_bridge.configuration.make_config import (
    ConfigurationError as ServerConfigurationError,
)
from navigation_bridge.configuration.settings import ObstacleConfig
from navigation_bridge.goals.goal import GoalFinished
from navigation_core.geometry import Vector3
from navigation_core.mapping.obstacles import POST_COLUMNS, Obstacles
from navigation_core.tasks.leading.flight_terms import AvoidanceConfig

__all__ = ["RehearsedFlight"]

TICK_S = 0.05
READY_TIMEOUT_S = 20.0
_SETTLE_S = 0.5
"""From the first position to the goal: each message has come once"""
_STATION, _BEAT_S = 255, 1.0
"""A ground station is there (MAV_GCS_SYSID): an ArduPilot's link failsafe is about its HEARTBEAT"""


class RehearsedFlight:
    """Both sides, and the link between them; from its loss on only the vehicle.

    Attributes:
        config: the server's settings.
        simulation: the vehicle's.
        simulated: the vehicle.
        bridge: what flies it.
        now: time, s.
        link_up: whether they hear each other.
        ends: how the goal ended.
        surroundings: the obstacles.
    """

    def __init__(self, order: RehearsalRequest) -> None:
        """Place the vehicle, and let the bridge find it.

        Raises:
            RequestError: there is no such vehicle here, or its settings cannot be used.
        """
        try:
            kind, autopilot = KINDS[order.autopilot]
        except KeyError:
            name = order.autopilot or "a vehicle of an unknown kind"
            raise RequestError(f"There is no rehearsal for {name}.") from None
        try:
            self.config = server_config(order)
            origin = origin_of(order, kind, autopilot)
            self.simulation = Simulation(
                [vehicle_config(order, kind, autopilot, origin)],
                world=world(order, kind, origin),
                tick_s=TICK_S,
            )
        except (ConfigurationError, ServerConfigurationError, UnknownParameterError) as error:
            raise RequestError(f"The vehicle's settings cannot be rehearsed: {error}") from error
        self.simulated = self.simulation.vehicles[0]
        self.bridge = Bridge(Vehicle(self.config.vehicle), self.config.bridge)
        sensed = Obstacles(np.array(order.sensed).reshape(-1, POST_COLUMNS))
        self.bridge.obstacles.assume(sensed)
        self.surroundings = _surroundings(self.config.bridge.obstacles, sensed, order)
        self.now = 0.0
        self.link_up = True
        self.ends: list[GoalFinished] = []
        self._codec = Codec(1, 191)
        self._charge = 1.0 if order.battery is None else order.battery
        self._station = Codec(_STATION, 190)
        self._beat_s = 0.0
        self._get_ready(order)

    def _get_ready(self, order: RehearsalRequest) -> None:
        self.bridge.start(self.now)
        self.simulated.silence_streams()
        home, known_s = home_point(order), math.inf
        while self.now < known_s + _SETTLE_S:
            if self.now > READY_TIMEOUT_S:
                raise RequestError("The simulated vehicle did not get ready.")
            self.tick()
            copter = self.simulated.firmware
            if home is not None and copter.started and copter.estimator.position_ok:
                copter.set_home(home)
                home = None
            if self.bridge.pose is None:
                known_s = math.inf
            elif math.isinf(known_s):
                known_s = self.now

    def tick(self) -> None:
        """Advance by a step."""
        self.now += TICK_S
        now, bridge, link = self.now, self.bridge, self.simulation.link
        copter = self.simulated.firmware
        if isinstance(copter, Px4Vehicle) and not copter.armed:
            copter.battery.remaining = self._charge  # its simulator fills it up on the ground
        self.simulation.run_to_us(round(now * 1e6))
        if not self.link_up:
            return
        for data in link.read_datagrams():
            for message in self._codec.decode(data):
                bridge.receive(message, now)
        deadline = bridge.next_deadline()
        if deadline is not None and deadline <= now:
            bridge.handle_timer(now)
        for message in bridge.messages_to_send():
            link.write(self._codec.encode(message))
        if now >= self._beat_s:
            self._beat_s += _BEAT_S
            link.write(self._station.encode(make("HEARTBEAT", type=6, autopilot=8)))
        while (output := bridge.next_output()) is not None:
            if isinstance(output, GoalFinished):
                self.ends.append(output)

    @property
    def position_enu_m(self) -> Vector3:
        """Where the vehicle truly is, in the map."""
        north, east, down = self.simulated.truth()[:3]
        return east, north, -down

    @property
    def speed_m_s(self) -> float:
        """How fast it truly is, in all directions."""
        return math.hypot(*self.simulated.truth()[3:6])

    @property
    def battery(self) -> float:
        """Its charge, from 0 to 1."""
        copter = self.simulated.firmware
        if isinstance(copter, Px4Vehicle):
            return copter.battery.remaining
        return self.simulated.snapshot().battery.remaining_percent / 100.0


def _surroundings(
    config: ObstacleConfig, sensed: Obstacles, order: RehearsalRequest
) -> Surroundings:
    """Return the obstacles, and the margin: what a flight that avoids them keeps in the air."""
    hull_m, margin_m = config.vehicle_radius_m, config.margin_m
    if order.avoid_obstacles:
        avoiding = AvoidanceConfig(vehicle_radius_m=hull_m, margin_m=margin_m)
        margin_m = avoiding.conflict_clearance_m - hull_m
    known = config.known.placed(lambda place: place)
    return Surroundings(known, sensed, hull_m, margin_m)
