"""A UDP relay between a simulator and a server, on which a test listens, talks and cuts."""

from __future__ import annotations

import random
import selectors
import socket
import threading

from mavlink_vehicle import codec
from mavlink_vehicle.codec import Codec, Message

_LOOPBACK = "127.0.0.1"
_GROUND_STATION_SYSTEM = 255
_GROUND_STATION_COMPONENT = 190


class Relay:
    """Forwards datagrams both ways between a vehicle and a server.

    The vehicle sends to :attr:`vehicle_port`; the server listens on ``server_port``. A
    ground station of the test's own may talk to the vehicle (:meth:`send_to_vehicle`).

    Attributes:
        loss: share of datagrams that are lost, 0 to 1.
    """

    def __init__(self, server_port: int) -> None:
        """Open the sockets and start forwarding."""
        self._server = (_LOOPBACK, server_port)
        self._front = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._front.bind((_LOOPBACK, 0))
        self._back = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._back.bind((_LOOPBACK, 0))
        self._front.setblocking(False)
        self._back.setblocking(False)
        self.vehicle_port: int = self._front.getsockname()[1]
        self._vehicle: tuple[str, int] | None = None
        self._ground_station = Codec(_GROUND_STATION_SYSTEM, _GROUND_STATION_COMPONENT)
        self._lock = threading.Lock()
        self._seen: list[Message] = []
        self._sent: list[Message] = []
        self._from_vehicle = Codec(_GROUND_STATION_SYSTEM, _GROUND_STATION_COMPONENT)
        self._from_server = Codec(_GROUND_STATION_SYSTEM, _GROUND_STATION_COMPONENT)
        self.loss = 0.0
        self.withheld: frozenset[str] = frozenset()
        """Names of messages of the vehicle that are lost, with all of their datagram"""
        self.withheld_after = ""
        """The name of a message of the server that has to come first, if any"""
        self._random = random.Random(1)
        self._cut = threading.Event()
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name="relay", daemon=True)
        self._thread.start()

    def cut(self) -> None:
        """Drop everything, both ways."""
        self._cut.set()

    def join(self) -> None:
        """Forward again."""
        self._cut.clear()

    def send_to_vehicle(self, message: Message) -> None:
        """Speak to the vehicle as a ground station does."""
        assert self._vehicle is not None, "the vehicle has not sent anything yet"
        self._front.sendto(self._ground_station.encode(message), self._vehicle)

    def set_mode(self, custom_mode: int) -> None:
        """Change the vehicle's mode as a pilot at a ground station does."""
        self.send_to_vehicle(
            codec.make(
                "COMMAND_LONG",
                target_system=1,
                target_component=1,
                command=176,  # MAV_CMD_DO_SET_MODE
                param1=1.0,
                param2=float(custom_mode),
            )
        )

    def from_vehicle(self, name: str) -> list[Message]:
        """Return the messages of one kind that the vehicle has sent."""
        with self._lock:
            return [message for message in self._seen if message.get_type() == name]

    def from_server(self, name: str) -> list[Message]:
        """Return the messages of one kind that the server has sent."""
        with self._lock:
            return [message for message in self._sent if message.get_type() == name]

    def close(self) -> None:
        """Stop forwarding."""
        self._stop.set()
        self._thread.join(5.0)
        self._front.close()
        self._back.close()

    def _run(self) -> None:
        with selectors.DefaultSelector() as selector:
            selector.register(self._front, selectors.EVENT_READ)
            selector.register(self._back, selectors.EVENT_READ)
            while not self._stop.is_set():
                for key, _ in selector.select(0.05):
                    self._forward(key.fileobj is self._front)

    def _forward(self, from_vehicle: bool) -> None:
        source = self._front if from_vehicle else self._back
        try:
            data, address = source.recvfrom(65535)
        except OSError:
            return  # the other side is not there (yet, or any more)
        with self._lock:
            messages = (self._from_vehicle if from_vehicle else self._from_server).decode(data)
            (self._seen if from_vehicle else self._sent).extend(messages)
        if from_vehicle:
            self._vehicle = address
        if not from_vehicle and any(each.get_type() == self.withheld_after for each in messages):
            self.withheld_after = ""
        withholds = from_vehicle and not self.withheld_after
        withheld = withholds and any(each.get_type() in self.withheld for each in messages)
        if self._cut.is_set() or withheld or self._random.random() < self.loss:
            return
        try:
            if from_vehicle:
                self._back.sendto(data, self._server)
            elif self._vehicle is not None:
                self._front.sendto(data, self._vehicle)
        except OSError:
            return
