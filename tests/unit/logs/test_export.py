"""Exports equal the arrays, with units and enums; errors are one sentence."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from flight_logs.errors import ExportError
from flight_logs.export import FIELDS_FILE, export_tlog
from flight_logs.export_command import main
from flight_logs.formats import Format
from flight_logs.tlog import Tlog, read_tlog
from mavlink_vehicle.codec import Codec, make
from tests.support.logs.made_logs import random_packets, tlog_of

RECORDING = Path(__file__).resolve().parents[2] / "data/copter_lowbatt.tlog"


@pytest.fixture(scope="module")
def log() -> Tlog:
    return read_tlog(RECORDING)


def csv_rows(path: Path) -> list[dict[str, str]]:
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def test_parquet_holds_every_value(tmp_path: Path) -> None:
    path = tmp_path / "all.tlog"
    path.write_bytes(tlog_of(random_packets(11, 600)))
    exported = export_tlog(path, tmp_path / "out", Format.PARQUET)
    log = read_tlog(path)
    assert exported.rows == {name: len(records) for name, records in log.items()}
    assert exported.counts == log.counts
    for name, records in log.items():
        table = pq.read_table(tmp_path / f"out/{name}.parquet")
        assert tuple(table.column_names) == records.dtype.names
        for field in table.column_names:
            values = records[field]
            column = table[field].to_pylist()
            if values.dtype.kind == "S":
                texts = [value.split(b"\0")[0].decode("utf-8", "replace") for value in values]
                assert column == texts
            else:
                expected = np.array(column, dtype=values.dtype)
                assert np.array_equal(values, expected, equal_nan=values.dtype.kind == "f")


def test_parquet_keeps_units_and_enums(tmp_path: Path) -> None:
    export_tlog(RECORDING, tmp_path, Format.PARQUET, messages=["HEARTBEAT", "GLOBAL_POSITION_INT"])
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "GLOBAL_POSITION_INT.parquet",
        "HEARTBEAT.parquet",
    ]
    schema = pq.read_schema(tmp_path / "GLOBAL_POSITION_INT.parquet")
    assert schema.field("lat").metadata[b"unit"] == b"degE7"
    assert schema.metadata[b"message_id"] == b"33"
    heartbeat = pq.read_schema(tmp_path / "HEARTBEAT.parquet")
    about = heartbeat.field("base_mode").metadata
    assert about[b"enum"] == b"MAV_MODE_FLAG"
    assert about[b"bitmask"] == b"true"
    assert json.loads(about[b"entries"])["128"] == "MAV_MODE_FLAG_SAFETY_ARMED"


def test_csv_holds_every_value(tmp_path: Path, log: Tlog) -> None:
    export_tlog(RECORDING, tmp_path, Format.CSV)
    for name, records in log.items():
        rows = csv_rows(tmp_path / f"{name}.csv")
        assert len(rows) == len(records)
        assert [float(row["time_s"]) for row in rows] == records["time_s"].tolist()
    attitude = [np.float32(row["roll"]) for row in csv_rows(tmp_path / "ATTITUDE.csv")]
    assert attitude == log["ATTITUDE"]["roll"].tolist()
    units = {
        (row["message"], row["field"]): row["unit"] for row in csv_rows(tmp_path / FIELDS_FILE)
    }
    assert units["ATTITUDE", "roll"] == "rad"


def test_csv_has_a_column_for_each_element(tmp_path: Path) -> None:
    path = tmp_path / "battery.tlog"
    voltages = list(range(4000, 4010))
    battery = make("BATTERY_STATUS", voltages=voltages)
    path.write_bytes(tlog_of([Codec(1, 1).encode(battery)] * 3))
    export_tlog(path, tmp_path, Format.CSV)
    rows = csv_rows(tmp_path / "BATTERY_STATUS.csv")
    assert [[int(row[f"voltages_{index}"]) for index in range(10)] for row in rows] == [
        voltages
    ] * 3


def test_names_of_enums_stand_in_place_of_numbers_when_asked_for(tmp_path: Path) -> None:
    path = tmp_path / "beats.tlog"
    codec = Codec(1, 1)
    beats = [
        make("HEARTBEAT", type=2, system_status=4, base_mode=129),
        make("HEARTBEAT", type=250, system_status=0, base_mode=0),
    ]
    path.write_bytes(tlog_of([codec.encode(beat) for beat in beats]))
    assert main([str(path), "--to", str(tmp_path), "--format", "csv", "--enum-names"]) == 0
    first, second = csv_rows(tmp_path / "HEARTBEAT.csv")
    assert first["type"] == "MAV_TYPE_QUADROTOR"
    assert first["base_mode"] == "MAV_MODE_FLAG_CUSTOM_MODE_ENABLED|MAV_MODE_FLAG_SAFETY_ARMED"
    assert second["type"] == "250"
    assert second["system_status"] == "MAV_STATE_UNINIT"
    assert second["base_mode"] == ""


def test_the_command_reports_what_it_wrote_and_skipped(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "some.tlog"
    path.write_bytes(RECORDING.read_bytes() + b"rest")
    assert main([str(path), "--to", str(tmp_path / "out"), "--messages", "attitude,HEARTBEAT"]) == 0
    out = capsys.readouterr().out
    assert "messages of 2 types" in out
    assert "4 bytes outside packets" in out
    assert main([str(path), "--to", str(tmp_path / "no"), "--messages", "WIND_COV"]) == 0
    assert "none of these messages" in capsys.readouterr().out
    assert not (tmp_path / "no").exists()


def test_bad_input_is_one_sentence_and_ends_with_2(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    empty = tmp_path / "empty.tlog"
    empty.touch()
    for arguments in ([str(empty)], [str(RECORDING), "--messages", "NONE"], [str(tmp_path)]):
        assert main([*arguments, "--to", str(tmp_path / "out")]) == 2
        told = capsys.readouterr()
        assert told.out == ""
        assert told.err.count("\n") == 1


def test_a_folder_that_cannot_be_written_is_one_sentence(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    blocked = tmp_path / "file"
    blocked.write_text("in the way")
    for kind in Format:
        with pytest.raises(ExportError, match="Cannot write to"):
            export_tlog(RECORDING, blocked, kind)
    assert main([str(RECORDING), "--to", str(blocked)]) == 1
    assert capsys.readouterr().err.startswith("Cannot write to")


def test_several_logs_are_exported_side_by_side_and_a_bad_one_stops_no_other(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    logs = [tmp_path / f"{name}.tlog" for name in "abc"]
    for log in logs:
        log.write_bytes(RECORDING.read_bytes())
    logs[1].write_bytes(b"")
    out = tmp_path / "out"
    assert main([*map(str, logs), "--to", str(out), "--messages", "ATTITUDE"]) == 2
    told = capfd.readouterr()
    assert told.out.count("messages of 1 types") == 2
    assert f"{logs[1]} is empty" in told.err
    written = sorted(path.relative_to(out) for path in out.rglob("*.parquet"))
    assert written == [Path("a/ATTITUDE.parquet"), Path("c/ATTITUDE.parquet")]
    assert main([str(logs[0]), str(logs[0]), "--to", str(out)]) == 2
    assert "the same name" in capfd.readouterr().err
