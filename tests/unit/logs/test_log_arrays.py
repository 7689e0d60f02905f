"""Arrays of a log: layouts, units and enums of the dialect, parts, progress."""

from __future__ import annotations

import random
import tracemalloc
from pathlib import Path

import numpy as np
import pytest

from flight_logs.dialect import HEADER_FIELDS, enum_entries, messages
from flight_logs.errors import LogError
from flight_logs.tlog import Counts, iterate_tlog, read_tlog
from mavlink_vehicle.codec import mavlink
from tests.support.logs.made_logs import packet_of_length, random_packets, tlog_of
from tests.support.logs.read_logs import assert_same_contents
from tests.support.messages.random_messages import CLASSES

RECORDING = Path(__file__).resolve().parents[2] / "data/copter_lowbatt.tlog"


def test_every_layout_is_pymavlinks() -> None:
    for message in messages():
        cls = mavlink.mavlink_map[message.number]
        assert message.dtype.names == (*HEADER_FIELDS, *cls.ordered_fieldnames)
        assert message.dtype.fields is not None
        places = [message.dtype.fields[name] for name in cls.ordered_fieldnames]
        ends = [offset + kind.itemsize for kind, offset, *_ in places]
        assert [offset for _, offset, *_ in places] == [places[0][1], *ends[:-1]], message.name
        assert ends[-1] - places[0][1] == cls.unpacker.size


@pytest.mark.parametrize(("version", "signed"), [(1, False), (2, False), (2, True)])
def test_payloads_of_every_length_are_read(tmp_path: Path, version: int, signed: bool) -> None:
    path = tmp_path / "lengths.tlog"
    source = random.Random(version)
    cls = mavlink.MAVLink_attitude_message
    packets = [
        packet_of_length(cls, source.randbytes(length), version, signed) for length in range(256)
    ]
    path.write_bytes(tlog_of(packets))
    log = read_tlog(path)
    assert log.counts.signed == 256 * signed
    decoded = [mavlink.MAVLink(None).decode(bytearray(packet)) for packet in packets]
    assert_same_contents("ATTITUDE", log["ATTITUDE"], decoded)


def test_all_messages_of_the_dialect_are_there() -> None:
    assert {message.name for message in messages()} == {cls.msgname for cls in CLASSES}


def test_units_and_enums_stand_beside_the_arrays() -> None:
    log = read_tlog(RECORDING)
    assert log.units("GLOBAL_POSITION_INT")["lat"] == "degE7"
    assert log.units("GLOBAL_POSITION_INT")["time_s"] == "s"
    assert log.enums("HEARTBEAT")["system_status"] == "MAV_STATE"
    assert enum_entries("MAV_STATE")[4] == "MAV_STATE_ACTIVE"
    assert not any(name.endswith("_ENUM_END") for name in enum_entries("MAV_STATE").values())
    with pytest.raises(LogError, match="There is no MAVLink message 'NONE'"):
        log.units("NONE")


def test_a_message_that_was_not_recorded_has_no_records() -> None:
    log = read_tlog(RECORDING)
    assert "WIND_COV" not in log
    nothing = log.records("WIND_COV")
    assert len(nothing) == 0
    assert "wind_x" in (nothing.dtype.names or ())
    assert log.records("HEARTBEAT") is log["HEARTBEAT"]


def test_only_the_messages_asked_for_are_decoded_but_all_are_counted() -> None:
    whole = read_tlog(RECORDING)
    some = read_tlog(RECORDING, messages=["ATTITUDE", "WIND_COV"])
    assert list(some) == ["ATTITUDE"]
    assert some.counts == whole.counts
    assert np.array_equal(some["ATTITUDE"], whole["ATTITUDE"])


def test_progress_ends_at_the_size_of_the_file() -> None:
    calls: list[tuple[int, int]] = []
    read_tlog(RECORDING, progress=lambda done, total: calls.append((done, total)))
    size = RECORDING.stat().st_size
    assert calls[-1] == (size, size)


def test_counts_of_pieces_can_be_added() -> None:
    one = Counts(bytes=10, packets=1, unknown_messages={7: 1})
    other = Counts(bytes=5, steps_back=1, unknown_messages={7: 2, 8: 1})
    both = Counts(bytes=15, packets=1, steps_back=1, unknown_messages={7: 3, 8: 1})
    assert one + other == both


def test_memory_follows_the_piece_not_the_file(tmp_path: Path) -> None:
    path = tmp_path / "long.tlog"
    path.write_bytes(tlog_of(random_packets(5, 300)) * 400)
    chunk_bytes = 256 << 10
    assert path.stat().st_size > 25 * chunk_bytes
    for _ in iterate_tlog(RECORDING):  # tables that are made once don't count
        pass
    tracemalloc.start()
    try:
        packets = sum(len(r) for part in iterate_tlog(path, chunk_bytes) for r in part.values())
        assert tracemalloc.get_traced_memory()[1] < 16 * chunk_bytes
    finally:
        tracemalloc.stop()
    assert packets > 100_000
