"""The logs that the simulated vehicles keep, as pymavlink and pyulog read them."""

from __future__ import annotations

import math
import struct
from pathlib import Path
from typing import Any

import pytest
from pymavlink.DFReader import DFReader_binary
from pymavlink.dialects.v20 import all as mav
from pyulog import ULog

from mavlink_sitl import Simulation
from mavlink_sitl.config import VehicleConfig
from mavlink_sitl.exchange import Severity
from mavlink_sitl.mavlink.logs import logbook
from mavlink_sitl.vehicles.vehicle import SimulatedVehicle
from sitl_support.ground_station import GroundStation


def armed_for(autopilot: str, seconds: float, kind: str = "copter") -> SimulatedVehicle:
    config = VehicleConfig(autopilot=autopilot, vehicle=kind, ready_after_s=1.0)
    simulation = Simulation([config])
    simulation.run_for(12.0)
    vehicle = simulation.vehicles[0]
    fly(simulation, seconds)
    return vehicle


def fly(simulation: Simulation, seconds: float) -> None:
    vehicle = simulation.vehicles[0]
    vehicle.firmware.arm(force=True)
    simulation.run_for(seconds)
    vehicle.firmware.disarm(force=True)
    simulation.run_for(1.0)


def written(vehicle: SimulatedVehicle, path: Path) -> str:
    path.write_bytes(vehicle.logbook.logs[-1].data)
    return str(path)


def test_an_ardupilots_log_is_read_by_pymavlink(tmp_path: Path) -> None:
    vehicle = armed_for("ardupilot", 5.0)
    reader = DFReader_binary(written(vehicle, tmp_path / "1.BIN"))
    seen: dict[str, list[Any]] = {}
    while (message := reader.recv_msg()) is not None:
        seen.setdefault(message.get_type(), []).append(message)
    reader.close()
    assert {"FMT", "PARM", "MSG", "MODE", "ARM", "ATT", "POS", "GPS", "BAT"} <= seen.keys()
    assert len(seen["POS"]) == pytest.approx(50, abs=2)
    place = seen["POS"][-1]
    here = vehicle.firmware.navigator.here()
    assert place.Lat == pytest.approx(here.latitude_deg, abs=1e-6)
    assert place.Lng == pytest.approx(here.longitude_deg, abs=1e-6)
    assert [message.ArmState for message in seen["ARM"]] == [0]
    values = {message.Name: message.Value for message in seen["PARM"]}
    assert values.keys() >= vehicle.parameters.table.acting.keys()
    assert any("Arming motors" in message.Message for message in seen["MSG"])
    # The reader places it in time by week and milliseconds of the GPS.
    unix_s = vehicle.snapshot().unix_time_us / 1e6
    assert seen["POS"][-1]._timestamp == pytest.approx(unix_s - 1.0, abs=0.3)


def test_a_px4s_log_is_read_by_pyulog(tmp_path: Path) -> None:
    vehicle = armed_for("px4", 5.0)
    log = ULog(written(vehicle, tmp_path / "0.ulg"))
    assert not log.file_corruption
    topics = {data.name: data.data for data in log.data_list}
    assert len(topics["vehicle_global_position"]["lat"]) == pytest.approx(50, abs=2)
    here = vehicle.firmware.navigator.here()
    assert topics["vehicle_global_position"]["lat"][-1] == pytest.approx(here.latitude_deg)
    norms = sum(topics["vehicle_attitude"][f"q[{axis}]"] ** 2 for axis in range(4))
    assert norms == pytest.approx(1.0, abs=1e-5)
    assert topics["vehicle_status"]["arming_state"][0] == 2
    assert topics["vehicle_status"]["arming_state"][-1] == 1
    assert log.initial_parameters.keys() == set(vehicle.parameters.of_interest())
    texts = [message.message for message in log.logged_messages]
    assert any("Armed" in text for text in texts)
    assert math.isfinite(topics["battery_status"]["remaining"][0])


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
@pytest.mark.parametrize("kind", ["copter", "rover", "boat", "plane"])
def test_each_flight_is_a_log_and_the_same_flight_is_the_same_log(
    autopilot: str, kind: str
) -> None:
    first, second = (armed_for(autopilot, 2.0, kind) for _ in range(2))
    assert len(first.logbook.logs) == 1
    assert first.logbook.logs[0].data == second.logbook.logs[0].data


def test_logs_outlive_a_restart_and_the_oldest_make_room(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(logbook, "LOGS_MAX", 3)
    simulation = Simulation([VehicleConfig(ready_after_s=1.0)])
    simulation.run_for(5.0)
    vehicle = simulation.vehicles[0]
    kept = []
    for _ in range(4):
        fly(simulation, 0.5)
        kept.append(vehicle.logbook.logs[-1])
    assert vehicle.logbook.logs == kept[1:]
    vehicle.power_cycle()
    simulation.run_for(5.0)
    assert vehicle.logbook.logs == kept[1:]


def test_a_restart_in_flight_ends_the_log_and_a_long_one_ends_by_itself(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(logbook, "BYTES_MAX", 20_000)
    config = VehicleConfig(ready_after_s=1.0, parameters={"DISARM_DELAY": 0.0})
    simulation = Simulation([config])
    simulation.run_for(5.0)
    vehicle = simulation.vehicles[0]
    vehicle.firmware.arm(force=True)
    simulation.run_for(40.0)
    sizes = [len(log.data) for log in vehicle.logbook.logs]
    assert len(sizes) >= 2
    assert max(sizes) < 21_000
    vehicle.power_cycle()
    simulation.run_for(3.0)
    size = len(vehicle.logbook.logs[-1].data)
    vehicle.firmware.say(Severity.INFO, "not armed")
    simulation.run_for(3.0)
    assert len(vehicle.logbook.logs[-1].data) == size


@pytest.mark.parametrize(
    ("autopilot", "path", "entries"),
    [
        ("ardupilot", b"/", [b"D.", b"D..", b"DAPM"]),
        ("ardupilot", b"", [b"D.", b"D..", b"DAPM"]),
        ("ardupilot", b"/APM", [b"D.", b"D..", b"DLOGS"]),
        ("px4", b"/", [b"D.", b"D..", b"Detc", b"Dfs"]),
        ("px4", b"/fs/microsd", [b"D.", b"D..", b"Dlog"]),
    ],
)
def test_folders_are_listed_from_the_root_on(
    autopilot: str, path: bytes, entries: list[bytes]
) -> None:
    station = GroundStation(Simulation([VehicleConfig(autopilot=autopilot)], seed=1))
    station.run(3.0)
    request = struct.pack("<HBBBBBxI", 1, 0, 3, len(path), 0, 0, 0) + path
    payload = request.ljust(251, b"\0")
    station.send(mav.MAVLink_file_transfer_protocol_message(0, 1, 1, payload))
    station.run(0.5)
    answer = bytes(station.last("FILE_TRANSFER_PROTOCOL").payload)
    given = answer[12 : 12 + answer[4]]
    assert answer[3] == 128
    assert [entry for entry in given.split(b"\0") if entry] == entries
