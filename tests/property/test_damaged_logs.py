"""Logs that were cut, changed or extended: every intact record is read."""

from __future__ import annotations

import functools
import tempfile
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from flight_logs.errors import LogError
from flight_logs.frames.framing import FRONT
from flight_logs.frames.pieces import pieces
from flight_logs.tlog import Counts, Tlog, iterate_tlog, read_tlog
from mavlink_vehicle.codec import mavlink
from tests.support.logs.made_logs import random_packets, tlog_of
from tests.support.logs.read_logs import (
    OWN_LOGS,
    Packet,
    assert_same_contents,
    by_name,
    mavutil_packets,
)

PACKETS = 60
REAL_BYTES = 4000
MAGIC_2 = 0xFD
SIGNED = 0x01
Damage: TypeAlias = Callable[[bytes], bytes]


@functools.cache
def whole_log(number: int) -> bytes:
    """A log without damage: the first ones are beginnings of recordings, the others made."""
    if number < len(OWN_LOGS):
        return OWN_LOGS[number].read_bytes()[:REAL_BYTES]
    return tlog_of(random_packets(number, PACKETS))


places = st.floats(0.0, 1.0, exclude_max=True)

DAYS_OFF_S = 3 * 86_400.0


def cut(place: float, size: int) -> Damage:
    return lambda log: log[: int(place * len(log))] + log[int(place * len(log)) + size :]


def insert(place: float, piece: bytes) -> Damage:
    return lambda log: log[: int(place * len(log))] + piece + log[int(place * len(log)) :]


def flip(place: float, bits: int) -> Damage:
    def changed(log: bytes) -> bytes:
        data = bytearray(log)
        if data:
            data[int(place * len(data))] ^= bits
        return bytes(data)

    return changed


def repeat(place: float, size: int, target: float) -> Damage:
    return lambda log: insert(target, log[int(place * len(log)) :][:size])(log)


damages: st.SearchStrategy[Damage] = st.one_of(
    st.builds(cut, places, st.integers(1, 400)),
    st.builds(flip, places, st.integers(1, 255)),
    st.builds(insert, places, st.binary(min_size=1, max_size=40)),
    st.builds(insert, places, st.lists(st.sampled_from([0xFD, 0xFE, 0, 9]), min_size=1).map(bytes)),
    st.builds(repeat, places, st.integers(1, 400), places),
)


@st.composite
def damaged_logs(draw: st.DrawFn) -> bytes:
    log = whole_log(draw(st.integers(0, len(OWN_LOGS) + 20)))
    for damage in draw(st.lists(damages, max_size=6)):
        log = damage(log)
    return log


@dataclass(frozen=True)
class Found:
    start: int
    stop: int
    time_s: float


def found_packets(path: Path) -> list[Found]:
    """Where in the file this project's reader finds packets."""
    found = []
    for piece in pieces(path, chunk_bytes=1 << 20):
        if piece.stamps is not None:
            places = (piece.packets.start - FRONT, piece.packets.stop - FRONT)
            columns = (*places, piece.stamps.time_s)
            found += [Found(*row) for row in zip(*(c.tolist() for c in columns), strict=True)]
    return found


def decoded(frame: bytes) -> Any:
    """The message in the frame, by pymavlink, which raises when the checksum is wrong."""
    signature = bytes(13) if frame[0] == MAGIC_2 and frame[2] == SIGNED else b""
    return mavlink.MAVLink(None).decode(bytearray(frame + signature))


def checked_part(frame: bytes) -> bytes:
    """A packet up to its checksum, which a signature may follow."""
    return frame[: frame[1] + (12 if frame[0] == MAGIC_2 else 8)]


def check(data: bytes, path: Path) -> None:
    path.write_bytes(data)
    by_mavutil = mavutil_packets(path)
    try:
        log = read_tlog(path)
    except LogError:
        assert not any(packet.message is not None for packet in by_mavutil)
        return
    found = found_packets(path)
    frames = [checked_part(data[item.start :]) for item in found]
    ours = [Packet(i.time_s, f, decoded(f)) for i, f in zip(found, frames, strict=True)]
    # mavutil takes eight bytes for a time wherever it was left standing, and may so make a
    # packet of pieces which aren't side by side in the file.
    theirs = [checked_part(packet.frame) for packet in by_mavutil if packet.message is not None]
    theirs = [frame for frame in theirs if frame in data]
    assert not Counter(theirs) - Counter(frames)
    for before, item in zip([Found(0, 0, 0.0), *found], found, strict=False):
        assert item.start >= before.stop
        if item.start == before.stop + 8:
            stamp_us = int.from_bytes(data[before.stop : item.start], "big")
            # A time that is days off is damaged, too, and replaced.
            off_s = abs(stamp_us * 1e-6 - item.time_s)
            assert off_s == 0.0 or off_s > DAYS_OFF_S
    assert {name: len(group) for name, group in by_name(ours).items()} == {
        name: len(records) for name, records in log.items()
    }
    for name, group in by_name(ours).items():
        assert_same_contents(name, log[name], [packet.message for packet in group])
    assert log.counts.bytes == len(data)
    assert 0 <= log.counts.bytes_outside <= len(data)
    assert_pieces_agree(path, log)


def assert_pieces_agree(path: Path, log: Tlog) -> None:
    parts = list(iterate_tlog(path, chunk_bytes=1))
    assert sum((part.counts for part in parts), Counts()) == log.counts
    for name, records in log.items():
        joined = np.concatenate([part[name] for part in parts if name in part])
        for field in records.dtype.names or ():
            assert joined[field].tobytes() == records[field].tobytes()


@pytest.mark.wide
@settings(max_examples=120, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(damaged_logs())
def test_every_whole_packet_of_a_damaged_log_is_read(data: bytes) -> None:
    with tempfile.TemporaryDirectory() as folder:
        check(data, Path(folder) / "damaged.tlog")


def test_logs_of_every_kind_of_packet_agree_without_damage(tmp_path: Path) -> None:
    for number in range(len(OWN_LOGS) + 20):
        check(whole_log(number), tmp_path / "whole.tlog")
