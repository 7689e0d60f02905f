"""DO_AUX_FUNCTION: what the pilot's switches do, by command."""

from __future__ import annotations

from typing import TYPE_CHECKING

from mavlink_sitl.exchange import Result
from mavlink_sitl.mavlink.codec import dialect
from mavlink_sitl.mavlink.received_command import ReceivedCommand

if TYPE_CHECKING:
    from mavlink_sitl.mavlink.server import MavlinkServer

HIGHEST = 2.0
"""Position of a switch"""


def _run(server: MavlinkServer, command: ReceivedCommand) -> Result:
    function, position = command.params[:2]
    if position > HIGHEST:
        return Result.DENIED
    known = server.vehicle.aux_function(int(function), int(position))
    return Result.ACCEPTED if known else Result.FAILED


AUX_FUNCTIONS = {dialect.MAV_CMD_DO_AUX_FUNCTION: (_run, 2)}
"""By MAV_CMD: what carries it out, and how many of param1..4 count"""
