"""The vehicle of a recording is the best known sender of HEARTBEAT in it, not the first."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from drone_navigation.tlog2mcap import convert
from flight_reports.analysis.flight import read_flights
from flight_reports.contents.log_reader import read_log
from flight_reports.flight_recording import read_recording
from mavlink_vehicle.codec import Codec, Message, make, mavlink, with_source
from mavlink_vehicle.io.tlog import TlogWriter
from tests.support.logs.bags import read_bag

BEGUN_UNIX_S = 1_700_000_000.0
SECONDS = 10
SPEED_M_S = 2.0
ARDUPILOT, GENERIC = mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA, mavlink.MAV_AUTOPILOT_GENERIC
COPTER = mavlink.MAV_TYPE_QUADROTOR
VEHICLE = (1, 1)
KINDS = {
    "station": mavlink.MAV_TYPE_GCS,
    "companion": mavlink.MAV_TYPE_ONBOARD_CONTROLLER,
    "gimbal": mavlink.MAV_TYPE_GIMBAL,
    "ADS-B receiver": mavlink.MAV_TYPE_ADSB,
    "camera": mavlink.MAV_TYPE_CAMERA,
}
SOURCES = [(255, 1), (1, 1), (1, 154), (9, 1)]


def beat(kind: int, autopilot: int, armed: bool) -> Message:
    return make(
        "HEARTBEAT", type=kind, autopilot=autopilot, base_mode=209 if armed else 81,
        custom_mode=4, system_status=4, mavlink_version=3,
    )  # fmt: skip


def placed(time_s: float, north_m: float) -> list[Message]:
    boot_ms = round(100_000 + 1000 * time_s)
    latitude = round((52.5 + math.degrees(north_m / 6_378_137.0)) * 1e7)
    return [
        make(
            "GLOBAL_POSITION_INT", time_boot_ms=boot_ms, lat=latitude, lon=134_000_000,
            alt=50_000, relative_alt=10_000, vx=200, vy=0, vz=0, hdg=0,
        ),
        make("LOCAL_POSITION_NED", time_boot_ms=boot_ms, x=north_m, y=0.0, z=-10.0,
             vx=SPEED_M_S, vy=0.0, vz=0.0),
        make("ATTITUDE", time_boot_ms=boot_ms, yaw=0.0),
    ]  # fmt: skip


def written(
    path: Path, other: tuple[int, int, tuple[int, int]], vehicle: tuple[int, int] = VEHICLE
) -> Path:
    """Write a copter's flight in which another sender speaks first, and in each second after."""
    kind, autopilot, source = other
    codec, writer = Codec(1, 1), TlogWriter(path)
    for step in range(10 * SECONDS):
        time_s = 0.1 * step
        told: list[Message] = []
        if step % 10 == 0:
            told = [with_source(beat(kind, autopilot, False), *source)]
            # Positions of a sender with the vehicle's ids could not be told from the vehicle's own.
            if source != vehicle:
                told += [with_source(message, *source) for message in placed(time_s, 500.0)]
        if step >= 10:
            if step % 10 == 5:
                told.append(with_source(beat(COPTER, ARDUPILOT, True), *vehicle))
            at = placed(time_s, SPEED_M_S * time_s)
            told += [with_source(message, *vehicle) for message in at]
        for message in told:
            writer.write(codec.encode(message), BEGUN_UNIX_S + time_s)
    # The last word is the other's, too.
    last = with_source(beat(kind, autopilot, False), *source)
    writer.write(codec.encode(last), BEGUN_UNIX_S + SECONDS)
    writer.close()
    return path


def assert_the_copter_is_shown(log: Path, systems: list[int]) -> None:
    flights = {flight.source[0]: flight for flight in read_flights(read_log(log))}
    assert sorted(flights) == systems
    flight = flights[VEHICLE[0]]
    assert flight.retold.name == "ArduCopter"
    flown_m = SPEED_M_S * (SECONDS - 1.1)
    assert flight.figures is not None
    assert flight.figures.distance_m == pytest.approx(flown_m, abs=0.5)
    recording = read_recording(log)
    assert recording.vehicle == "ArduCopter, system 1"
    assert recording.figures == flight.figures
    bag = log.with_suffix(".mcap")
    convert(log, bag)
    name = "/navigation_server" if len(systems) == 1 else "/system_1/navigation_server"
    topics = read_bag(bag).topics
    poses = [message.pose.position for _, message in topics[f"{name}/pose"].messages]
    assert poses[-1].y - poses[0].y == pytest.approx(flown_m, abs=1.0)
    status = [message for _, message in topics[f"{name}/vehicle_status"].messages]
    assert status[-1].autopilot == "ArduCopter"


@pytest.mark.parametrize("source", SOURCES)
@pytest.mark.parametrize("kind", sorted(KINDS))
def test_a_sender_that_is_no_vehicle_is_none_in_a_log(
    tmp_path: Path, kind: str, source: tuple[int, int]
) -> None:
    log = written(tmp_path / "a.tlog", (KINDS[kind], GENERIC, source))
    assert_the_copter_is_shown(log, [1])


@pytest.mark.parametrize("source", [(1, 1), (1, 2), (1, 240)])
def test_a_better_known_vehicle_replaces_another_of_its_system(
    tmp_path: Path, source: tuple[int, int]
) -> None:
    log = written(tmp_path / "a.tlog", (mavlink.MAV_TYPE_GENERIC, GENERIC, source))
    assert_the_copter_is_shown(log, [1])


def test_an_unknown_autopilot_of_another_system_is_a_second_vehicle(tmp_path: Path) -> None:
    log = written(tmp_path / "a.tlog", (COPTER, GENERIC, (9, 1)))
    assert_the_copter_is_shown(log, [1, 9])


def test_a_vehicle_that_is_no_first_component_is_found(tmp_path: Path) -> None:
    other = (mavlink.MAV_TYPE_GENERIC, GENERIC, (1, 1))
    log = written(tmp_path / "a.tlog", other, vehicle=(1, 5))
    assert_the_copter_is_shown(log, [1])


def test_a_log_without_a_vehicle_shows_who_sends_positions(tmp_path: Path) -> None:
    log = tmp_path / "a.tlog"
    codec, writer = Codec(1, 1), TlogWriter(log)
    station = with_source(beat(mavlink.MAV_TYPE_GCS, GENERIC, False), 255, 190)
    for step in range(20):
        for message in [*placed(0.1 * step, 0.2 * step), station]:
            writer.write(codec.encode(message), BEGUN_UNIX_S + 0.1 * step)
    writer.close()
    assert [flight.source for flight in read_flights(read_log(log))] == [VEHICLE]
