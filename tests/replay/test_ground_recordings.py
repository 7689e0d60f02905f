"""The recorded conversations with the real ArduRover and ArduPlane, played into the simulated ones.

What is meant to differ stands here, each with its reason; nothing else may.
"""

from __future__ import annotations

import functools
import math

import pytest
from pymavlink.dialects.v20 import all as mav

from mavlink_sitl import Simulation, VehicleConfig
from mavlink_sitl.tlog import read_records
from tests.replay.conversation import (
    DATA,
    Conversation,
    Timed,
    acknowledgements,
    arrival_s,
    changes,
    replay,
    texts,
    track,
)

READY_AFTER_S = {"rover_guided": 42.11, "rover_auto": 42.11, "plane_guided": 20.52}
VEHICLES = {"rover_guided": "rover", "rover_auto": "rover", "plane_guided": "plane"}

NAMES = list(VEHICLES)

DIFFERENT_TEXTS = {
    "INS: alloc 6144 bytes for ISB (free=524288)": "there is no such memory",
    "RCInput: decoding UDP (Pulses)": "there is no such receiver",
}
"""Text: reason"""


@functools.cache
def conversation(name: str) -> Conversation:
    config = VehicleConfig(vehicle=VEHICLES[name], ready_after_s=READY_AFTER_S[name])
    return replay(name, config=config)


@pytest.mark.parametrize("name", NAMES)
def test_every_command_is_answered_as_the_real_one_answered(name: str) -> None:
    flight = conversation(name)
    assert acknowledgements(flight.ours) == acknowledgements(flight.real)


@pytest.mark.parametrize("name", NAMES)
def test_the_heartbeat_goes_through_the_same_states(name: str) -> None:
    flight = conversation(name)
    fields = ("custom_mode", "base_mode", "system_status")
    real = changes(flight.real, "HEARTBEAT", *fields)
    ours = changes(flight.ours, "HEARTBEAT", *fields)
    assert [v for _, v in ours] == [v for _, v in real]
    for (real_s, state), (our_s, _) in zip(real, ours, strict=True):
        assert our_s == pytest.approx(real_s, abs=1.1), state


@pytest.mark.parametrize("name", NAMES)
def test_landed_states_come_in_the_same_order(name: str) -> None:
    flight = conversation(name)
    real = [v for _, v in changes(flight.real, "EXTENDED_SYS_STATE", "landed_state")]
    assert [v for _, v in changes(flight.ours, "EXTENDED_SYS_STATE", "landed_state")] == real


@pytest.mark.parametrize("name", NAMES)
def test_the_same_words_are_said(name: str) -> None:
    flight = conversation(name)
    real = {text for text in texts(flight.real) if text not in DIFFERENT_TEXTS}
    assert set(texts(flight.ours)) == real


def test_a_refused_acceleration_is_told_in_two_chunks_every_time() -> None:
    flight = conversation("rover_guided")
    told = [text for text in texts(flight.ours) if "NORE in mask" in text]
    assert len(told) == len([text for text in texts(flight.real) if "NORE in mask" in text])


def arrivals(flight: Conversation, ours: bool) -> list[float]:
    messages = flight.ours if ours else flight.real
    return [t for t, m in messages if m.get_type() == "MISSION_ITEM_REACHED" and m.seq == 0]


def test_rover_tells_each_arrival_as_item_0() -> None:
    flight = conversation("rover_guided")
    assert len(arrivals(flight, True)) == len(arrivals(flight, False)) == 4


ROVER_LEGS = [48.37, 62.35, 75.06, 133.12]
"""When a position was sent"""


@pytest.mark.parametrize(("leg", "from_s"), list(enumerate(ROVER_LEGS)))
def test_rover_takes_as_long_to_each_position(leg: int, from_s: float) -> None:
    flight = conversation("rover_guided")
    real, ours = arrivals(flight, False)[leg], arrivals(flight, True)[leg]
    assert ours - from_s == pytest.approx(real - from_s, rel=0.1)


ROVER_TARGETS = [((20.0, 0.0), 48.37), ((20.0, 15.0), 62.35)]


@pytest.mark.parametrize(("target", "from_s"), ROVER_TARGETS)
def test_rover_is_near_each_target_in_time(target: tuple[float, float], from_s: float) -> None:
    flight = conversation("rover_guided")
    place = (*target, 0.0)
    expected = arrival_s(flight.real, place, from_s, within_m=2.5)
    assert arrival_s(flight.ours, place, from_s, within_m=2.5) == pytest.approx(expected, rel=0.1)


def test_rover_moves_as_the_recorded_one() -> None:
    """Distance at equal times, over all setpoints; relative setpoints add up their errors."""
    flight = conversation("rover_guided")
    ours = {round(t, 1): (n, e) for t, n, e, _ in track(flight.ours)}
    squares = [
        math.dist((n, e), ours[round(t, 1)]) ** 2
        for t, n, e, _ in track(flight.real)
        if 48.0 <= t <= 103.0 and round(t, 1) in ours
    ]
    assert len(squares) > 200
    assert math.sqrt(sum(squares) / len(squares)) < 1.0


def test_rover_mission_is_told_as_the_recorded_one() -> None:
    """Left for HOLD and taken up again, a refused CLEAR_ALL, a second upload on the way."""
    flight = conversation("rover_auto")
    fields = ("seq", "total", "mission_state", "mission_mode")
    for kind, names in (("MISSION_CURRENT", fields), ("MISSION_ACK", ("type",))):
        real = [v for _, v in changes(flight.real, kind, *names)]
        assert [v for _, v in changes(flight.ours, kind, *names)] == real
    asked = [
        [m.seq for _, m in x if m.get_type() == "MISSION_REQUEST"]
        for x in (flight.real, flight.ours)
    ]
    assert asked[0] == asked[1]


MISSION_LEGS = [42.49, 55.59, 60.96]
"""When the recorded rover set off to items 1, 2 (again, after HOLD) and 3. The way to item 4
was begun again by the second upload, at another place, so its time says nothing."""


@pytest.mark.parametrize(("leg", "from_s"), list(enumerate(MISSION_LEGS)))
def test_rover_takes_as_long_to_each_item(leg: int, from_s: float) -> None:
    flight = conversation("rover_auto")
    real, ours = (
        [t for t, m in x if m.get_type() == "MISSION_ITEM_REACHED"]
        for x in (flight.real, flight.ours)
    )
    begin_s = from_s if leg < 2 else ours[leg - 1]
    assert ours[leg] - begin_s == pytest.approx(real[leg] - from_s, rel=0.1)


def height_reached_s(messages: Timed, height_m: float) -> float:
    return next(t for t, _, _, down in track(messages) if -down >= height_m)


@pytest.mark.parametrize("height_m", [10.0, 25.0, 40.0, 49.0])
def test_plane_takes_off_as_fast(height_m: float) -> None:
    flight = conversation("plane_guided")
    armed_s = 25.87
    expected = height_reached_s(flight.real, height_m) - armed_s
    assert height_reached_s(flight.ours, height_m) - armed_s == pytest.approx(expected, rel=0.1)


def test_plane_climbs_to_the_height_of_rtl_as_fast() -> None:
    flight = conversation("plane_guided")
    expected = height_reached_s(flight.real, 97.0) - 69.9
    assert height_reached_s(flight.ours, 97.0) - 69.9 == pytest.approx(expected, rel=0.1)


def turned_s(messages: Timed, centre: tuple[float, float], radius_m: float, from_s: float) -> float:
    """Time until the plane is within a distance of a point."""
    for t, north, east, _ in track(messages):
        if t >= from_s and math.dist((north, east), centre) <= radius_m:
            return t - from_s
    raise AssertionError("never near")


PLANE_TARGETS = [((300.0, 100.0), 95.0, 51.8), ((0.0, 0.0), 100.0, 69.9)]
"""Where DO_REPOSITION and RTL sent it, and how near it comes first"""


@pytest.mark.parametrize(("centre", "radius_m", "from_s"), PLANE_TARGETS)
def test_plane_takes_as_long_to_each_circle(
    centre: tuple[float, float], radius_m: float, from_s: float
) -> None:
    flight = conversation("plane_guided")
    expected = turned_s(flight.real, centre, radius_m, from_s)
    assert turned_s(flight.ours, centre, radius_m, from_s) == pytest.approx(expected, rel=0.1)


def test_plane_ignores_the_local_setpoints_of_the_recording() -> None:
    """300 m north by LOCAL_NED and GLOBAL_INT: both went on circling where GUIDED began."""
    flight = conversation("plane_guided")
    for messages in (flight.real, flight.ours):
        places = [(n, e) for t, n, e, _ in track(messages) if 45.0 < t < 51.0]
        assert all(math.dist(place, (228.0, -107.0)) < 135.0 for place in places)


def test_plane_tells_that_it_circles_as_item_0() -> None:
    flight = conversation("plane_guided")
    assert len(arrivals(flight, True)) == len(arrivals(flight, False)) == 2


def test_plane_is_close_to_the_recorded_one_all_the_time() -> None:
    flight = conversation("plane_guided")
    ours = {round(t, 1): (n, e) for t, n, e, _ in track(flight.ours)}
    squares = [
        math.dist((n, e), ours[round(t, 1)]) ** 2
        for t, n, e, _ in track(flight.real)
        if 26.0 <= t <= 88.0 and round(t, 1) in ours
    ]
    assert len(squares) > 100
    assert math.sqrt(sum(squares) / len(squares)) < 20.0


# Two copters and a rover at once (`multi_udp`).


@functools.cache
def three_vehicles() -> tuple[dict[int, Timed], dict[int, Timed]]:
    """What the three real vehicles and the three simulated ones said, by system id."""
    decoder = mav.MAVLink(None)
    records = [
        (time_us / 1e6, decoder.decode(bytearray(frame)))
        for time_us, frame in read_records((DATA / "multi_udp.tlog").read_bytes())
    ]
    boot_s = next(
        t - m.time_boot_ms / 1e3 for t, m in records if m.get_type() == "LOCAL_POSITION_NED"
    )
    real: dict[int, Timed] = {1: [], 2: [], 3: []}
    ours: dict[int, Timed] = {1: [], 2: [], 3: []}
    kinds = ("copter", "copter", "rover")
    simulation = Simulation(
        [VehicleConfig(vehicle=kind, ready_after_s=42.0) for kind in kinds], seed=1
    )
    listening = mav.MAVLink(None)

    def until(time_s: float) -> None:
        while simulation.time_s < time_s:
            simulation.run_to_us(min(simulation.time_us + 50_000, math.ceil(time_s * 1e6)))
            for vehicle in simulation.vehicles:
                for message in listening.parse_buffer(vehicle.link.read()) or []:
                    ours[vehicle.system_id].append((simulation.time_s, message))

    for time_s, message in records:
        if message.get_srcSystem() < 250:
            real[message.get_srcSystem()].append((time_s - boot_s, message))
            continue
        until(time_s - boot_s)
        for vehicle in simulation.vehicles:
            vehicle.link.write(bytes(message.get_msgbuf()))
    until(records[-1][0] - boot_s)
    return real, ours


@pytest.mark.parametrize("system", [1, 2, 3])
def test_three_vehicles_answer_as_the_real_ones(system: int) -> None:
    real, ours = three_vehicles()
    assert acknowledgements(ours[system]) == acknowledgements(real[system])
    modes = [
        [v for _, v in changes(said[system], "HEARTBEAT", "type", "custom_mode", "base_mode")]
        for said in (real, ours)
    ]
    assert modes[0][-3:] == modes[1][-3:]


THREE_TARGETS = {1: (15.0, 5.0, -8.0), 2: (15.0, 10.0, -12.0), 3: (15.0, 15.0, 0.0)}


@pytest.mark.parametrize("system", [1, 2, 3])
def test_three_vehicles_take_as_long_to_their_targets(system: int) -> None:
    real, ours = three_vehicles()
    target = THREE_TARGETS[system]
    expected = arrival_s(real[system], target, 62.19, within_m=1.5)
    assert arrival_s(ours[system], target, 62.19, within_m=1.5) == pytest.approx(expected, rel=0.1)
