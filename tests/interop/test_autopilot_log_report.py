"""The report of an autopilot's own log, downloaded over a lossy link from the simulator."""

from __future__ import annotations

from pathlib import Path

import pytest

from flight_logs.errors import LogError
from flight_reports.analysis.flight import read_flights
from flight_reports.analysis.warnings import lacking
from flight_reports.contents.log_reader import read_log
from flight_reports.navigation_report import main
from mavlink_sitl import LinkFaults, VehicleConfig
from mavlink_vehicle.events import LogChunkReceived, LogsListed, LogTransferEnded
from tests.support.flights.vehicle_pair import VehiclePair

pytestmark = pytest.mark.wide_but_first


def downloaded(autopilot: str, path: Path, kind: str = "copter") -> VehiclePair:
    """Arm, take off to 8 m, land, and store the log of it."""
    pair = VehiclePair(
        simulated=VehicleConfig(autopilot=autopilot, vehicle=kind, ready_after_s=1.0)
    ).ready()
    vehicle = pair.vehicle
    if autopilot == "ardupilot":
        pair.finish(vehicle.take_control(pair.now))
    pair.finish(vehicle.arm(pair.now))
    pair.finish(vehicle.take_off(8.0, pair.now))
    pair.run_for(5.0)
    pair.finish(vehicle.land(pair.now))
    pair.run_until(lambda: not vehicle.state.armed, 90.0)
    pair.copter.link.set_faults(LinkFaults(loss=0.2))
    vehicle.logs.list_logs(pair.now)
    pair.run_until(lambda: bool(pair.all(LogTransferEnded)))
    vehicle.logs.download(pair.all(LogsListed)[0].logs[-1], 0, pair.now)
    pair.run_until(lambda: len(pair.all(LogTransferEnded)) == 2, 300.0)
    path.write_bytes(b"".join(chunk.data for chunk in pair.all(LogChunkReceived)))
    assert path.read_bytes() == bytes(pair.copter.logbook.logs[-1].data)
    return pair


@pytest.mark.parametrize(
    ("autopilot", "suffix", "mode", "landing"),
    [("ardupilot", ".bin", "GUIDED", "LAND"), ("px4", ".ulg", "AUTO.LOITER", "AUTO.LAND")],
)
def test_a_downloaded_log_is_reported(
    tmp_path: Path, autopilot: str, suffix: str, mode: str, landing: str
) -> None:
    path = tmp_path / f"flight{suffix}"
    downloaded(autopilot, path)
    (flight,) = read_flights(read_log(path))
    assert flight.path == path
    assert "copter" in flight.name.lower()
    assert flight.track.position_enu_m[:, 2].max() == pytest.approx(8.0, abs=0.6)
    assert flight.track.ground_speed_m_s.max() < 1.0
    modes = [name for _, name in flight.retold.modes]
    assert mode in modes
    assert modes.index(landing) > modes.index(mode)
    assert [armed for _, armed in flight.retold.armed] == [True, False]
    assert flight.armed_s == pytest.approx(flight.contents.duration_s, abs=1.5)
    assert flight.retold.battery[0][1] == pytest.approx(100.0, abs=2.0)
    assert flight.retold.state.firmware_version is not None
    assert not flight.link.numbers_follow
    assert lacking(flight)[0].startswith("This is the autopilot's own log")

    out = tmp_path / "page.html"
    assert main([str(path), "--out", str(out)]) == 0
    assert path.name in out.read_text(encoding="utf-8")


@pytest.mark.parametrize("suffix", [".bin", ".ulg"])
def test_a_damaged_log_is_reported_or_rejected_with_a_sentence(
    tmp_path: Path, suffix: str, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / f"flight{suffix}"
    downloaded("ardupilot" if suffix == ".bin" else "px4", path)
    whole = path.read_bytes()
    for damaged in (whole[: len(whole) // 2], whole[:10], whole[:200] + bytes(500) + whole[700:]):
        path.write_bytes(damaged)
        code = main([str(path), "--out", str(tmp_path / "page.html")])
        error = capsys.readouterr().err
        assert code == 0 or (code == 2 and str(path) in error)
    path.unlink()
    with pytest.raises(LogError, match="Cannot read"):
        read_log(path)
