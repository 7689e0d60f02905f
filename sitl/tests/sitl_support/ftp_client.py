"""MAVFTP for a station: single requests, and pymavlink's own client over simulated time."""

from __future__ import annotations

import struct
from typing import Any, NamedTuple

from pymavlink.dialects.v20 import all as mav

from mavlink_sitl import Simulation, VehicleConfig
from sitl_support.ground_station import GroundStation, Message

ACK, NAK = 128, 129
CARDS = {"ardupilot": "/", "px4": "/fs/microsd/"}
"""Where files may be put"""
HEADER = struct.Struct("<HBBBBBxI")


class Reply(NamedTuple):
    """An answer as it came."""

    number: int
    session: int
    kind: int
    op: int
    complete: int
    offset: int
    data: bytes


def reply(message: Message) -> Reply:
    payload = bytes(message.payload)
    number, session, kind, size, op, complete, offset = HEADER.unpack_from(payload)
    return Reply(number, session, kind, op, complete, offset, payload[12 : 12 + size])


class FtpClient:
    """Sends requests with numbers of their own."""

    def __init__(self, station: GroundStation) -> None:
        self.station = station
        self._number = 0

    def send(
        self, op: int, data: bytes = b"", offset: int = 0, size: int | None = None, session: int = 0
    ) -> None:
        """Only send."""
        head = HEADER.pack(
            self._number, session, op, len(data) if size is None else size, 0, 0, offset
        )
        payload = (head + data).ljust(251, b"\0")
        self._number = (self._number + 1) % 65536
        self.station.send(mav.MAVLink_file_transfer_protocol_message(0, 1, 1, payload))

    def ask(
        self, op: int, data: bytes = b"", offset: int = 0, size: int | None = None, session: int = 0
    ) -> list[Reply]:
        """Send and wait; all that comes."""
        begin = len(self.station.messages("FILE_TRANSFER_PROTOCOL"))
        self.send(op, data, offset, size, session)
        self.station.run(0.3, step_s=0.1)
        return [reply(m) for m in self.station.messages("FILE_TRANSFER_PROTOCOL")[begin:]]

    def one(
        self, op: int, data: bytes = b"", offset: int = 0, size: int | None = None, session: int = 0
    ) -> Reply:
        (answer,) = self.ask(op, data, offset, size, session)
        return answer

    def refused(
        self, op: int, data: bytes = b"", offset: int = 0, size: int | None = None, session: int = 0
    ) -> list[int]:
        """The error of a request, and errno if it has one."""
        answer = self.one(op, data, offset, size, session)
        assert answer.kind == NAK
        return list(answer.data)

    def done(
        self, op: int, data: bytes = b"", offset: int = 0, size: int | None = None, session: int = 0
    ) -> bytes:
        """The data of the answer to a request, which must be an ACK."""
        answer = self.one(op, data, offset, size, session)
        assert answer.kind == ACK, (op, answer)
        return answer.data


def connected(autopilot: str, vehicle: str = "copter") -> FtpClient:
    """A client of a vehicle that has just started."""
    config = VehicleConfig(autopilot=autopilot, vehicle=vehicle, ready_after_s=1.0)
    station = GroundStation(Simulation([config], seed=1))
    station.run(3.0)
    return FtpClient(station)


def card(client: FtpClient, name: str = "") -> bytes:
    """A path that may be changed."""
    px4 = client.station.vehicle.firmware.personality.kind.startswith("px4")
    return f"{CARDS['px4' if px4 else 'ardupilot']}{name}".encode("ascii")


class Master:
    """A link as pymavlink's MAVFTP uses it; a wait lets simulated time pass."""

    source_system, source_component = 255, 190

    def __init__(self, station: GroundStation) -> None:
        self._station = station
        self._taken = len(station.messages("FILE_TRANSFER_PROTOCOL"))
        self.mav = self

    def file_transfer_protocol_send(
        self, network: int, system: int, component: int, payload: Any
    ) -> None:
        message = mav.MAVLink_file_transfer_protocol_message(
            network, system, component, bytes(payload)
        )
        self._station.send(message)

    def recv_match(self, **_: object) -> Message | None:
        for _attempt in range(20):
            received = self._station.messages("FILE_TRANSFER_PROTOCOL")
            if self._taken < len(received):
                self._taken += 1
                return received[self._taken - 1]
            self._station.run(0.01, step_s=0.01)
        return None
