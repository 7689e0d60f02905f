"""Replays the ground station's messages of a recording to a simulated vehicle."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from comparison.recording import Recording, Timed, decode_telemetry, sender_of
from comparison.start import Start
from mavlink_sitl.mavlink.codec import Decoder, Encoder, Message, dialect
from mavlink_sitl.mavlink.missions.mission_items import identity
from mavlink_sitl.simulation import Simulation

STEP_US = 50_000
SETTLE_S = 5.0
"""From ready to doing something, before a recording that begins in the middle"""
LONGEST_WAY_S = 600.0
GUIDED = {"copter": 4, "rover": 15, "boat": 15, "plane": 15}
PLANE_TAKEOFF = 13
OFFBOARD = 6 << 16
FORCE = 21196
"""Arming without checks"""
POSITION_ONLY = 0xDF8
NEAR_M = {"copter": 0.5, "rover": 2.5, "boat": 2.5, "plane": 150.0}


@dataclass(frozen=True)
class Conversation:
    """One flight, twice. Times are seconds since power-up.

    Attributes:
        recording: what the ground station and the real vehicle said.
        start: how the vehicle was at the beginning.
        ours: what the simulated one said.
    """

    recording: Recording
    start: Start
    ours: Timed

    @property
    def sent(self) -> Timed:
        """The messages of the ground station."""
        return self.recording.sent

    @property
    def real(self) -> Timed:
        """The messages of the real vehicle."""
        return self.recording.real


def replay(recording: Recording, start: Start, seed: int = 1) -> Conversation:
    """Play a recording to a simulated vehicle that begins as the real one did."""
    player = _Player(start, seed)
    player.prepare(recording.begin_s)
    player.ours.clear()
    for time_s, message in recording.sent:
        player.run_until(time_s)
        player.write(message)
    player.run_until(recording.end_s)
    return Conversation(recording, start, player.ours)


class _Player:
    def __init__(self, start: Start, seed: int) -> None:
        self._start = start
        self._simulation = Simulation([start.config], seed=seed)
        self._vehicle = self._simulation.vehicles[0]
        self._links = self._vehicle.links
        self._decoder = Decoder()
        self._encoder = Encoder(255, 190)
        self._own = (self._vehicle.system_id, 1)
        self._shift_us = 0
        """Simulated time less the recording's"""
        self.ours: Timed = []

    # The recording.

    def run_until(self, time_s: float) -> None:
        """Let time pass, by the recording's clock."""
        end_us = math.ceil(time_s * 1e6) + self._shift_us
        while self._simulation.time_us < end_us:
            self._simulation.run_to_us(min(self._simulation.time_us + STEP_US, end_us))
            self._take()

    def write(self, message: Message) -> None:
        """Hand on what the ground station said."""
        # A heartbeat that one link hands on to another came from a ground station there.
        handed_on = message.get_srcSystem() == 255 and len(self._links) > 1
        self._links[1 if handed_on else 0].write(bytes(message.get_msgbuf()))
        self._take()

    def _take(self) -> None:
        for other in self._links[1:]:
            other.read()
        now_s = (self._simulation.time_us - self._shift_us) / 1e6
        for frame in self._links[0].read_datagrams():
            for message in decode_telemetry(self._decoder, frame):
                if sender_of(message) == self._own:
                    self.ours.append((now_s, message))

    # Before the recording.

    def prepare(self, begin_s: float) -> None:
        """Bring the vehicle to where the recording begins."""
        start = self._start
        ready_s = start.config.ready_after_s + SETTLE_S
        if begin_s < ready_s and not start.under_way:
            self.run_until(begin_s)
        else:
            # The heartbeats' place within the second is kept.
            self.run_until(ready_s + (begin_s - ready_s) % 1.0)
        if start.mission:
            self._vehicle.plans.mission.replace(list(start.mission), identity(list(start.mission)))
        if start.under_way or begin_s > ready_s:
            self._set_out()
            self.run_until(self._now_s() + (begin_s - self._now_s()) % 1.0)
        for number, interval_us in start.interval_us.items():
            self._command(dialect.MAV_CMD_SET_MESSAGE_INTERVAL, number, interval_us)
        self._shift_us = self._simulation.time_us - round(begin_s * 1e6)

    def _now_s(self) -> float:
        return self._simulation.time_us / 1e6

    def _set_out(self) -> None:
        start, kind = self._start, self._start.config.vehicle
        place = start.position_ned_m
        if start.armed and start.config.autopilot == "px4":
            self._go_by_offboard(place or (0.0, 0.0, -10.0))
        elif start.armed:
            self._mode(PLANE_TAKEOFF if kind == "plane" else GUIDED[kind])
            self._command(dialect.MAV_CMD_COMPONENT_ARM_DISARM, 1, FORCE)
            self._go_by_guided(kind, place)
        if start.mode != self._vehicle.firmware.mode.spec.number:
            self._mode(start.mode)

    def _go_by_guided(self, kind: str, place: tuple[float, float, float] | None) -> None:
        if place is None or (kind == "copter" and place[2] > -1.0):
            return
        if kind == "copter":
            self._command(dialect.MAV_CMD_NAV_TAKEOFF, *[0.0] * 6, -place[2])
            self._wait(lambda: self._vehicle.firmware.motion.down_m < place[2] + 1.0)
        elif kind == "plane":
            self._wait(lambda: self._vehicle.firmware.motion.down_m < -40.0)
            self._mode(GUIDED[kind])
        self._setpoint(place)
        self._wait(lambda: self._distance_m(place) < NEAR_M[kind])

    def _go_by_offboard(self, place: tuple[float, float, float]) -> None:
        def steady() -> bool:
            self._setpoint(place)
            return self._distance_m(place) < NEAR_M["copter"]

        self._send(dialect.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))
        for _ in range(40):
            self._setpoint(place)
            self.run_until(self._now_s() + 0.05)
        self._mode(OFFBOARD)
        self._command(dialect.MAV_CMD_COMPONENT_ARM_DISARM, 1, FORCE)
        self._wait(steady)

    def _wait(self, holds: Callable[[], bool]) -> None:
        """Until it is so, or it takes too long: then the comparison begins from there."""
        limit_s = self._now_s() + LONGEST_WAY_S
        while not holds() and self._now_s() < limit_s:
            self.run_until(self._now_s() + 0.2)

    def _distance_m(self, place: tuple[float, float, float]) -> float:
        return math.dist(self._vehicle.firmware.motion[:3], place)

    def _mode(self, number: int) -> None:
        main, sub = (number >> 16 & 0xFF, number >> 24) if number > 0xFFFF else (number, 0)
        self._command(dialect.MAV_CMD_DO_SET_MODE, 1, main, sub)

    def _command(self, command: int, *values: float) -> None:
        padded = (*values, *[0.0] * (7 - len(values)))
        self._send(dialect.MAVLink_command_long_message(*self._own, command, 0, *padded))

    def _setpoint(self, place: tuple[float, float, float]) -> None:
        self._send(
            dialect.MAVLink_set_position_target_local_ned_message(
                0, *self._own, dialect.MAV_FRAME_LOCAL_NED, POSITION_ONLY, *place, *[0.0] * 8
            )
        )

    def _send(self, message: Message) -> None:
        self._links[0].write(self._encoder.encode(message))
        self._take()
