"""Files that are not tlogs get one sentence; of damaged ones the intact part is read."""

from __future__ import annotations

import os
import random
import tracemalloc
from pathlib import Path

import numpy as np
import pytest

from flight_logs.errors import (
    EmptyLogError,
    LogError,
    NotATlogError,
    RawStreamError,
    SwappedStampsError,
)
from flight_logs.tlog import iterate_tlog, read_tlog
from mavlink_vehicle.codec import Codec, make
from tests.support.logs.made_logs import START_US, STEP_US, random_packets, tlog_of, unknown_packet

GIB = 1 << 30


def heartbeats(count: int) -> list[bytes]:
    codec = Codec(1, 1)
    return [codec.encode(make("HEARTBEAT", custom_mode=index)) for index in range(count)]


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "some.tlog"


def test_an_empty_log_is_named_as_such(path: Path) -> None:
    path.touch()
    with pytest.raises(EmptyLogError, match=r"some\.tlog is empty: nothing was recorded\."):
        read_tlog(path)


@pytest.mark.parametrize("place", ["missing.tlog", "."])
def test_what_cannot_be_opened_is_named_with_the_reason(tmp_path: Path, place: str) -> None:
    with pytest.raises(LogError, match=r"^Cannot read .*(No such file|directory)"):
        read_tlog(tmp_path / place)


@pytest.mark.parametrize(
    "content",
    [
        b"time,roll\n1.0,0.2\n" * 5000,
        random.Random(3).randbytes(300_000),
        bytes(100_000),
        b"\xfe" * 300_000,
        b"\xfd" * 300_000,
        b"\x00" * 8 + b"\xfd",
        b"x",
    ],
    ids=["text", "noise", "zeros", "magic 1", "magic 2", "no packet", "one byte"],
)
def test_what_holds_no_packet_is_no_tlog(path: Path, content: bytes) -> None:
    path.write_bytes(content)
    with pytest.raises(NotATlogError, match=r"is not a tlog: there is no MAVLink packet in"):
        read_tlog(path)


def test_two_gigabytes_of_zeros_are_rejected_with_little_memory(path: Path) -> None:
    path.touch()
    os.truncate(path, 2 * GIB)
    tracemalloc.start()
    try:
        with pytest.raises(NotATlogError, match=r"no MAVLink packet in its first 16 MiB"):
            read_tlog(path)
        assert tracemalloc.get_traced_memory()[1] < 64 << 20
    finally:
        tracemalloc.stop()


def test_zeros_in_the_middle_are_passed_over(path: Path) -> None:
    packets = heartbeats(20)
    hole = 40 << 20
    with path.open("wb") as file:
        file.write(tlog_of(packets[:10]))
        file.seek(hole, os.SEEK_CUR)
        file.write(tlog_of(packets[10:], START_US + 10 * STEP_US))
    log = read_tlog(path)
    assert log["HEARTBEAT"]["custom_mode"].tolist() == list(range(20))
    assert log.counts.bytes_outside == hole
    steps_s = np.diff(log["HEARTBEAT"]["time_s"])
    assert steps_s == pytest.approx(np.full(19, STEP_US * 1e-6), abs=1e-6)


def test_a_log_of_one_message_is_read(path: Path) -> None:
    path.write_bytes(tlog_of(heartbeats(1)))
    log = read_tlog(path)
    assert list(log) == ["HEARTBEAT"]
    assert log["HEARTBEAT"]["time_s"].tolist() == [START_US * 1e-6]
    assert log["HEARTBEAT"]["system"].tolist() == [1]


def test_a_log_that_ends_within_a_packet_gives_all_before_it(path: Path) -> None:
    packets = heartbeats(3)
    data = tlog_of(packets)
    for size in range(1, len(data)):
        path.write_bytes(data[:size])
        whole = size // (len(data) // 3)
        if whole:
            log = read_tlog(path)
            assert len(log["HEARTBEAT"]) == whole
            assert log.counts.bytes_outside == size - whole * (len(data) // 3)
        else:
            with pytest.raises(NotATlogError):
                read_tlog(path)


def test_a_raw_stream_is_distinguished_from_a_tlog(path: Path) -> None:
    for packets in (heartbeats(1), heartbeats(50), random_packets(1, 50)):
        path.write_bytes(b"".join(packets))
        with pytest.raises(
            RawStreamError, match="raw telemetry stream: its packets have no timestamps"
        ):
            read_tlog(path)


def test_times_with_swapped_bytes_are_named_as_such(path: Path) -> None:
    swapped = int.from_bytes(START_US.to_bytes(8, "little"), "big")
    stamped = [swapped.to_bytes(8, "big") + packet for packet in heartbeats(30)]
    path.write_bytes(b"".join(stamped))
    with pytest.raises(SwappedStampsError, match=r"little-endian; a tlog has .* big-endian"):
        read_tlog(path)


def test_a_clock_that_goes_backwards_is_kept_and_counted(path: Path) -> None:
    packets = heartbeats(20)
    back_us = START_US - 3600 * 1_000_000
    path.write_bytes(tlog_of(packets[:10]) + tlog_of(packets[10:], back_us))
    log = read_tlog(path)
    assert log.counts.steps_back == 1
    assert log["HEARTBEAT"]["custom_mode"].tolist() == list(range(20))
    assert log["HEARTBEAT"]["time_s"][10] == back_us * 1e-6


def test_a_damaged_time_after_damage_is_replaced_by_the_one_before(path: Path) -> None:
    first, second = tlog_of(heartbeats(1)), tlog_of(heartbeats(1), START_US + STEP_US)
    missing = first + second[3:]
    absurd = first + b"junk" + b"\x7f" + second[1:]
    for content in (missing, absurd):
        path.write_bytes(content)
        log = read_tlog(path)
        assert log["HEARTBEAT"]["time_s"].tolist() == [START_US * 1e-6] * 2
        assert log.counts.stamps_lost == 1


def test_damage_is_counted_by_kind(path: Path) -> None:
    good, spoiled, last = heartbeats(3)
    spoiled = spoiled[:12] + bytes([spoiled[12] ^ 1]) + spoiled[13:]
    path.write_bytes(tlog_of([good, spoiled, unknown_packet(b"abc"), last]) + b"rest")
    counts = read_tlog(path).counts
    assert counts.packets == 2
    assert counts.bad_checksums == 1
    assert counts.unknown_messages == {54_321: 1}
    assert counts.bytes_outside == 4
    assert counts.bytes == path.stat().st_size


def test_what_an_unknown_message_carries_is_not_counted_beside_it(path: Path) -> None:
    carrier = unknown_packet(tlog_of([unknown_packet(b"")] * 3))
    path.write_bytes(tlog_of([*heartbeats(1), carrier, *heartbeats(1)]))
    counts = read_tlog(path).counts
    assert counts.unknown_messages == {54_321: 1}
    assert counts.bytes_outside == 0


def test_a_log_of_another_dialect_is_an_empty_log_with_its_counts(path: Path) -> None:
    path.write_bytes(tlog_of([unknown_packet(bytes(index)) for index in range(10)]))
    log = read_tlog(path)
    assert dict(log) == {}
    assert log.counts.unknown_messages == {54_321: 10}


def test_a_message_that_does_not_exist_cannot_be_asked_for(path: Path) -> None:
    path.write_bytes(tlog_of(heartbeats(1)))
    with pytest.raises(LogError, match="There is no MAVLink message 'HARTBEAT'; use a name such"):
        read_tlog(path, messages=["HARTBEAT"])
    with pytest.raises(LogError, match="at least one byte, not 0"):
        list(iterate_tlog(path, chunk_bytes=0))


@pytest.mark.parametrize("place", [0, 1, 9, 19])
@pytest.mark.parametrize("bit", [42, 50, 58, 62])
@pytest.mark.parametrize("chunk_bytes", [1, 1 << 20])
def test_one_damaged_bit_of_a_time_costs_that_time_only(
    path: Path, place: int, bit: int, chunk_bytes: int
) -> None:
    packets = heartbeats(20)
    whole = tlog_of(packets)
    size = len(whole) // len(packets)
    data = bytearray(whole)
    data[place * size + 7 - bit // 8] ^= 1 << bit % 8
    path.write_bytes(data)
    parts = list(iterate_tlog(path, chunk_bytes))
    times_s = np.concatenate([part["HEARTBEAT"]["time_s"] for part in parts])
    assert sum(part.counts.stamps_lost for part in parts) == 1
    assert sum(part.counts.steps_back for part in parts) == 0
    wanted_s = (START_US + STEP_US * np.arange(20)) * 1e-6
    wanted_s[place] = wanted_s[max(place - 1, 0)] if place else wanted_s[1]
    assert times_s == pytest.approx(wanted_s, abs=1e-6)


@pytest.mark.parametrize("step_s", [40 * 365 * 86400, -40 * 365 * 86400])
def test_a_clock_that_is_set_far_is_kept(path: Path, step_s: int) -> None:
    packets = heartbeats(20)
    later_us = START_US + step_s * 1_000_000
    path.write_bytes(tlog_of(packets[:10]) + tlog_of(packets[10:], later_us))
    log = read_tlog(path)
    assert log.counts.stamps_lost == 0
    assert log.counts.steps_back == (step_s < 0)
    assert log["HEARTBEAT"]["time_s"][10:] == pytest.approx(
        (later_us + STEP_US * np.arange(10)) * 1e-6, abs=1e-6
    )
