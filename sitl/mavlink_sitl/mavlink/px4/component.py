"""A MAVLink component beside a PX4, on each of its links, sans-IO.

PX4 hands on what is sent to such a component, and nothing of it is signed.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import ClassVar

from mavlink_sitl.autopilot.px4.payload import Px4Payload
from mavlink_sitl.exchange import Result
from mavlink_sitl.mavlink.codec import Encoder, Message, dialect
from mavlink_sitl.mavlink.messages.snapshot import Builder, Snapshot

HEARTBEAT_US = 1_000_000
COMMANDS = ("COMMAND_LONG", "COMMAND_INT")


class Component:
    """Speaks for one component on one link.

    Args:
        system_id: of the vehicle.
        payload: gimbal and camera.
        snapshot: what the vehicle would report now.
        send: takes a frame for the link.
        now_us: simulated time.

    Attributes:
        number: its MAVLink component.
        kind: its MAV_TYPE.
        builders: what can be requested, by message id.
        due_us: when `tick` has something to do.
    """

    number: ClassVar[int]
    kind: ClassVar[int]
    builders: ClassVar[Mapping[int, Builder]]
    requests: ClassVar[Mapping[int, int]] = {dialect.MAV_CMD_REQUEST_MESSAGE: 0}
    """By command: the message that it requests; 0 for that of its first parameter"""

    def __init__(
        self,
        system_id: int,
        payload: Px4Payload,
        snapshot: Callable[[], Snapshot],
        send: Callable[[bytes], None],
        now_us: int,
    ) -> None:
        self.payload = payload
        self._system_id = system_id
        self._snapshot = snapshot
        self._send_frame = send
        self._encoder = Encoder(system_id, self.number)
        self.due_us = self._beat_at_us = now_us

    def send(self, number: int) -> None:
        """Send a message by its id."""
        message = self.builders[number](self._snapshot())
        for each in message if isinstance(message, list) else (message,):
            if each is not None:
                self._send_frame(self._encoder.encode(each))

    def tick(self, now_us: int) -> None:
        """Send HEARTBEAT once a second."""
        if now_us >= self._beat_at_us:
            self._beat_at_us += HEARTBEAT_US
            beat = dialect.MAVLink_heartbeat_message
            nobody, active = dialect.MAV_AUTOPILOT_INVALID, dialect.MAV_STATE_ACTIVE
            self._send_frame(self._encoder.encode(beat(self.kind, nobody, 0, 0, active, 3)))
        self.due_us = self._beat_at_us

    def is_asked(self, message: Message) -> bool:
        """Whether a message is a command for it."""
        return message.get_type() in COMMANDS and (
            message.target_system == self._system_id
            and message.target_component in (0, self.number)
        )

    def receive(self, message: Message) -> None:
        """Carry out a command, and answer it."""
        asked = self.requests.get(message.command)
        if asked is None:
            self._acknowledge(message, self.carry_out(message))
            return
        number = message.param1 if asked == 0 else asked
        known = number in self.builders
        self._acknowledge(message, Result.ACCEPTED if known else Result.UNSUPPORTED)
        if known:
            self.send(int(number))

    def _acknowledge(self, message: Message, result: Result) -> None:
        sender = (message.get_srcSystem(), message.get_srcComponent())
        ack = dialect.MAVLink_command_ack_message(message.command, int(result), 0, 0, *sender)
        self._send_frame(self._encoder.encode(ack))

    def carry_out(self, message: Message) -> Result:
        """Carry out a command that is no request for a message."""
        return Result.UNSUPPORTED
