"""PREFLIGHT_CALIBRATION."""

from __future__ import annotations

from typing import TYPE_CHECKING

from mavlink_sitl.exchange import Result, Severity
from mavlink_sitl.mavlink.received_command import ReceivedCommand

if TYPE_CHECKING:
    from mavlink_sitl.mavlink.server import MavlinkServer


FORCE_SAVE = 76
SIMPLE, TRIM = 4, 2
"""PREFLIGHT_CALIBRATION's param5: accelerometers on the level, and their trim"""


def calibrate(server: MavlinkServer, command: ReceivedCommand) -> Result:
    """PREFLIGHT_CALIBRATION: what needs no hands on the vehicle is done at once."""
    vehicle = server.vehicle
    if vehicle.soft_armed:
        vehicle.say(Severity.NOTICE, "Disarm to allow calibration")
        return Result.FAILED
    gyroscopes, compass, barometer, _ = command.params
    if gyroscopes == 1.0:
        vehicle.saved.gyroscopes()
        return Result.ACCEPTED
    if barometer == 1.0:
        vehicle.say(Severity.INFO, "Updating barometer calibration")
        vehicle.saved.barometers()
        vehicle.say(Severity.INFO, "Barometer calibration complete")
        return Result.ACCEPTED
    if command.x in (SIMPLE, TRIM, FORCE_SAVE):
        vehicle.saved.accelerometers(trim=command.x == TRIM)
        return Result.ACCEPTED
    return Result.ACCEPTED if compass == FORCE_SAVE else Result.UNSUPPORTED
