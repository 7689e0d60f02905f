"""The packets of a log, one by one, equal those behind the arrays."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import pytest

from flight_logs.errors import NotATlogError
from flight_logs.frames.packets import iterate_packets
from flight_logs.tlog import read_tlog
from mavlink_vehicle.codec import Codec
from tests.support.logs.read_logs import OWN_LOGS

LOG = OWN_LOGS[0]


def test_each_packet_is_one_message_of_the_arrays() -> None:
    codec = Codec(255, 190)
    counts: Counter[str] = Counter()
    times_s: dict[str, list[float]] = {}
    for time_s, packet in iterate_packets(LOG):
        (message,) = codec.decode(packet)
        counts[message.get_type()] += 1
        times_s.setdefault(message.get_type(), []).append(time_s)
    log = read_tlog(LOG)
    assert counts == {name: len(records) for name, records in log.items()}
    for name, records in log.items():
        assert records["time_s"].tolist() == times_s[name]


def test_packets_around_damage_are_there(tmp_path: Path) -> None:
    data = LOG.read_bytes()
    path = tmp_path / "damaged.tlog"
    path.write_bytes(data[:5000] + bytes(3000) + data[8000:-7])
    packets = [packet for _, packet in iterate_packets(path)]
    assert len(packets) == read_tlog(path).counts.packets > 100


def test_how_far_it_is_can_be_followed() -> None:
    told: list[tuple[int, int]] = []
    assert list(iterate_packets(LOG, lambda done, size: told.append((done, size))))
    assert told[-1] == (LOG.stat().st_size, LOG.stat().st_size)


def test_what_is_no_log_is_rejected(tmp_path: Path) -> None:
    path = tmp_path / "text.tlog"
    path.write_bytes(b"no log\n" * 1000)
    with pytest.raises(NotATlogError):
        list(iterate_packets(path))
