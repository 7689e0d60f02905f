"""Commands that each kind of vehicle with ArduPilot answers in its own way.

Seen in `copter_acks`, `rover_guided` and `plane_guided`; the others follow the firmware's source.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from mavlink_sitl.autopilot.ardupilot.copter.copter import Copter
from mavlink_sitl.autopilot.ardupilot.plane import plane
from mavlink_sitl.autopilot.ardupilot.rover import rover
from mavlink_sitl.autopilot.common.commander import Commander
from mavlink_sitl.autopilot.state.setpoint import Setpoint, SetpointFrame
from mavlink_sitl.exchange import Result, Severity, Vector
from mavlink_sitl.mavlink import setpoints
from mavlink_sitl.mavlink.codec import dialect
from mavlink_sitl.mavlink.received_command import RELATIVE_ALT, Handler, ReceivedCommand

if TYPE_CHECKING:
    from mavlink_sitl.mavlink.server import MavlinkServer


def _mode(number: int) -> Handler:
    return lambda server, _: server.vehicle.set_mode(number)


def _reposition(guided: int, otherwise: Result) -> Handler:
    """DO_REPOSITION as COMMAND_INT; bit 0 of param2 allows the change to GUIDED.

    A copter ignores the speed and the heading (`copter_guided_cmds`); outside the fence it fails
    (`copter_fence3`). A plane takes a positive radius in param3; without one it keeps that of
    the last DO_REPOSITION in this GUIDED, at first WP_LOITER_RAD. param4 says which way round.
    """

    def handler(server: MavlinkServer, command: ReceivedCommand) -> Result:
        vehicle = server.vehicle
        if command.is_long:
            return Result.UNSUPPORTED
        if vehicle.mode.spec.number != guided and not int(command.params[1]) & 1:
            return otherwise
        if not setpoints.usable(command.z) or (command.x == 0 and command.y == 0):
            return Result.DENIED
        position = setpoints.local_position(
            vehicle, command.frame, int(command.x), int(command.y), command.z
        )
        if position is None:
            return Result.DENIED
        if isinstance(vehicle, plane.Plane) and not vehicle.fence.allows(position):
            return Result.DENIED
        if vehicle.set_mode(guided) is not Result.ACCEPTED:
            return Result.FAILED
        return _go_to(vehicle, command, position)

    return handler


def _go_to(vehicle: Commander, command: ReceivedCommand, position: Vector) -> Result:
    """Where a DO_REPOSITION sends a vehicle that is in GUIDED; NED metres."""
    if isinstance(vehicle, plane.Plane):
        against = setpoints.usable(command.params[3]) and command.params[3] != 0.0
        given_m = command.params[2] if setpoints.usable(command.params[2]) else 0.0
        vehicle.reposition(position, max(float(int(given_m)), 0.0), against)
        return Result.ACCEPTED
    if not isinstance(vehicle, rover.Rover):
        if not vehicle.fence.allows(position):
            return Result.FAILED
        vehicle.setpoint(Setpoint(SetpointFrame.LOCAL, position_m=position))
        return Result.ACCEPTED
    if command.params[0] > 0.0:
        # Only a way that is being driven takes a speed (`rover_setpoints3`).
        if vehicle.destination_ned_m() is None:
            return Result.FAILED
        vehicle.change_speed(1, command.params[0])
    vehicle.go_to(Setpoint(SetpointFrame.LOCAL, position_m=position))
    return Result.ACCEPTED


def _copter(server: MavlinkServer) -> Copter:
    assert isinstance(server.vehicle, Copter)
    return server.vehicle


def _take_off(server: MavlinkServer, command: ReceivedCommand) -> Result:
    if command.frame != RELATIVE_ALT or not setpoints.usable(command.z):
        return Result.DENIED
    return _copter(server).take_off(command.z)


def _pause_or_go_on(server: MavlinkServer, command: ReceivedCommand) -> Result:
    if command.params[0] not in (0.0, 1.0):
        return Result.DENIED
    return _copter(server).pause_or_go_on(command.params[0] == 1.0)


def _condition_yaw(server: MavlinkServer, command: ReceivedCommand) -> Result:
    """CONDITION_YAW: turn the nose, in the modes that fly by themselves."""
    angle_deg, rate_deg_s, direction, relative = command.params
    if not 0.0 <= angle_deg <= 360.0 or relative not in (0.0, 1.0):
        return Result.FAILED
    copter = _copter(server)
    copter.yaw.turn(copter.motion.yaw_rad, angle_deg, rate_deg_s, direction, relative)
    return Result.ACCEPTED


def _look_at(server: MavlinkServer, command: ReceivedCommand) -> Result:
    """DO_SET_ROI, _LOCATION and _NONE: keep the nose towards a place; zeros end that, too."""
    copter, place = _copter(server), None
    if command.id != dialect.MAV_CMD_DO_SET_ROI_NONE and (command.x or command.y or command.z):
        place = setpoints.place_of(copter, command, command.frame)
        if place is None:
            return Result.DENIED
    if copter.payload.has_gimbal:
        return copter.payload.look_at(place)
    copter.yaw.look_at(place)
    return Result.ACCEPTED


def _motor_test(server: MavlinkServer, command: ReceivedCommand) -> Result:
    """DO_MOTOR_TEST; param5 is how many motors."""
    place, kind, value, each_s = command.params
    if not setpoints.usable(command.x):
        return Result.DENIED
    test = _copter(server).motor_test
    return test.start(int(place), int(kind), value, each_s, int(command.x))


def _as_plane(server: MavlinkServer) -> plane.Plane:
    assert isinstance(server.vehicle, plane.Plane)
    return server.vehicle


def _set_reverse(server: MavlinkServer, command: ReceivedCommand) -> Result:
    """DO_SET_REVERSE."""
    assert isinstance(server.vehicle, rover.Rover)
    if command.params[0] not in (0.0, 1.0):
        return Result.DENIED
    server.vehicle.backwards = command.params[0] == 1.0
    return Result.ACCEPTED


def _rover_motor_test(server: MavlinkServer, command: ReceivedCommand) -> Result:
    """DO_MOTOR_TEST."""
    assert isinstance(server.vehicle, rover.Rover)
    motor, kind, value, seconds = command.params
    return server.vehicle.motor_test.start(int(motor), int(kind), value, seconds)


def _guided_change_speed(server: MavlinkServer, command: ReceivedCommand) -> Result:
    """GUIDED_CHANGE_SPEED: an airspeed (0), in GUIDED (`plane_guided_repo`)."""
    vehicle = _as_plane(server)
    if vehicle.mode.spec.number != plane.MODE_GUIDED:
        return Result.FAILED
    kind, speed_m_s = command.params[:2]
    if kind != 0.0:
        return Result.DENIED
    return vehicle.change_speed(0, speed_m_s) if speed_m_s > 0.0 else Result.FAILED


def _change_speed(server: MavlinkServer, command: ReceivedCommand) -> Result:
    """DO_CHANGE_SPEED: without a speed, param3 may be a throttle, which changes nothing here.

    Seen in `plane_guided_repo`.
    """
    kind, speed_m_s, throttle_percent, _ = command.params
    if kind == 0.0 and speed_m_s == -1.0 and 0.0 < throttle_percent <= 100.0:
        server.vehicle.say(Severity.INFO, f"Set throttle {int(throttle_percent)}")
        return Result.ACCEPTED
    return server.vehicle.change_speed(int(kind), speed_m_s)


_COPTER: dict[int, tuple[Handler, int]] = {
    dialect.MAV_CMD_NAV_TAKEOFF: (_take_off, 0),
    dialect.MAV_CMD_DO_PAUSE_CONTINUE: (_pause_or_go_on, 1),
    dialect.MAV_CMD_CONDITION_YAW: (_condition_yaw, 4),
    dialect.MAV_CMD_DO_SET_ROI: (_look_at, 0),
    dialect.MAV_CMD_DO_SET_ROI_LOCATION: (_look_at, 0),
    dialect.MAV_CMD_DO_SET_ROI_NONE: (_look_at, 0),
    dialect.MAV_CMD_DO_MOTOR_TEST: (_motor_test, 4),
    dialect.MAV_CMD_DO_LAND_START: (lambda s, _: _copter(s).start_landing_sequence(), 0),
    dialect.MAV_CMD_NAV_LOITER_UNLIM: (_mode(5), 0),
    dialect.MAV_CMD_NAV_RETURN_TO_LAUNCH: (_mode(6), 0),
    dialect.MAV_CMD_NAV_LAND: (_mode(9), 0),
    dialect.MAV_CMD_NAV_VTOL_LAND: (_mode(9), 0),
    dialect.MAV_CMD_DO_REPOSITION: (_reposition(4, Result.DENIED), 3),
}
_ROVER: dict[int, tuple[Handler, int]] = {
    dialect.MAV_CMD_NAV_RETURN_TO_LAUNCH: (_mode(rover.MODE_RTL), 0),
    dialect.MAV_CMD_DO_MOTOR_TEST: (_rover_motor_test, 4),
    dialect.MAV_CMD_DO_SET_REVERSE: (_set_reverse, 1),
    dialect.MAV_CMD_DO_REPOSITION: (_reposition(rover.MODE_GUIDED, Result.DENIED), 3),
}

_PLANE: dict[int, tuple[Handler, int]] = {
    dialect.MAV_CMD_DO_LAND_START: (lambda s, _: _as_plane(s).start_landing(), 0),
    dialect.MAV_CMD_DO_GO_AROUND: (lambda s, c: _as_plane(s).go_around(c.params[0]), 1),
    dialect.MAV_CMD_DO_CHANGE_SPEED: (_change_speed, 2),
    dialect.MAV_CMD_GUIDED_CHANGE_SPEED: (_guided_change_speed, 2),
    dialect.MAV_CMD_NAV_TAKEOFF: (lambda *_: Result.FAILED, 0),
    dialect.MAV_CMD_NAV_LOITER_UNLIM: (_mode(plane.MODE_LOITER), 0),
    dialect.MAV_CMD_NAV_RETURN_TO_LAUNCH: (_mode(plane.MODE_RTL), 0),
    dialect.MAV_CMD_DO_REPOSITION: (_reposition(plane.MODE_GUIDED, Result.FAILED), 2),
}

BY_KIND: dict[str, dict[int, tuple[Handler, int]]] = {
    "copter": _COPTER,
    "rover": _ROVER,
    "boat": _ROVER,
    "plane": _PLANE,
}
"""By vehicle type and command: what is answered another way"""
