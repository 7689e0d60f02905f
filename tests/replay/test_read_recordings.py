"""Arrays of recordings agree with what pymavlink's `mavutil` and the codec read.

The large ones are those of `tests/data/recordings`.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from flight_logs.tlog import iterate_tlog, read_tlog
from tests.support.logs.read_logs import (
    LARGE_LOGS,
    OWN_LOGS,
    assert_the_same,
    codec_packets,
    mavutil_packets,
)

pytestmark = pytest.mark.wide


LOGS = OWN_LOGS + LARGE_LOGS


def log_id(path: Path) -> str:
    return f"{path.parent.name}/{path.stem}"


@pytest.mark.parametrize("path", LOGS, ids=log_id)
def test_every_field_agrees_with_mavutil(path: Path) -> None:
    packets = mavutil_packets(path)
    log = read_tlog(path)
    assert_the_same(log, packets)
    assert log.counts.packets == sum(packet.message is not None for packet in packets)
    assert log.counts.bad_checksums == sum(packet.message is None for packet in packets)
    assert log.counts.bytes == path.stat().st_size


@pytest.mark.parametrize("path", OWN_LOGS, ids=log_id)
def test_every_packet_agrees_with_the_codec(path: Path) -> None:
    assert_the_same(read_tlog(path), codec_packets(path))


@pytest.mark.parametrize("path", OWN_LOGS, ids=log_id)
def test_small_pieces_make_the_same_arrays(path: Path) -> None:
    whole = read_tlog(path)
    parts = list(iterate_tlog(path, chunk_bytes=1))
    assert len(parts) > path.stat().st_size >> 13
    for name, records in whole.items():
        joined = np.concatenate([part[name] for part in parts if name in part])
        for field in records.dtype.names or ():
            assert joined[field].tobytes() == records[field].tobytes(), f"{name}.{field}"
    assert sum((part.counts for part in parts[1:]), parts[0].counts) == whole.counts
