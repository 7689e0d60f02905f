from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink import mavutil

from mavlink_vehicle.codec import Codec, make
from mavlink_vehicle.errors import LinkError
from mavlink_vehicle.io.tlog import TlogReader, TlogWriter

FRAMES = [Codec(1, 1).encode(make("ATTITUDE", roll=float(n), yawspeed=1.0)) for n in range(5)]
TIMES_S = [1_700_000_000.25 + n for n in range(5)]


def written(path: Path) -> Path:
    writer = TlogWriter(path)
    for frame, time_s in zip(FRAMES, TIMES_S, strict=True):
        writer.write(frame, time_s)
    writer.flush()
    writer.close()
    writer.close()
    return path


def test_what_is_written_is_read(tmp_path: Path) -> None:
    records = list(TlogReader(written(tmp_path / "flight.tlog")))
    assert [packet for _, packet in records] == FRAMES
    assert [time_s for time_s, _ in records] == pytest.approx(TIMES_S)


def test_pymavlink_reads_it(tmp_path: Path) -> None:
    log = mavutil.mavlink_connection(str(written(tmp_path / "flight.tlog")))
    messages = [log.recv_match(), log.recv_match()]
    log.close()
    assert [message.roll for message in messages] == [0.0, 1.0]
    assert messages[0]._timestamp == pytest.approx(TIMES_S[0])


def test_a_killed_process_leaves_what_it_flushed(tmp_path: Path) -> None:
    path = tmp_path / "flight.tlog"
    program = (
        "import os, sys\n"
        "from mavlink_vehicle.io.tlog import TlogWriter\n"
        "writer = TlogWriter(sys.argv[1])\n"
        "writer.write(bytes.fromhex(sys.argv[2]), 1.0)\n"
        "writer.flush()\n"
        "writer.write(bytes.fromhex(sys.argv[2]), 2.0)\n"
        "os.kill(os.getpid(), 9)\n"
    )
    command = [sys.executable, "-c", program, str(path), FRAMES[0].hex()]
    assert subprocess.run(command, timeout=30.0, check=False).returncode == -9
    assert [packet for _, packet in TlogReader(path)][:1] == [FRAMES[0]]


def test_a_cut_end_ends_the_recording(tmp_path: Path) -> None:
    path = written(tmp_path / "flight.tlog")
    path.write_bytes(path.read_bytes()[:-3])
    assert [packet for _, packet in TlogReader(path)] == FRAMES[:-1]


@given(st.binary(max_size=40))
def test_damage_in_the_middle_is_stepped_over(damage: bytes) -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = written(Path(folder) / "flight.tlog")
        size = len(FRAMES[0]) + 8
        data = path.read_bytes()
        clean = damage.replace(b"\xfd", b"").replace(b"\xfe", b"")
        path.write_bytes(data[: 2 * size] + clean + data[2 * size :])
        packets = [packet for _, packet in TlogReader(path)]
    assert packets[:2] == FRAMES[:2]
    assert packets[-1] == FRAMES[-1]


def test_an_empty_file_is_an_empty_recording(tmp_path: Path) -> None:
    path = tmp_path / "empty.tlog"
    path.touch()
    assert list(TlogReader(path)) == []


def test_a_missing_folder_is_said_and_not_made(tmp_path: Path) -> None:
    folder = tmp_path / "flihgts"
    with pytest.raises(LinkError, match=rf"the folder {folder} does not exist; create it first\.$"):
        TlogWriter(folder / "flight.tlog")
    assert not folder.exists()


def test_a_place_that_cannot_be_written_is_said_plainly(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(LinkError, match="Cannot record to"):
        TlogWriter(tmp_path / "file" / "flight.tlog")
