"""`mavlink_vehicle` against `mavlink_sitl` on simulated time, over a link that may be bad."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

from mavlink_sitl import LinkFaults, Simulation
from mavlink_sitl import VehicleConfig as SimulatedVehicleConfig
from mavlink_vehicle.codec import Codec, Message, make
from mavlink_vehicle.events import OperationFinished, VehicleEvent
from mavlink_vehicle.io.clock import ManualClock
from mavlink_vehicle.vehicle import Vehicle, VehicleConfig

TICK_S = 0.01
EventT = TypeVar("EventT")

BAD_RADIO = LinkFaults(loss=0.2, duplicate=0.1, delay_s=0.5)
"""A fifth lost, half a second late, some twice."""

WORSE_RADIO = LinkFaults(loss=0.2, duplicate=0.2, delay_s=0.3, jitter_s=0.4)
"""The same, and out of order."""


class VehiclePair:
    """Both sides, moved tick by tick."""

    def __init__(
        self,
        seed: int = 1,
        faults: LinkFaults | None = None,
        config: VehicleConfig | None = None,
        simulated: SimulatedVehicleConfig | None = None,
    ) -> None:
        """Start both; the copter is ready to arm after a second."""
        self._faults = faults
        self.simulation = Simulation(
            [simulated or SimulatedVehicleConfig(ready_after_s=1.0, faults=faults)], seed=seed
        )
        self.copter = self.simulation.vehicles[0]
        self.vehicle = Vehicle(config)
        self.clock = ManualClock()
        self.events: list[tuple[float, VehicleEvent]] = []
        self.sent: list[tuple[float, Message]] = []
        self._codec = Codec(1, 191)
        self.vehicle.start(0.0)

    @property
    def now(self) -> float:
        """Simulated time."""
        return self.clock.now()

    def tick(self) -> None:
        """Continue by 10 ms."""
        self.simulation.run_for(TICK_S)
        self.clock.advance_to(self.simulation.time_s)
        now = self.now
        for datagram in self.simulation.link.read_datagrams():
            for message in self._codec.decode(datagram):
                self.vehicle.receive(message, now)
        deadline = self.vehicle.next_deadline()
        if deadline is not None and deadline <= now:
            self.vehicle.handle_timer(now)
        self.flush()

    def flush(self) -> None:
        """Send what the vehicle has to send; take its events."""
        for message in self.vehicle.messages_to_send():
            self.sent.append((self.now, message))
            self.simulation.link.write(self._codec.encode(message))
        while (event := self.vehicle.next_event()) is not None:
            self.events.append((self.now, event))

    def run_for(self, seconds: float) -> None:
        """Continue for a while."""
        end_s = self.now + seconds
        while self.now < end_s:
            self.tick()

    def run_until(self, condition: Callable[[], bool], timeout_s: float = 60.0) -> None:
        """Continue until it holds; fail after `timeout_s` of simulated time."""
        end_s = self.now + timeout_s
        while not condition():
            assert self.now < end_s, f"not within {timeout_s} s; last: {self.events[-6:]}"
            self.tick()

    def all(self, kind: type[EventT]) -> list[EventT]:
        """Return all events of one kind."""
        return [event for _, event in self.events if isinstance(event, kind)]

    def finish(self, operation_id: int, timeout_s: float = 60.0) -> OperationFinished:
        """Continue until an operation has ended, and return how; it must end once."""
        self.flush()
        self.run_until(lambda: bool(self._ends(operation_id)), timeout_s)
        (end,) = self._ends(operation_id)
        return end

    def ready(self) -> VehiclePair:
        """Continue until the vehicle is found, its telemetry comes and it would arm."""
        self.run_until(
            lambda: (
                self.vehicle.state.prearm_ok is True
                and self.vehicle.state.position_valid
                and self.vehicle.state.local_position is not None
                and self.vehicle.state.home is not None
            )
        )
        return self

    def reboot(self) -> None:
        """Restart the autopilot, as a ground station on another link would."""
        station = Codec(255, 190)
        command = make("COMMAND_LONG", target_system=1, target_component=1, command=246, param1=1.0)
        link = self.simulation.link
        link.set_faults(None)
        link.write(station.encode(command))
        link.set_faults(self._faults)

    def names_sent(self) -> list[str]:
        """Return the names of all messages that were sent."""
        return [message.get_type() for _, message in self.sent]

    def _ends(self, operation_id: int) -> list[OperationFinished]:
        return [e for e in self.all(OperationFinished) if e.operation_id == operation_id]
