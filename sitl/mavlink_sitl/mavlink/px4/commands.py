"""COMMAND_LONG and COMMAND_INT as PX4 answers them.

The frame of a COMMAND_INT is ignored: altitudes are above sea level, always. Each rule was
seen in the recordings (`probe_ground` and the flights); a command that is not here is
UNSUPPORTED.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, TypeAlias

from mavlink_sitl.autopilot.personality import px4
from mavlink_sitl.autopilot.px4.multicopter.copter import Px4Copter
from mavlink_sitl.autopilot.px4.multicopter.orbit import OrbitRequest
from mavlink_sitl.autopilot.px4.plane.plane import Px4Plane
from mavlink_sitl.exchange import Result, Severity
from mavlink_sitl.geodesy import GeoPoint
from mavlink_sitl.mavlink.codec import dialect
from mavlink_sitl.mavlink.commands import FORCE, SHARED, request
from mavlink_sitl.mavlink.external_position import take_origin
from mavlink_sitl.mavlink.missions.mission_items import NOT_GIVEN
from mavlink_sitl.mavlink.px4 import gimbal
from mavlink_sitl.mavlink.px4.rates import STREAMS
from mavlink_sitl.mavlink.received_command import ReceivedCommand
from mavlink_sitl.mavlink.setpoints import usable

if TYPE_CHECKING:
    from mavlink_sitl.mavlink.px4.server import Px4Server

Handler: TypeAlias = "Callable[[Px4Server, ReceivedCommand], Result | None]"
HEARTBEAT, ORBIT_STATUS, AVAILABLE_MODES, CURRENT_MODE = 0, 360, 435, 436
_CHANGE_MODE = 1
NAN_AS_INTEGER = 0x7FF80000
"""NaN as some senders write it into the integers x and y of a COMMAND_INT"""


def mode_number(base_mode: int, main: int, sub: int) -> int:
    """The custom mode that DO_SET_MODE means; without CUSTOM_MODE_ENABLED the old flags count."""
    if base_mode & dialect.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED:
        if main == px4.MAIN_POSCTL and sub != px4.POSITION_SLOW:
            return px4.POSCTL  # whatever the sub mode
        if main == px4.MAIN_AUTO and sub == 0:
            return px4.MISSION
        # The others have no sub modes, and do not look at one.
        return px4.custom_mode(main, sub if main in (px4.MAIN_POSCTL, px4.MAIN_AUTO) else 0)
    if base_mode & dialect.MAV_MODE_FLAG_AUTO_ENABLED:
        return px4.MISSION
    return px4.POSCTL if base_mode & dialect.MAV_MODE_FLAG_GUIDED_ENABLED else px4.MANUAL


def _set_mode(server: Px4Server, command: ReceivedCommand) -> Result | None:
    # The receiver acknowledges first, whatever will become of it; the verdict comes after.
    server.acknowledge(command.id, Result.ACCEPTED)
    # Some clients leave param3 NaN where a mode has no sub mode.
    base, main = int(command.params[0]), int(command.params[1])
    sub = int(command.params[2]) if usable(command.params[2]) else 0
    if not (0 <= main <= 255 and 0 <= sub <= 255):
        return Result.ACCEPTED  # a main mode that does not exist changes nothing
    return server.choose_mode(mode_number(base, main, sub))


def _arm_disarm(server: Px4Server, command: ReceivedCommand) -> Result | None:
    what, force = command.params[0], command.params[1] == FORCE
    if what == 1.0:
        return server.vehicle.arm(force)
    if what == 0.0:
        return server.vehicle.disarm(force)
    server.vehicle.say(Severity.CRITICAL, f"Unsupported ARM_DISARM param: {what:.3f}")
    return None


def _take_off(server: Px4Server, command: ReceivedCommand) -> Result:
    # Zeros mean "not given", as in `probe_ground`.
    altitude = command.z if usable(command.z) and command.z != 0.0 else None
    return server.vehicle.take_off_to(altitude)


def _reposition(server: Px4Server, command: ReceivedCommand) -> Result:
    if not usable(command.params[1]) or not int(command.params[1]) & _CHANGE_MODE:
        return Result.UNSUPPORTED
    if not command.is_long and NAN_AS_INTEGER in (command.x, command.y):
        return Result.DENIED
    point = place_of(command)
    if point is None and _given(command.x) and _given(command.y):
        return Result.ACCEPTED  # a place that is none: accepted all the same
    if command.z == command.z and not usable(command.z):
        return Result.DENIED
    yaw = command.params[3] if usable(command.params[3]) else None
    result = server.vehicle.reposition(point, command.z if usable(command.z) else None, yaw)
    if usable(command.params[0]) and command.params[0] > 0.0:
        server.vehicle.change_speed(1, command.params[0])
    return result


def _given(value: float) -> bool:
    return math.isfinite(value) and value != -(2**31) and value != 2**31 - 1


def place_of(command: ReceivedCommand) -> GeoPoint | None:
    """Where x and y are; None where they are not given, or not on earth."""
    if not (_given(command.x) and _given(command.y)):
        return None
    scale = 1.0 if command.is_long else 1e7
    latitude, longitude = command.x / scale, command.y / scale
    if abs(latitude) > 90.0 or abs(longitude) > 180.0:
        return None
    return GeoPoint(latitude, longitude, 0.0)


def _change_altitude(server: Px4Server, command: ReceivedCommand) -> Result:
    return server.vehicle.reposition(None, command.params[0], None)


def _standard_mode(server: Px4Server, command: ReceivedCommand) -> Result:
    modes = server.vehicle.personality.available_modes
    number = next((m[0] for m in modes if m[1] == command.params[0] != 0), None)
    return Result.FAILED if number is None else server.vehicle.set_mode(number)


def _calibrate(server: Px4Server, command: ReceivedCommand) -> Result:
    params = (*command.params[:4], command.x, command.y, command.z)
    return server.vehicle.calibration.command(tuple(v if usable(v) else 0.0 for v in params))


def _ignore(_server: Px4Server, _: ReceivedCommand) -> None:
    """For parts that it does not have: nobody answers."""


def _set_interval(server: Px4Server, command: ReceivedCommand) -> Result:
    message_id, interval_us = int(command.params[0]), command.params[1]
    if message_id not in STREAMS:
        return Result.FAILED
    server.set_interval(message_id, int(min(max(interval_us, -1.0), 2.0**31)))
    return Result.ACCEPTED


def _get_interval(server: Px4Server, command: ReceivedCommand) -> Result:
    message_id = int(command.params[0])
    interval_us = server.streams.interval_us(message_id) if message_id in server.builders else 0
    message_id = min(max(message_id, 0), 65535)
    server.send(dialect.MAVLink_message_interval_message(message_id, interval_us))
    return Result.ACCEPTED


def _request_message(server: Px4Server, command: ReceivedCommand) -> Result:
    message_id = int(command.params[0])
    if message_id == AVAILABLE_MODES:
        wanted = command.params[1]
        server.send_modes(int(wanted) if usable(wanted) else 0)
        return Result.ACCEPTED
    offered = message_id in STREAMS or message_id == HEARTBEAT
    if not offered or message_id not in server.builders:
        return Result.DENIED
    if message_id == CURRENT_MODE:
        return Result.DENIED
    if message_id == ORBIT_STATUS and not server.has_now(message_id):
        return Result.DENIED
    server.send_later(message_id)
    return Result.ACCEPTED


def _set_home(server: Px4Server, command: ReceivedCommand) -> Result:
    vehicle = server.vehicle
    if not vehicle.estimator.position_ok:
        return Result.TEMPORARILY_REJECTED
    if command.params[0] == 1.0:
        vehicle.set_home()
        return Result.ACCEPTED
    point = place_of(command)
    if point is None or not usable(command.z):
        return Result.DENIED
    vehicle.navigator.set_home_at(point._replace(altitude_amsl_m=command.z))
    return Result.ACCEPTED


def _set_origin(server: Px4Server, command: ReceivedCommand) -> Result:
    """DO_SET_GLOBAL_ORIGIN, from 1.18 on; all of the place has to be given."""
    point = place_of(command)
    if point is None or not usable(command.z):
        return Result.DENIED
    take_origin(server.vehicle, point._replace(altitude_amsl_m=command.z))
    return Result.ACCEPTED


def _reboot(server: Px4Server, command: ReceivedCommand) -> Result:
    if command.params[0] == 0.0 and not server.vehicle.armed:
        return Result.ACCEPTED  # nothing is to be done
    if command.params[0] not in (1.0, 3.0):
        return Result.DENIED
    return Result.DENIED if server.vehicle.armed else server.vehicle.reboot()


def _store(server: Px4Server, command: ReceivedCommand) -> Result | None:
    """PREFLIGHT_STORAGE: reads, writes or resets; what it sets it saves by itself at once."""
    if server.vehicle.armed:
        return Result.TEMPORARILY_REJECTED
    what = int(command.params[0])
    if what in (RESET_ALL, RESET_EVERYTHING):
        server.vehicle.parameters.reset()
    return Result.ACCEPTED if READ_ALL <= what <= RESET_EVERYTHING else None


def _terminate(server: Px4Server, command: ReceivedCommand) -> Result:
    if command.params[0] <= 0.5:
        return Result.DENIED
    return server.vehicle.terminate()


def _look_at(server: Px4Server, command: ReceivedCommand) -> Result:
    """A region of interest, also without a gimbal to look at it."""
    if not all(map(usable, (command.x, command.y, command.z))):
        return Result.DENIED
    point = place_of(command)
    if point is not None:
        vehicle = server.vehicle
        place = vehicle.navigator.frame.to_local(point._replace(altitude_amsl_m=command.z))
        vehicle.payload.look_at(place)
    return Result.ACCEPTED


READ_ALL, RESET_ALL, RESET_EVERYTHING = 0, 2, 4
"""PREFLIGHT_STORAGE.param1; 1 writes, 3 restores the factory's calibration, which there is not"""
UNANSWERED = (
    dialect.MAV_CMD_DO_DIGICAM_CONTROL,
    dialect.MAV_CMD_DO_SET_CAM_TRIGG_DIST,
    dialect.MAV_CMD_DO_GRIPPER,
    dialect.MAV_CMD_REQUEST_CAMERA_INFORMATION,
    dialect.MAV_CMD_DO_VTOL_TRANSITION,
)
HANDLERS: dict[int, tuple[Handler, int]] = {
    **SHARED,
    dialect.MAV_CMD_NAV_RETURN_TO_LAUNCH: (lambda s, _: s.vehicle.return_to_launch(), 0),
    dialect.MAV_CMD_NAV_LAND: (lambda s, _: s.vehicle.land_here(), 0),
    dialect.MAV_CMD_NAV_TAKEOFF: (_take_off, 0),
    dialect.MAV_CMD_DO_SET_MODE: (_set_mode, 2),
    dialect.MAV_CMD_DO_SET_HOME: (_set_home, 1),
    dialect.MAV_CMD_DO_FLIGHTTERMINATION: (_terminate, 1),
    dialect.MAV_CMD_DO_REPOSITION: (_reposition, 0),
    dialect.MAV_CMD_DO_CHANGE_ALTITUDE: (_change_altitude, 1),
    dialect.MAV_CMD_DO_SET_STANDARD_MODE: (_standard_mode, 1),
    dialect.MAV_CMD_PREFLIGHT_CALIBRATION: (_calibrate, 0),
    dialect.MAV_CMD_DO_GO_AROUND: (lambda *_: Result.ACCEPTED, 1),
    dialect.MAV_CMD_DO_SET_ROI_LOCATION: (_look_at, 0),
    dialect.MAV_CMD_DO_SET_ROI_NONE: (lambda s, _: s.vehicle.payload.look_at(None), 0),
    dialect.MAV_CMD_DO_MOUNT_CONTROL: (gimbal.mount, 0),
    dialect.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW: (gimbal.point, 0),
    dialect.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE: (gimbal.configure, 0),
    dialect.MAV_CMD_DO_SET_ACTUATOR: (lambda *_: Result.ACCEPTED, 0),
    **dict.fromkeys(UNANSWERED, (_ignore, 0)),
    dialect.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN: (_reboot, 1),
    dialect.MAV_CMD_PREFLIGHT_STORAGE: (_store, 1),
    dialect.MAV_CMD_MISSION_START: (lambda s, c: s.vehicle.start_mission(c.params[0]), 1),
    dialect.MAV_CMD_COMPONENT_ARM_DISARM: (_arm_disarm, 1),
    dialect.MAV_CMD_GET_MESSAGE_INTERVAL: (_get_interval, 1),
    dialect.MAV_CMD_SET_MESSAGE_INTERVAL: (_set_interval, 2),
    dialect.MAV_CMD_REQUEST_MESSAGE: (_request_message, 1),
    dialect.MAV_CMD_REQUEST_PROTOCOL_VERSION: (request(300), 0),
    dialect.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES: (request(148), 0),
}
"""Of all kinds, by MAV_CMD: what carries it out, and how many of param1..4 have to be numbers"""


ADDED: dict[int, tuple[Handler, int]] = {
    dialect.MAV_CMD_DO_SET_GLOBAL_ORIGIN: (_set_origin, 0),
}
"""The same of those that only later releases know (`Personality.added_commands`)"""
FIGURE_EIGHT = 35


def handle(server: Px4Server, command: ReceivedCommand) -> Result | None:
    """Carry out a command.

    Returns:
        The result for COMMAND_ACK, or None when no answer is sent.
    """
    personality = server.vehicle.personality
    added = command.id in personality.added_commands
    entry = (ADDED if added else BY_KIND[personality.kind]).get(command.id)
    if entry is None or command.id in personality.removed_commands:
        return Result.UNSUPPORTED
    handler, used = entry
    known = personality.used_params.get(command.id)
    if known is not None and not set_params(command) <= known.of_command:
        return Result.DENIED
    if not all(usable(value) for value in command.params[:used]):
        return Result.DENIED
    return handler(server, command)


def set_params(command: ReceivedCommand) -> frozenset[int]:
    """The numbers, 1 to 7, of the params that are given: neither NaN nor 0."""
    unplaced = not command.is_long and command.x == command.y == NOT_GIVEN
    place = (0.0, 0.0) if unplaced else (command.x, command.y)
    values = (*command.params, *place, command.z)
    return frozenset(i for i, v in enumerate(values, 1) if not math.isnan(v) and v != 0.0)


def _or_none(value: float) -> float | None:
    return value if usable(value) else None


def orbit(server: Px4Server, command: ReceivedCommand) -> Result:
    """DO_ORBIT of a multicopter; how many turns (param4) does not count."""
    assert isinstance(server.vehicle, Px4Copter)
    radius, speed, behaviour, _ = command.params
    return server.vehicle.orbit(
        OrbitRequest(
            _or_none(radius),
            _or_none(speed),
            round(behaviour) if usable(behaviour) else None,
            place_of(command),
            _or_none(command.z),
        )
    )


def circle(server: Px4Server, command: ReceivedCommand) -> Result:
    """DO_ORBIT of a plane: AUTO.LOITER with a radius of its own; only that and the place count."""
    assert isinstance(server.vehicle, Px4Plane)
    return server.vehicle.orbit(place_of(command), _or_none(command.z), _or_none(command.params[0]))


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
    "px4plane": {**HANDLERS, _ORBIT: (circle, 0)},
}
"""By vehicle type and MAV_CMD; see `HANDLERS`"""
