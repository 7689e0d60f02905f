"""A goal flown through real sockets: driver, router and bridge here, the simulator beside.

Ground stations of all sorts may speak on a port of their own.
"""

from __future__ import annotations

import contextlib
import itertools
import socket
import time
from collections.abc import Callable, Iterator
from typing import TypeVar

from mavlink_vehicle.codec import Codec, Message
from mavlink_vehicle.io.clock import MonotonicClock
from mavlink_vehicle.io.driver import Driver
from mavlink_vehicle.io.endpoints import LinkStatistics
from mavlink_vehicle.io.links import open_link
from mavlink_vehicle.io.links.udp import UdpLink
from mavlink_vehicle.io.router import Router
from mavlink_vehicle.vehicle import Vehicle
from navigation_bridge.bridge import Bridge
from navigation_bridge.configuration.make_config import make_config
from navigation_bridge.goals.goal import GoalFeedback, GoalFinished
from navigation_bridge.goals.requests import (
    NavigateRequest,
    Request,
    WaypointRequest,
    WaypointsRequest,
)
from pytest_mavlink_sitl import simulator_process
from tests.support.processes import patient_s

ResultT = TypeVar("ResultT")
SPEEDUP = 2.0
LIMIT_S = patient_s(30.0)


class HostileStation:
    """A socket that says whatever it likes to a port of this machine."""

    def __init__(self, port: int, system: int = 254, component: int = 190) -> None:
        """Open it."""
        self.codec = Codec(system, component)
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        self._socket.connect(("127.0.0.1", port))

    def send(self, *messages: Message) -> None:
        """Send messages, in the name of whoever they say, or in its own."""
        for message in messages:
            self.write(self.codec.encode(message))

    def write(self, data: bytes) -> None:
        """Send bytes."""
        with contextlib.suppress(OSError):  # full: the flood has drowned itself
            self._socket.send(data)

    def read(self) -> list[bytes]:
        """Return what has come."""
        found: list[bytes] = []
        with contextlib.suppress(OSError):
            while True:
                found.append(self._socket.recv(65536))
        return found

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()


class _Application:
    """The bridge as a driver runs it; keeps what it tells."""

    def __init__(self, bridge: Bridge) -> None:
        self.ends: dict[str, GoalFinished] = {}
        self.status = ""
        self.start = bridge.start
        self.receive = bridge.receive
        self.overhear = bridge.overhear
        self.handle_timer = bridge.handle_timer
        self.next_deadline = bridge.next_deadline
        self._bridge = bridge

    def messages_to_send(self) -> list[Message]:
        messages = self._bridge.messages_to_send()
        while (output := self._bridge.next_output()) is not None:
            if isinstance(output, GoalFinished):
                self.ends[output.goal_id] = output
            elif isinstance(output, GoalFeedback):
                self.status = output.status.value
        return messages


class UdpFlight:
    """Everything between a goal and a simulated vehicle but ROS."""

    def __init__(self, vehicle_port: int) -> None:
        """Listen to a vehicle on a port, and to ground stations on another."""
        config = make_config({"arming": "auto"})
        stations = open_link("udpin://127.0.0.1:0")
        assert isinstance(stations, UdpLink)
        self.vehicle_port, self.station_port = vehicle_port, stations.port
        self.errors: list[Exception] = []
        self.clock = MonotonicClock(SPEEDUP)
        self.bridge = Bridge(Vehicle(config.vehicle), config.bridge)
        self.router = Router(
            [open_link(f"udpin://127.0.0.1:{vehicle_port}")], lambda: Codec(1, 191), [stations]
        )
        self._application = _Application(self.bridge)
        self._driver = Driver(self._application, self.router, self.clock, self.errors.append)
        self._ids = itertools.count(1)
        self._stations: list[HostileStation] = []
        self._driver.start()

    def station(self, system: int = 254, component: int = 190) -> HostileStation:
        """Return one more station, which is closed with the flight."""
        self._stations.append(HostileStation(self.station_port, system, component))
        return self._stations[-1]

    def on_thread(self, work: Callable[[], ResultT]) -> ResultT:
        """Return what `work` returns on the driver's thread."""
        return self._driver.call(work)

    def wait(self, condition: Callable[[], bool], what: str) -> None:
        """Wait until something holds on the driver's thread."""
        limit_s = time.monotonic() + LIMIT_S
        while not self._driver.call(condition):
            assert time.monotonic() < limit_s, f"not within {LIMIT_S:g} s: {what}"
            time.sleep(0.01)

    def ready(self) -> UdpFlight:
        """Wait until goals are taken."""
        request = _request((0.0, 0.0, 4.0))
        self.wait(lambda: self.bridge.goals.check(request, self.clock.now()) is None, "ready")
        return self

    def send(self, x: float, y: float, z: float, by_mission: bool = False) -> str:
        """Start a goal, and wait until the vehicle is on its way."""
        request: Request = _request((x, y, z))
        if by_mission:
            request = WaypointsRequest((WaypointRequest((x, y, z)),), by_mission=True)
        goal_id = f"{next(self._ids):032x}"

        def start() -> None:
            rejection = self.bridge.goals.check(request, self.clock.now())
            assert rejection is None, rejection
            self.bridge.goals.start(goal_id, request, self.clock.now())

        self._application.status = ""
        self._driver.call(start)
        self.wait(lambda: self._has_begun(goal_id), "the way")
        return goal_id

    def under_way(self, goal_id: str) -> bool:
        """Return whether a goal has not ended."""
        return goal_id not in self._application.ends

    def _has_begun(self, goal_id: str) -> bool:
        return self._application.status == "NAVIGATING" or goal_id in self._application.ends

    def end(self, goal_id: str) -> GoalFinished:
        """Wait for the end of a goal."""
        ends = self._application.ends
        self.wait(lambda: goal_id in ends, "the end of the goal")
        return ends[goal_id]

    def counts(self) -> LinkStatistics:
        """Return what was counted of the ground stations."""
        return self._driver.call(lambda: self.router.statistics.station_links()[0][1])

    def setpoints(self) -> int:
        """Return how many setpoints have left for the active goal."""
        return self._driver.call(lambda: self.bridge.vehicle.setpoints.statistics.sent)

    def close(self) -> None:
        """End everything."""
        for station in self._stations:
            station.close()
        self._driver.stop()


def _request(position_m: tuple[float, float, float]) -> NavigateRequest:
    return NavigateRequest("map", position_m, (0.0, 0.0, 0.0, 1.0), False, 0.0)


@contextlib.contextmanager
def udp_flight(*options: str) -> Iterator[UdpFlight]:
    """Fly a simulated vehicle, with options of the simulator; ready for goals."""
    with simulator_process("--speedup", f"{SPEEDUP:g}", "--ready-after", "1", *options) as port:
        flight = UdpFlight(port)
        try:
            yield flight.ready()
            assert flight.errors == []
        finally:
            flight.close()
