"""PREFLIGHT_CALIBRATION, ACCELCAL_VEHICLE_POS and the calibration of the compasses."""

from __future__ import annotations

from typing import TYPE_CHECKING

from mavlink_sitl.exchange import Result, Severity
from mavlink_sitl.mavlink import setpoints
from mavlink_sitl.mavlink.codec import dialect
from mavlink_sitl.mavlink.received_command import Handler, ReceivedCommand

if TYPE_CHECKING:
    from mavlink_sitl.mavlink.server import MavlinkServer


FORCE_SAVE = 76
POSITIONS, SIMPLE, TRIM = 1, 4, 2
"""PREFLIGHT_CALIBRATION's param5: accelerometers in six positions, on the level, their trim"""


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
    if command.x == POSITIONS:
        vehicle.saved.gyroscopes()
        vehicle.accelerometers.start()
        return Result.ACCEPTED
    if command.x in (SIMPLE, TRIM, FORCE_SAVE):
        vehicle.saved.accelerometers(trim=command.x == TRIM)
        return Result.ACCEPTED
    return Result.ACCEPTED if compass == FORCE_SAVE else Result.UNSUPPORTED


def _in_position(server: MavlinkServer, command: ReceivedCommand) -> Result:
    there = server.vehicle.accelerometers.there(command.params[0])
    return Result.ACCEPTED if there else Result.FAILED


def _start_compasses(server: MavlinkServer, command: ReceivedCommand) -> Result:
    mask, _, autosave, delay_s = command.params
    reboot = setpoints.usable(command.x) and command.x != 0
    return server.vehicle.compasses.start(int(mask), autosave != 0.0, delay_s, reboot)


def _accept_compasses(server: MavlinkServer, command: ReceivedCommand) -> Result:
    return server.vehicle.compasses.accept(int(command.params[0]))


def _cancel_compasses(server: MavlinkServer, command: ReceivedCommand) -> Result:
    return server.vehicle.compasses.cancel(int(command.params[0]))


CALIBRATION: dict[int, tuple[Handler, int]] = {
    dialect.MAV_CMD_PREFLIGHT_CALIBRATION: (calibrate, 4),
    dialect.MAV_CMD_ACCELCAL_VEHICLE_POS: (_in_position, 1),
    dialect.MAV_CMD_DO_START_MAG_CAL: (_start_compasses, 4),
    dialect.MAV_CMD_DO_ACCEPT_MAG_CAL: (_accept_compasses, 1),
    dialect.MAV_CMD_DO_CANCEL_MAG_CAL: (_cancel_compasses, 1),
}
"""By MAV_CMD: what carries it out, and how many of param1..4 count"""
