"""Commands of PX4 that only some kinds of vehicle have, and the table of each kind.

Read in the firmware: DO_ORBIT is a mode of multicopters.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from mavlink_sitl.autopilot.px4.multicopter.copter import Px4Copter
from mavlink_sitl.autopilot.px4.multicopter.orbit import OrbitRequest
from mavlink_sitl.exchange import Result, Severity
from mavlink_sitl.mavlink.codec import dialect
from mavlink_sitl.mavlink.px4.commands import HANDLERS, Handler, place_of
from mavlink_sitl.mavlink.received_command import ReceivedCommand
from mavlink_sitl.mavlink.setpoints import usable

if TYPE_CHECKING:
    from mavlink_sitl.mavlink.px4.server import Px4Server

FIGURE_EIGHT = 35


def handle(server: Px4Server, command: ReceivedCommand) -> Result | None:
    """Carry out a command.

    Returns:
        The result for COMMAND_ACK, or None when no answer is sent.
    """
    entry = BY_KIND[server.vehicle.personality.kind].get(command.id)
    if entry is None:
        return Result.UNSUPPORTED
    handler, used = entry
    if not all(usable(value) for value in command.params[:used]):
        return Result.DENIED
    return handler(server, command)


def _given(value: float) -> float | None:
    return value if usable(value) else None


def orbit(server: Px4Server, command: ReceivedCommand) -> Result:
    """DO_ORBIT of a multicopter; how many turns (param4) does not count."""
    assert isinstance(server.vehicle, Px4Copter)
    radius, speed, behaviour, _ = command.params
    return server.vehicle.orbit(
        OrbitRequest(
            _given(radius),
            _given(speed),
            round(behaviour) if usable(behaviour) else None,
            place_of(command),
            _given(command.z),
        )
    )


def no_figure_eight(server: Px4Server, _: ReceivedCommand) -> None:
    """DO_FIGURE_EIGHT to a copter, rover or boat: a text and no COMMAND_ACK."""
    text = "Figure 8 command only available for fixed wing and vtol vehicles."
    server.vehicle.say(Severity.CRITICAL, text)


_ORBIT = dialect.MAV_CMD_DO_ORBIT
_WITHOUT: dict[int, tuple[Handler, int]] = {**HANDLERS, FIGURE_EIGHT: (no_figure_eight, 0)}
BY_KIND: dict[str, dict[int, tuple[Handler, int]]] = {
    "px4copter": {**_WITHOUT, _ORBIT: (orbit, 0)},
    "px4rover": _WITHOUT,
    "px4boat": _WITHOUT,
    "px4plane": HANDLERS,
}
"""By vehicle type and MAV_CMD; see `HANDLERS`"""
