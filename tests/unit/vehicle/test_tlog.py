from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink import mavutil

from mavlink_vehicle.codec import Codec, make
from mavlink_vehicle.errors import LinkError
from mavlink_vehicle.io.tlog import TlogReader, TlogWriter
from mavlink_vehicle.io.tlog_thread import ThreadedTlogWriter
from tests.support.processes import HANGS_AFTER_S, patient_s

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
    assert subprocess.run(command, timeout=HANGS_AFTER_S, check=False).returncode == -9
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


def told(writer: ThreadedTlogWriter) -> str:
    """Wait for the end of a recording; return why it has ended."""
    limit_s = time.monotonic() + patient_s(20.0)
    while (failure := writer.failure) is None and time.monotonic() < limit_s:
        threading.Event().wait(0.01)
    return str(failure)


def test_a_thread_writes_the_same(tmp_path: Path) -> None:
    writer = ThreadedTlogWriter(tmp_path / "flight.tlog")
    for frame, time_s in zip(FRAMES, TIMES_S, strict=True):
        writer.write(frame, time_s)
    writer.close()
    assert writer.failure is None
    assert (tmp_path / "flight.tlog").read_bytes() == written(tmp_path / "a.tlog").read_bytes()


def test_a_disk_that_takes_nothing_holds_up_neither_a_turn_nor_the_end(tmp_path: Path) -> None:
    """A pipe that nobody reads is one; its writer waits in the system for ever."""
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    writer = ThreadedTlogWriter(pipe)
    for _ in range(10_000):  # a pipe takes 65,536 bytes
        writer.write(FRAMES[0])
        writer.flush()
    writer.close()
    assert writer.failure is None
    os.close(reader)
    assert "Broken pipe" in told(writer)


def test_a_full_disk_ends_the_recording_of_a_thread_only() -> None:
    writer = ThreadedTlogWriter("/dev/full")
    writer.write(FRAMES[0])
    assert "No space left on device" in told(writer)
    writer.write(FRAMES[0])
    writer.close()
