"""Simulated time, determinism, many vehicles, bad links."""

from __future__ import annotations

import hashlib
import io
import math
import random

import pytest
from pymavlink.dialects.v20 import all as mav

from mavlink_sitl import (
    ConfigurationError,
    GeoPoint,
    LinkFaults,
    Simulation,
    VehicleConfig,
    Wind,
    World,
)
from mavlink_sitl.dynamics.battery import BatteryModel
from mavlink_sitl.world.model import Obstacle
from sitl_support.ground_station import GUIDED, POSITION, GroundStation, copter
from sitl_support.tlogs import read_records

Script = list[tuple[float, bytes]]


def script() -> Script:
    """The writes of a ground station: time (seconds, whole microseconds) and bytes."""
    out = mav.MAVLink(None, srcSystem=255, srcComponent=190)

    def command(*params: float) -> bytes:
        values = [*params, *([0.0] * (8 - len(params)))]
        message = mav.MAVLink_command_long_message(1, 1, int(values[0]), 0, *values[1:])
        return bytes(message.pack(out))

    def setpoint(north: float) -> bytes:
        message = mav.MAVLink_set_position_target_local_ned_message(
            0, 1, 1, 1, POSITION, north, 3.0, -8.0, 0, 0, 0, 0, 0, 0, 0, 0
        )
        return bytes(message.pack(out))

    writes = [(1.0, command(511, message_id, 1e5)) for message_id in (1, 24, 30, 32, 33, 147)]
    writes += [(3.0123, command(176, 1, GUIDED)), (3.1, command(400, 1))]
    writes += [(3.2000001, command(22, 0, 0, 0, 0, 0, 0, 8)), (14.567, setpoint(20.0))]
    writes += [(18.0, b"\xfd\x00garbage"), (22.345, command(176, 1, 9))]
    return writes


def fly(seed: int, chunks: random.Random | None, until_s: float = 30.0) -> bytes:
    """The tlog of the script, with the time in between cut into pieces."""
    log = io.BytesIO()
    simulation = Simulation([VehicleConfig(ready_after_s=1.0)], seed=seed, tlog=log)
    for time_s, data in [*script(), (until_s, b"")]:
        target_us = round(time_s * 1e6)
        while simulation.time_us < target_us:
            piece_us = target_us - simulation.time_us
            if chunks is not None:
                piece_us = min(
                    piece_us, chunks.choice([1, 999, 10_000, 12_345, 100_000, 2_000_000])
                )
            simulation.run_for(piece_us / 1e6)
        simulation.link.write(data)
    return log.getvalue()


def test_the_same_seed_and_inputs_give_a_byte_identical_tlog_however_time_is_cut() -> None:
    reference = fly(7, None)
    assert len(reference) > 50_000
    for number in range(3):
        again = fly(7, random.Random(number))
        assert hashlib.sha256(again).digest() == hashlib.sha256(reference).digest()


def test_another_seed_gives_another_flight() -> None:
    assert fly(7, None, 12.0) != fly(8, None, 12.0)


def test_run_until_gives_the_same_bytes_as_run_for() -> None:
    logs = []
    for use_until in (False, True):
        log = io.BytesIO()
        simulation = Simulation(seed=3, tlog=log)
        if use_until:
            assert not simulation.run_until(lambda: False, 20.0)
        else:
            simulation.run_for(20.0)
        assert simulation.time_s == 20.0
        logs.append(log.getvalue())
    assert logs[0] == logs[1]


def test_the_tlog_holds_both_directions_in_simulated_time() -> None:
    records = list(read_records(fly(7, None, 25.0)))
    times = [time_us for time_us, _ in records]
    assert times == sorted(times)
    assert times[-1] - times[0] < 25e6
    senders = {frame[5] for _, frame in records}
    assert senders == {1, 255}
    decoder = mav.MAVLink(None)
    kinds = {decoder.decode(bytearray(frame)).get_type() for _, frame in records}
    assert {"COMMAND_LONG", "COMMAND_ACK", "SET_POSITION_TARGET_LOCAL_NED", "HEARTBEAT"} <= kinds


def test_run_until_stops_at_once_and_returns_the_result() -> None:
    simulation = Simulation()
    assert simulation.run_until(lambda: simulation.time_s >= 0.5, 2.0)
    assert simulation.time_s == 0.5
    assert simulation.run_until(lambda: True, 1.0)
    assert simulation.time_s == 0.5


@pytest.mark.parametrize("seconds", [-1.0, math.nan, math.inf])
def test_time_runs_forwards(seconds: float) -> None:
    with pytest.raises(ValueError, match="time cannot advance"):
        Simulation().run_for(seconds)


def test_no_vehicle_is_no_simulation() -> None:
    with pytest.raises(ConfigurationError, match="at least one vehicle"):
        Simulation([])


@pytest.mark.parametrize(
    ("config", "words"),
    [
        ({"vehicle": "airship"}, "airship with ardupilot is not supported"),
        ({"autopilot": "inav"}, "copter with inav is not supported"),
        ({"system_id": 0}, "system id"),
        ({"system_id": 256}, "system id"),
        ({"home": GeoPoint(91.0, 0.0, 0.0)}, "latitude"),
        ({"home": GeoPoint(0.0, math.nan, 0.0)}, "longitude"),
        ({"home": GeoPoint(0.0, 0.0, 1e9)}, "altitude"),
        ({"heading_deg": math.nan}, "heading"),
        ({"ready_after_s": -1.0}, "time until ready"),
        ({"battery_remaining": 1.5}, "charge"),
        ({"battery": BatteryModel(cells=0)}, "cell"),
        ({"battery": BatteryModel(capacity_mah=math.nan)}, "capacity"),
    ],
)
def test_a_wrong_configuration_gets_a_sentence(config: dict[str, object], words: str) -> None:
    with pytest.raises(ConfigurationError, match=words):
        VehicleConfig(**config)  # type: ignore[arg-type]


def test_home_and_heading_are_where_it_starts() -> None:
    config = VehicleConfig(home=GeoPoint(47.397742, 8.545594, 488.0), heading_deg=120.0)
    station = GroundStation(Simulation([config])).ready()
    station.run(0.5)
    place = station.last("GLOBAL_POSITION_INT")
    assert (place.lat, place.lon) == pytest.approx((473977420, 85455940), abs=10)
    assert place.alt == pytest.approx(488000, abs=100)
    assert place.hdg == pytest.approx(12000, abs=10)


@pytest.mark.night
def test_many_vehicles_fly_each_for_itself() -> None:
    """One pipeline: the array of three flies like a single one with the same orders."""
    simulation = Simulation([VehicleConfig(ready_after_s=1.0)] * 3, seed=1)
    stations = [GroundStation(simulation, index) for index in range(3)]
    simulation.run_for(2.0)
    for number, station in enumerate(stations):
        system = number + 1
        assert station.vehicle.system_id == system
        for command, *params in ((176, 1, GUIDED), (400, 1), (22, 0, 0, 0, 0, 0, 0, 10)):
            assert station.command(command, *params, system=system) == 0
    simulation.run_for(15.0)
    targets = [(20.0, 0.0, -10.0), (0.0, -15.0, -12.0), (5.0, 5.0, -6.0)]
    for station, target in zip(stations, targets, strict=True):
        station.send(
            mav.MAVLink_set_position_target_local_ned_message(
                0, station.vehicle.system_id, 1, 1, POSITION, *target, 0, 0, 0, 0, 0, 0, 0, 0
            )
        )
    alone = copter(ready_after_s=1.0)
    alone.run(2.0)
    for command, *params in ((176, 1, GUIDED), (400, 1), (22, 0, 0, 0, 0, 0, 0, 10)):
        alone.command(command, *params)
    alone.simulation.run_for(15.0)
    alone.setpoint(POSITION, targets[0])
    for _ in range(10):
        simulation.run_for(1.0)
        alone.simulation.run_for(1.0)
        assert stations[0].position == pytest.approx(alone.position, abs=0.01)
    for station, target in zip(stations, targets, strict=True):
        assert station.position == pytest.approx(target, abs=0.4)
        assert math.hypot(*station.velocity) < 0.3


def test_truth_has_a_row_for_each_vehicle() -> None:
    truth = Simulation([VehicleConfig(heading_deg=90.0), VehicleConfig()]).truth
    assert truth.position_ned_m.shape == truth.velocity_ned_m_s.shape == (2, 3)
    assert truth.yaw_rad[0] == pytest.approx(math.pi / 2)
    assert truth.on_ground.tolist() == [True, True]


def rise(simulation: Simulation, seconds: float) -> None:
    """All copters take off to 10 m; some time passes."""
    for number, vehicle in enumerate(simulation.vehicles):
        station = GroundStation(simulation, number)
        for command, *params in ((176, 1, GUIDED), (400, 1), (22, 0, 0, 0, 0, 0, 0, 10)):
            assert station.command(command, *params, system=vehicle.system_id) == 0
    simulation.run_for(seconds)


@pytest.mark.parametrize("count", [1, 2])
def test_truth_is_a_snapshot_even_if_it_is_read_later(count: int) -> None:
    simulation = Simulation([VehicleConfig()] * count, seed=1)
    simulation.run_for(4.0)
    rise(simulation, 4.0)
    at_once, later = simulation.truth, simulation.truth
    position, velocity = at_once.position_ned_m.copy(), at_once.velocity_ned_m_s.copy()
    simulation.run_for(8.0)
    now = simulation.truth
    assert (now.position_ned_m[:, 2] < position[:, 2] - 1.0).all()
    for snapshot in (at_once, later):
        assert (snapshot.position_ned_m == position).all()
        assert (snapshot.velocity_ned_m_s == velocity).all()
    assert position.shape == velocity.shape == (count, 3)
    assert later.yaw_rad.shape == (count,)
    assert not later.on_ground.any()


def test_truth_keeps_who_had_not_yet_collided() -> None:
    ceiling = Obstacle("ceiling", (0.0, 0.0), radius_m=3.0, bottom_m=4.0, top_m=5.0)
    simulation = Simulation(seed=1, world=World(obstacles=(ceiling,)))
    simulation.run_for(4.0)
    before = simulation.truth
    rise(simulation, 1.0)
    assert simulation.run_until(lambda: bool(simulation.truth.collided[0]), 30.0)
    assert before.collided.tolist() == [False]


def test_a_silent_link_passes_nothing_and_the_vehicle_continues() -> None:
    station = copter().ready().take_off(5.0)
    station.setpoint(POSITION, (10.0, 0.0, -5.0))
    station.vehicle.link.silent = True
    count = len(station.log)
    assert station.command(512, 0) == -1
    station.run(10.0)
    assert len(station.log) == count
    assert station.position == pytest.approx((10.0, 0.0, -5.0), abs=0.4)
    station.vehicle.link.silent = False
    station.run(1.0)
    assert len(station.log) > count


def test_a_bad_link_loses_doubles_and_delays_what_it_says_and_the_same_each_time() -> None:
    received = []
    for _ in range(2):
        faults = LinkFaults(loss=0.2, duplicate=0.1, delay_s=0.5, jitter_s=0.2)
        station = copter()
        station.interval(30, 50.0)
        station.vehicle.link.set_faults(faults)
        begin_s = station.now_s
        station.run(20.0)
        received.append([(t, m.time_boot_ms) for t, m in station.log if m.get_type() == "ATTITUDE"])
        stamps = [ms for _, ms in received[-1]]
        assert len(set(stamps)) == pytest.approx(0.8 * 50 * 19.4, rel=0.05)
        assert len(stamps) - len(set(stamps)) == pytest.approx(0.1 * len(stamps), rel=0.4)
        late = [t * 1000 - ms for t, ms in received[-1] if t > begin_s + 1.0]
        assert min(late) >= 500
        assert max(late) <= 760
        assert stamps != sorted(stamps), "jitter reorders"
    assert received[0] == received[1]


def test_commands_survive_a_delay() -> None:
    station = copter(faults=LinkFaults(delay_s=0.3))
    station.run(2.0)
    assert station.command(512, 0) == -1
    station.run(0.7)
    assert station.messages("COMMAND_ACK")


@pytest.mark.parametrize(
    "wrong",
    [
        {"loss": -0.1},
        {"loss": 1.1},
        {"duplicate": math.nan},
        {"delay_s": -1.0},
        {"jitter_s": math.inf},
    ],
)
def test_impossible_faults_are_rejected(wrong: dict[str, float]) -> None:
    with pytest.raises(ValueError, match="must be"):
        LinkFaults(**wrong)


def test_wind_is_felt_and_held_against() -> None:
    simulation = Simulation(
        [VehicleConfig(ready_after_s=1.0)], world=World(wind=Wind((0.0, 6.0, 0.0)))
    )
    station = GroundStation(simulation).ready().take_off(10.0)
    station.interval(168, 5.0)
    station.run(10.0)
    assert station.position == pytest.approx((0.0, 0.0, -10.0), abs=0.3)
    attitude = station.last("ATTITUDE")
    lean = math.degrees(math.hypot(attitude.roll, attitude.pitch))
    assert lean == pytest.approx(13.0, abs=3.0)
    wind = station.last("WIND")
    assert wind.speed == pytest.approx(6.0)
    assert abs(wind.direction) == pytest.approx(90.0)
    assert wind.direction < 0.0, "it comes from the west"


def test_a_60_s_flight_is_the_same_object_to_test_with_as_documented() -> None:
    """The example of docs/sitl.md in spirit: no sockets, no sleeping."""
    simulation = Simulation(vehicles=[VehicleConfig()], seed=1)
    assert simulation.run_until(lambda: b"\xfd" in simulation.link.read(), timeout_s=3.0)
