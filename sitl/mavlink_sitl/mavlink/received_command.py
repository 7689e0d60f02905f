"""A command as it was received, and the server as its handlers see it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol

from mavlink_sitl.autopilot.common.commander import Commander
from mavlink_sitl.mavlink.codec import Message
from mavlink_sitl.mavlink.messages.streams import StreamSchedule

RELATIVE_ALT = 3


@dataclass(frozen=True)
class ReceivedCommand:
    """A command in its COMMAND_INT form.

    Attributes:
        id: MAV_CMD.
        params: param1..param4.
        x: latitude, 1e7 degrees, or param5.
        y: longitude, 1e7 degrees, or param6.
        z: altitude, metres, or param7.
        frame: MAV_FRAME.
        is_long: whether it came as a COMMAND_LONG.
    """

    id: int
    params: tuple[float, float, float, float]
    x: float
    y: float
    z: float
    frame: int
    is_long: bool


def from_message(message: Message) -> ReceivedCommand:
    """Either message as a command."""
    params = (message.param1, message.param2, message.param3, message.param4)
    if message.get_type() == "COMMAND_INT":
        return ReceivedCommand(
            message.command, params, message.x, message.y, message.z, message.frame, False
        )
    x, y = message.param5, message.param6
    return ReceivedCommand(message.command, params, x, y, message.param7, RELATIVE_ALT, True)


class CommandServer(Protocol):
    """A server, as far as the handlers of commands use it.

    Attributes:
        now_us: simulated time.
        streams: what is sent at a rate.
        heartbeat_us: from HEARTBEAT to HEARTBEAT; 0 for none.
    """

    now_us: int
    streams: StreamSchedule
    heartbeat_us: int

    @property
    def vehicle(self) -> Commander:
        """The vehicle that it speaks for."""

    @property
    def builders(self) -> Mapping[int, Any]:
        """By message id: what can be streamed and requested."""

    def send(self, message: Message) -> None:
        """Put a message into the outboxes."""

    def beat(self, interval_us: int) -> None:
        """Send HEARTBEAT at another interval; 0 for no more."""

    def send_later(self, message_id: int) -> None:
        """Send a telemetry message once the answer to the request is out."""

    def send_mode_list(self, place: int) -> bool:
        """AVAILABLE_MODES: one of them, from 1, or with 0 all; whether there is such a one."""
