"""A command as it was received, and the type of its handlers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

from mavlink_sitl.exchange import Result
from mavlink_sitl.mavlink.codec import Message

if TYPE_CHECKING:
    from mavlink_sitl.mavlink.server import MavlinkServer

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


Handler: TypeAlias = "Callable[[MavlinkServer, ReceivedCommand], Result]"
