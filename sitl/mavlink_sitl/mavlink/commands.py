"""COMMAND_LONG and COMMAND_INT: the answer and the effect of each.

A COMMAND_LONG is read as a COMMAND_INT in MAV_FRAME_GLOBAL_RELATIVE_ALT, as the firmware
does. Each rule here was seen in the recordings (`copter_acks`); a command that is not here
is UNSUPPORTED.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from mavlink_sitl.autopilot.devices import aux_functions
from mavlink_sitl.exchange import Result, Severity
from mavlink_sitl.mavlink import kind_commands, payload_commands, setpoints
from mavlink_sitl.mavlink.codec import dialect
from mavlink_sitl.mavlink.messages import known_messages
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
    **payload_commands.PAYLOAD_COMMANDS,
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
    dialect.MAV_CMD_DO_SET_RELAY: (_always(Result.ACCEPTED), 2),
    dialect.MAV_CMD_DO_REPEAT_RELAY: (_always(Result.ACCEPTED), 3),
    dialect.MAV_CMD_DO_REPEAT_SERVO: (_always(Result.ACCEPTED), 4),
    dialect.MAV_CMD_VIDEO_START_CAPTURE: (_always(Result.FAILED), 0),
    dialect.MAV_CMD_DO_START_MAG_CAL: (_always(Result.ACCEPTED), 4),
    dialect.MAV_CMD_DO_ACCEPT_MAG_CAL: (_always(Result.ACCEPTED), 1),
    dialect.MAV_CMD_DO_CANCEL_MAG_CAL: (_always(Result.ACCEPTED), 1),
    dialect.MAV_CMD_SET_EKF_SOURCE_SET: (
        lambda _, c: Result.ACCEPTED if c.params[0] in (1.0, 2.0, 3.0) else Result.DENIED,
        1,
    ),
}
"""By MAV_CMD: what carries it out, and how many of param1..4 count"""


FORCE = 21196
"""The value of param2 that arms and disarms against all checks"""

HEARTBEAT, HEARTBEAT_US = 0, 1_000_000
LONGEST_INTERVAL_US = 60_000_000


def handle(server: MavlinkServer, command: ReceivedCommand) -> Result:
    """Carry out a command."""
    table = kind_commands.BY_KIND[server.vehicle.personality.kind]
    entry = table.get(command.id, _HANDLERS.get(command.id))
    if entry is None:
        return Result.UNSUPPORTED
    handler, used = entry
    if not all(setpoints.usable(value) for value in command.params[:used]):
        return Result.DENIED
    return handler(server, command)


def _arm_disarm(server: MavlinkServer, command: ReceivedCommand) -> Result:
    force = int(command.params[1]) == FORCE
    if command.params[0] == 1.0:
        return server.vehicle.arm(force)
    if command.params[0] == 0.0:
        return server.vehicle.disarm(force)
    return Result.UNSUPPORTED


def _set_mode(server: MavlinkServer, command: ReceivedCommand) -> Result:
    base_mode, custom_mode = command.params[0], command.params[1]
    if not int(base_mode) & dialect.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED:
        return Result.DENIED
    return server.vehicle.set_mode(int(custom_mode))


def change_speed(server: MavlinkServer, command: ReceivedCommand) -> Result:
    """DO_CHANGE_SPEED."""
    return server.vehicle.change_speed(int(command.params[0]), command.params[1])


def _known(server: MavlinkServer, message_id: int) -> bool:
    return message_id in known_messages.BY_KIND[server.vehicle.personality.kind]


def _set_interval(server: MavlinkServer, command: ReceivedCommand) -> Result:
    message_id, interval_us = int(command.params[0]), command.params[1]
    if command.params[2] != 0.0:
        return Result.DENIED
    if not _known(server, message_id):
        server.vehicle.say(Severity.INFO, f"No ap_message for mavlink id ({message_id})")
        return Result.DENIED
    if 0 < interval_us < server.vehicle.personality.shortest_interval_us:
        text = f"Requested rate for message ID {message_id} too fast. Increase SCHED_LOOP_RATE"
        server.vehicle.say(Severity.INFO, text)
        return Result.DENIED
    _take_interval(server, message_id, interval_us)
    return Result.ACCEPTED


def _take_interval(server: MavlinkServer, message_id: int, interval_us: float) -> None:
    """At most a minute; 0 gives that of its group back, and less than that stops it."""
    interval_us = int(min(interval_us, LONGEST_INTERVAL_US))
    if message_id == HEARTBEAT:
        server.beat(max(interval_us, 0) or (HEARTBEAT_US if interval_us == 0 else 0))
    elif interval_us > 0:
        server.streams.set(message_id, interval_us, server.now_us)
    elif interval_us == 0:
        server.streams.reset(message_id, server.now_us)
    else:
        server.streams.stop(message_id)


def _get_interval(server: MavlinkServer, command: ReceivedCommand) -> Result:
    message_id = int(command.params[0])
    if not _known(server, message_id):
        server.send(dialect.MAVLink_message_interval_message(message_id & 0xFFFF, 0))
        return Result.FAILED
    interval_us = server.streams.interval_us(message_id)
    if message_id == HEARTBEAT:
        interval_us = server.heartbeat_us or -1
    server.send(dialect.MAVLink_message_interval_message(message_id, interval_us))
    return Result.ACCEPTED


AVAILABLE_MODES = 435


def _request_message(server: MavlinkServer, command: ReceivedCommand) -> Result:
    message_id = int(command.params[0])
    if message_id == AVAILABLE_MODES:
        place = command.params[1] if setpoints.usable(command.params[1]) else 0.0
        return Result.ACCEPTED if server.send_mode_list(int(place)) else Result.FAILED
    if not _known(server, message_id):
        return Result.FAILED
    server.send_later(message_id)
    return Result.ACCEPTED


def request(message_id: int) -> Handler:
    """Of a message by itself: it follows the answer."""

    def handler(server: MavlinkServer, _: ReceivedCommand) -> Result:
        server.send_later(message_id)
        return Result.ACCEPTED

    return handler


def _capabilities(server: MavlinkServer, command: ReceivedCommand) -> Result:
    """REQUEST_AUTOPILOT_CAPABILITIES: with param1 = 1 (`copter_ground_cmds`)."""
    if command.params[0] != 1.0:
        return Result.FAILED
    return request(148)(server, command)


def _set_home(server: MavlinkServer, command: ReceivedCommand) -> Result:
    """Home is here, with param1 = 1 or without a place; else there. Arming leaves it there."""
    vehicle = server.vehicle
    if not vehicle.estimator.position_ok or command.params[0] not in (0.0, 1.0):
        return Result.FAILED
    if command.params[0] == 1.0 or not (command.x or command.y):
        vehicle.set_home()
        vehicle.navigator.home_locked = True
        return Result.ACCEPTED
    place = setpoints.place_of(vehicle, command, dialect.MAV_FRAME_GLOBAL)
    if place is None:
        return Result.DENIED
    vehicle.set_home(vehicle.navigator.frame.to_geodetic(*place))
    vehicle.navigator.home_locked = True
    return Result.ACCEPTED


def _reboot(server: MavlinkServer, command: ReceivedCommand) -> Result:
    if command.params[0] not in (1.0, 3.0):
        # Asked first whether it is armed, also by a test of the motors (`copter_ground_cmds`).
        return Result.FAILED if server.vehicle.soft_armed else Result.UNSUPPORTED
    return server.vehicle.reboot()


def _mission_start(server: MavlinkServer, command: ReceivedCommand) -> Result:
    """MISSION_START: of the whole mission only (`copter_mission_misc`)."""
    if command.params[0] or command.params[1]:
        return Result.DENIED
    return server.vehicle.start_mission()


def _set_current_item(server: MavlinkServer, command: ReceivedCommand) -> Result:
    """DO_SET_MISSION_CURRENT; param2 = 1 has the jumps begin again."""
    vehicle, seq, again = server.vehicle, int(command.params[0]), command.params[1] == 1.0
    if again and 0 <= seq < len(vehicle.plans.mission.items):
        vehicle.plans.forget_progress()
    result = vehicle.auto.set_current(seq)
    if result is Result.ACCEPTED:
        server.send_later(42)
    return result


def _jump_to_tag(server: MavlinkServer, command: ReceivedCommand) -> Result:
    """DO_JUMP_TAG: to the mission's first JUMP_TAG of that number."""
    tag = int(command.params[0])
    if not 0 <= tag <= 0xFFFF:
        return Result.DENIED
    place = server.vehicle.plans.place_of_tag(tag)
    if place is None or server.vehicle.auto.set_current(place) is not Result.ACCEPTED:
        return Result.FAILED
    server.send_later(42)
    return Result.ACCEPTED


def _enable_fence(server: MavlinkServer, command: ReceivedCommand) -> Result:
    """DO_FENCE_ENABLE; 2 puts only the floor out of force, which counts by itself here."""
    if command.params[0] not in (0.0, 1.0, 2.0) or "FENCE_ENABLE" not in server.vehicle.parameters:
        return Result.FAILED
    if command.params[0] != 2.0:
        server.vehicle.fence.enable(command.params[0] == 1.0)
    return Result.ACCEPTED


def _terminate(server: MavlinkServer, command: ReceivedCommand) -> Result:
    if command.params[0] <= 0.5:
        return Result.FAILED
    return server.vehicle.disarm(force=True)


def _store(server: MavlinkServer, command: ReceivedCommand) -> Result:
    """PREFLIGHT_STORAGE: only 2, which empties the storage; it shows at the next start."""
    if command.params[0] != 2.0:
        return Result.DENIED
    server.vehicle.parameters.erase()
    server.vehicle.say(Severity.WARNING, "All parameters reset, reboot board")
    return Result.ACCEPTED


def inject_failure(server: MavlinkServer, command: ReceivedCommand) -> Result:
    """INJECT_FAILURE."""
    unit, kind, instance = (int(value) for value in command.params[:3])
    return server.vehicle.body.inject_failure(unit, kind, instance)


SHARED: dict[int, tuple[Handler, int]] = {
    dialect.MAV_CMD_DO_CHANGE_SPEED: (change_speed, 2),
    dialect.MAV_CMD_INJECT_FAILURE: (inject_failure, 3),
    dialect.MAV_CMD_RUN_PREARM_CHECKS: (lambda s, _: s.vehicle.arming.run_checks(), 0),
    dialect.MAV_CMD_GET_HOME_POSITION: (request(242), 0),
}
"""Of all firmwares"""
_HANDLERS: dict[int, tuple[Handler, int]] = {
    **SHARED,
    **GROUND_COMMANDS,
    dialect.MAV_CMD_DO_SET_MODE: (_set_mode, 2),
    dialect.MAV_CMD_DO_SET_HOME: (_set_home, 1),
    dialect.MAV_CMD_DO_FLIGHTTERMINATION: (_terminate, 1),
    dialect.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN: (_reboot, 1),
    dialect.MAV_CMD_PREFLIGHT_STORAGE: (_store, 1),
    dialect.MAV_CMD_MISSION_START: (_mission_start, 2),
    dialect.MAV_CMD_DO_SET_MISSION_CURRENT: (_set_current_item, 1),
    dialect.MAV_CMD_DO_JUMP_TAG: (_jump_to_tag, 1),
    dialect.MAV_CMD_DO_FENCE_ENABLE: (_enable_fence, 1),
    dialect.MAV_CMD_COMPONENT_ARM_DISARM: (_arm_disarm, 2),
    dialect.MAV_CMD_GET_MESSAGE_INTERVAL: (_get_interval, 1),
    dialect.MAV_CMD_SET_MESSAGE_INTERVAL: (_set_interval, 2),
    dialect.MAV_CMD_REQUEST_MESSAGE: (_request_message, 1),
    dialect.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES: (_capabilities, 1),
}
"""By MAV_CMD: what carries it out, and how many of param1..4 count; others may be NaN"""
