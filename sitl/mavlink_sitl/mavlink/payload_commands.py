"""Commands for the camera, the gimbal and the gripper of an ArduPilot.

The answers are recorded of an ArduCopter 4.7, with and without these devices.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from mavlink_sitl.exchange import Result
from mavlink_sitl.mavlink import setpoints
from mavlink_sitl.mavlink.codec import dialect
from mavlink_sitl.mavlink.received_command import Handler, ReceivedCommand

if TYPE_CHECKING:
    from mavlink_sitl.mavlink.server import MavlinkServer

_TARGETING, _NEUTRAL_MODE = 2.0, 1.0
_NEUTRAL = 2


def _capture(server: MavlinkServer, command: ReceivedCommand) -> Result:
    return server.vehicle.payload.take_photo() if command.params[2] == 1.0 else Result.FAILED


def _shoot(server: MavlinkServer, command: ReceivedCommand) -> Result:
    """DO_DIGICAM_CONTROL: accepted without a camera, too."""
    if command.x == 1.0:
        server.vehicle.payload.take_photo()
    return Result.ACCEPTED


def _trigger(server: MavlinkServer, command: ReceivedCommand) -> Result:
    distance_m, _, at_once, _ = command.params
    return server.vehicle.payload.trigger_every(distance_m, at_once=at_once == 1.0)


def _configure(server: MavlinkServer, command: ReceivedCommand) -> Result:
    return server.vehicle.payload.configure((command.params[0], command.params[1]))


def _point(server: MavlinkServer, command: ReceivedCommand) -> Result:
    pitch_deg, yaw_deg = command.params[:2]
    return server.vehicle.payload.point(pitch_deg, yaw_deg, int(command.x))


def _mount(server: MavlinkServer, command: ReceivedCommand) -> Result:
    payload, (pitch_deg, _, yaw_deg, _) = server.vehicle.payload, command.params
    if command.z == _NEUTRAL_MODE:
        return payload.point(0.0, 0.0, _NEUTRAL)
    return payload.point(pitch_deg, yaw_deg, 0) if command.z == _TARGETING else Result.FAILED


def _look_at(server: MavlinkServer, command: ReceivedCommand) -> Result:
    place = setpoints.place_of(server.vehicle, command, command.frame)
    return Result.DENIED if place is None else server.vehicle.payload.look_at(place)


PAYLOAD_COMMANDS: dict[int, tuple[Handler, int]] = {
    dialect.MAV_CMD_DO_DIGICAM_CONTROL: (_shoot, 4),
    dialect.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE: (_configure, 2),
    dialect.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW: (_point, 0),
    dialect.MAV_CMD_DO_GRIPPER: (
        lambda server, command: server.vehicle.payload.grip(grabs=command.params[1] == 1.0),
        2,
    ),
    dialect.MAV_CMD_DO_MOUNT_CONTROL: (_mount, 0),
    dialect.MAV_CMD_DO_SET_CAM_TRIGG_DIST: (_trigger, 3),
    dialect.MAV_CMD_DO_SET_ROI_LOCATION: (_look_at, 0),
    dialect.MAV_CMD_DO_SET_ROI_NONE: (lambda server, _: server.vehicle.payload.look_at(None), 0),
    dialect.MAV_CMD_IMAGE_START_CAPTURE: (_capture, 0),
    dialect.MAV_CMD_IMAGE_STOP_CAPTURE: (lambda *_: Result.ACCEPTED, 0),
}
"""By MAV_CMD: what carries it out, and how many of param1..4 count"""
