"""Golden payloads of each operation on each vehicle type.

Each is the payload of one frame, little-endian, as MAVLink 2 sends it: without the zeros at its
end. They were checked by hand against the message definitions; `test_the_golden_payloads_say`
spells out what the important ones mean.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from functools import partial
from pathlib import Path

import pytest

from mavlink_vehicle.codec import Codec, Message, mavlink
from mavlink_vehicle.errors import SetpointError
from mavlink_vehicle.events import LandedState, OperationFinished, OperationResult
from mavlink_vehicle.vehicle import SetpointNed, Vehicle, VehicleConfig
from tests.support.messages.autopilot_messages import AutopilotMessages

ARDUPILOT, PX4 = mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA, mavlink.MAV_AUTOPILOT_PX4
QUAD, ROVER, PLANE = (
    mavlink.MAV_TYPE_QUADROTOR,
    mavlink.MAV_TYPE_GROUND_ROVER,
    mavlink.MAV_TYPE_FIXED_WING,
)
OFFBOARD, PX4_LOITER, PX4_MISSION = 0x00060000, 0x03040000, 0x04040000
VEHICLES = {
    "ArduCopter": (ARDUPILOT, QUAD, 4),
    "ArduRover": (ARDUPILOT, ROVER, 15),
    "ArduPlane": (ARDUPILOT, PLANE, 15),
    "PX4 multicopter": (PX4, QUAD, OFFBOARD),
    "PX4 rover": (PX4, ROVER, OFFBOARD),
    "PX4 plane": (PX4, PLANE, PX4_LOITER),
}
"""MAV_AUTOPILOT, MAV_TYPE and the control mode's number."""

HERE, SPEED, PUSH = (1.0, 2.0, -3.0), (0.5, -0.25, 0.125), (0.0, 0.5, 0.0)
FULL = SetpointNed(HERE, SPEED, PUSH, yaw_ned_rad=0.75)
Action = Callable[[Vehicle], object]


def sent(
    name: str, action: Action, *, mode: int | None = None, armed: bool = True
) -> list[Message]:
    """Return what a vehicle, standing at 488 m with home there, sends for an action at 10 s."""
    autopilot, kind, control = VEHICLES[name]
    say = AutopilotMessages()
    vehicle = Vehicle(VehicleConfig(message_rates_hz={}))
    for message in (
        say.heartbeat(autopilot=autopilot, vehicle_type=kind),
        say("EXTENDED_SYS_STATE", landed_state=LandedState.ON_GROUND),
        say.position(9.0),
        say("LOCAL_POSITION_NED", time_boot_ms=9000, z=-0.5),
        say("HOME_POSITION", latitude=473977420, longitude=85455940, altitude=487000),
        say.heartbeat(
            control if mode is None else mode, armed, 4, autopilot=autopilot, vehicle_type=kind
        ),
    ):
        vehicle.receive(message, 10.0)
    vehicle.messages_to_send()
    action(vehicle)
    return vehicle.messages_to_send()


def stream(setpoint: SetpointNed) -> Action:
    def action(vehicle: Vehicle) -> None:
        vehicle.setpoints.open(10.0)
        vehicle.send_setpoint(setpoint, 10.0)

    return action


ACTIONS: dict[str, Action] = {
    "take control": lambda vehicle: vehicle.take_control(10.0),
    "arm": lambda vehicle: vehicle.arm(10.0),
    "hold": lambda vehicle: vehicle.hold(10.0),
    "land": lambda vehicle: vehicle.land(10.0),
    "return": lambda vehicle: vehicle.return_to_launch(10.0),
    "disarm": lambda vehicle: vehicle.disarm(10.0),
    "disarm by force": lambda vehicle: vehicle.disarm(10.0, force=True),
    "take-off": lambda vehicle: vehicle.take_off(10.0, 10.0),
    "reposition": lambda vehicle: vehicle.reposition(47.4, 8.5, 587.0, 10.0, 60.0),
    "speed": lambda vehicle: vehicle.change_speed(7.5, 10.0),
    "position": stream(SetpointNed(HERE)),
    "velocity": stream(SetpointNed(velocity_ned_m_s=SPEED)),
    "full": stream(FULL),
}
ELSEWHERE = {"ArduRover": 10, "ArduPlane": 10, "ArduCopter": 3}
"""Numbers of AUTO, where the control mode would be "already so", or the speed command fails."""


def situation(name: str, action: str) -> tuple[int | None, bool]:
    """Return the mode (None: the control mode) and whether the vehicle is armed."""
    mode = None
    if action in ("hold", "take control", "speed"):
        mode = ELSEWHERE.get(name, PX4_MISSION)
    if action == "arm" and name.startswith("PX4"):
        mode = PX4_LOITER  # armed in OFFBOARD it would be sent another mode first
    return mode, action != "arm"


GOLDEN: dict[str, dict[str, str | None]] = json.loads(
    Path(__file__).with_name("golden_payloads.json").read_text("utf-8")
)
"""Payload by vehicle and action; None: rejected, nothing is sent."""


def message_of(name: str, action: str) -> Message | None:
    mode, armed = situation(name, action)
    try:
        messages = sent(name, ACTIONS[action], mode=mode, armed=armed)
    except SetpointError:
        return None
    assert len(messages) <= 1
    return messages[0] if messages else None


@pytest.mark.parametrize("action", ACTIONS)
@pytest.mark.parametrize("name", VEHICLES)
def test_the_frames_are_the_golden_ones(name: str, action: str) -> None:
    message = message_of(name, action)
    payload = None if message is None else Codec(1, 191).encode(message)[10:-2].hex()
    assert payload == GOLDEN[name][action]


def golden(name: str, action: str, kind: str) -> Message:
    """Return a golden payload, decoded by its definition."""
    payload = bytes.fromhex(GOLDEN[name][action] or "")
    message = message_of(name, action)
    assert message is not None
    assert message.get_type() == kind
    layout = type(message)
    values = layout.unpacker.unpack(payload.ljust(layout.unpacker.size, b"\x00"))
    for field, value in zip(layout.ordered_fieldnames, values, strict=True):
        setattr(message, field, value)
    return message


def test_the_golden_payloads_say() -> None:
    """The rules that the payloads hold, in words."""
    # PX4's DO_SET_MODE: custom flag, main mode, sub mode; ArduPilot's: custom flag, mode.
    mode = golden("PX4 multicopter", "hold", "COMMAND_LONG")
    assert (mode.command, mode.param1, mode.param2, mode.param3) == (176, 1.0, 4.0, 3.0)
    mode = golden("ArduCopter", "hold", "COMMAND_LONG")
    assert (mode.command, mode.param1, mode.param2, mode.param3) == (176, 1.0, 17.0, 0.0)
    # A take-off: above home; above sea level from the ground (488 m, though home says 487).
    assert golden("ArduCopter", "take-off", "COMMAND_LONG").param7 == 10.0
    for name in ("PX4 multicopter", "PX4 plane"):
        rise = golden(name, "take-off", "COMMAND_LONG")
        assert rise.param7 == 498.0
        assert all(math.isnan(value) for value in (rise.param4, rise.param5, rise.param6))
    assert golden("ArduPlane", "take-off", "COMMAND_LONG").param2 == 13.0  # the mode TAKEOFF
    # DO_REPOSITION: COMMAND_INT with the mode flag; above home, or above sea level.
    place = golden("ArduPlane", "reposition", "COMMAND_INT")
    assert (place.command, place.frame, place.param2, place.z) == (192, 6, 1.0, 100.0)
    place = golden("PX4 plane", "reposition", "COMMAND_INT")
    # With a radius DO_ORBIT: DO_REPOSITION has that of NAV_LOITER_RAD.
    assert (place.command, place.frame, place.param1, place.z) == (34, 5, 60.0, 587.0)
    assert (place.x, place.y) == (474000000, 85000000)
    # Setpoints in LOCAL_NED; ground vehicles get velocities without yaw and acceleration.
    for name in ("ArduRover", "PX4 rover"):
        assert golden(name, "full", "SET_POSITION_TARGET_LOCAL_NED").type_mask == 0x0DC7
    for name in ("ArduCopter", "PX4 multicopter"):
        setpoint = golden(name, "full", "SET_POSITION_TARGET_LOCAL_NED")
        assert (setpoint.type_mask, setpoint.coordinate_frame) == (0x0800, 1)
    # A speed is an airspeed (0) for ArduPlane, a ground speed (1) for the others.
    assert golden("ArduPlane", "speed", "COMMAND_LONG").param1 == 0.0
    assert golden("PX4 rover", "speed", "COMMAND_LONG").param1 == 1.0


REFUSALS = [
    ("ArduRover", "land", "ArduRover has no mode for this"),
    ("ArduPlane", "land", "ArduPlane has no mode for this"),
    ("PX4 rover", "take-off", "PX4 rover has no take-off command"),
    ("ArduRover", "take-off", "ArduRover has no take-off command"),
    ("ArduCopter", "reposition", "ArduCopter is flown by setpoints"),
    ("PX4 multicopter", "take control", "open the stream and send them first"),
]


@pytest.mark.parametrize(("name", "action", "words"), REFUSALS)
def test_what_a_kind_cannot_do_is_rejected_with_the_reason(
    name: str, action: str, words: str
) -> None:
    ends: list[OperationFinished] = []

    def act(vehicle: Vehicle) -> None:
        ACTIONS[action](vehicle)
        while (event := vehicle.next_event()) is not None:
            if isinstance(event, OperationFinished):
                ends.append(event)

    assert not sent(name, act, mode=situation(name, action)[0])
    (end,) = ends
    assert end.result is OperationResult.REFUSED
    assert words in end.reason


def test_px4s_offboard_command_comes_after_the_stream() -> None:
    def act(vehicle: Vehicle, until_s: float) -> None:
        vehicle.setpoints.open(10.0)
        vehicle.take_control(10.0)
        now = 10.0
        while now < until_s:
            vehicle.send_setpoint(FULL, now)
            vehicle.handle_timer(now)
            now += 0.05

    def modes(until_s: float) -> list[Message]:
        messages = sent("PX4 multicopter", partial(act, until_s=until_s), mode=PX4_LOITER)
        return [m for m in messages if m.get_type() == "COMMAND_LONG" and m.command == 176]

    assert not modes(11.15)
    (command,) = modes(11.25)
    assert (command.param1, command.param2, command.param3) == (1, 6, 0)


@pytest.mark.parametrize("name", VEHICLES)
@pytest.mark.parametrize("bad", [math.nan, math.inf, -1.0, 0.0])
def test_a_speed_without_sense_is_rejected(name: str, bad: float) -> None:
    mode = situation(name, "speed")[0]
    assert not sent(name, lambda vehicle: vehicle.change_speed(bad, 10.0), mode=mode)


def test_a_speed_command_without_effect_is_not_sent() -> None:
    """A PX4 accepts it in OFFBOARD, and an ArduRover rejects it while setpoints are its speed."""
    for name in ("PX4 multicopter", "PX4 rover", "ArduRover"):
        assert not sent(name, ACTIONS["speed"])
    assert sent("ArduCopter", ACTIONS["speed"])


@pytest.mark.parametrize(
    "place", [(math.nan, 8.5, 500.0), (91.0, 8.5, 500.0), (47.4, 181.0, 500.0), (47.4, 8.5, 1e9)]
)
@pytest.mark.parametrize("name", ["ArduPlane", "PX4 plane"])
def test_a_place_that_is_none_is_rejected(name: str, place: tuple[float, float, float]) -> None:
    assert not sent(name, lambda vehicle: vehicle.reposition(*place, 10.0))
    good = (47.4, 8.5, 500.0)
    assert not sent(name, lambda vehicle: vehicle.reposition(*good, 10.0, radius_m=math.nan))
    assert not sent(name, lambda vehicle: vehicle.reposition(*good, 10.0), armed=False)
    assert sent(name, lambda vehicle: vehicle.reposition(*good, 10.0))
