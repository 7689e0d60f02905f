"""The logs of eleven releases of each firmware hold vehicle, version, modes, track and battery."""

from __future__ import annotations

import random
from dataclasses import replace
from datetime import datetime, timezone
from pathlib import Path

import numpy as np
import pytest
from pymavlink.DFReader import DFReader_binary
from pyulog import ULog

from flight_reports.analysis.flight import Flight, read_flights
from flight_reports.analysis.warnings import lacking, warnings
from flight_reports.contents.log_reader import read_log
from flight_reports.navigation_report import main
from tests.support.logs.firmware_logs import (
    ARDUPILOT_RELEASES,
    BEGUN_UNIX_S,
    HEIGHT_M,
    MODES_AT_S,
    PERCENT,
    PX4_MODES,
    PX4_RELEASES,
    SECONDS,
    SPEED_M_S,
    VOLTAGE_V,
    Px4Options,
    ardupilot_kinds,
    ardupilot_log,
    px4_log,
    px4_version,
)

pytestmark = pytest.mark.wide_but_first


NAMES = {"copter": "ArduCopter", "plane": "ArduPlane", "rover": "ArduRover", "sub": "ArduSub"}
ALL = [(release, kind) for release in ARDUPILOT_RELEASES for kind in ardupilot_kinds(release)]


def flown(data: bytes, path: Path) -> Flight:
    path.write_bytes(data)
    (flight,) = read_flights(read_log(path))
    return flight


def found(flight: Flight) -> list[str]:
    return [f"{warned.first.kind}: {warned.first.text}" for warned in warnings(flight)]


def assert_whole(flight: Flight, modes: tuple[str, ...]) -> None:
    """Fail unless the flight that every log holds is read, and nothing that is not so."""
    assert flight.retold.modes == [
        (pytest.approx(at_s, abs=0.3), name) for at_s, name in zip(MODES_AT_S, modes, strict=True)
    ]
    assert flight.contents.duration_s == pytest.approx(SECONDS, abs=0.01)
    track = flight.track
    assert track.time_s[-1] - track.time_s[0] == pytest.approx(SECONDS, abs=0.3)
    assert track.length_m == pytest.approx(SPEED_M_S * SECONDS, rel=0.03)
    assert track.ground_speed_m_s == pytest.approx(np.full(len(track.time_s), SPEED_M_S), abs=0.1)
    voltages = [voltage_v for _, voltage_v in flight.retold.voltage]
    assert (voltages[0], voltages[-1]) == pytest.approx(VOLTAGE_V, abs=0.02)
    assert flight.retold.armed[0] == (pytest.approx(0.0, abs=0.3), True)
    assert not [told for told in found(flight) if "Low battery" not in told]


@pytest.mark.parametrize(("release", "kind"), ALL)
def test_an_ardupilots_log_of_any_release_is_read(tmp_path: Path, release: str, kind: str) -> None:
    log = ardupilot_log(release, kind)
    flight = flown(log.data, tmp_path / "flight.bin")
    assert flight.retold.name == NAMES[kind]
    assert flight.retold.state.firmware_version == log.version
    assert_whole(flight, log.modes)
    percents = [percent for _, percent in flight.retold.battery]
    if log.has_percent:
        assert (percents[0], percents[-1]) == pytest.approx(PERCENT, abs=1.0)
    else:
        assert percents == []
        assert "battery voltage, but not" in " ".join(lacking(flight))


@pytest.mark.parametrize("release", ARDUPILOT_RELEASES)
def test_an_ardupilots_log_has_what_pymavlink_reads(tmp_path: Path, release: str) -> None:
    path = tmp_path / "flight.bin"
    flight = flown(ardupilot_log(release).data, path)
    reader = DFReader_binary(str(path))
    kinds = {form.name for form in reader.formats.values()}
    positions = "POS" if "POS" in kinds else "GPS"
    places, modes, stamps = [], [], []
    while (record := reader.recv_msg()) is not None:
        stamps.append(record._timestamp)
        if record.get_type() == positions:
            places.append((record._timestamp, record.Lat, record.Lng))
        elif record.get_type() == "MODE":
            modes.append(record._timestamp)
    reader.close()
    begun_s = min(stamp for stamp in stamps if stamp > BEGUN_UNIX_S - 1.0)
    assert flight.contents.begun_unix_s == pytest.approx(begun_s, abs=0.01)
    assert flight.contents.duration_s == pytest.approx(max(stamps) - begun_s, abs=0.01)
    assert [time_s for time_s, _ in flight.retold.modes] == pytest.approx(
        [time_s - begun_s for time_s in modes], abs=0.01
    )
    assert len(flight.track.time_s) == len(places)
    assert flight.track.time_s == pytest.approx(
        np.array([time_s - begun_s for time_s, _, _ in places]), abs=0.01
    )
    frame = flight.track.frame
    assert frame is not None
    altitude_m = frame.origin[2]
    for (_, latitude, longitude), here in zip(places, flight.track.position_enu_m, strict=True):
        north_m, east_m, _ = frame.ned_m((latitude, longitude, altitude_m))
        assert (east_m, north_m) == pytest.approx(here[:2], abs=0.02)


@pytest.mark.parametrize("release", ["4.1", "4.7"])
def test_a_charge_of_255_percent_is_unknown(tmp_path: Path, release: str) -> None:
    flight = flown(ardupilot_log(release, percent=False).data, tmp_path / "flight.bin")
    assert flight.retold.battery == []
    status = flight.contents.of("SYS_STATUS", flight.source)
    assert status is not None
    assert set(status["current_battery"].tolist()) == {-310}


@pytest.mark.parametrize("release", ARDUPILOT_RELEASES)
def test_sparse_records_are_no_silence(tmp_path: Path, release: str) -> None:
    without = ("POS", "GPS", "BAT", "CURR", "EKF1", "NKF1", "XKF1", "ORGN")
    log = ardupilot_log(release, without=without, position_hz=1)
    flight = flown(log.data, tmp_path / "flight.bin")
    assert flight.contents.duration_s == pytest.approx(SECONDS, abs=0.01)
    assert found(flight) == []


def test_records_of_no_interest_are_no_silence(tmp_path: Path) -> None:
    log = ardupilot_log("4.5", without=("POS", "GPS", "BAT", "ATT", "ORGN"))
    flight = flown(log.data, tmp_path / "flight.bin")
    assert flight.contents.duration_s == pytest.approx(SECONDS, abs=0.01)
    assert found(flight) == []


@pytest.mark.parametrize("release", ARDUPILOT_RELEASES[2:])
def test_a_disarmed_ardupilot_that_hardly_logs_is_not_silent(tmp_path: Path, release: str) -> None:
    flight = flown(ardupilot_log(release, idle_s=124).data, tmp_path / "flight.bin")
    assert flight.contents.duration_s == pytest.approx(SECONDS + 124, abs=0.01)
    assert found(flight) == []


def test_a_hole_in_a_log_of_an_armed_vehicle_is_shown(tmp_path: Path) -> None:
    whole = ardupilot_log("4.5").data
    # One span of records is missing: nothing of the file is damaged.
    records = whole.split(b"\xa3\x95")
    third = len(records) // 3
    data = b"\xa3\x95".join(records[:third] + records[third + third // 2 :])
    told = found(flown(data, tmp_path / "flight.bin"))
    assert len(told) == 1
    assert told[0].startswith("silence: The log has no records for ")


@pytest.mark.parametrize("release", ARDUPILOT_RELEASES)
def test_a_log_without_a_date_does_not_invent_one(tmp_path: Path, release: str) -> None:
    log = ardupilot_log(release, gps_time=False)
    out = tmp_path / "page.html"
    flight = flown(log.data, tmp_path / "flight.bin")
    assert not flight.contents.has_date
    assert main([str(tmp_path / "flight.bin"), "--out", str(out)]) == 0
    text = out.read_text("utf-8")
    assert "<dt>recorded</dt><dd>unknown</dd>" in text
    assert f"{datetime.now(timezone.utc):%Y-%m-%d}" not in text.split('id="plots"')[0]
    assert flight.contents.duration_s == pytest.approx(SECONDS, abs=0.01)


@pytest.mark.parametrize("suffix", ["bin", "ulg"])
@pytest.mark.parametrize("what", ["junk", "zeros", "magic"])
@pytest.mark.parametrize("size", [300, 20_000])
def test_damage_is_on_the_page_and_not_on_standard_error(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], suffix: str, what: str, size: int
) -> None:
    whole = ardupilot_log("3.4").data if suffix == "bin" else px4_log("1.14")
    junk = {
        "junk": random.Random(3).randbytes(size),
        "zeros": bytes(size),
        "magic": b"\xa3\x95\x80" * (size // 3),
    }[what]
    middle = len(whole) // 2
    path = tmp_path / f"flight.{suffix}"
    path.write_bytes(whole[:middle] + junk + whole[middle:])
    out = tmp_path / "page.html"
    assert main([str(path), "--out", str(out)]) == 0
    told = capfd.readouterr()
    assert told.err == ""
    assert told.out == f"Wrote {out}\n"
    (flight,) = read_flights(read_log(path))
    assert any(text.startswith("damage: ") for text in found(flight))
    assert "damaged" in out.read_text("utf-8").split('id="plots"')[0]
    if suffix == "bin":
        # All but the record in which the junk lies.
        assert flight.contents.duration_s == pytest.approx(SECONDS, abs=0.01)
        assert flight.track.length_m == pytest.approx(SPEED_M_S * SECONDS, rel=0.03)


def test_a_log_that_ends_within_a_record_is_not_damaged(tmp_path: Path) -> None:
    whole = ardupilot_log("4.5").data
    for data in (whole[:-5], whole + bytes(200), whole + b"\xff" * 249):
        flight = flown(data, tmp_path / "flight.bin")
        assert not [text for text in found(flight) if text.startswith("damage")]
        assert flight.contents.duration_s == pytest.approx(SECONDS, abs=1.0)


@pytest.mark.parametrize("release", PX4_RELEASES)
def test_a_px4s_log_of_any_release_is_read(tmp_path: Path, release: str) -> None:
    path = tmp_path / "flight.ulg"
    flight = flown(px4_log(release), path)
    assert flight.retold.name == "PX4 multicopter"
    assert flight.retold.state.firmware_version == px4_version(release)
    assert flight.contents.begun_unix_s == pytest.approx(BEGUN_UNIX_S, abs=0.01)
    assert_whole(flight, tuple(name for _, name in PX4_MODES))
    percents = [percent for _, percent in flight.retold.battery]
    assert (percents[0], percents[-1]) == pytest.approx(PERCENT, abs=1.0)
    reference = ULog(str(path))
    (positions,) = [d for d in reference.data_list if d.name == "vehicle_global_position"]
    assert len(flight.track.time_s) == len(positions.data["timestamp"])
    last_s = (reference.last_timestamp - reference.start_timestamp) / 1e6
    assert flight.contents.duration_s == pytest.approx(last_s, abs=0.01)


@pytest.mark.parametrize("release", PX4_RELEASES)
def test_a_px4s_receiver_or_local_position_makes_a_track(tmp_path: Path, release: str) -> None:
    estimated = ("vehicle_global_position", "vehicle_local_position")
    flight = flown(px4_log(release, Px4Options(without=estimated)), tmp_path / "gps.ulg")
    assert flight.track.length_m == pytest.approx(SPEED_M_S * SECONDS, rel=0.03)
    without = ("vehicle_global_position", "vehicle_gps_position", "sensor_gps")
    flight = flown(px4_log(release, Px4Options(without=without)), tmp_path / "local.ulg")
    assert flight.track.length_m == pytest.approx(SPEED_M_S * SECONDS, rel=0.03)
    assert flight.track.position_enu_m[:, 2] == pytest.approx(
        np.full(len(flight.track.time_s), HEIGHT_M), abs=0.01
    )
    assert not flight.contents.has_date
    assert flight.contents.duration_s == pytest.approx(SECONDS, abs=0.01)


@pytest.mark.parametrize("release", PX4_RELEASES)
def test_a_px4s_log_does_not_invent_a_date_or_a_charge(tmp_path: Path, release: str) -> None:
    options = Px4Options(gps_time=False, remaining=False)
    flight = flown(px4_log(release, options), tmp_path / "flight.ulg")
    assert not flight.contents.has_date
    assert flight.retold.battery == []
    assert len(flight.retold.voltage) > 50
    options = replace(
        options,
        xy_valid=False,
        without=("vehicle_global_position", "vehicle_gps_position", "sensor_gps"),
    )
    flight = flown(px4_log(release, options), tmp_path / "indoor.ulg")
    assert "no valid horizontal position" in " ".join(lacking(flight))


@pytest.mark.parametrize(
    ("release", "nav_states", "names"),
    [
        ("1.6", (16, 8, 10), ["RATTITUDE", "AUTO.LAND", "ACRO"]),
        ("1.11", (16, 6, 21), ["RATTITUDE", "AUTO.RTL", "POSCTL.ORBIT"]),
        ("1.18", (6, 8, 23), ["POSCTL.SLOW", "ALTITUDE_CRUISE", "AUTO.EXTERNAL1"]),
    ],
)
def test_a_px4s_modes_are_those_of_its_version(
    tmp_path: Path, release: str, nav_states: tuple[int, ...], names: list[str]
) -> None:
    flight = flown(px4_log(release, Px4Options(nav_states=nav_states)), tmp_path / "flight.ulg")
    assert [name for _, name in flight.retold.modes] == names
