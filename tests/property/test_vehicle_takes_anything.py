"""Any input from a vehicle or an impostor: no exception, no invalid state."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable
from typing import Protocol, runtime_checkable

from hypothesis import given, settings
from hypothesis import strategies as st

from mavlink_vehicle.codec import Codec, mavlink
from mavlink_vehicle.errors import SetpointError
from mavlink_vehicle.protocols.stations.overheard import ANSWERS, HEARD
from mavlink_vehicle.vehicle import SetpointNed, Vehicle, VehicleConfig
from tests.support.messages.autopilot_messages import AutopilotMessages
from tests.support.messages.random_messages import CLASSES, STRANGE_FLOATS, random_message

KNOWN = [
    cls
    for cls in CLASSES
    if cls.msgname
    in (
        "HEARTBEAT", "SYSTEM_TIME", "GLOBAL_POSITION_INT", "LOCAL_POSITION_NED", "ATTITUDE",
        "BATTERY_STATUS", "SYS_STATUS", "EXTENDED_SYS_STATE", "HOME_POSITION",
        "GPS_GLOBAL_ORIGIN", "GPS_RAW_INT", "EKF_STATUS_REPORT", "ESTIMATOR_STATUS",
        "AUTOPILOT_VERSION", "STATUSTEXT", "COMMAND_ACK", "CURRENT_MODE", "FENCE_STATUS",
    )
]  # fmt: skip
OVERHEARD = [cls for cls in CLASSES if cls in (*HEARD, *ANSWERS)]
OPERATIONS: dict[str, Callable[[Vehicle, float], int]] = {
    "mode": lambda vehicle, now: vehicle.change_mode("GUIDED", now),
    "arm": lambda vehicle, now: vehicle.arm(now),
    "disarm": lambda vehicle, now: vehicle.disarm(now, force=True),
    "take off": lambda vehicle, now: vehicle.take_off(5.0, now),
    "control": lambda vehicle, now: vehicle.take_control(now),
    "hold": lambda vehicle, now: vehicle.hold(now),
    "land": lambda vehicle, now: vehicle.land(now),
    "return": lambda vehicle, now: vehicle.return_to_launch(now),
    "place": lambda vehicle, now: vehicle.reposition(47.0, 8.0, 500.0, now),
    "speed": lambda vehicle, now: vehicle.change_speed(3.0, now),
}


@runtime_checkable
class Timed(Protocol):
    """What runs in a service."""

    deadline_s: float | None


STEP = st.tuples(
    st.one_of(st.sampled_from(KNOWN), st.sampled_from(OVERHEARD), st.sampled_from(CLASSES)),
    st.integers(0, 1_000_000),
    st.sampled_from([0.0, 0.01, 0.5, 4.0]),
    st.sampled_from([None, None, *OPERATIONS, "cancel", "stream", "setpoint"]),
)


def act(vehicle: Vehicle, what: str | None, now: float) -> None:
    if what in OPERATIONS:
        OPERATIONS[what](vehicle, now)
    elif what == "cancel":
        vehicle.operations.abandon(now)
    elif what == "stream":
        vehicle.setpoints.open(now)
    elif what == "setpoint":
        with contextlib.suppress(SetpointError):
            vehicle.send_setpoint(SetpointNed((1.0, 2.0, -3.0), (0.1, 0.0, 0.0)), now)


VEHICLES = [
    None,
    *((mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA, kind) for kind in (1, 2, 10)),
    *((mavlink.MAV_AUTOPILOT_PX4, kind) for kind in (1, 2, 10, 22)),
]
"""Not heard yet, or MAV_AUTOPILOT and MAV_TYPE."""


@given(st.lists(STEP, max_size=60), st.sampled_from(VEHICLES))
@settings(max_examples=200)
def test_anything_may_come_at_any_time(
    steps: list[tuple],  # type: ignore[type-arg]
    kind: tuple[int, int] | None,
) -> None:
    vehicle, codec, now = Vehicle(VehicleConfig()), Codec(1, 191), 100.0
    station = mavlink.MAVLink(None, srcSystem=255, srcComponent=190)
    vehicle.start(now)
    if kind is not None:
        say = AutopilotMessages()
        for armed in (False, True):
            beat = say.heartbeat(armed=armed, status=4, autopilot=kind[0], vehicle_type=kind[1])
            vehicle.receive(beat, now)
    packer = mavlink.MAVLink(None, srcSystem=1, srcComponent=1)
    started, ended = 0, 0
    for number, (cls, seed, pause_s, what) in enumerate(steps):
        now += pause_s
        packer.seq = number % 256
        frame = bytes(random_message(cls, seed, STRANGE_FLOATS).pack(packer))
        for message in codec.decode(frame):
            vehicle.receive(message, now)
        for message in codec.decode(bytes(random_message(cls, seed, STRANGE_FLOATS).pack(station))):
            vehicle.overhear(message, now)
        act(vehicle, what, now)
        started += what in OPERATIONS
        check_attributes(vehicle)
        vehicle.handle_timer(now)
        check_attributes(vehicle)
        for message in vehicle.messages_to_send():
            codec.encode(message)
        while (event := vehicle.next_event()) is not None:
            ended += type(event).__name__ == "OperationFinished"
    assert 0 <= started - ended <= 1
    check_sense(vehicle)


def check_attributes(vehicle: Vehicle) -> None:
    """A service hides no deadline of its part, no message and no event from its attributes."""
    for service in vehicle.services:
        part = service.pending
        if isinstance(part, Timed) and part.deadline_s is not None:
            assert service.deadline_s is not None
            assert service.deadline_s <= part.deadline_s
        if part is None and not service.outbox:
            assert service.messages_to_send() == []
        if not service.events:
            assert service.next_event() is None


def check_sense(vehicle: Vehicle) -> None:
    state = vehicle.state
    numbers: list[float | None] = []
    if state.global_position is not None:
        numbers += state.global_position.velocity_ned_m_s
        numbers.append(state.global_position.heading_ned_rad)
    if state.local_position is not None:
        numbers += [*state.local_position.position_ned_m, *state.local_position.velocity_ned_m_s]
    if state.attitude is not None:
        numbers += [state.attitude.roll_rad, state.attitude.yaw_ned_rad]
    if state.battery is not None:
        numbers += [state.battery.remaining, state.battery.voltage_v, state.battery.current_a]
        assert state.battery.remaining is None or 0.0 <= state.battery.remaining <= 1.0
    if state.home is not None and state.home.position_ned_m is not None:
        numbers += state.home.position_ned_m
    assert all(number is None or math.isfinite(number) for number in numbers)
    for text in state.status_texts:
        assert text.text.isprintable()
