"""Commands that rovers, boats and planes answer differently from copters.

Seen in `rover_guided` and `plane_guided`. None stands for UNSUPPORTED.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from mavlink_sitl.autopilot import plane, rover
from mavlink_sitl.autopilot.guided import Frame, Setpoint
from mavlink_sitl.exchange import Result
from mavlink_sitl.mavlink import setpoints
from mavlink_sitl.mavlink.codec import dialect
from mavlink_sitl.mavlink.copter_commands import COPTER

if TYPE_CHECKING:
    from mavlink_sitl.mavlink.commands import Command
    from mavlink_sitl.mavlink.server import MavlinkServer

Handler = Callable[["MavlinkServer", "Command"], Result]


def _mode(number: int) -> Handler:
    return lambda server, _: server.copter.set_mode(number)


def _reposition(guided: int, otherwise: Result) -> Handler:
    """DO_REPOSITION as COMMAND_INT; bit 0 of param2 allows the change to GUIDED."""

    def handler(server: MavlinkServer, command: Command) -> Result:
        copter = server.copter
        if command.is_long:
            return Result.UNSUPPORTED
        if copter.mode.spec.number != guided and not int(command.params[1]) & 1:
            return otherwise
        if not setpoints.usable(command.z) or (command.x == 0 and command.y == 0):
            return Result.DENIED
        position = setpoints.local_position(
            copter, command.frame, int(command.x), int(command.y), command.z
        )
        if position is None:
            return Result.DENIED
        if isinstance(copter, plane.Plane) and not copter.fence.allows(position):
            return Result.DENIED
        if copter.set_mode(guided) is not Result.ACCEPTED:
            return Result.FAILED
        if isinstance(copter, plane.Plane):
            radius, backwards = command.params[2], command.params[3]
            against = setpoints.usable(backwards) and backwards != 0.0
            copter.reposition(position, -max(radius, 0.0) if against else max(radius, 0.0))
            return Result.ACCEPTED
        if command.params[0] > 0.0:
            copter.change_speed(1, command.params[0])
        copter.go_to(Setpoint(Frame.LOCAL, position_m=position))
        return Result.ACCEPTED

    return handler


def _as_plane(server: MavlinkServer) -> plane.Plane:
    assert isinstance(server.copter, plane.Plane)
    return server.copter


def _start_landing(server: MavlinkServer, _: Command) -> Result:
    """DO_LAND_START: to the nearest one in the mission."""
    return Result.ACCEPTED if _as_plane(server).start_landing() else Result.FAILED


def _go_around(server: MavlinkServer, command: Command) -> Result:
    """DO_GO_AROUND: only while landing."""
    return Result.ACCEPTED if _as_plane(server).go_around(command.params[0]) else Result.FAILED


def _mission_start(server: MavlinkServer, command: Command) -> Result:
    """MISSION_START: of the whole mission only."""
    if command.params[0] or command.params[1]:
        return Result.DENIED
    return server.copter.start_mission()


_ROVER: dict[int, Handler | None] = {
    dialect.MAV_CMD_NAV_TAKEOFF: None,
    dialect.MAV_CMD_NAV_LAND: None,
    dialect.MAV_CMD_NAV_LOITER_UNLIM: None,
    dialect.MAV_CMD_NAV_RETURN_TO_LAUNCH: _mode(rover.MODE_RTL),
    dialect.MAV_CMD_DO_REPOSITION: _reposition(rover.MODE_GUIDED, Result.DENIED),
}

_PLANE: dict[int, Handler | None] = {
    dialect.MAV_CMD_NAV_LAND: None,
    dialect.MAV_CMD_DO_LAND_START: _start_landing,
    dialect.MAV_CMD_DO_GO_AROUND: _go_around,
    dialect.MAV_CMD_MISSION_START: _mission_start,
    dialect.MAV_CMD_NAV_TAKEOFF: lambda *_: Result.FAILED,
    dialect.MAV_CMD_NAV_LOITER_UNLIM: _mode(plane.MODE_LOITER),
    dialect.MAV_CMD_NAV_RETURN_TO_LAUNCH: _mode(plane.MODE_RTL),
    dialect.MAV_CMD_DO_REPOSITION: _reposition(plane.MODE_GUIDED, Result.FAILED),
}

BY_KIND: dict[str, dict[int, Handler | None]] = {
    "copter": COPTER,
    "rover": _ROVER,
    "boat": _ROVER,
    "plane": _PLANE,
}
"""By kind of vehicle and command: what is answered another way"""
