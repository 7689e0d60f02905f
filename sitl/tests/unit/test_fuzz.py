"""A million hostile frames, and every message with extreme values, into vehicles under way."""

from __future__ import annotations

import gc
import itertools
import math
import random
import sys
from collections.abc import Iterator

import pytest
from pymavlink.dialects.v20 import all as mav

from mavlink_sitl import Simulation, VehicleConfig
from mavlink_sitl.config import PERSONALITIES
from mavlink_sitl.mavlink.codec import Decoder
from sitl_support.ground_station import GroundStation, alive
from sitl_support.hostile_frames import UNSIGNED, extreme_payloads, frame_of, frames

TOTAL = 1_000_000
TOGETHER = 8
"""Frames in a datagram; every other datagram has one"""
MOST_NEW_BLOCKS = 30_000
"""Python's objects; what is kept for each frame would be more than 100,000"""


def under_way(vehicle: str, autopilot: str) -> GroundStation:
    config = VehicleConfig(vehicle=vehicle, autopilot=autopilot, ready_after_s=1.0)
    station = GroundStation(Simulation([config], seed=1))
    station.run(4.0)
    station.command(mav.MAV_CMD_COMPONENT_ARM_DISARM, 1, 21196)
    return station


def check_finite(station: GroundStation) -> None:
    assert all(math.isfinite(x) for x in (*station.position, *station.velocity))


def unharmed(station: GroundStation) -> None:
    """It still moves, thinks and answers, whatever its link received."""
    station.vehicle.link.silent = station.vehicle.link.mute = False
    station.vehicle.link.set_faults(None)
    alive(station, 6.0)
    answers = station.send(mav.MAVLink_timesync_message(0, 123))
    assert any(m.get_type() == "TIMESYNC" and m.ts1 == 123 for m in answers)
    station.send(mav.MAVLink_param_request_read_message(1, 1, b"", 0))
    station.run(0.5)
    assert station.messages("PARAM_VALUE")


def datagrams(seed: int, count: int) -> Iterator[bytes]:
    """Hostile frames, alone and several together."""
    source = itertools.islice(frames(seed), count)
    while batch := list(itertools.islice(source, TOGETHER)):
        yield from batch[:1]
        yield b"".join(batch[1:])


@pytest.mark.wide
@pytest.mark.parametrize(("vehicle", "autopilot"), PERSONALITIES)
def test_a_million_hostile_frames_do_no_harm(vehicle: str, autopilot: str) -> None:
    """All kinds and firmwares take their share, at some 10,000 frames a simulated second."""
    station = under_way(vehicle, autopilot)
    share = math.ceil(TOTAL / len(PERSONALITIES))
    blocks = 0
    for number, datagram in enumerate(datagrams(len(vehicle + autopilot), share)):
        station.vehicle.link.write(datagram)
        if number % 50 == 0:
            station.simulation.run_for(0.02)
            station.vehicle.link.read()
        if number % 2000 == 0:
            check_finite(station)
        if number == share // TOGETHER:
            gc.collect()
            blocks = sys.getallocatedblocks()
    gc.collect()
    assert sys.getallocatedblocks() - blocks < MOST_NEW_BLOCKS
    unharmed(station)


def test_every_byte_is_in_a_message_or_counted_as_bad() -> None:
    decoder = Decoder()
    sent = taken = 0
    for datagram in datagrams(1, 50_000):
        sent += len(datagram)
        taken += sum(len(message.get_msgbuf()) for message in decoder.feed(datagram))
        decoder.reset()
    assert taken > 100_000
    assert taken + decoder.bad_bytes == sent


@pytest.mark.parametrize(("vehicle", "autopilot"), PERSONALITIES)
def test_every_message_of_the_dialect_with_extreme_fields(vehicle: str, autopilot: str) -> None:
    """Lowest, highest, NaN, infinite; empty texts and texts without an end."""
    station = under_way(vehicle, autopilot)
    assert len(UNSIGNED) > 250
    for kind in UNSIGNED:
        for payload in extreme_payloads(kind):
            station.vehicle.link.write(frame_of(kind, payload))
        station.simulation.run_for(0.01)
        station.vehicle.link.read()
        check_finite(station)
    unharmed(station)


SETPOINTS = (
    mav.MAVLink_set_position_target_local_ned_message,
    mav.MAVLink_set_position_target_global_int_message,
    mav.MAVLink_set_attitude_target_message,
)


@pytest.mark.parametrize(("vehicle", "autopilot"), PERSONALITIES)
@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_not_a_number_in_any_field_of_any_setpoint_moves_nothing(
    vehicle: str, autopilot: str, bad: float
) -> None:
    station = under_way(vehicle, autopilot)
    rng = random.Random(1)
    for kind in SETPOINTS:
        places = [
            place
            for place, name in enumerate(kind.fieldnames)
            if kind.fieldtypes[place] == "float" and name != "q"
        ]
        for place in places:
            fields = [0.0] * len(kind.fieldnames)
            fields[place] = bad
            named = dict(zip(kind.fieldnames, fields, strict=True))
            whole = ("time_boot_ms", "lat_int", "lon_int")
            named.update({name: 0 for name in whole if name in named})
            named.update(target_system=1, target_component=1, type_mask=0)
            if "coordinate_frame" in named:
                named["coordinate_frame"] = rng.choice([1, 5, 6, 8, 9])
            if "q" in named:
                named["q"] = [1.0, 0.0, 0.0, 0.0]
            if "thrust_body" in named:
                named["thrust_body"] = [0.0, 0.0, 0.0]
            station.vehicle.link.write(station.pack(kind(**named)))
            station.simulation.run_for(0.1)
            check_finite(station)
            assert math.hypot(*station.velocity) < 100.0
    unharmed(station)


NUMBERS = (
    *(n for n in range(16, 600) if n != mav.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN),
    2000, 2500, 2501, 3000, 4000, 5000, 31999, 42000, 42003, 42007, 42424, 42425, 42426, 42428,
)  # fmt: skip


FIGURE_EIGHT = 35
"""MAV_CMD_DO_FIGURE_EIGHT, which pymavlink's dialect lacks"""
TAKE_NO_NUMBERS = {
    mav.MAV_CMD_NAV_LOITER_UNLIM,
    mav.MAV_CMD_NAV_RETURN_TO_LAUNCH,
    mav.MAV_CMD_NAV_LAND,
    mav.MAV_CMD_NAV_VTOL_LAND,
    mav.MAV_CMD_DO_SET_ROI_NONE,
    mav.MAV_CMD_RUN_PREARM_CHECKS,
    mav.MAV_CMD_GET_HOME_POSITION,
    mav.MAV_CMD_DO_SEND_BANNER,
    mav.MAV_CMD_REQUEST_PROTOCOL_VERSION,
    mav.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES,
}
"""Changes of mode and requests: NaN in a field that is not used means "not given"."""


@pytest.mark.parametrize(("vehicle", "autopilot"), PERSONALITIES)
def test_a_command_without_a_number_in_any_field_is_rejected(vehicle: str, autopilot: str) -> None:
    """Unless it takes none.

    PX4 has usual numbers for a take-off and an orbit, and leaves an output as it is without one.
    """
    takes_usual = {
        mav.MAV_CMD_NAV_TAKEOFF,
        mav.MAV_CMD_DO_ORBIT,
        FIGURE_EIGHT,
        mav.MAV_CMD_DO_SET_ACTUATOR,
    }
    usual = takes_usual if autopilot == "px4" else set()
    may = TAKE_NO_NUMBERS | usual
    station = under_way(vehicle, autopilot)
    nan = math.nan
    for number in NUMBERS:
        before = len(station.log)
        station.send(mav.MAVLink_command_long_message(1, 1, number, 0, *[nan] * 7))
        station.send(mav.MAVLink_command_int_message(1, 1, 6, number, 0, 0, *[nan] * 4, 0, 0, nan))
        answers = [m for _, m in station.log[before:] if m.get_type() == "COMMAND_ACK"]
        assert {m.command for m in answers} <= {number}
        assert number in may or mav.MAV_RESULT_ACCEPTED not in [m.result for m in answers]
        station.simulation.run_for(0.02)
        check_finite(station)
    unharmed(station)
