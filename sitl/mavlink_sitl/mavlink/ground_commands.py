"""Commands of every ArduPilot for its devices, mostly given on the ground."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from mavlink_sitl.autopilot.devices import aux_functions
from mavlink_sitl.exchange import Result, Severity
from mavlink_sitl.mavlink.codec import dialect
from mavlink_sitl.mavlink.received_command import Handler, ReceivedCommand

if TYPE_CHECKING:
    from mavlink_sitl.mavlink.server import MavlinkServer


FORCE_SAVE = 76
SIMPLE, TRIM = 4, 2
"""PREFLIGHT_CALIBRATION's param5: accelerometers on the level, and their trim"""
HIGHEST = 2.0
"""Position of a switch"""


def _calibrate(server: MavlinkServer, command: ReceivedCommand) -> Result:
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


def _switch(server: MavlinkServer, command: ReceivedCommand) -> Result:
    """DO_AUX_FUNCTION: what the pilot's switches do, by command."""
    function, position = command.params[:2]
    if position > HIGHEST:
        return Result.DENIED
    known = aux_functions.run(server.vehicle, int(function), int(position))
    return Result.ACCEPTED if known else Result.FAILED


def _reset_battery(server: MavlinkServer, command: ReceivedCommand) -> Result:
    """BATTERY_RESET: the monitor of the first battery counts from another charge."""
    vehicle, mask = server.vehicle, int(command.params[0])
    left = min(max(command.params[1] / 100.0, 0.0), 1.0)
    if mask & 1:
        spent_mah = vehicle.parameters["BATT_CAPACITY"] * (1.0 - left)
        vehicle.charge_added_mah += vehicle.observation.battery.consumed_mah - spent_mah
    return Result.ACCEPTED


def _send_banner(server: MavlinkServer, _: ReceivedCommand) -> Result:
    vehicle = server.vehicle
    for text in vehicle.personality.banner:
        vehicle.say(Severity.INFO, text)
    return Result.ACCEPTED


def _always(result: Result) -> Handler:
    return lambda *_: result


def _look_at(_: MavlinkServer, command: ReceivedCommand) -> Result:
    """DO_SET_ROI: taken for a camera that is not there."""
    given = all(map(math.isfinite, (command.x, command.y, command.z)))
    return Result.ACCEPTED if given else Result.DENIED


GROUND_COMMANDS: dict[int, tuple[Handler, int]] = {
    dialect.MAV_CMD_DO_SET_SERVO: (
        lambda s, c: s.vehicle.outputs.set_servo(int(c.params[0]), c.params[1]),
        2,
    ),
    dialect.MAV_CMD_PREFLIGHT_CALIBRATION: (_calibrate, 4),
    dialect.MAV_CMD_DO_AUX_FUNCTION: (_switch, 2),
    dialect.MAV_CMD_BATTERY_RESET: (_reset_battery, 2),
    dialect.MAV_CMD_DO_SEND_BANNER: (_send_banner, 0),
    # Devices that are not simulated. The answers are those of the recording `copter_ground_cmds`.
    dialect.MAV_CMD_DO_SET_ROI: (_look_at, 0),
    dialect.MAV_CMD_DO_SET_ROI_LOCATION: (_look_at, 0),
    dialect.MAV_CMD_DO_SET_ROI_NONE: (_always(Result.ACCEPTED), 0),
    dialect.MAV_CMD_DO_SET_RELAY: (_always(Result.ACCEPTED), 2),
    dialect.MAV_CMD_DO_REPEAT_RELAY: (_always(Result.ACCEPTED), 3),
    dialect.MAV_CMD_DO_REPEAT_SERVO: (_always(Result.ACCEPTED), 4),
    dialect.MAV_CMD_DO_GRIPPER: (_always(Result.FAILED), 0),
    dialect.MAV_CMD_VIDEO_START_CAPTURE: (_always(Result.FAILED), 0),
    dialect.MAV_CMD_DO_MOUNT_CONTROL: (_always(Result.FAILED), 0),
    dialect.MAV_CMD_DO_SET_CAM_TRIGG_DIST: (_always(Result.ACCEPTED), 3),
    dialect.MAV_CMD_DO_DIGICAM_CONTROL: (_always(Result.ACCEPTED), 4),
    dialect.MAV_CMD_DO_START_MAG_CAL: (_always(Result.ACCEPTED), 4),
    dialect.MAV_CMD_DO_ACCEPT_MAG_CAL: (_always(Result.ACCEPTED), 1),
    dialect.MAV_CMD_DO_CANCEL_MAG_CAL: (_always(Result.ACCEPTED), 1),
    dialect.MAV_CMD_SET_EKF_SOURCE_SET: (
        lambda _, c: Result.ACCEPTED if c.params[0] in (1.0, 2.0, 3.0) else Result.DENIED,
        1,
    ),
}
"""By MAV_CMD: what carries it out, and how many of param1..4 count"""
