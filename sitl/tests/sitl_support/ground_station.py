"""A ground station for the simulated autopilot: pymavlink on one side, simulated time on the other.

It uses pymavlink itself, not the simulator's codec, so that a mistake there shows.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from pymavlink.dialects.v20 import all as mav

from mavlink_sitl import LinkFaults, Simulation, VehicleConfig
from mavlink_sitl.vehicles.vehicle import SimulatedVehicle

Message = Any

ACCEPTED, TEMPORARILY_REJECTED, DENIED, UNSUPPORTED, FAILED = 0, 1, 2, 3, 4
STABILIZE, ALT_HOLD, AUTO, GUIDED, LOITER, RTL, LAND, BRAKE = 0, 2, 3, 4, 5, 6, 9, 17
POSITION, VELOCITY, ACCELERATION = 0xDF8, 0xDC7, 0xC3F
POSITION_VELOCITY, POSITION_VELOCITY_ACCELERATION = 0xDC0, 0xC00
YAW, YAW_RATE = 0x400, 0x800
"""Type masks; YAW and YAW_RATE are bits to take away"""


class GroundStation:
    """Sends and receives for one vehicle of a simulation.

    Attributes:
        simulation: it.
        log: everything received, with the simulated time of reading.
    """

    def __init__(
        self,
        simulation: Simulation,
        index: int = 0,
        system: int = 255,
        component: int = 190,
        link: int = 0,
    ) -> None:
        self.simulation = simulation
        self.vehicle: SimulatedVehicle = simulation.vehicles[index]
        self.link = self.vehicle.links[link]
        self.log: list[tuple[float, Message]] = []
        self._by_kind: dict[str, list[tuple[float, Message]]] = {}
        self._sorted = 0
        self._first: tuple[float, Message] | None = None
        self._out = mav.MAVLink(None, srcSystem=system, srcComponent=component)
        self._in = mav.MAVLink(None)
        self._in.robust_parsing = True
        self._heartbeat_at_s: float | None = None

    # Time.

    @property
    def now_s(self) -> float:
        return self.simulation.time_s

    def read(self) -> list[Message]:
        """Take what has arrived; what is no message fails the test."""
        new = self._in.parse_buffer(self.link.read()) or []
        assert all(message.get_type() != "BAD_DATA" for message in new)
        self.log += [(self.now_s, message) for message in new]
        return list(new)

    def run(self, seconds: float, step_s: float = 0.05) -> None:
        """Let time pass; read, and send heartbeats if asked to."""
        end_us = self.simulation.time_us + round(seconds * 1e6)
        while self.simulation.time_us < end_us:
            if self._heartbeat_at_s is not None and self.now_s >= self._heartbeat_at_s:
                self._heartbeat_at_s = self.now_s + 1.0
                self.send(mav.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))
            self.simulation.run_for(min(step_s, (end_us - self.simulation.time_us) / 1e6))
            self.read()

    def run_until(self, condition: Callable[[], bool], timeout_s: float = 60.0) -> float:
        """Let time pass until something holds; how long it took. Fails the test if it doesn't."""
        start_s = self.now_s
        while not condition():
            assert self.now_s - start_s < timeout_s, f"not within {timeout_s} s"
            self.run(0.05)
        return self.now_s - start_s

    def heartbeats(self, on: bool) -> None:
        """Send a HEARTBEAT every second from now on, or no more."""
        self._heartbeat_at_s = self.now_s if on else None

    # Sending.

    def pack(self, message: Message) -> bytes:
        frame = bytes(message.pack(self._out))
        self._out.seq = (self._out.seq + 1) % 256
        return frame

    def send(self, message: Message) -> list[Message]:
        """Send; what is answered at once."""
        self.link.write(self.pack(message))
        return self.read()

    def command(self, command: int, *params: float, system: int = 1, component: int = 1) -> int:
        """COMMAND_LONG; the result of its COMMAND_ACK, or -1 without one."""
        values = [*params, *([0.0] * (7 - len(params)))]
        return self._result(
            command,
            self.send(mav.MAVLink_command_long_message(system, component, command, 0, *values)),
        )

    def command_int(
        self,
        command: int,
        frame: int,
        *params: float,
        x: int = 0,
        y: int = 0,
        z: float = 0.0,
    ) -> int:
        """COMMAND_INT; the same."""
        values = [*params, *([0.0] * (4 - len(params)))]
        return self._result(
            command,
            self.send(
                mav.MAVLink_command_int_message(1, 1, frame, command, 0, 0, *values, x, y, z)
            ),
        )

    @staticmethod
    def _result(command: int, answers: list[Message]) -> int:
        acks = [m for m in answers if m.get_type() == "COMMAND_ACK"]
        assert len(acks) <= 1, "one command, one acknowledgement"
        if not acks:
            return -1
        assert acks[0].command == command
        return int(acks[0].result)

    def mode(self, number: int) -> int:
        return self.command(mav.MAV_CMD_DO_SET_MODE, 1, number)

    def arm(self) -> int:
        return self.command(mav.MAV_CMD_COMPONENT_ARM_DISARM, 1)

    def interval(self, message_id: int, rate_hz: float) -> int:
        return self.command(mav.MAV_CMD_SET_MESSAGE_INTERVAL, message_id, 1e6 / rate_hz)

    def setpoint(
        self,
        mask: int,
        position: tuple[float, float, float] = (0.0, 0.0, 0.0),
        velocity: tuple[float, float, float] = (0.0, 0.0, 0.0),
        acceleration: tuple[float, float, float] = (0.0, 0.0, 0.0),
        yaw: float = 0.0,
        yaw_rate: float = 0.0,
        frame: int = mav.MAV_FRAME_LOCAL_NED,
    ) -> list[Message]:
        """SET_POSITION_TARGET_LOCAL_NED."""
        return self.send(
            mav.MAVLink_set_position_target_local_ned_message(
                0, 1, 1, frame, mask, *position, *velocity, *acceleration, yaw, yaw_rate
            )
        )

    def stream(self, seconds: float, rate_hz: float, send: Callable[[], object]) -> None:
        """Send something at a rate for a while."""
        for _ in range(round(seconds * rate_hz)):
            send()
            self.run(1.0 / rate_hz)

    # Received messages.

    def _of_kind(self, kind: str) -> list[tuple[float, Message]]:
        """The logged messages of a kind, cached: conditions ask often, and a log gets long."""
        if self._sorted and (len(self.log) < self._sorted or self.log[0] is not self._first):
            self._by_kind, self._sorted = {}, 0  # a test has cleared the log
        for entry in self.log[self._sorted :]:
            self._by_kind.setdefault(entry[1].get_type(), []).append(entry)
        self._sorted = len(self.log)
        self._first = self.log[0] if self.log else None
        return self._by_kind.get(kind, [])

    def messages(self, kind: str, since_s: float = 0.0) -> list[Message]:
        return [m for t, m in self._of_kind(kind) if t >= since_s]

    def last(self, kind: str) -> Message:
        return self._of_kind(kind)[-1][1]

    def texts(self, since_s: float = 0.0) -> list[str]:
        return [m.text for m in self.messages("STATUSTEXT", since_s)]

    def changes(self, kind: str, field: str) -> list[int]:
        """The values a field went through."""
        values = [getattr(m, field) for m in self.messages(kind)]
        return [v for i, v in enumerate(values) if i == 0 or v != values[i - 1]]

    # Where the vehicle is.

    @property
    def position(self) -> tuple[float, float, float]:
        """The truth, NED metres from home."""
        north, east, down = self.simulation.truth.position_ned_m[self.vehicle.index]
        return float(north), float(east), float(down)

    @property
    def velocity(self) -> tuple[float, float, float]:
        """The truth, NED m/s."""
        north, east, down = self.simulation.truth.velocity_ned_m_s[self.vehicle.index]
        return float(north), float(east), float(down)

    # Whole manoeuvres.

    def ready(self) -> GroundStation:
        """Wait until the vehicle knows its position; ask for the usual streams."""
        self.run_until(lambda: self.vehicle.firmware.estimator.position_ok)
        self.run(1.5)
        for message_id in (1, 30, 32, 33, 85, 147, 245):
            assert self.interval(message_id, 10.0) == ACCEPTED
        return self

    def take_off(self, height_m: float) -> GroundStation:
        """GUIDED, arm, climb, and wait until it is done."""
        assert self.mode(GUIDED) == ACCEPTED
        assert self.arm() == ACCEPTED
        assert self.command(mav.MAV_CMD_NAV_TAKEOFF, 0, 0, 0, 0, 0, 0, height_m) == ACCEPTED
        self.run_until(lambda: self.vehicle.firmware.landed_state.name == "IN_AIR")
        return self


def alive(station: GroundStation, seconds: float = 1.5) -> None:
    """See a vehicle think, move and answer after all that it has received."""
    station.vehicle.link.read()
    station.log.clear()
    station.run(seconds)
    assert station.messages("HEARTBEAT")
    assert all(math.isfinite(x) for x in (*station.position, *station.velocity))
    assert station.command(31999) == UNSUPPORTED


def copter(
    ready_after_s: float = 1.0,
    parameters: dict[str, float] | None = None,
    seed: int = 1,
    faults: LinkFaults | None = None,
    links: tuple[str, ...] = ("gcs",),
) -> GroundStation:
    """A ground station with a copter that has just been switched on."""
    config = VehicleConfig(
        ready_after_s=ready_after_s, parameters=parameters or {}, faults=faults, links=links
    )
    return GroundStation(Simulation([config], seed=seed))


def flying(height_m: float = 10.0, parameters: dict[str, float] | None = None) -> GroundStation:
    """A ground station with a copter that hovers in GUIDED above home."""
    return copter(parameters=parameters).ready().take_off(height_m)
