"""Logs as pymavlink's `mavutil` and this project's codec read them, to hold arrays against."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np
from pymavlink import mavutil

from flight_logs.frames.records import Records
from mavlink_vehicle.codec import Codec, mavlink
from mavlink_vehicle.io.tlog import TlogReader
from tests.support.logs.recordings import NAMES, SMALL, recording

ROOT = Path(__file__).resolve().parents[3]
OWN_LOGS = sorted([*ROOT.glob("tests/data/*.tlog"), *SMALL.glob("*.tlog")])
LARGE_LOGS = [recording(name) for name in NAMES]


@dataclass(frozen=True)
class Packet:
    """A packet as another reader gives it; without a message if it calls it damaged."""

    time_s: float
    frame: bytes
    message: Any | None

    @property
    def name(self) -> str:
        return str(self.message.get_type()) if self.message is not None else ""


@contextmanager
def mavutil_with_this_dialect() -> Iterator[None]:
    with (
        mock.patch.dict(os.environ, {"MAVLINK20": "1"}),
        mock.patch.object(mavutil, "mavlink", mavlink),
    ):
        yield


def mavutil_packets(path: Path) -> list[Packet]:
    """Everything that `mavutil`'s reader of logs finds; unknown messages are left out."""
    packets = []
    with mavutil_with_this_dialect():
        log = mavutil.mavlogfile(str(path))
        log.first_byte = False  # it would choose another dialect
        while (message := log.recv_msg()) is not None:
            frame = bytes(message.get_msgbuf())
            if message.get_type() == "BAD_DATA":
                packets.append(Packet(message._timestamp, frame, None))
            elif not isinstance(message, mavlink.MAVLink_unknown):
                packets.append(Packet(message._timestamp, frame, message))
        log.close()
    return packets


def codec_packets(path: Path) -> list[Packet]:
    """Return the log as this project's reader and codec read it, packet by packet."""
    codec = Codec(255, 190)
    return [
        Packet(time_s, frame, message)
        for time_s, frame in TlogReader(path)
        for message in codec.decode(frame)
    ]


def by_name(packets: Sequence[Packet]) -> dict[str, list[Packet]]:
    found: dict[str, list[Packet]] = {}
    for packet in packets:
        if packet.message is not None:
            found.setdefault(packet.name, []).append(packet)
    return found


def assert_the_same(log: Mapping[str, Records], packets: Sequence[Packet]) -> None:
    """Fail unless the log has these packets and no others, field by field, in their order."""
    expected = by_name(packets)
    assert {name: len(records) for name, records in log.items()} == {
        name: len(group) for name, group in expected.items()
    }
    for name, group in expected.items():
        assert log[name]["time_s"].tolist() == [packet.time_s for packet in group], name
        assert_same_contents(name, log[name], [packet.message for packet in group])


def assert_same_contents(name: str, records: Records, messages: Sequence[Any]) -> None:
    """Fail unless every record has the message's source and fields; times are not looked at."""
    assert records["system"].tolist() == [m.get_srcSystem() for m in messages], name
    assert records["component"].tolist() == [m.get_srcComponent() for m in messages], name
    assert records["sequence_number"].tolist() == [m.get_seq() for m in messages], name
    cls = mavlink.mavlink_map[messages[0].get_msgId()]
    for field, c_type in zip(cls.fieldnames, cls.fieldtypes, strict=True):
        values = records[field]
        if c_type == "char":
            expected = np.array([getattr(m, f"_{field}_raw") for m in messages], values.dtype)
            assert np.array_equal(values, expected), f"{name}.{field}"
        else:
            expected = np.array([getattr(m, field) for m in messages], values.dtype)
            same = np.array_equal(values, expected, equal_nan=values.dtype.kind == "f")
            assert same, f"{name}.{field}"
