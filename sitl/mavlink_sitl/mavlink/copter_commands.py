"""Commands known only to copters here, or carried out by them in their own way.

Answers are those of the recording `copter_acks`; others follow ArduCopter's source.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from mavlink_sitl.autopilot.ardupilot.copter.copter import Copter
from mavlink_sitl.exchange import Result
from mavlink_sitl.mavlink import setpoints
from mavlink_sitl.mavlink.codec import dialect
from mavlink_sitl.mavlink.received_command import Handler, ReceivedCommand

if TYPE_CHECKING:
    from mavlink_sitl.mavlink.server import MavlinkServer


def _copter(server: MavlinkServer) -> Copter:
    assert isinstance(server.vehicle, Copter)
    return server.vehicle


def condition_yaw(server: MavlinkServer, command: ReceivedCommand) -> Result:
    """CONDITION_YAW: turn the nose, in the modes that fly by themselves."""
    angle_deg, rate_deg_s, direction, relative = command.params
    if not 0.0 <= angle_deg <= 360.0 or relative not in (0.0, 1.0):
        return Result.FAILED
    copter = _copter(server)
    copter.yaw.turn(copter.motion.yaw_rad, angle_deg, rate_deg_s, direction, relative)
    return Result.ACCEPTED


def look_at(server: MavlinkServer, command: ReceivedCommand) -> Result:
    """DO_SET_ROI and DO_SET_ROI_LOCATION: keep the nose towards a place; zeros end that."""
    copter = _copter(server)
    if not (command.x or command.y or command.z):
        return look_at_nothing(server, command)
    place = setpoints.place_of(copter, command, command.frame)
    if place is None:
        return Result.DENIED
    copter.yaw.look_at(place)
    return Result.ACCEPTED


def look_at_nothing(server: MavlinkServer, _: ReceivedCommand) -> Result:
    """DO_SET_ROI_NONE."""
    _copter(server).yaw.look_at(None)
    return Result.ACCEPTED


def motor_test(server: MavlinkServer, command: ReceivedCommand) -> Result:
    """DO_MOTOR_TEST; param5 is how many motors."""
    place, kind, value, each_s = command.params
    if not setpoints.usable(command.x):
        return Result.DENIED
    test = _copter(server).motor_test
    return test.start(int(place), int(kind), value, each_s, int(command.x))


COPTER: dict[int, tuple[Handler, int]] = {
    dialect.MAV_CMD_CONDITION_YAW: (condition_yaw, 4),
    dialect.MAV_CMD_DO_SET_ROI: (look_at, 0),
    dialect.MAV_CMD_DO_SET_ROI_LOCATION: (look_at, 0),
    dialect.MAV_CMD_DO_SET_ROI_NONE: (look_at_nothing, 0),
    dialect.MAV_CMD_DO_MOTOR_TEST: (motor_test, 4),
    dialect.MAV_CMD_DO_LAND_START: (lambda s, _: _copter(s).start_landing_sequence(), 0),
}
"""By MAV_CMD: what carries it out, and how many of param1..4 count"""
