"""Commands known only to copters here, or answered alike by every ArduPilot on the ground.

What `copter_acks` shows is answered as there; the rest follows ArduCopter's source.
"""

from __future__ import annotations

from collections.abc import Callable

from mavlink_sitl.autopilot.ardupilot.copter.copter import Copter
from mavlink_sitl.exchange import Result, Severity
from mavlink_sitl.mavlink import setpoints
from mavlink_sitl.mavlink.codec import dialect
from mavlink_sitl.mavlink.received_command import CommandServer, ReceivedCommand

Handler = Callable[[CommandServer, ReceivedCommand], Result]

FORCE_SAVE = 76
SIMPLE, TRIM = 4, 2
"""PREFLIGHT_CALIBRATION's param5: accelerometers on the level, and their trim"""


def _copter(server: CommandServer) -> Copter:
    assert isinstance(server.vehicle, Copter)
    return server.vehicle


def condition_yaw(server: CommandServer, command: ReceivedCommand) -> Result:
    """CONDITION_YAW: turn the nose, in the modes that fly by themselves."""
    angle_deg, rate_deg_s, direction, relative = command.params
    if not 0.0 <= angle_deg <= 360.0 or relative not in (0.0, 1.0):
        return Result.FAILED
    copter = _copter(server)
    copter.yaw.turn(copter.motion.yaw_rad, angle_deg, rate_deg_s, direction, relative)
    return Result.ACCEPTED


def look_at(server: CommandServer, command: ReceivedCommand) -> Result:
    """DO_SET_ROI and DO_SET_ROI_LOCATION: keep the nose towards a place; zeros end that."""
    copter = _copter(server)
    if not (command.x or command.y or command.z):
        return look_at_nothing(server, command)
    place = setpoints.place_of(copter, command, command.frame)
    if place is None:
        return Result.DENIED
    copter.yaw.look_at(place)
    return Result.ACCEPTED


def look_at_nothing(server: CommandServer, _: ReceivedCommand) -> Result:
    """DO_SET_ROI_NONE."""
    _copter(server).yaw.look_at(None)
    return Result.ACCEPTED


def motor_test(server: CommandServer, command: ReceivedCommand) -> Result:
    """DO_MOTOR_TEST; param5 is how many motors."""
    place, kind, value, each_s = command.params
    if not setpoints.usable(command.x):
        return Result.DENIED
    test = _copter(server).motor_test
    return test.start(int(place), int(kind), value, each_s, int(command.x))


def calibrate(server: CommandServer, command: ReceivedCommand) -> Result:
    """PREFLIGHT_CALIBRATION: what needs no hands on the vehicle is done at once."""
    copter = server.vehicle
    if copter.soft_armed:
        copter.say(Severity.NOTICE, "Disarm to allow calibration")
        return Result.FAILED
    gyroscopes, compass, barometer, _ = command.params
    if gyroscopes == 1.0:
        return Result.ACCEPTED
    if barometer == 1.0:
        copter.say(Severity.INFO, "Updating barometer calibration")
        copter.say(Severity.INFO, "Barometer calibration complete")
        return Result.ACCEPTED
    done = command.x in (SIMPLE, TRIM, FORCE_SAVE) or compass == FORCE_SAVE
    return Result.ACCEPTED if done else Result.UNSUPPORTED


def _always(result: Result) -> Handler:
    return lambda *_: result


def _source_set(_: CommandServer, command: ReceivedCommand) -> Result:
    return Result.ACCEPTED if command.params[0] in (1.0, 2.0, 3.0) else Result.DENIED


def set_servo(server: CommandServer, command: ReceivedCommand) -> Result:
    """DO_SET_SERVO."""
    return server.vehicle.set_servo(int(command.params[0]), command.params[1])


COPTER: dict[int, tuple[Handler, int]] = {
    dialect.MAV_CMD_CONDITION_YAW: (condition_yaw, 4),
    dialect.MAV_CMD_DO_SET_ROI: (look_at, 0),
    dialect.MAV_CMD_DO_SET_ROI_LOCATION: (look_at, 0),
    dialect.MAV_CMD_DO_SET_ROI_NONE: (look_at_nothing, 0),
    dialect.MAV_CMD_DO_MOTOR_TEST: (motor_test, 4),
    dialect.MAV_CMD_PREFLIGHT_CALIBRATION: (calibrate, 4),
    dialect.MAV_CMD_DO_SET_SERVO: (set_servo, 2),
    dialect.MAV_CMD_DO_LAND_START: (lambda s, _: _copter(s).start_landing_sequence(), 0),
    # What there is none of, or nobody sees. The answers are those of `copter_ground_cmds`.
    dialect.MAV_CMD_DO_GRIPPER: (_always(Result.FAILED), 0),
    dialect.MAV_CMD_VIDEO_START_CAPTURE: (_always(Result.FAILED), 0),
    dialect.MAV_CMD_DO_MOUNT_CONTROL: (_always(Result.FAILED), 0),
    dialect.MAV_CMD_DO_SET_RELAY: (_always(Result.ACCEPTED), 2),
    dialect.MAV_CMD_DO_REPEAT_SERVO: (_always(Result.ACCEPTED), 4),
    dialect.MAV_CMD_DO_SET_CAM_TRIGG_DIST: (_always(Result.ACCEPTED), 3),
    dialect.MAV_CMD_DO_DIGICAM_CONTROL: (_always(Result.ACCEPTED), 4),
    dialect.MAV_CMD_SET_EKF_SOURCE_SET: (_source_set, 1),
}
"""By MAV_CMD: what carries it out, and how many of param1..4 count"""
